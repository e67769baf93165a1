"""Sweeps: each row is the run that `simulate` gives, whatever is shared; batches and interruptions change nothing."""

import os
import weakref
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT, SCENES
from wrcore.analysis.assessment.wheels import creep_power, wear_number, wheel_forces
from wrcore.cli import main
from wrcore.errors import InputError
from wrcore.run.motion import amplitude, hunting_frequency
from wrcore.sweep import batch as sweep_batch
from wrcore.sweep.measures import MEASURES

SMOKE = ROOT / "config" / "sweeps" / "smoke.yaml"


@pytest.fixture(scope="module")
def smoke():
    return wr.run_sweep(SMOKE)


def small(**changes):
    data = {
        "name": "small",
        "scene": str(ELLIPTIC / "suspended_wheelset.yaml"),
        "set": {"integration.duration": 0.05},
        "sampling": {"kind": "latin_hypercube", "runs": 6, "seed": 3},
        "keys": {"speed": {"from": 20, "to": 40}, "initial.y": {"from": -0.003, "to": 0.003}},
        "measures": ["y_max_m", "steps"],
        "batch": 2,
    }
    return data | changes


@pytest.mark.parametrize("row", [0, 7, 18, 23])
def test_measures_of_a_row_are_those_of_the_run_alone(smoke, row):
    sweep = wr.load_sweep(SMOKE)
    values = sweep.runs.loc[row].to_dict()
    run = wr.simulate(sweep.scene, overrides=values)
    late = run.t >= 0.05
    last = run.t >= 0.2 - 0.1 - 1e-9
    y = run["wheelset"].y_m
    got = smoke.loc[row]
    assert got["y_rms_m"] == pytest.approx(np.sqrt(np.mean(y[late] ** 2)), rel=1e-14)
    assert got["y_max_m"] == np.abs(y[late]).max() and got["amplitude_m"] == amplitude(y[last])
    assert got["yaw_max_rad"] == pytest.approx(np.abs(run["wheelset"].yaw_rad[late]).max(), rel=1e-12)
    np.testing.assert_equal(got["frequency_Hz"], hunting_frequency(run.t[late], y[late]))
    wheels = [[force[late] for force in wheel_forces(run, "wheelset", side)] for side in ("left", "right")]
    assert got["Q_max_N"] == pytest.approx(max(q.max() for q, _ in wheels), rel=1e-12)
    assert got["Q_min_N"] == pytest.approx(min(q.min() for q, _ in wheels), rel=1e-12)
    assert got["Y_max_N"] == pytest.approx(max(np.abs(lateral).max() for _, lateral in wheels), rel=1e-12)
    assert got["Y_over_Q_max"] == pytest.approx(max(np.abs(lateral / q).max() for q, lateral in wheels), rel=1e-12)
    wear = {
        "T_gamma_mean_N": lambda side: wear_number(run, "wheelset", side),
        "T_gamma_spin_mean_N": lambda side: wear_number(run, "wheelset", side, spin=True),
        "creep_power_mean_W": lambda side: creep_power(run, "wheelset", side),
    }
    way = np.linalg.norm([run["wheelset"][f"v{axis}_m_per_s"][late] for axis in "xyz"], axis=0)
    for name, of in wear.items():
        weights = None if name == "creep_power_mean_W" else way
        means = [np.average(of(side)[late], weights=weights) for side in ("left", "right")]
        assert got[name] == pytest.approx(max(means), rel=1e-12)
    for counter in ("steps", "rejected", "rhs_evaluations", "table_out_of_range", "simulated_s"):
        assert got[counter] == run.counters[counter]
    assert (got["status"], got["method"]) == (run.status, run.settings["method_used"])


def test_a_grid_has_every_combination_once(smoke):
    keys = ["speed", "contact.detection", "rail.inclination", "contact.friction"]
    assert len(smoke) == 3 * 2 * 2 * 2 == len(smoke[keys].drop_duplicates())
    assert sorted(smoke["speed"].unique()) == [20.0, 40.0, 60.0]
    np.testing.assert_allclose(sorted(smoke["contact.friction"].unique()), [0.1, 0.4])
    assert smoke["run"].tolist() == list(range(24)) and set(wr.load_sweep(SMOKE).data["measures"]) <= set(smoke)
    assert set(MEASURES) - set(smoke) == {"jacobians", "factorisations", "smallest_step_s", "wall_s"}


