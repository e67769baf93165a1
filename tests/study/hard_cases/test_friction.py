"""Friction from none to very high, its jumps, creep laws at their ends."""

from study.hard_cases.friction import friction_ladder, law_ends


def test_friction_from_none_to_high(vehicles, assert_passed):
    found = friction_ladder(vehicles, ["suspended wheelset"], [0.05, 0.8], ["table", "polach"], 1.0, ["spatial"])
    assert_passed(found)
    assert found[0]["outcome"] == "refused" and "contact.friction" in found[0]["reason"]


def test_laws_give_numbers_everywhere(vehicles, assert_passed):
    found = law_ends(vehicles, "suspended wheelset", [1e-6, 0.1, 1.0, 10.0, 1e6], [1e-6, 1.0, 1e9])
    assert_passed(found)
    assert {row["case"] for row in found if row["known_limit"]} == {"law linear at its ends"}
