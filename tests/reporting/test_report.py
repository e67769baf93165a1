"""A report of runs: sections of every example, numbers of its tables, damaged files, names that are code, accuracy."""

import json
import re

import h5py
import numpy as np
import pytest
from synthetic import hunting_run

import wrcore as wr
from tests.conftest import ELLIPTIC
from tests.reporting.html_parts import HARMLESS, Parts
from wrcore.cli import main
from wrcore.reporting.page import figures
from wrcore.reporting.sections import accuracy, track
from wrcore.run.output.run import Run

ALWAYS = ["scene", "figures", "track", "motion", "forces", "contact", "wear", "cost"]
EXAMPLES = {
    "crossing": 0.4, "freight_wagon_empty": 0.3, "freight_wagon_laden": 0.3, "guided_car": 0.3, "locomotive": 0.3,
    "metro_car": 0.3, "suspended_wheelset": 0.3, "trailer_vehicle": 0.3, "wheel_slide": 0.3, "wheelset": 0.3,
}  # fmt: skip
"""Duration of a run of each example, s."""

EVERYTHING = {
    "output.channels": ["pose", "velocity", "acceleration", "contact", "wheel_motion"], "output.rate": 1000,
    "integration.duration": 6.0,
    "track.path": [{"tangent": 30}, {"transition": 40}, {"curve": 80, "radius": 600, "cant": 0.09}],
    "track.irregularity": {"spectrum": {"level": "low", "seed": 4, "length": 200, "begin": 15}},
}  # fmt: skip


@pytest.fixture(scope="module")
def coach():
    """A coach in a curve with irregularity and all channels."""
    return wr.simulate(ELLIPTIC / "trailer_vehicle.yaml", EVERYTHING)


@pytest.fixture(scope="module")
def coach_page(coach):
    return wr.report(coach, accuracy=False)


@pytest.fixture(scope="module")
def wheelset():
    channels = {"output.channels": ["pose", "velocity", "contact", "wheel_motion"], "integration.duration": 1.0}
    return wr.simulate(ELLIPTIC / "suspended_wheelset.yaml", channels)


