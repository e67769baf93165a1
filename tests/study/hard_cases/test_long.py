"""The long run's case of the study notices each of its faults; that it passes is checked by the smoke workflow."""

import numpy as np

from study.hard_cases import long as analysis_hard_long
from study.hard_cases.long import hunting
from tests.conftest import ELLIPTIC
from wrcore.errors.checked_hdf5 import sign

VEHICLES = {"suspended wheelset": {"scene": str(ELLIPTIC / "suspended_wheelset.yaml")}}
CHANGES = {"speed": 60.0, "contact.creep.model": "she", "integration.method": "rk4"}


def checks(duration=40.0):
    found = hunting(VEHICLES, "suspended wheelset", CHANGES, duration)
    return {row["invariant"]: row for row in found}


def test_a_bit_that_differs_is_noticed(monkeypatch):
    whole = analysis_hard_long.simulate_to

    def not_quite(scene, path, *args, **kwargs):
        if args or path.name != "again.h5":
            return whole(scene, path, *args, **kwargs)
        part = sorted(path.parent.glob(".again.h5.parts/*.h5"))[-1]  # what the crash left
        with analysis_hard_long.h5py.File(part, "a") as file:
            state = file["end/checkpoint/memory/state"]
            state[1] += 1e-12  # m; the last bit may be lost in rounding again
        sign(part)
        return whole(scene, path, *args, **kwargs)

    monkeypatch.setattr(analysis_hard_long, "simulate_to", not_quite)
    row = checks(10.0)["channels that differ when taken up again"]
    assert not row["passed"] and row["value"] > 5


def test_growing_memory_is_noticed(monkeypatch):
    whole, hoard = analysis_hard_long.simulate_to, []

    def hoarding(scene, path, progress=None, **kwargs):
        def keep(t):
            hoard.append(np.zeros(100_000))
            return progress(t)

        return whole(scene, path, keep if progress else None, **kwargs)

    monkeypatch.setattr(analysis_hard_long, "simulate_to", hoarding)
    assert not checks(10.0)["peak memory, second half over first"]["passed"]


def test_drift_is_noticed(monkeypatch):
    load = analysis_hard_long.load_run

    def drifting(path):
        run = load(path)
        channels = run.groups["wheelset"]
        channels["y_m"] = channels["y_m"] * np.linspace(1.0, 1.01, len(run.t))
        return run

    monkeypatch.setattr(analysis_hard_long, "load_run", drifting)
    assert not checks()["change of the amplitude, of its own"]["passed"]