def test_a_latin_hypercube_has_one_run_in_each_part_of_each_range():
    keys = {
        "speed": {"from": 20, "to": 40}, "integration.rtol": {"from": 1e-6, "to": 1e-3, "scale": "log"},
        "contact.detection": {"values": ["planar", "spatial"]},
    }  # fmt: skip
    sampling = {"kind": "latin_hypercube", "runs": 40, "seed": 5}
    runs = wr.load_sweep(small(keys=keys, sampling=sampling)).runs
    assert sorted(((runs["speed"] - 20) / 20 * 40).astype(int)) == list(range(40))
    assert sorted(((np.log10(runs["integration.rtol"]) + 6) / 3 * 40).astype(int)) == list(range(40))
    assert runs["contact.detection"].value_counts().to_dict() == {"planar": 20, "spatial": 20}
    assert wr.load_sweep(small(keys=keys, sampling=sampling)).runs.equals(runs)
    other = wr.load_sweep(small(keys=keys, sampling=sampling | {"seed": 6})).runs
    assert not other["speed"].equals(runs["speed"])


def test_threads_and_batches_change_nothing():
    whole = wr.run_sweep(small())
    pd.testing.assert_frame_equal(wr.run_sweep(small(), threads=3), whole)
    sweep = wr.load_sweep(small())
    parts = [sweep_batch.run_rows(sweep, sweep.rows(batch, 4)) for batch in range(4)]
    pd.testing.assert_frame_equal(pd.concat(parts, ignore_index=True), whole)


def test_an_interrupted_sweep_goes_on_where_it_was(tmp_path, monkeypatch):
    sweep, out = wr.load_sweep(small()), tmp_path / "table.csv"
    calls = []

    def third_fails(*args, original=sweep_batch.run_rows):
        calls.append(args[1].index.tolist())
        if len(calls) == 3:
            raise KeyboardInterrupt
        return original(*args)

    monkeypatch.setattr(sweep_batch, "run_rows", third_fails)
    with pytest.raises(KeyboardInterrupt):
        sweep_batch.sweep_to_file(sweep, out)
    assert not out.exists()
    sweep_batch.sweep_to_file(sweep, out)
    assert calls == [[0, 1], [2, 3], [4, 5], [4, 5]]
    monkeypatch.undo()
    pd.testing.assert_frame_equal(sweep_batch.load_table(out), wr.run_sweep(small()))
    assert [path.name for path in tmp_path.iterdir()] == ["table.csv"]


def test_another_scene_is_another_digest():
    assert wr.load_sweep(small()).digest() == wr.load_sweep(small()).digest()
    digests = {wr.load_sweep(small(**c)).digest() for c in ({}, {"set": {"speed": 21}}, {"measures": ["steps"]})}
    assert len(digests) == 3


def of_files(folder):
    """A sweep over two vehicles and two wheels whose files lie in a folder of the test."""
    vehicle = (ELLIPTIC.parent / "vehicles" / "suspended_wheelset.yaml").read_text()
    for name in ("one.yaml", "other.yaml"):
        (folder / name).write_text(vehicle)
    u = np.linspace(-0.060, 0.055, 231)
    for name in ("wheel.csv", "worn.csv"):
        rows = (f"{a:.6f},{b:.9f}" for a, b in zip(u, wr.named_profile("S1002", "wheel")(u), strict=True))
        (folder / name).write_text("\n".join(["u_m,f_m", *rows]))
    (folder / "track.csv").write_text("s_m,left_lateral_m\n" + "".join(f"{k},0.0\n" for k in range(9)))
    scene = yaml.safe_load((ELLIPTIC / "suspended_wheelset.yaml").read_text())
    scene["wheel"], scene["vehicle"]["parameters"] = {"profile": "wheel.csv"}, "one.yaml"
    scene["track"] = {"irregularity": {"points": ["track.csv"], "fade_in": 1.0, "fade_out": 1.0}}
    scene["contact"]["creep"] = {"model": "she"}
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene))
    keys = {
        "wheel.profile": {"values": ["wheel.csv", {"points": "worn.csv"}]},
        "vehicle.parameters": {"values": ["one.yaml", "other.yaml"]},
    }
    data = small(scene="scene.yaml", keys=keys, sampling={"kind": "grid"})
    (folder / "sweep.yaml").write_text(yaml.safe_dump(data))
    return folder / "sweep.yaml"


def edit(path):
    """A change that leaves a file readable: a digit of its last number, or a comment."""
    text = path.read_text()
    path.write_text(text + "# \n" if path.suffix == ".yaml" else text.rstrip() + "1\n")


