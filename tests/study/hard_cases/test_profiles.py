"""Worn, kinked, noisy, sparse and truncated profiles."""

from study.hard_cases.profiles import profiles


def test_profiles_are_run_or_refused(vehicles, assert_passed):
    entries = {
        "worn": {"kind": "worn", "shape": {"share": 0.9, "reach": 0.025}, "spacing": 2.5e-4},
        "kinked": {
            "kind": "kinked",
            "shape": {"height": 5e-5, "place": -0.004, "half_width": 0.002},
            "spacing": 2.5e-4,
        },
        "noisy": {"kind": "plain", "spacing": 1e-3, "noise": 1e-5, "seed": 1},
        "sparse": {"kind": "plain", "spacing": 5e-3},
        "ends at the contact": {"kind": "plain", "spacing": 2.5e-4, "end": 0.001},
        "ends inside": {"kind": "plain", "spacing": 2.5e-4, "end": -0.02},
    }
    found = profiles(vehicles, ["suspended wheelset"], entries, 1.0, ["spatial"], ["auto"])
    assert_passed(found)
    outcomes = {row["case"]: row["outcome"] for row in found}
    assert outcomes.pop("ends inside") == "refused"
    assert set(outcomes.values()) == {"survived"}
