"""What a person holds can be copied, and sent to another process: every public class, and every exception."""

import copy
import multiprocessing
import pickle
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from synthetic import hunting_run

import wrcore as wr
from tests.attacks.outcomes import same_numbers
from tests.conftest import ELLIPTIC, SCENES
from wrcore.errors import InputError, UnknownNameError

WAYS = {"pickle": lambda thing: pickle.loads(pickle.dumps(thing)), "copy": copy.copy, "deepcopy": copy.deepcopy}


def subclasses(kind):
    return {kind}.union(*map(subclasses, kind.__subclasses__()))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", sorted(subclasses(InputError), key=str))
def test_errors(way, kind):
    error = kind("scene.yaml", "speed", "expected a\nspeed")
    again = WAYS[way](error)
    assert type(again) is kind and str(again) == str(error) == "scene.yaml: speed: expected a speed"
    assert vars(again) == vars(error)


def speed_of(speed):
    return wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", speed=speed).data["speed"]


def test_a_bad_input_of_a_pool_of_processes_is_raised_here():
    with multiprocessing.get_context("spawn").Pool(1) as pool, pytest.raises(InputError, match="expected a speed"):
        pool.map_async(speed_of, [20.0, -20.0]).get(timeout=120.0)


def test_an_unknown_group_is_an_input_error_and_a_key_error():
    with pytest.raises(UnknownNameError, match="no group 'wheel'") as caught:
        _ = hunting_run()["wheel"]
    assert isinstance(caught.value, KeyError) and "\n" not in str(caught.value)


def pair():
    wheel, rail = wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40)
    return wr.WheelsetOnTrack.alike(wheel, rail)


def assessed():
    run = hunting_run()
    run.t = run.t / 10.0  # 2000 1/s
    return wr.assess(run)


def animated():
    scene = wr.load_scene(SCENES / "wheelset.yaml", integration__duration=0.05)
    return wr.draw(wr.simulate(scene), scene)


def measured():
    run = hunting_run()
    return wr.Signal("t_s", run.t, {"wheelset.y_m": run["wheelset"].y_m})


def fitted():
    changes = {"integration.duration": 0.4, "contact.patch": "moment", "contact.creep.model": "linear"}
    scene = wr.load_scene(SCENES / "suspended_wheelset.yaml", changes)
    run = wr.simulate(scene, initial__y=0.0034)
    return wr.fit(scene, {"initial.y": (0.001, 0.005)}, wr.Signal("t_s", run.t, {"wheelset.y_m": run["wheelset"].y_m}))


def fitted_path():
    s = np.arange(0.0, 500.0)
    curvature = np.interp(s, [0, 100, 160, 400, 460, 500], [0, 0, 1 / 600, 1 / 600, 0, 0])
    return wr.fit_path(wr.Signal("s_m", s, {"curvature_per_m": curvature}))


MADE = {
    "Assessment": assessed, "Comparison": lambda: wr.compare(hunting_run(), hunting_run(flange_at=1.0)),
    "CreepTable": wr.ensure_table, "InputError": lambda: InputError("a", "b", "c"),
    "Patch": lambda: wr.patch(pair(), load=5e4)[0], "RollingContact": lambda: wr.RollingContact(1.0, level=6),
    "Run": hunting_run, "Scene": lambda: wr.load_scene(ELLIPTIC / "trailer_vehicle.yaml"), "Settling": wr.Settling,
    "WheelWear": lambda: wr.WheelWear(*np.ones((4, 3)), 1.0, 2.0), "WheelsetOnTrack": pair,
    "Channels": lambda: hunting_run()["wheelset"], "Channels of a wheel": lambda: hunting_run()["wheelset/left"],
    "Sweep": lambda: wr.load_sweep(ELLIPTIC.parent / "sweeps" / "smoke.yaml"),
    "Animation": animated, "Signal": measured, "Fit": fitted, "FittedPath": fitted_path,
    "SignalComparison": lambda: wr.compare(hunting_run(), measured()),
    "ReportPage": lambda: wr.report(hunting_run(), accuracy=False),
}  # fmt: skip
"""One of each public class, and of what public functions hand out."""


def parts(thing):
    """What two equal things have in common: their attributes, down to arrays, numbers and text."""
    if isinstance(thing, dict):
        return {key: parts(value) for key, value in thing.items()}
    if isinstance(thing, list | tuple):
        return [parts(value) for value in thing]
    if isinstance(thing, set | frozenset):
        return parts(sorted(thing, key=str))
    if isinstance(thing, partial):
        return [thing.func.__name__, parts(thing.args)]
    if hasattr(thing, "to_dict"):
        return parts(thing.to_dict("list"))
    if isinstance(thing, Path):
        return str(thing)
    if isinstance(thing, np.ndarray | np.generic | int | float | str | None):
        return thing
    return {"class": type(thing).__name__, **parts(vars(thing))}


def test_there_is_one_of_each_public_class():
    assert {name for name in wr.__all__ if isinstance(getattr(wr, name), type)} - {"Session"} <= MADE.keys()


def test_a_session_is_not_copied():
    """It goes on in arrays whose addresses its kernels hold."""
    session = wr.start(ELLIPTIC / "suspended_wheelset.yaml")
    for way in WAYS.values():
        with pytest.raises(InputError, match="session: copy: expected save and restore"):
            way(session)


@pytest.mark.parametrize("name", MADE)
def test_results(name):
    thing = MADE[name]()
    for way in WAYS.values():
        again = way(thing)
        assert type(again) is type(thing) and same_numbers(parts(again), parts(thing))
        if name.startswith("Channels"):
            assert dir(again) == dir(thing) and all(
                np.array_equal(again[key], thing[key], equal_nan=True) for key in thing._ipython_key_completions_()
            )