FILES = ["wheel.csv", "worn.csv", "one.yaml", "other.yaml", "track.csv"]


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_changed_is_another_digest(tmp_path, name):
    sweep = wr.load_sweep(of_files(tmp_path))
    assert {Path(path).name for path in sweep.files} == set(FILES)
    assert wr.load_sweep(tmp_path / "sweep.yaml").digest() == sweep.digest()
    edit(tmp_path / name)
    assert wr.load_sweep(tmp_path / "sweep.yaml").digest() != sweep.digest()


def test_parts_of_other_files_are_not_gathered(tmp_path, capsys):
    """Half of a sweep before an edit of the wheel and half after were one table, with status 0."""
    base = ["sweep", str(of_files(tmp_path)), "--out"]
    parts = [str(tmp_path / f"part{i}.{ending}") for i, ending in ((1, "csv"), (2, "h5"))]
    assert main([*base, parts[0], "--batch", "1/2"]) == 0
    edit(tmp_path / "worn.csv")
    assert main([*base, parts[1], "--batch", "2/2"]) == 0
    capsys.readouterr()
    assert main([*base, str(tmp_path / "all.csv"), "--gather", *parts]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "part1.csv: expected a whole part of this sweep" in said
    assert not (tmp_path / "all.csv").exists()
    assert main([*base, parts[0], "--batch", "1/2"]) == 0
    assert main([*base, str(tmp_path / "all.csv"), "--gather", *parts]) == 0


def stopped(monkeypatch, after, act):
    """Sweeps whose batches do something, once, after so many of them."""
    count = iter(range(100))

    def run_rows(*args, original=sweep_batch.run_rows):
        rows = original(*args)
        if next(count) == after:
            act()
        return rows

    monkeypatch.setattr(sweep_batch, "run_rows", run_rows)


def interrupt():
    raise KeyboardInterrupt


def test_an_interrupted_sweep_whose_files_changed_does_not_go_on(tmp_path, monkeypatch, capsys):
    source, out = of_files(tmp_path), tmp_path / "table.csv"
    stopped(monkeypatch, 1, interrupt)
    with pytest.raises(KeyboardInterrupt):
        sweep_batch.sweep_to_file(wr.load_sweep(source), out)
    monkeypatch.undo()
    before = (tmp_path / "wheel.csv").read_text()
    edit(tmp_path / "wheel.csv")
    assert main(["sweep", str(source), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert (
        "expected the sweep, scene and files that the batches in .table.csv." in said and "remove that folder" in said
    )
    (tmp_path / "wheel.csv").write_text(before)
    assert main(["sweep", str(source), "--out", str(out)]) == 0 and not list(tmp_path.glob(".table*"))


def test_a_file_that_changes_while_a_sweep_runs_ends_it(tmp_path, monkeypatch):
    sweep = wr.load_sweep(of_files(tmp_path))
    stopped(monkeypatch, 0, lambda: edit(tmp_path / "other.yaml"))
    with pytest.raises(InputError, match=r"other.yaml: expected the content with which this began"):
        sweep_batch.sweep_to_file(sweep, tmp_path / "table.csv")
    assert not (tmp_path / "table.csv").exists()


def test_two_sweeps_do_not_write_one_table(tmp_path, monkeypatch):
    """Both computed all of it, and the second ended with "No such file"."""
    sweep, found = wr.load_sweep(small()), []

    def second():
        with pytest.raises(InputError) as caught:
            sweep_batch.sweep_to_file(sweep, tmp_path / "table.csv")
        found.append(str(caught.value))

    stopped(monkeypatch, 0, second)
    sweep_batch.sweep_to_file(sweep, tmp_path / "table.csv")
    assert found == [f"--out: {tmp_path / 'table.csv'}: expected a file that no other process is writing"]
    assert [path.name for path in tmp_path.iterdir()] == ["table.csv"]


@pytest.mark.parametrize("ending", ["csv", "h5"])
def test_a_pipe_is_neither_a_part_nor_a_table(tmp_path, ending, capsys):
    (tmp_path / "small.yaml").write_text(yaml.safe_dump(small()))
    os.mkfifo(tmp_path / f"pipe.{ending}")
    base = ["sweep", str(tmp_path / "small.yaml"), "--out"]
    assert main([*base, str(tmp_path / "all.csv"), "--gather", str(tmp_path / f"pipe.{ending}")]) == 2
    assert "no regular file" in capsys.readouterr().err
    assert main([*base, str(tmp_path / f"pipe.{ending}")]) == 2
    assert "--out" in capsys.readouterr().err


@pytest.mark.parametrize("ending", ["csv", "h5"])
def test_tables_come_back_as_they_were(tmp_path, smoke, ending):
    sweep_batch.write_table(tmp_path / f"t.{ending}", smoke)
    pd.testing.assert_frame_equal(sweep_batch.load_table(tmp_path / f"t.{ending}"), smoke, check_dtype=False)


def test_numbers_of_the_vehicle_are_swept_by_their_key_paths():
    """Each row is the run of a vehicle file with these numbers, one of them a factor on all elements of a pattern."""
    scene = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml")
    vehicle = yaml.safe_load((ELLIPTIC.parent / "vehicles" / "suspended_wheelset.yaml").read_text())
    keys = {
        "vehicle.bodies.wheelset.mass": {"from": 1200.0, "to": 1800.0, "steps": 2},
        "vehicle.elements.*.stiffness.factor": {"values": [0.8, 1.25]},
    }
    table = wr.run_sweep(small(sampling={"kind": "grid"}, keys=keys, measures=["y_rms_m", "yaw_max_rad"]))
    assert len(table) == 4 == table["y_rms_m"].nunique()
    for row in table.to_dict("records"):
        content = yaml.safe_load(yaml.safe_dump(vehicle))
        content["bodies"]["wheelset"]["mass"] = row["vehicle.bodies.wheelset.mass"]
        for item in content["elements"]:
            if "stiffness" in item:
                item["stiffness"] = [row["vehicle.elements.*.stiffness.factor"] * k for k in item["stiffness"]]
        run = wr.simulate(scene, {"vehicle.parameters": content, "integration.duration": 0.05})
        assert row["yaw_max_rad"] == pytest.approx(np.abs(run["wheelset"].yaw_rad).max(), rel=1e-12)


def test_numbers_in_lists_are_swept_by_their_place():
    path = [{"transition": 5.0}, {"curve": 50.0, "radius": 500.0}]
    sweep = {
        "name": "radii", "scene": str(ELLIPTIC / "suspended_wheelset.yaml"), "sampling": {"kind": "grid"},
        "set": {"integration.duration": 1.0, "track.path": path}, "measures": ["y_rms_m"],
        "keys": {"track.path.1.radius": {"values": [400.0, 300.0]}},
    }  # fmt: skip
    table = wr.run_sweep(sweep)
    for row, radius in enumerate((400.0, 300.0)):
        alone = {**sweep, "keys": {"track.path": {"values": [[path[0], {"curve": 50.0, "radius": radius}]]}}}
        assert table["y_rms_m"][row] == pytest.approx(wr.run_sweep(alone)["y_rms_m"][0], rel=1e-12)
    assert abs(table["y_rms_m"][0] - table["y_rms_m"][1]) > 1e-6
    for place in ("2", "-1", "curve"):
        with pytest.raises(wr.InputError, match="expected the number of one of 2 in the list, from 0, got"):
            wr.load_sweep({**sweep, "keys": {f"track.path.{place}.radius": {"values": [400.0]}}})


def test_a_scene_and_vehicles_may_be_content():
    vehicle = yaml.safe_load((ELLIPTIC.parent / "vehicles" / "suspended_wheelset.yaml").read_text())
    scene = yaml.safe_load((ELLIPTIC / "suspended_wheelset.yaml").read_text())
    scene["vehicle"]["parameters"] = vehicle
    heavy = yaml.safe_load(yaml.safe_dump(vehicle | {"name": "heavy"}))
    heavy["bodies"]["wheelset"]["mass"] *= 1.5
    keys = {"vehicle.parameters": {"values": [vehicle, heavy]}}
    sweep = wr.load_sweep(small(scene=scene, sampling={"kind": "grid"}, keys=keys))
    table = wr.run_sweep(sweep)
    assert table["y_max_m"].tolist() == [wr.simulate(sweep.scene, {"vehicle.parameters": one})["wheelset"].y_m.max()
                                         for one in (vehicle, heavy)]  # fmt: skip
    assert (table["steps"].nunique(), table["y_max_m"].nunique()) != (1, 1)


def test_seeds_of_an_irregularity_and_lists():
    """A list is run after run, no grid; seeds are numbers of the track's own key."""
    spectrum = {"level": "low", "seed": 1, "length": 60.0, "begin": 2.0}
    keys = {"track.irregularity.spectrum.seed": {"values": [1, 2, 3]}, "speed": {"values": [20, 30, 25]}}
    data = small(sampling={"kind": "list"}, keys=keys, measures=["y_rms_m"])
    data["set"] = data["set"] | {"track.irregularity": {"spectrum": spectrum}, "integration.duration": 0.3}
    table = wr.run_sweep(data)
    assert table["speed"].tolist() == [20, 30, 25] and table["y_rms_m"].nunique() == 3
    run = wr.simulate(wr.load_sweep(data).scene, {"track.irregularity.spectrum.seed": 3, "speed": 25})
    assert table["y_rms_m"][2] == pytest.approx(np.sqrt(np.mean(run["wheelset"].y_m ** 2)), rel=1e-12)
    keys["speed"]["values"].pop()
    with pytest.raises(InputError, match=r"keys.speed: expected as many values as of track\S+, 3, got 2"):
        wr.load_sweep(data)


def test_sobol_points_fill_ranges_evenly_and_repeat():
    keys = {"speed": {"from": 20, "to": 40}, "initial.y": {"from": 1e-4, "to": 1e-2, "scale": "log"},
            "contact.detection": {"values": ["planar", "spatial"]}}  # fmt: skip
    runs = wr.load_sweep(small(keys=keys, sampling={"kind": "sobol", "runs": 64, "seed": 2})).runs
    assert sorted(((runs["speed"] - 20) / 20 * 64).astype(int)) == list(range(64))
    quarters = pd.crosstab(((runs["speed"] - 20) / 5).astype(int), (2 * (np.log10(runs["initial.y"]) + 4)).astype(int))
    assert quarters.shape == (4, 4) and (quarters == 4).all(axis=None)  # of two keys together
    assert runs["contact.detection"].value_counts().to_dict() == {"planar": 32, "spatial": 32}
    assert wr.load_sweep(small(keys=keys, sampling={"kind": "sobol", "runs": 64, "seed": 2})).runs.equals(runs)
    assert not wr.load_sweep(small(keys=keys, sampling={"kind": "sobol", "runs": 64, "seed": 3})).runs.equals(runs)
    with pytest.raises(InputError, match=r"sampling.runs: expected a power of 2 for Sobol points, got 60"):
        wr.load_sweep(small(keys=keys, sampling={"kind": "sobol", "runs": 60}))


@pytest.mark.parametrize(
    ("key", "nearest"),
    [
        ("sped", "speed"), ("contact.fricton", "friction"), ("vehicle.bodies.wheelset.mas", "mass"),
        ("vehicle.bodies.weelset.mass", "wheelset"), ("track.irregularity.spectrum.sead", "seed"),
    ],
)  # fmt: skip
def test_a_wrong_key_path_is_one_line_with_the_nearest_before_any_run(key, nearest):
    spectrum = {"level": "low", "seed": 1, "length": 60.0}
    data = small(sampling={"kind": "grid"}, keys={key: {"values": [1, 2]}})
    data["set"] = {"track.irregularity": {"spectrum": spectrum}}
    with pytest.raises(InputError) as caught:
        wr.load_sweep(data)
    said = str(caught.value)
    assert said.startswith(f"sweep: keys.{key}: ") and said.endswith(f"did you mean {nearest!r}?"), said


@pytest.mark.parametrize("threads", [1, 2])
def test_vehicles_are_made_when_they_are_run_and_let_go(monkeypatch, threads):
    """A vehicle takes some megabytes: a thousand of them at once would not fit."""
    monkeypatch.setattr(sweep_batch, "AHEAD", 2)
    known, alive = weakref.WeakSet(), []

    def watched(task, measures, original=sweep_batch._run):
        known.add(task.scene.vehicle)
        alive.append(len(known))
        return original(task, measures)

    monkeypatch.setattr(sweep_batch, "_run", watched)
    keys = {"speed": {"values": [20, 30]}, "vehicle.bodies.wheelset.mass": {"from": 1200.0, "to": 1800.0, "steps": 12}}
    table = wr.run_sweep(small(sampling={"kind": "grid"}, keys=keys), threads=threads)
    assert len(alive) == 24 and max(alive) <= 2 + 4 * (threads - 1)
    assert table["speed"].tolist() == 12 * [20] + 12 * [30]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ([(0, 4), (2, 4)], "3 are in none: --batch 2/4, 4/4"), ([(1, 2)], "3 are in none: --batch 1/2"),
        ([(0, 6), (3, 6)], "4 are in none: --batch 2/6, 3/6, 5/6, 6/6"),
        ([(0, 3), (5, 6)], "3 are in none: runs 2 to 4"), ([], "6 are in none"),
    ],
)  # fmt: skip
def test_gather_names_the_parts_that_are_missing(tmp_path, given, says):
    sweep, paths = wr.load_sweep(small()), []
    for part, count in given:
        paths.append(tmp_path / f"{part}_{count}.csv")
        sweep_batch.write_table(paths[-1], sweep_batch.run_rows(sweep, sweep.rows(part, count)), sweep)
    with pytest.raises(InputError) as caught:
        sweep_batch.gather(sweep, paths, tmp_path / "all.csv")
    assert says in str(caught.value) and not (tmp_path / "all.csv").exists()


def test_command_runs_a_whole_sweep_and_parts_of_it(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text(yaml.safe_dump(small()))
    base = ["sweep", str(tmp_path / "small.yaml"), "--out"]
    assert main([*base, str(tmp_path / "whole.csv"), "--threads", "2"]) == 0
    assert "small: 6 of 6 runs, 6 completed" in capsys.readouterr().out
    parts = [str(tmp_path / f"part{i}.csv") for i in (1, 2)]
    for i, part in enumerate(parts, 1):
        assert main([*base, part, "--batch", f"{i}/2"]) == 0
    assert main([*base, str(tmp_path / "gathered.csv"), "--gather", *reversed(parts)]) == 0
    assert (tmp_path / "gathered.csv").read_text() == (tmp_path / "whole.csv").read_text()
    capsys.readouterr()
    for wrong, says in (
        (parts[:1], "3 are in none: --batch 2/2"),
        ([*parts, parts[0]], "run 0: expected each run once"),
    ):
        assert main([*base, str(tmp_path / "x.csv"), "--gather", *wrong]) == 2
        assert says in capsys.readouterr().err
    for place, other in ((2, small(set={"speed": 21})), (1, None)):  # of another scene; damaged
        spoiled = tmp_path / f"spoiled{place}.csv"
        spoiled.write_text((tmp_path / "part1.csv").read_text().replace("0.", "1.", 1))
        if other:
            (tmp_path / "other.yaml").write_text(yaml.safe_dump(other))
            assert main(["sweep", str(tmp_path / "other.yaml"), "--out", str(spoiled), "--batch", "1/2"]) == 0
            capsys.readouterr()
        assert main([*base, str(tmp_path / "x.csv"), "--gather", str(spoiled), parts[1]]) == 2
        assert "expected a whole part of this sweep" in capsys.readouterr().err
    assert not (tmp_path / "x.csv").exists()
    assert main([*base, str(tmp_path / "x.csv"), "--batch", "3/2"]) == 2
    assert "--batch: expected i/n with 1 <= i <= n <= 6 runs, got '3/2'" in capsys.readouterr().err


def test_a_run_that_derails_is_a_row_and_not_an_end():
    keys = {"initial.yaw": {"values": [0.0, 0.09]}, "speed": {"values": [10]}}
    changes = {"contact.friction": 0.9, "integration.duration": 0.6}
    table = wr.run_sweep(
        small(scene=str(SCENES / "wheelset.yaml"), set=changes, sampling={"kind": "grid"}, keys=keys,
              measures=["y_max_m", "simulated_s", "amplitude_m", "Q_max_N"])
    )  # fmt: skip
    assert table["status"].tolist() == ["completed", "derailed"]
    assert table["simulated_s"][1] < 0.6 and table.notna().all(axis=None)
    run = wr.simulate(SCENES / "wheelset.yaml", speed=10, initial={"yaw": 0.09}, **changes)
    assert table["y_max_m"][1] == np.abs(run["wheelset"].y_m).max() and table["simulated_s"][1] == run.t[-1]


def test_curved_and_irregular_track_is_measured_along_the_track():
    path = [{"tangent": 20}, {"transition": 30}, {"curve": 100, "radius": 500, "cant": 0.1}]
    changes = {"integration.duration": 0.3, "contact.creep.model": "she"}
    keys = {"track.irregularity.spectrum.seed": {"values": [1, 2]}, "speed": {"values": [30]}}
    spectrum = {"level": "low", "seed": 0, "length": 200, "begin": 5.0}
    scene = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {**changes, "track.path": path}).data
    scene["track"]["irregularity"] = {"spectrum": spectrum}
    run = wr.simulate(ELLIPTIC / "suspended_wheelset.yaml", overrides={**changes, "speed": 30, "track": scene["track"],
                      "track.irregularity.spectrum.seed": 2})  # fmt: skip
    setting = {**changes, "track": scene["track"]}
    table = wr.run_sweep(small(set=setting, keys=keys, sampling={"kind": "grid"}, measures=["y_rms_m", "yaw_max_rad"]))
    y, yaw = run["wheelset"].y_m, run["wheelset"].yaw_rad
    assert table["y_rms_m"][1] == pytest.approx(np.sqrt(np.mean(y**2)), rel=1e-14)
    assert table["y_rms_m"][1] != table["y_rms_m"][0] and table["yaw_max_rad"][1] == np.abs(yaw).max()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"keys": {"sped": {"values": [1]}}}, "keys.sped: .*sped: unknown key"),
        ({"keys": {"speed": {"from": 10, "to": 200}}}, "keys.speed: .*a speed in m/s, above 0"),
        ({"keys": {"speed": {"from": 30, "to": 20}}}, "keys.speed: expected from < to"),
        ({"keys": {"speed": {"from": 30}}}, "keys.speed: expected values, or from and to"),
        ({"keys": {"speed": {"from": 30, "to": 40, "values": [3]}}}, "expected either values or from and to"),
        ({"keys": {"speed": {"from": 20, "to": 30}}, "sampling": {"kind": "grid"}}, "keys.speed.steps"),
        ({"keys": {"integration.method": {"values": ["scipy_bdf"]}}}, "keys.integration.method: expected one of auto"),
        (
            {"keys": {"vehicle.count": {"from": 1, "to": 4}}, "set": {"vehicle.spacing": 3.0}},
            "keys.vehicle.count: .*a number of equal vehicles, 1 to 1000, got 2.2426",
        ),
        ({"keys": {}}, "keys: expected a mapping from scene keys"),
        ({"sampling": {"kind": "latin_hypercube"}}, "sampling.runs"),
        ({"sampling": {"kind": "random"}}, "sampling.kind: expected 'grid'"),
        ({"measures": ["y_max"]}, "measures: expected one of y_rms_m, .* got 'y_max'"),
        ({"scene": "absent.yaml"}, "scene: expected an existing file, got 'absent.yaml'"),
        ({"batch": 1, "sampling": {"kind": "latin_hypercube", "runs": 600}}, "batch: expected at least 2 runs"),
        ({"speed": 3}, "speed: unknown key"),
    ],
)
def test_wrong_sweeps_are_refused_with_one_line(changes, expected):
    with pytest.raises(InputError, match=expected) as caught:
        wr.load_sweep(small(**changes))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ending", ["csv", "h5"])
