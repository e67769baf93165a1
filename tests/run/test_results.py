"""Run files: nothing is lost, nothing half-written is read, the same run gives the same bytes."""

import h5py
import numpy as np
import pytest
from synthetic import hunting_run

from wrcore import __version__
from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import BLOCK, new_hdf5, sign
from wrcore.run.output.files import load_run, load_runs, unit_of, write_run
from wrcore.run.simulate import Run


@pytest.fixture
def written(tmp_path):
    run = hunting_run(flange_at=1.0)
    path = tmp_path / "deep" / "run.h5"
    write_run(path, run)
    return run, path


def test_round_trip_keeps_every_value_bit_for_bit(written):
    run, path = written
    read = load_run(path)
    assert (read.scene, read.settings, read.counters) == (run.scene, run.settings, run.counters)
    assert (read.status, read.reason) == ("completed", "")
    assert np.array_equal(read.t, run.t)
    assert read.groups.keys() == run.groups.keys()
    for group, channels in run.groups.items():
        assert read.groups[group].keys() == channels.keys()
        for name, values in channels.items():
            assert np.array_equal(read.groups[group][name], values, equal_nan=True), (group, name)


def test_numpy_numbers_in_counters_come_back_as_plain_numbers(tmp_path):
    run = hunting_run()
    run.counters = {"steps": np.int64(7), "wall_s": np.float64(0.25)}
    write_run(tmp_path / "run.h5", run)
    assert load_run(tmp_path / "run.h5").counters == {"steps": 7, "wall_s": 0.25}


def test_every_dataset_states_unit_and_description(written):
    with h5py.File(written[1]) as file:
        names = []
        file.visit(names.append)
        seen = {name: dict(file[name].attrs) for name in names if isinstance(file[name], h5py.Dataset)}
        assert len(seen) == 1 + 11 + 2 * 17
        assert all(attrs["units"] and attrs["description"] for attrs in seen.values())
        assert seen["wheelset/left/Mz_Nm"]["units"] == "N m"
        assert file.attrs["wrcore_version"] == __version__


def test_a_run_is_stored_under_a_name_that_says_so(tmp_path):
    for name in ("run.csv", "run", "run.h5.txt"):
        with pytest.raises(InputError, match=f"{name}: expected a name that ends in .h5 or .hdf5"):
            hunting_run().save(tmp_path / name)
    assert not list(tmp_path.iterdir())
    hunting_run().save(tmp_path / "run.HDF5")
    assert load_run(tmp_path / "run.HDF5").status == "completed"


@pytest.mark.parametrize(
    ("channel", "unit"),
    [("t", "s"), ("y_m", "m"), ("vy_m_per_s", "m/s"), ("wz_rad_per_s", "rad/s"), ("phi_per_m", "1/m"), ("N_N", "N")]
    + [("Mz_Nm", "N m"), ("yaw_rad", "rad"), ("xi", "1"), ("p_max_Pa", "Pa")],
)
def test_unit_is_read_off_the_name(channel, unit):
    assert unit_of(channel) == unit


def test_same_run_gives_same_bytes(tmp_path):
    for name in ("one.h5", "two.h5"):
        write_run(tmp_path / name, hunting_run())
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()


def test_every_channel_has_the_times_as_its_scale(written):
    run, path = written
    with h5py.File(path) as file:
        names = [f"{group}/{name}" for group, channels in run.groups.items() for name in channels]
        assert all(file[name].dims[0].keys() == ["t"] and file[name].dims[0]["t"] == file["t"] for name in names)
        listed = file["t"].attrs["REFERENCE_LIST"]
        assert {file[entry["dataset"]].name[1:] for entry in listed} == set(names)


def test_run_of_a_long_train_has_more_channels_than_a_scale_can_list(tmp_path):
    groups = {f"body_{k}": {"y_m": np.full(2, float(k)), "z_m": np.zeros((2, 3))} for k in range(2100)}
    write_run(tmp_path / "run.h5", Run({"name": "train"}, "completed", "", np.array([0.0, 0.5]), groups))
    found = load_run(tmp_path / "run.h5")
    assert len(found.groups) == 2100 and found["body_2099"].y_m.tolist() == [2099.0, 2099.0]


