"""The checked front of public functions: what annotations exclude is one line, the rest goes through."""

import copy
import inspect
import pickle
import timeit
from collections.abc import Iterable, Sequence
from os import PathLike
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike

import wrcore as wr
from wrcore.errors import InputError
from wrcore.errors.checked_calls import ABOVE_ZERO, OneOf, Within, checked, kind_of

GOOD_AND_BAD = [
    (float, [0, 1.5, np.float32(2.0), np.int64(1)],
     [True, np.float32(np.inf), "1", None, np.nan, np.inf, 10**400, 1j, [1.0]]),
    (Annotated[float | None, ABOVE_ZERO], [None, 1e-3], [0.0, -1.0, np.nan]),
    (Annotated[int, Within(1, 8)], [1, np.int64(8)], [0, 9, 1.0, True, 2**70]),
    (Annotated[float, Within(high=np.inf)], [np.inf], [np.nan]),
    (str, ["", "ä"], ["a\0b", "\ud800", b"a", 1]), (bool, [True, np.bool_(False)], [0, 1, "yes", None]),
    (Annotated[str, OneOf({"left": 1})], ["left"], ["Left", None, ["left"]]),
    (Annotated[ArrayLike, Within(0.0, 1.0, dimensions=1)], [0.5, [0, 1], np.ones(2, np.float32)],
     [[], [2.0], [np.nan], ["a"], [[0.5]], [[1], [1, 2]], np.array([1j]), None, [True]]),
    (ArrayLike, [np.ones(2, np.float32)], [np.float32(np.inf), np.array([np.inf], np.float32)]),
    (ArrayLike | None, [None, [[1.0]]], ["x", object()]),
    (Iterable[float], [[1.0], np.ones(2), range(3), iter([1.0])], [1.0, "12", ["1"], [np.nan], np.array(3.0), {1: 1}]),
    (Annotated[Sequence[float], ABOVE_ZERO], [[1.0]], [[], [0.0], 1.0]),
    (Sequence[str], [["a"], ()], ["a", [1], iter(["a"])]), (str | PathLike[str], ["a"], [1, None, b"a"]),
    (dict[str, wr.Settling], [{}, {"a": wr.Settling()}], [{"a": 1}, {1: wr.Settling()}, []]),
    (wr.Run | Literal[False], [False], [0, "run.h5", None]), (Any, [None, 3], []),
]  # fmt: skip


@pytest.mark.parametrize("annotation, good, bad", GOOD_AND_BAD, ids=[str(row[0])[:40] for row in GOOD_AND_BAD])
def test_kinds(annotation, good, bad):
    kind = kind_of(annotation)
    assert all(kind.fits(value) for value in good) and not any(kind.fits(value) for value in bad)


@checked
def drawn(length: Annotated[float, Within(0.0, 2.0, "m")] = 1.0, *names: str, side: str = "left", **more: Any) -> float:
    """A docstring."""
    return length, names, side, more


def test_what_is_refused_and_how():
    value = np.float32(1.5)
    assert drawn(value, "a", "b", side="x", other=None)[0] == 1.5 and drawn() == (1.0, (), "left", {})
    assert [type(part) for part in (drawn(value)[0], drawn(np.int8(1))[0])] == [float, int]  # not of fewer digits
    for call, says in ((lambda: drawn("1"), "drawn: length: expected a number, at least 0 and at most 2 m, got '1'"),
                       (lambda: drawn(1.0, "a", 2), "drawn: names: expected text, got 2"),
                       (lambda: wr.ensure_table(planes=10**5000), "ensure_table: planes: expected one of .* got a int"),
                       (lambda: drawn(side=None), "drawn: side: expected text, got None"),
                       (lambda: drawn(-(10**5000)), "drawn: length: expected a number, .* got a int")):  # fmt: skip
        with pytest.raises(InputError, match=says):
            call()


def test_a_wrong_call_stays_pythons_own():
    for call in (lambda: wr.wear_number(), lambda: wr.example("wheelset", 3), lambda: wr.load_run(paht="a")):
        with pytest.raises(TypeError):
            call()


def test_introspection_copies_and_doctests_are_as_before():
    assert str(inspect.signature(wr.wear_number)).startswith("(run: 'Run', wheelset: 'str', side: 'Side'")
    assert drawn.__doc__ == "A docstring." and pickle.loads(pickle.dumps(wr.patch)) is wr.patch
    assert copy.deepcopy(wr.Settling(window=1.0)) == wr.Settling(1.0)


