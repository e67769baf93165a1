"""reports/bring_your_own.md works as written: its files are written, its commands and lines of Python are run."""

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from tests.pages import run_blocks


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder in which all blocks were run in their order."""
    place = tmp_path_factory.mktemp("own")
    (place / "config").symlink_to(ELLIPTIC.parent)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        run_blocks("bring_your_own.md")
    return place


def test_every_block_ran(folder):
    assert {"worn.h5", "rough.h5", "curve.h5", "curve.png", "my_sweep.csv"} <= {path.name for path in folder.iterdir()}


def test_the_three_forms_of_a_profile_are_the_same_wheel(folder):
    one, other = (pd.read_csv(folder / name) for name in ("conicity.csv", "conicity_simpack.csv"))
    np.testing.assert_allclose(one, other, rtol=1e-6)
    turned = {
        "points": str(folder / "meter.txt"),
        "unit": "mm",
        "mirrored": True,
        "downwards": True,
        "shift": [0.07, 0],
    }
    u = np.linspace(-0.03, 0.03, 61)
    worn, read = (wr.named_profile(spec, "wheel")(u) for spec in (str(folder / "worn.csv"), turned))
    np.testing.assert_allclose(worn, read, rtol=0, atol=2e-8)
    hollow = worn - wr.named_profile("S1002", "wheel")(u)
    assert hollow[30] == pytest.approx(0.0, abs=1e-9)  # the tape circle is the origin, worn or not
    np.testing.assert_allclose(hollow[[0, -1]], -3e-4, rtol=0.01)  # what is left beside it lies lower
    conicity = one.set_index("amplitude_m").equivalent_conicity
    assert conicity.iloc[np.abs(conicity.index - 3e-3).argmin()] == pytest.approx(0.226, rel=0.01)


def test_a_meters_file_is_the_same_wheel(folder):
    old = wr.named_profile(folder / "old.whl", "wheel")
    u = np.linspace(-0.05, 0.05, 101)
    np.testing.assert_allclose(old(u), wr.named_profile(folder / "worn.csv", "wheel")(u), rtol=0, atol=3e-7)
    assert "left out" in old.source and "lines 5-24, 625-644" in old.source
    one, other = (pd.read_csv(folder / name) for name in ("conicity.csv", "conicity_meter.csv"))
    np.testing.assert_allclose(one.equivalent_conicity, other.equivalent_conicity, rtol=2e-3)
    assert (folder / "old.svg").is_file()


def test_runs_feel_what_was_brought(folder):
    worn, rough, curve = (wr.load_run(folder / name) for name in ("worn.h5", "rough.h5", "curve.h5"))
    assert {run.status for run in (worn, rough, curve)} == {"completed"}
    one_sided = wr.load_run(folder / "one_sided.h5")
    assert one_sided.status == "completed" and np.abs(one_sided["wheelset"].y_m[-1] - worn["wheelset"].y_m[-1]) > 1e-4
    nominal = wr.simulate(ELLIPTIC / "suspended_wheelset.yaml", integration__duration=0.2)
    assert np.abs(worn["wheelset"].y_m - nominal["wheelset"].y_m).max() > 1e-5
    assert np.ptp(rough["wheelset"].z_m) > 1e-4
    assert curve["wheelset"].yaw_rad[-1] != 0.0 and curve.scene["track"]["path"][2]["radius"] == 800
    table = pd.read_csv(folder / "my_sweep.csv")
    assert len(table) == 6 and set(table["wheel.profile"]) == {"S1002", "worn.csv"}