def test_a_damaged_batch_of_an_interrupted_sweep_is_run_again(tmp_path, ending):
    sweep, part = wr.load_sweep(small()), tmp_path / f"part.{ending}"
    sweep_batch.write_table(part, table := sweep_batch.run_rows(sweep, sweep.rows(0)), sweep)
    pd.testing.assert_frame_equal(sweep_batch.load_table(part, sweep), table, check_dtype=False)
    part.write_bytes(part.read_bytes()[:-3])
    with pytest.raises(InputError):
        sweep_batch.load_table(part, sweep)
    folder = tmp_path / f".table.csv.{sweep.digest()}"
    folder.mkdir()
    (folder / "0000.csv").write_text("run,speed\n0,")
    sweep_batch.sweep_to_file(sweep, tmp_path / "table.csv")
    pd.testing.assert_frame_equal(sweep_batch.load_table(tmp_path / "table.csv"), wr.run_sweep(sweep))


def test_a_table_does_not_go_over_something_else(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text(yaml.safe_dump(small()))
    wr.write_run(tmp_path / "run.h5", wr.simulate(SCENES / "wheelset.yaml", integration__duration=0.01))
    before = (tmp_path / "run.h5").read_bytes()
    for name, says in (("run.h5", "expected no file, or one of 'wrcore sweep'"), ("table.txt", "ends in .csv or .h5")):
        assert main(["sweep", str(tmp_path / "small.yaml"), "--out", str(tmp_path / name)]) == 2
        assert says in capsys.readouterr().err
    scene = ["simulate", str(ELLIPTIC / "suspended_wheelset.yaml"), "--out", str(tmp_path / "run.h5")]
    assert main(scene) == 2 and "this one is of 'wheelset'" in capsys.readouterr().err
    assert (tmp_path / "run.h5").read_bytes() == before


def test_a_table_of_another_kind_is_refused(tmp_path):
    with pytest.raises(InputError, match="expected a sweep's table"):
        sweep_batch.load_table(tmp_path / "absent.csv")
    wr.write_run(tmp_path / "run.h5", wr.simulate(SCENES / "wheelset.yaml", integration__duration=0.01))
    with pytest.raises(InputError, match="expected 'wrcore sweep'"):
        sweep_batch.load_table(tmp_path / "run.h5")


def test_figure_of_a_sweep_has_a_panel_with_units_per_key(smoke):
    from wrcore.analysis.plot_sweep import sweep_scatter

    keys = ["speed", "contact.detection", "rail.inclination", "contact.friction"]
    figure = sweep_scatter(smoke, keys, "amplitude_m")
    labels = [axes.get_xlabel() for axes in figure.axes[:4]]
    assert labels == ["speed / m/s", "detection", "inclination", "friction"]
    assert figure.axes[0].get_ylabel() == "amplitude / mm"
    shown = figure.axes[0].collections[0].get_offsets()
    np.testing.assert_allclose(shown[:, 1], 1e3 * smoke["amplitude_m"])
    np.testing.assert_allclose(shown[:, 0], smoke["speed"])


def test_runs_that_differ_in_their_models_are_those_of_scenes_alone():
    """Equations of motion are used again from run to run: none may keep anything of the one before."""
    keys = {
        "contact.creep.model": {"values": ["table", "she", "linear"]},
        "contact.detection": {"values": ["spatial", "auto"]},
        "contact.patch": {"values": ["moment", "maximum"]},
        "integration.method": {"values": ["tsit5", "rodas4"]},
    }
    table = wr.run_sweep(small(keys=keys, sampling={"kind": "grid"}, measures=["y_rms_m", "rhs_evaluations"]))
    sweep = wr.load_sweep(small(keys=keys, sampling={"kind": "grid"}))
    for row in (0, 7, 9, 14, 23):
        run = wr.simulate(sweep.scene, overrides=sweep.runs.loc[row].to_dict())
        assert table["rhs_evaluations"][row] == run.counters["rhs_evaluations"]
        assert table["y_rms_m"][row] == pytest.approx(np.sqrt(np.mean(run["wheelset"].y_m ** 2)), rel=1e-14)


def keyed(keys, **changes):
    return small(sampling={"kind": "list"}, measures=["y_rms_m", "y_max_m"], keys=keys, **changes)


def test_keys_below_a_mapping_that_the_scene_leaves_out_are_runs_of_their_own():
    keys = {
        "initial.bodies.wheelset.vy": {"values": [0.0, 0.05]},
        "initial.bodies.wheelset.yaw": {"values": [0.0, 1e-3]},
    }
    table = wr.run_sweep(keyed(keys))
    for row, values in wr.load_sweep(keyed(keys)).runs.iterrows():
        run = wr.simulate(ELLIPTIC / "suspended_wheelset.yaml", values.to_dict(), integration__duration=0.05)
        assert table.loc[row, "y_max_m"] == np.abs(run["wheelset"].y_m).max()
    assert table.loc[1, "y_rms_m"] != table.loc[0, "y_rms_m"]


def test_null_among_the_values_of_a_key_is_refused():
    with pytest.raises(InputError, match="keys.initial.y: expected values, got null"):
        wr.load_sweep(keyed({"initial.y": {"values": [0.003, None]}}))


STIFFNESS = "vehicle.elements.axle_box_left.stiffness"


@pytest.mark.parametrize(
    ("keys", "field"),
    [
        ({f"{STIFFNESS}.y": {"values": [0.75e6]}, STIFFNESS: {"values": [[1.5e6, 0.75e6, 0.0]]}}, f"{STIFFNESS}.y"),
        ({STIFFNESS: {"values": [[1.5e6, 0.75e6, 0.0]]}, f"{STIFFNESS}.y": {"values": [0.75e6]}}, f"{STIFFNESS}.y"),
        ({f"{STIFFNESS}.y": {"values": [0.75e6]}, f"{STIFFNESS}.1": {"values": [5e6]}}, f"{STIFFNESS}.y"),
        ({"contact.friction": {"values": [0.3]}, "contact.friction.mu": {"values": [0.3]}}, "contact.friction.mu"),
        ({"initial": {"values": [{"y": 0.0}]}, "initial.bodies.wheelset.vy": {"values": [0.1]}},
         "initial.bodies.wheelset.vy"),
    ],
)  # fmt: skip
def test_keys_that_hold_each_other_are_refused(keys, field):
    with pytest.raises(InputError, match="expected keys of which none holds another one") as caught:
        wr.load_sweep(keyed(keys))
    assert caught.value.field == f"keys.{field}"
    whole = {key: entry["values"][0] for key, entry in keys.items()}
    if "initial" not in whole:  # a mapping whose keys are changed one by one
        with pytest.raises(InputError, match="changes: .*none holds another one"):
            wr.load_sweep(keyed({"speed": {"values": [20]}}, set=whole))


def test_values_that_do_not_go_together_are_refused_before_the_first_run():
    keys = {"contact.patch": {"values": ["exact", "moment"]}, "contact.creep.model": {"values": ["table", "polach"]}}
    base = {"contact.patch": "moment", "integration.duration": 0.05}
    wr.load_sweep(keyed(keys, set=base))
    both = keyed(keys, set=base) | {"sampling": {"kind": "grid"}}
    with pytest.raises(InputError, match="keys, run 1: expected values that go together, got contact.patch 'exact'"):
        wr.load_sweep(both)