def test_every_public_function_is_checked_and_every_annotation_is_understood():
    made = (
        "InputError",
        "Assessment",
        "Comparison",
        "CreepTable",
        "Fit",
        "FittedPath",
        "Patch",
        "ReportPage",
        "RollingContact",
        "Run",
        "Scene",
        "Session",
        "SignalComparison",
        "WheelWear",
        "__version__",
    )
    for name in set(wr.__all__) - {*made, "list_profiles"}:
        public = getattr(wr, name)
        function = public.__init__ if isinstance(public, type) else public
        assert hasattr(function, "__wrapped__"), name
        space = inspect.unwrap(function).__globals__
        for part in inspect.signature(function).parameters.values():
            text = part.annotation
            assert kind_of(eval(text, space) if isinstance(text, str) else text).text, (name, part)


def test_the_front_costs_no_more_than_binding_a_signature():
    @checked
    def plain(a: float, b: Annotated[float, ABOVE_ZERO] = 1.0, c: Annotated[str, OneOf(("x",))] = "x"):
        return a

    plain.__module__ = __name__
    bind = inspect.signature(inspect.unwrap(plain)).bind
    calls = (lambda: plain(1.0, b=2.0, c="x"), lambda: bind(1.0, b=2.0, c="x"))
    front, binding = np.min([[timeit.timeit(call, number=1000) for call in calls] for _ in range(50)], axis=0)
    assert front < 3.0 * binding  # found: once to 1.3 times, 3 us


def test_paths_that_cannot_be_are_one_line(tmp_path):
    run = wr.Run({"name": "still"}, "completed", "", np.array([0.0]), {"wheelset": {"y_m": np.zeros(1)}})
    (tmp_path / "file").write_text("")
    for path in ("a" * 5000, tmp_path / "file" / "run.h5", tmp_path, ".", "/"):
        with pytest.raises(InputError):
            run.save(path)


def test_a_pose_deep_in_the_rail_is_refused_at_once():
    wheel, rail = wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40)
    pair = wr.WheelsetOnTrack.alike(wheel, rail)
    for z in (0.0, -1.9, 0.3, 0.4, 0.458):
        with pytest.raises(InputError, match="patch: z: expected at most 1 mm of overlap"):
            wr.patch(pair, z=z)
    assert wr.patch(pair, z=0.5) == [] and wr.patch(pair, z=0.4597)[0].normal > 1e3


MASKED = np.ma.array([1e-3, 2e-3, 3e-3], mask=[False, True, False])


@pytest.mark.parametrize("values", [MASKED, [MASKED, MASKED], np.ma.masked, [np.ma.masked, 1e-3], (1e-3, np.ma.masked)])
def test_masked_values_are_refused_wherever_arrays_go(values):
    """They would count as numbers: numpy drops the mask when it converts an array."""
    pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    scene = wr.example("suspended_wheelset")
    for call in (
        lambda: wr.creep_force("she", 6e-3, 4e-3, 5e4, values, 0.0, 0.0),
        lambda: wr.contacts(pair, y=values), lambda: wr.first_touch(pair, values),
        lambda: wr.conicity_curve(pair, values), lambda: wr.Settling(window=values),
        lambda: wr.hunting_frequency(values, values), lambda: wr.frequency_response(scene, values),
        lambda: wr.limit_cycles(scene, values), lambda: wr.quasi_static_curving(scene, values),
        lambda: wr.simulate(scene, start=values), lambda: wr.simulate(scene, {"initial.y": values}),
        lambda: wr.load_scene(scene, initial={"y": values}), lambda: wr.start(scene, start=values),
    ):  # fmt: skip
        with pytest.raises(InputError) as error:
            call()
        assert "\n" not in str(error.value)


def test_masked_arrays_without_masked_values_are_arrays():
    whole = np.ma.array([1e-3, 2e-3], mask=False)
    same = wr.creep_force("she", 6e-3, 4e-3, 5e4, whole.filled(), 0.0, 0.0)
    np.testing.assert_array_equal(wr.creep_force("she", 6e-3, 4e-3, 5e4, whole, 0.0, 0.0), same)