def test_every_example_has_a_duration():
    assert sorted(path.stem for path in ELLIPTIC.glob("*.yaml")) == sorted(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_example_gives_a_page_with_its_sections(name, tmp_path):
    path = tmp_path / "run.h5"
    wr.simulate(ELLIPTIC / f"{name}.yaml", {"integration.duration": EXAMPLES[name]}).save(path)
    scene = ELLIPTIC / f"{name}.yaml"
    page = wr.report(path, accuracy=False, scene=wr.load_scene(scene, {"integration.duration": EXAMPLES[name]}))
    fast = name == "crossing"  # 5000 outputs per second are enough for EN 14363
    sections = [*ALWAYS[:6], *["assessment"] * fast, *ALWAYS[6:]]
    assert list(page.sections) == sections
    assert {part for part, _ in page.omitted} == {"EN 12299", "ISO 2631", *["EN 14363"] * (not fast)}
    parts = Parts(page.html)
    assert parts.tags <= HARMLESS and [link for link in parts.links if not link.startswith("#")] == []
    assert parts.sections == [*sections, "omitted"] and len(page.html) < 3e6


def test_run_with_all_channels_has_all_sections(coach_page):
    assert list(coach_page.sections) == [*ALWAYS[:6], "assessment", "wear", "spectra", "cost"]
    assert coach_page.omitted == () and len(coach_page.html) < 3e6
    for text in ("Curvature", "Cant", "longitudinal level", "EN 14363", "Sperling", "ISO 2631", "Welch"):
        assert text in coach_page.html


def test_numbers_of_the_page_are_those_of_the_functions(coach, coach_page):
    rows = Parts(coach_page.html).rows
    table = wr.wheel_table(coach)
    expected = {
        "Q_max_N": table["Q_max_N"].max(), "Q_min_N": table["Q_min_N"].min(), "Y_max_N": table["Y_max_N"].max(),
        "Q_mean_N": table["Q_mean_N"].mean(), "Y_over_Q_max": table["Y_over_Q_max"].max(),
        "T_gamma_mean_N": table["T_gamma_mean_N"].max(), "creep_power_mean_W": table["creep_power_mean_W"].sum(),
        "steps": coach.counters["steps"], "rhs_evaluations": coach.counters["rhs_evaluations"],
        "wall_s": coach.counters["wall_s"], "real_time_ratio": coach.counters["simulated_s"] / coach.counters["wall_s"],
        "sum_Y_max_N": max(np.abs(coach[f"wheelset_{k}"].sum_Y_N).max() for k in (1, 2, 3, 4)),
        "frequency_Hz": wr.hunting_frequency(coach.t, coach["wheelset_1"].y_m),
        "distance_m": np.ptp(coach["wheelset_1"].s_m), "yaw_max_rad": max(
            np.abs(coach[f"wheelset_{k}"].yaw_rad).max() for k in (1, 2, 3, 4)),
    }  # fmt: skip
    assert {name: rows[name] for name in expected} == {name: [float(value)] for name, value in expected.items()}
    comfort = wr.assess(coach, "EN 12299").summary.set_index("body")
    assert rows["car_body.N_MV"] == [comfort.loc["car_body", "N_MV"]]
    assert rows["car_body.Wz_lateral"] == [comfort.loc["car_body", "Wz_lateral"]]
    z = coach["car_body"].az_m_per_s2
    assert rows["car_body.az_m_per_s2"] == [pytest.approx(np.std(z), rel=1e-12)]
    every = re.findall(r'<data value="([^"]*)"', coach_page.html)
    summary = wr.assess(coach).summary
    for value in [*summary["value"], *summary["limit"], *table.drop(columns=["wheelset", "side"]).to_numpy().ravel()]:
        assert repr(float(value)) in every


def test_evaluation_begins_where_it_is_told(coach):
    rows = Parts(wr.report(coach, begin=3.0, accuracy=False).html).rows
    assert rows["Q_max_N"] == [wr.wheel_table(coach, 3.0)["Q_max_N"].max()] != [wr.wheel_table(coach)["Q_max_N"].max()]
    with pytest.raises(wr.InputError, match="begin: expected 0 to"):
        wr.report(coach, begin=6.0)


def test_two_runs_have_a_column_each(wheelset, coach):
    page = wr.report([wheelset, coach], accuracy=False)
    rows = Parts(page.html).rows
    assert rows["steps"] == [wheelset.counters["steps"], coach.counters["steps"]]
    assert len(rows["Q_max_N"]) == 2 and page.html.count('scope="col" class="run">trailer_vehicle') >= 2
    assert (
        "EN 14363, suspended_wheelset",
        "output.rate: expected at least 1000 1/s in the scene, got 200 1/s",
    ) in page.omitted
    assert not any("trailer_vehicle" in part for part, _ in page.omitted)


def test_equal_names_are_numbered_and_too_many_runs_refused(wheelset):
    page = wr.report([wheelset, wheelset], accuracy=False)
    assert "suspended_wheelset (1)" in page.html and "suspended_wheelset (2)" in page.html
    for runs in ([], [wheelset] * 7):
        with pytest.raises(wr.InputError, match="expected 1 to 6 runs"):
            wr.report(runs)


def test_chosen_channels_are_drawn_over_the_chosen_axis(wheelset):
    page = wr.report(wheelset, channels=["wheelset.roll_rad"], over="distance", accuracy=False)
    assert "wheelset.roll_rad over distance" in page.html and "wheelset.y_m over" not in page.html
    assert "wheelset.y_m over time" in wr.report(wheelset, accuracy=False).html
    with pytest.raises(wr.InputError, match="did you mean 'wheelset.y_m'"):
        wr.report(wheelset, channels=["wheelset.y"])


def test_section_that_fails_is_named_and_the_others_stay(wheelset, monkeypatch):
    monkeypatch.setattr(track, "section", lambda report: 1 / 0)
    page = wr.report(wheelset, accuracy=False)
    assert "track" not in page.sections and "forces" in page.sections
    assert page.omitted[0] == ("Track", "ZeroDivisionError: division by zero")


def test_contact_errors_of_the_page_are_those_of_the_function(wheelset):
    rows = Parts(wr.report(wheelset).html).rows
    errors = wr.contact_errors(wheelset)
    expected = [
        np.percentile(errors[name].abs(), percent) for name in accuracy.ERRORS for percent in (50.0, 95.0, 100.0)
    ]
    assert rows["contact_errors"] == pytest.approx(expected, rel=1e-9) and expected[0] > 0.0


def test_integration_error_decreases_with_the_tolerance(monkeypatch):
    monkeypatch.setattr(accuracy, "errors_of_contact", lambda *_: 1 / 0)
    found = []
    for rtol in (1e-2, 1e-6):
        changes = {"integration.duration": 1.0, "integration.rtol": rtol}
        rows = Parts(wr.report(wr.simulate(ELLIPTIC / "suspended_wheelset.yaml", changes)).html).rows
        assert rows["integration_stretch_s"] == [1.0]
        found.append(rows["integration_y"][0])
    assert 0.0 < found[1] < 0.1 * found[0]


def test_laws_of_a_run_file_are_not_executed(tmp_path):
    changes = {"integration.duration": 0.1}
    wr.simulate(wr.example("guided_car"), changes).save(tmp_path / "run.h5")
    page = wr.report(tmp_path / "run.h5")
    (reason,) = {text for part, text in page.omitted if part == "Integration error"}
    assert "trust=True" in reason and "guidance.py" in reason


EVIL = "<script>document.title='bad'</script>\"'><img src=x onerror=alert(1)>$\\frac{1}$</style></svg>&amp;"
"""A name that would be executed if it were not escaped."""


def evil_run():
    run = hunting_run()
    run.groups = {name.replace("wheelset", f"w{EVIL}".replace("/", "|")): part for name, part in run.groups.items()}
    run.scene |= {"name": EVIL, "vehicle": {"model": EVIL}, "wheel": {"profile": EVIL}, "rail": {"points": EVIL}}
    run.scene |= {"output": {"rate": 200.0, "channels": [EVIL]}, "track": {"path": [{"radius": EVIL}], EVIL: 1}}
    run.scene["contact"] = {"patch": EVIL, "detection": EVIL, "creep": {"model": EVIL}, "friction": {EVIL: 1}}
    run.status, run.reason = "derailed", EVIL
    run.settings |= {"method": EVIL, "wrcore_version": EVIL, "accuracy_of": EVIL, "accuracy_found": 1.0}
    return run


def test_names_that_are_code_are_text(tmp_path):
    evil_run().save(tmp_path / "run.h5")
    page = wr.report([tmp_path / "run.h5", hunting_run()])
    parts = Parts(page.html)
    assert "forces" in page.sections and "scene" in page.sections
    assert parts.tags <= HARMLESS and not [name for name in parts.attributes if name.startswith("on")]
    assert [link for link in parts.links if not link.startswith("#")] == [] and EVIL in parts.title
    assert "default-src 'none'" in page.html.replace("&#x27;", "'")


SPOILED = [
    {"track": 5}, {"contact": []}, {"vehicle": None}, {"speed": "fast"}, {"speed": None}, {"output": 3},
    {"track": {"path": 7}},
    {"track": {"irregularity": {"spectrum": 1}}}, {"contact": {"friction": {"arc_length": 1, "mu": "a"}}},
    {"wheel": {"profile": ["x"]}}, {"initial": [1]}, {"integration": {"duration": "long"}},
]  # fmt: skip


@pytest.mark.parametrize("change", SPOILED, ids=json.dumps)
def test_spoiled_scene_of_a_run_gives_a_page(change, wheelset):
    run = Run({**wheelset.scene, **change}, "completed", "", wheelset.t, wheelset.groups, wheelset.counters, {})
    page = wr.report(run)
    assert {"scene", "motion", "cost"} <= set(page.sections)


def test_damaged_files_give_one_line(tmp_path, wheelset, capsys):
    wheelset.save(tmp_path / "run.h5")
    whole = (tmp_path / "run.h5").read_bytes()
    contents = {"empty.h5": b"", "text.h5": b"t_s,y_m\n0,1\n", "cut.h5": whole[: len(whole) // 2],
                "flipped.h5": whole[:3000] + bytes(255 - b for b in whole[3000:3600]) + whole[3600:]}  # fmt: skip
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = [1.0]
    for name in (*contents, "foreign.h5", "absent.h5"):
        assert main(["report", str(tmp_path / name), "--out", str(tmp_path / "page.html")]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and name in said, said
    assert not (tmp_path / "page.html").exists()


def test_run_without_output_times_is_refused():
    with pytest.raises(wr.InputError, match="at least two output times"):
        wr.report(Run({"name": "short"}, "failed", "no start", np.array([0.0]), {}))


def test_run_with_motion_only_has_the_sections_that_it_can():
    t = np.linspace(0.0, 1.0, 101)
    run = Run({"name": "still"}, "completed", "", t, {"car_body": {"y_m": np.sin(t), "x_m": 20.0 * t}})
    page = wr.report(run)
    assert "motion" in page.sections and not {"forces", "contact", "wear", "spectra"} & set(page.sections)


def test_command_writes_the_page(tmp_path, wheelset, capsys):
    wheelset.save(tmp_path / "run.h5")
    out = tmp_path / "page.html"
    assert main(["report", str(tmp_path / "run.h5"), "--out", str(out), "--no-accuracy"]) == 0
    assert out.read_text("utf-8") == wr.report(tmp_path / "run.h5", accuracy=False).html
    assert "sections: scene, figures" in capsys.readouterr().out
    assert main(["report", str(tmp_path / "run.h5"), "--out", str(tmp_path / "page.pdf")]) == 2
    assert "expected a name that ends in .html" in capsys.readouterr().err


def test_printed_figures():
    given = (54612.3, 0.00123456, -2.5e-9, 0.0, 100.0, -0.5, np.inf, 3e12)
    assert [figures(value) for value in given] == [
        "54612", "0.00123", "−2.5·10⁻⁹", "0", "100", "−0.500", "∞", "3·10¹²",
    ]  # fmt: skip
