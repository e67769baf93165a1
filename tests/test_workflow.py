"""The smoke workflow, by the command that a user types: every rule runs, and then nothing is left to do."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from study.hard_cases.study import unexplained
from wrcore.run.output.files import load_run

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "results" / "smoke"
FIGURES = ("fig1_parametrisation", "fig2_profiles", "fig3_detection", "fig4_lateral_position", "fig5_contact_points")
CONTACT_FIGURES = tuple(
    f"contact_{name}"
    for name in ("location", "radius_difference", "angle", "conicity", "location_with_yaw", "planar_error",
                 "force_sweep", "patch_forces")
)  # fmt: skip
CONTACT_RULES = {"contact_pairs", "contact_planar_error", "contact_reductions"}
BENCHMARK_FIGURES = ("ivp_work_precision", "ivp_constraints")
CREEP_FIGURES = ("creep_curves", "creep_traction", "creep_cost", "creep_error_map", "creep_smoothness")


def snakemake(*arguments):
    command = [sys.executable, "-m", "snakemake", "--cores", "2", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope="module")
def smoke():
    """Results of the smoke workflow; on a fresh checkout this runs it, as ``make smoke`` does."""
    done = snakemake("--configfile", "config/smoke.yaml")
    assert done.returncode == 0, done.stdout + done.stderr
    return RESULTS


def test_nothing_is_left_to_do_after_the_smoke_run(smoke):
    again = snakemake("-n", "--configfile", "config/smoke.yaml")
    assert again.returncode == 0
    assert "Nothing to be done" in again.stdout + again.stderr


def found(folder, name):
    """The one file of a name among the results of all questions."""
    (path,) = folder.glob(f"*/{name}")
    return path


@pytest.mark.parametrize("name", FIGURES + CREEP_FIGURES + CONTACT_FIGURES + BENCHMARK_FIGURES)
def test_every_figure_is_there_as_png_and_svg(smoke, name):
    assert found(smoke, f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in found(smoke, f"{name}.svg").read_text()[:2000]


def test_every_text_of_every_figure_can_be_read(smoke):
    logs = sorted((ROOT / "logs" / "smoke").rglob("*.log"))
    said = [line for log in logs for line in log.read_text("utf-8").splitlines() if "UserWarning: figure " in line]
    assert len(logs) > 40 and said == []


def test_smoke_runs_every_rule_of_the_study(smoke):
    rules = []
    for extra in (["--configfile", "config/smoke.yaml"], []):
        listed = snakemake("-n", "--forceall", *extra)
        assert listed.returncode == 0
        table = listed.stdout.partition("Job stats:")[2].partition("total")[0]
        rules.append(set(re.findall(r"^(\w+) +\d+$", table, re.MULTILINE)))
    assert rules[0] == rules[1] >= {"creep_table", "simulate", "time_runs", "report_archive", *FIGURES}
    assert rules[0] >= CONTACT_RULES | {"ivp_wheelset", "fig_ivp"}
    assert rules[0] >= {"creep_study_table", "creep_errors", "creep_costs", *(f"fig_{name}" for name in CREEP_FIGURES)}


CHANGES = [
    (
        {"paper": {"cases": {"suspended_v60": {"set": {"integration.duration": 0.6}}}}},
        "suspended_v60: planar and spatial run",
        "wheelset_v20: planar and spatial run",
    ),
    (
        {"paper": {"twins": {"rtol": 2.0e-8}}},
        "wheelset_v20: tighter and mirrored twin",
        "wheelset_v20: planar and spatial run",
    ),
    (
        {"paper": {"timing": {"repetitions": 3}}},
        "Timing: planar and spatial runs",
        "wheelset_v20: planar and spatial run",
    ),
    ({"creep": {"cost": {"passes": 3}}}, "Costs of all creep laws", "Errors of all creep laws"),
    ({"contact": {"amplitudes": {"num": 7}}}, "Contact geometry of the pairs", "Error of planar detection"),
    ({"ivp": {"repetitions": 2}}, "Benchmark: the Test Set's wheelset", "Fig. 2"),
    ({"paper": {"figures": {"detection_pose": {"y": 0.006}}}}, "Fig. 3: planar and spatial detection", "Fig. 2"),
]
"""Settings, what each runs again because of its parameters, and what it does not concern."""
ALONE = [({"creep": {"table": {"tolerance": 0.04}}}, "Creep table", "Contact geometry without load")]


@pytest.mark.parametrize("changes", [CHANGES, ALONE], ids=["by themselves", "creep table"])
def test_a_changed_setting_runs_again_what_it_concerns(smoke, tmp_path, changes):
    files = [tmp_path / f"{k}.yaml" for k in range(len(changes))]
    for path, (change, _, _) in zip(files, changes, strict=True):
        path.write_text(yaml.safe_dump(change))
    plan = snakemake("-n", "--configfile", "config/smoke.yaml", *files)
    assert plan.returncode == 0
    for _, again, kept in changes:
        assert re.search(rf"{again}.*\nReason: .*Params have changed", plan.stdout), plan.stdout
        assert kept not in plan.stdout


@pytest.fixture(scope="module")
def checkout(smoke, tmp_path_factory):
    """A copy of the checkout after the smoke run, whose sources can be edited while others use the real ones."""
    copy = tmp_path_factory.mktemp("checkout")
    for name in ("config", "notebooks", "profiles", "reports", "results", "tests", "workflow", "wrcore", ".snakemake"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "log", "auxiliary"))
    shutil.copy2(ROOT / "Snakefile", copy)
    return copy


@pytest.mark.parametrize(
    ("edited", "again", "kept"),
    [
        (["wrcore/creep/laws.py"], {"creep_table", "creep_laws", "simulate"}, {"fig2_profiles", "fig_ivp"}),
        (
            ["wrcore/analysis/assessment/wheels.py", "workflow/study/paper/figures.py"],
            {"vehicle_lateral_motion", "sweep_speeds", "accuracy_study", "fig1_parametrisation"},
            {"simulate", "creep_table", "fig_ivp"},
        ),
    ],
)  # fmt: skip
def test_an_edit_runs_again_what_stands_on_it(checkout, edited, again, kept):
    sources = {checkout / name: ((checkout / name).stat(), (checkout / name).read_text("utf-8")) for name in edited}
    for source, (_, text) in sources.items():
        source.write_text(text + "\n# edited\n", "utf-8")
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "-n", "--configfile", "config/smoke.yaml"]
    plan = subprocess.run(command, cwd=checkout, capture_output=True, text=True)
    for source, (before, text) in sources.items():
        source.write_text(text, "utf-8")
        os.utime(source, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert plan.returncode == 0, plan.stderr
    rules = set(re.findall(r"^rule (\w+):|^(\w+) +\d+$", plan.stdout, re.MULTILINE))
    planned = {name for pair in rules for name in pair if name}
    assert again <= planned and not kept & planned, planned


def test_runs_carry_their_scene_and_no_machine_path(smoke):
    for path in sorted((smoke / "paper" / "runs").glob("*/*.h5")):
        run = load_run(path)
        assert run.status == "completed"
        assert run.scene["contact"]["detection"] == ("planar" if path.stem == "planar" else "spatial")
        assert str(ROOT) not in json.dumps([run.scene, run.settings])
        assert np.isfinite(run["wheelset"].y_m).all()


def test_timing_table_has_both_detections_and_their_ratio(smoke):
    table = pd.read_csv(smoke / "paper" / "timing.csv")
    assert table["case"].tolist() == ["wheelset_v20"] * 2 + ["wheelset_v20, first 0.1 s"] * 2
    assert sorted(table["detection"].tolist()) == ["planar", "planar", "spatial", "spatial"]
    assert (table[["wall_s", "rhs_evaluations", "us_per_call"]] > 0).all(axis=None)
    for name in ("ratio_per_run", "ratio_per_call", "ratio_of_calls"):
        assert (table[f"{name}_least"] <= table[name]).all() and (table[name] <= table[f"{name}_largest"]).all()


def test_comparison_is_within_every_tolerance(smoke):
    table = pd.read_csv(smoke / "paper" / "comparison.csv", keep_default_na=False)
    assert "no" not in table["within"].tolist(), table.to_string()
    assert "yes" in table["within"].tolist()


def test_creep_laws_are_compared_in_all_files_against_both_references(smoke):
    table = pd.read_csv(smoke / "creep" / "creep_laws.csv")
    settings = yaml.safe_load((ROOT / "config/smoke.yaml").read_text())["creep"]
    assert {row["name"] for row in settings["tables"]} < set(table["model"])
    assert (table.groupby(["cases", "against"])["model"].nunique() >= 4 + len(settings["tables"])).all()
    assert len(table.groupby(["cases", "against"])) == 6
    assert (table[["force_q99", "moment_max", "us_per_case"]] > 0).all(axis=None)


def test_reductions_of_the_study_are_compared_in_all_cases(smoke):
    table = pd.read_csv(smoke / "contact" / "reductions.csv")
    assert dict(table.groupby("set").cases.first()) == {"A22": 20, "light100N": 44, "light1N": 44, "load10kN": 44}
    assert set(table.reduction) == {"maximum", "moment"}


def test_benchmark_of_the_study_meets_its_bar(smoke):
    table = pd.read_csv(smoke / "ivp" / "ivp_work_precision.csv")
    bar = yaml.safe_load((ROOT / "config/study.yaml").read_text())["ivp"]["bar"]
    assert bar == 1e-6 and (table.status == "completed").all()
    assert (table.error_x_m[table.rtol <= 1e-6] < bar).all(), table.to_string()
    assert len(pd.read_csv(smoke / "ivp" / "ivp_values.csv")) == 17


def test_no_hard_case_of_the_study_fails_without_a_known_limit(smoke):
    table = pd.read_csv(smoke / "hard_cases" / "all.csv")
    assert {"survived", "refused"} == set(table["outcome"])
    assert len(unexplained(table)) == 0, unexplained(table).to_string()
    assert set(table["family"]) >= {
        "low speed",
        "contact jumps",
        "lift-off",
        "flange",
        "profiles",
        "friction",
        "track",
        "integration",
        "long run",
    }


def test_sweep_of_the_study_has_all_its_runs(smoke):
    table = pd.read_csv(smoke / "sweeps" / "smoke.csv")
    assert table["run"].tolist() == list(range(24)) and set(table["status"]) == {"completed"}
    assert (smoke / "sweeps" / "sweep_smoke.svg").is_file()


@pytest.mark.parametrize("name", sorted(path.name for path in (ROOT / "notebooks").glob("*.ipynb")))
def test_notebooks_were_executed_and_hold_figures(smoke, name):
    cells = json.loads((smoke / "notebooks" / name).read_text())["cells"]
    outputs = [output for cell in cells if cell["cell_type"] == "code" for output in cell["outputs"]]
    assert not [output for output in outputs if output["output_type"] == "error" or output.get("name") == "stderr"]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert str(ROOT) not in json.dumps(outputs)


def test_report_holds_the_figures(smoke):
    with zipfile.ZipFile(smoke / "report.zip") as archive:
        text = "".join(archive.namelist())
        assert "report.html" in text
        assert all(f"{name}.png" in text for name in FIGURES + CREEP_FIGURES + CONTACT_FIGURES + BENCHMARK_FIGURES)


def test_pages_of_the_report_open_without_a_network_and_hold_everything(smoke):
    from tests.study.report.test_site import check_pages

    pages = [smoke / "report" / "index.html", *sorted((smoke / "report").glob("[0-9]*.html"))]
    check_pages(pages)
    assert len(pages) == 15
    text = "".join(page.read_text("utf-8") for page in pages)
    assert all(f"{name}.png" in text for name in FIGURES + CREEP_FIGURES + CONTACT_FIGURES + BENCHMARK_FIGURES)
