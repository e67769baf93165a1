"""Friction, irregularity and creep laws of the user's own against the same ones from the package."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from tests.scene import own_laws
from tests.scene.own_laws import TABLE, waves
from wrcore.creep.laws import GROUP
from wrcore.errors import InputError
from wrcore.kernels.handles import Kind
from wrcore.run.checkpoints import model_fingerprint
from wrcore.scene.compile import compile_scene

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
LAWS = "tests/scene/own_laws.py:"
SHORT = {"integration.duration": 0.6, "speed": 30.0, "initial.y": 0.003}


def run(changes):
    return wr.simulate(SCENE, {**SHORT, **changes}, progress=False)


def test_friction_over_arc_length_is_the_table():
    own = {"law": f"{LAWS}friction", "length": 20.0, "spacing": 0.5}
    table = {side: {"arc_length": TABLE["arc_length"], "mu": TABLE[side]} for side in ("left", "right")}
    explicit = {"integration.method": "rk4"}  # over kinks long steps' lengths hang on last bits
    one, other = (run({"contact.friction": friction, **explicit}) for friction in (own, table))
    np.testing.assert_allclose(one["wheelset"].y_m, other["wheelset"].y_m, rtol=0, atol=1e-12)
    assert np.abs(one["wheelset"].y_m - run(explicit)["wheelset"].y_m).max() > 1e-5


def test_friction_that_falls_with_slip_is_the_formula():
    brake = {
        "drive.brakes": [{"name": "b", "bodies": ["wheelset", "frame"], "torque": 2e4}],
        "integration.duration": 2.0,
    }
    formula = {"mu": 0.3, "falling": {"ratio": 0.4, "decay": 0.6}}
    own = {"mu": 0.3, "falling": {"law": f"{LAWS}falling", "length": 40.0, "spacing": 0.01}}
    one, other, flat = (run({**brake, "contact.friction": friction}) for friction in (own, formula, 0.3))
    rates = [found["wheelset"].wy_rad_per_s for found in (one, other, flat)]
    np.testing.assert_allclose(rates[0], rates[1], rtol=0, atol=1e-3)
    assert rates[0][-1] < 0.5 * rates[2][-1]  # it slides where mu does not fall


def test_a_law_of_friction_compiles_no_kernel_anew():
    """A type of its own, such as that of an array not to be written to, would cost a minute of compilation."""
    own = {"falling": {"law": f"{LAWS}falling", "length": 40.0, "spacing": 0.01}}
    along = {"law": f"{LAWS}friction", "length": 20.0, "spacing": 0.5}
    scenes = [wr.load_scene(SCENE, {"contact.friction": friction}) for friction in (0.3, {"mu": 0.3} | own, along)]
    assert len({Kind(compile_scene(scene)[0])._numba_type_ for scene in scenes}) == 1


def test_irregularity_is_what_a_file_of_it_is(tmp_path):
    s = np.linspace(0.0, 60.0, 241)
    names = "left_lateral_m,left_vertical_m,right_lateral_m,right_vertical_m"
    np.savetxt(
        tmp_path / "waves.csv", np.column_stack([s, waves(s).T]), "%.17g", ",", header=f"s_m,{names}", comments=""
    )
    own = {"own": {"law": f"{LAWS}waves", "length": 60.0, "spacing": 0.25}, "fade_in": 2.0}
    points = {"points": str(tmp_path / "waves.csv"), "fade_in": 2.0}
    one, other = (run({"track.irregularity": irregularity}) for irregularity in (own, points))
    np.testing.assert_allclose(one["wheelset"].y_m, other["wheelset"].y_m, rtol=0, atol=1e-12)
    assert np.ptp(one["wheelset"].y_m) > 1e-3


def test_a_creep_law_of_ones_own_is_the_built_in_one(monkeypatch):
    explicit = {"integration.method": "rk4"}  # a Jacobian takes differences of the law's last bits
    one, other = (run(explicit | {"contact.creep.model": model}) for model in (f"{LAWS}as_she", "she"))
    np.testing.assert_allclose(one["wheelset"].y_m, other["wheelset"].y_m, rtol=0, atol=1e-12)
    entry = EntryPoint("my_she", "tests.scene.own_laws:as_she", GROUP)
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: [entry] if group == GROUP else [])
    named = run(explicit | {"contact.creep.model": "my_she"})
    np.testing.assert_array_equal(named["wheelset"].y_m, one["wheelset"].y_m)
    marks = [
        model_fingerprint(compile_scene(wr.load_scene(SCENE, {"contact.creep.model": model}))[0])
        for model in ("my_she", own_laws.as_she, "she")
    ]
    assert marks[0] == marks[1] != marks[2]


BAD = {
    "shape": ({"contact.friction": {"law": f"{LAWS}of_one_size", "length": 9, "spacing": 1}}, "contact.friction.law",
              "expected values of shape (2, 10) or (10,), got (3,)"),
    "bounds": ({"contact.friction": {"law": f"{LAWS}too_large", "length": 9, "spacing": 1}}, "contact.friction.law",
               "coefficients from 1e-09 to 1, got 2 to 2"),
    "not a number": ({"contact.friction": {"law": f"{LAWS}holed", "length": 9, "spacing": 1}}, "contact.friction.law",
                     "finite numbers"),
    "no length": ({"contact.friction": {"law": f"{LAWS}holed", "spacing": 1}}, "contact.friction.length", "missing"),
    "falling": ({"contact.friction": {"mu": 0.3, "falling": {"law": f"{LAWS}too_large", "length": 1, "spacing": 0.1}}},
                "contact.friction.falling.law", "factors from 0.01 to 1"),
    "both": ({"contact.friction": {"mu": 0.3, "falling": {"ratio": 0.4}}}, "contact.friction.falling.decay", "missing"),
    "far out": ({"track.irregularity": {"own": {"law": f"{LAWS}too_large", "length": 90}}},
                "track.irregularity.own.law", "deviations in m, within 0.05, got 2"),
    "two numbers": ({"contact.creep.model": f"{LAWS}of_two"}, "contact.creep.model", "three numbers fx, fy, mz"),
    "in Python": ({"contact.creep.model": f"{LAWS}plain"}, "contact.creep.model", "compiled by numba.njit"),
    "unknown": ({"contact.creep.model": "polack"}, "contact.creep.model", "did you mean 'polach'"),
    "exact": ({"contact.creep.model": f"{LAWS}as_she", "contact.patch": "exact"}, "contact.patch", "moment"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_what_does_not_work_is_refused_in_one_line(name):
    changes, field, expected = BAD[name]
    with pytest.raises(InputError) as caught:
        compile_scene(wr.load_scene(SCENE, changes))
    assert caught.value.field == field and expected in caught.value.expected and "\n" not in str(caught.value)


def test_rails_that_do_not_climb():
    """On a steep cant ramp wheels feel 1/400 of slope less, and lie as high in the curve."""
    path = [{"transition": 40.0}, {"curve": 60.0, "radius": 600.0, "cant": 0.1}]
    changes = {"track.path": path, "integration.duration": 2.5, "speed": 25.0, "initial.y": 0.0}
    climbing, flat = (run({**changes, "track.rail_climb": climb}) for climb in (True, False))
    ramp = (climbing["wheelset"].s_m > 10.0) & (climbing["wheelset"].s_m < 30.0)
    apart = np.abs(climbing["wheelset"].y_m - flat["wheelset"].y_m)
    assert apart[ramp].max() > 1e-5 and apart[-1] < 0.2 * apart[ramp].max()