def test_failed_write_leaves_the_old_file_and_no_remains(written):
    run, path = written
    before = path.read_bytes()
    run.settings = {"not": object()}
    with pytest.raises(TypeError, match="object cannot be written"):
        write_run(path, run)
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == ["run.h5"]


@pytest.mark.parametrize("keep", [0, 100, 0.5, 0.99])
def test_truncated_file_is_an_input_error_that_names_it(written, keep):
    path = written[1]
    data = path.read_bytes()
    path.write_bytes(data[: keep if isinstance(keep, int) else int(keep * len(data))])
    with pytest.raises(InputError, match="run.h5.*complete run file"):
        load_run(path)


def test_foreign_files_are_input_errors(tmp_path, written):
    (tmp_path / "notes.h5").write_text("not HDF5")
    with pytest.raises(InputError, match="notes.h5"):
        load_run(tmp_path / "notes.h5")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["t"] = [1.0]
    with pytest.raises(InputError, match="other.h5: expected .* without the digest"):
        load_run(tmp_path / "other.h5")
    with new_hdf5(tmp_path / "sealed.h5") as file:
        file["t"] = [1.0]
    with pytest.raises(InputError, match="expected 'wrcore run', got 'none'"):
        load_run(tmp_path / "sealed.h5")
    with h5py.File(written[1], "a") as file:
        file.attrs["format_version"] = 99
    with pytest.raises(InputError, match="run.h5.*SHA-256 does not belong"):
        load_run(written[1])
    sign(written[1])
    with pytest.raises(InputError, match="expected 3, got 99"):
        load_run(written[1])
    with pytest.raises(InputError, match="no such file"):
        load_run(tmp_path / "absent.h5")


def test_a_file_of_an_older_version_is_one_clear_line(written):
    _, path = written
    with h5py.File(path, "a") as file:
        file.attrs["format_version"] = 2
    sign(path)
    with pytest.raises(InputError, match="format_version: expected 3, got 2: 'wrcore simulate' runs its scene again"):
        load_run(path)
    path.write_bytes(path.read_bytes()[BLOCK:])
    with pytest.raises(InputError, match="without the digest that ours begins with"):
        load_run(path)


def test_missing_part_of_a_run_is_an_input_error(written):
    with h5py.File(written[1], "a") as file:
        del file.attrs["scene"]
    sign(written[1])
    with pytest.raises(InputError, match="complete run file"):
        load_run(written[1])


def test_group_access_by_attribute_and_error_that_names_the_groups():
    run = hunting_run()
    assert run["wheelset"].y_m is run.groups["wheelset"]["y_m"]
    with pytest.raises(KeyError, match="wheelset/left"):
        run["wheelsets"]


def test_a_run_that_failed_at_once_is_kept_too(tmp_path):
    empty = Run({}, "failed", "no equilibrium", np.empty(0), {"wheelset": {"y_m": np.empty(0)}})
    write_run(tmp_path / "run.h5", empty)
    read = load_run(tmp_path / "run.h5")
    assert (read.status, read.reason, read.t.size) == ("failed", "no equilibrium", 0)


def test_runs_are_sorted_by_folder_and_file(tmp_path):
    paths = [tmp_path / case / f"{name}.h5" for case in ("free", "suspended") for name in ("planar", "spatial")]
    for path in paths:
        write_run(path, hunting_run(path.stem))
    cases = load_runs(paths)
    assert {case: list(runs) for case, runs in cases.items()} == {
        "free": ["planar", "spatial"],
        "suspended": ["planar", "spatial"],
    }
    assert cases["free"]["spatial"].scene["contact"]["detection"] == "spatial"


@pytest.mark.parametrize(
    ("attribute", "value", "said"),
    [
        ("reason", 3, "attribute reason: expected text, got"),
        ("format", "x" * 5000, "attribute format: expected 'wrcore run', got 'xxx"),
    ],
)
def test_head_that_is_wrong_is_named_in_a_short_line(attribute, value, said, tmp_path):
    hunting_run().save(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file.attrs[attribute] = value
    sign(tmp_path / "run.h5")
    with pytest.raises(InputError, match=said) as caught:
        load_run(tmp_path / "run.h5")
    assert len(str(caught.value)) < len(str(tmp_path)) + 150
