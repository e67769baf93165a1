"""Friction that differs, changes along the track and falls with slip; wheels that roll back."""

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from wrcore.contact.search import reduction as columns
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError
from wrcore.scene.compile import compile_scene

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
MODELS = {
    "table": {}, "linear": {"contact.creep.model": "linear"}, "she": {"contact.creep.model": "she"},
    "polach": {"contact.creep.model": "polach"}, "fastsim": {"contact.creep.model": "fastsim"},
    "shape numbers": {"contact.creep.planes": "sdec", "contact.creep.tolerance": 0.05},
    "exact": {"contact.patch": "exact", "contact.resolution": "coarse"},
    "exact, creepages": {"contact.patch": "exact", "contact.resolution": "coarse", "contact.slip": "creepages"},
}  # fmt: skip
OFF = {"initial.y": 0.003, "initial.yaw": 0.002}


def prepared(changes, place=None):
    """Equations of a scene and its initial state, at another place of the track if one is given."""
    model, state = compile_scene(wr.load_scene(SCENE, {**OFF, **changes}))
    equations = Equations(model)
    state = state.copy()
    if place is not None:
        state[0] = place
    return equations, state


def patches(changes, state, place=None):
    """Rows of the patches, left and right, in a given state."""
    equations, _ = prepared(changes)
    state = state.copy()
    if place is not None:
        state[0] = place
    equations(0.0, state)
    work = equations.work
    return [work.patches[0, side, : work.counts[0, side]].copy() for side in range(2)]


def slipping(state, part=0.03):
    """The state with wheels that turn faster than they roll: most creep laws are saturated there."""
    state = state.copy()
    state[11] *= 1.0 + part
    return state


COMPILED = {"shape numbers": pytest.mark.check}  # kernels of their own, a minute


@pytest.mark.parametrize("name", [pytest.param(name, marks=COMPILED.get(name, ())) for name in MODELS])
def test_rails_that_differ_give_what_each_gives_alone(name):
    _, state = prepared(MODELS[name])
    state = slipping(state, 0.002)
    both = patches({**MODELS[name], "contact.friction": {"left": 0.4, "right": 0.1}}, state)
    for side, mu in enumerate((0.4, 0.1)):
        alone = patches({**MODELS[name], "contact.friction": mu}, state)
        np.testing.assert_allclose(both[side], alone[side], rtol=1e-12, atol=1e-12)
    assert abs(both[0][0, columns.FX]) > 1.5 * abs(both[1][0, columns.FX]) or name == "linear"


def test_friction_along_the_track_is_looked_up_at_the_wheelset():
    table = {"arc_length": [10.0, 20.0, 20.001], "mu": [0.1, 0.3, 0.05]}
    _, state = prepared({})
    for place, mu in ((-5.0, 0.1), (15.0, 0.2), (20.0, 0.3), (300.0, 0.05)):
        expected = patches({"contact.friction": mu}, slipping(state), place)
        for spec in (table, {"left": table, "right": mu}):
            found = patches({"contact.friction": spec}, slipping(state), place)
            for side in range(2):
                np.testing.assert_allclose(found[side], expected[side], rtol=1e-9, atol=1e-12)


def test_friction_along_a_curve_is_looked_up_by_arc_length():
    changes = {"track.path": [{"transition": 30}, {"curve": 200, "radius": 400, "cant": 0.05}]}
    ramp = {"arc_length": [0.0, 100.0], "mu": [0.1, 0.5]}
    equations, state = prepared({**changes, "contact.friction": ramp})
    run = wr.simulate(wr.load_scene(SCENE, {**changes, "contact.friction": ramp, "integration.duration": 3.0}))
    mu = 0.1 + 0.4 * run["wheelset"]["s_m"] / 100.0
    for side in ("left", "right"):
        part = run[f"wheelset/{side}"]
        used = np.nansum(np.hypot(part["Fx_N"], part["Fy_N"]), axis=1) / np.nansum(part["N_N"], axis=1)
        assert np.all(used < 1.01 * mu)  # the table's tolerance


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("part", [0.02, 0.2])
def test_friction_falls_with_slip_as_polach_has_it(name, part):
    ratio, decay, mu0 = 0.4, 0.6, 0.55  # Polach (2005), dry
    if name == "linear":
        part *= 1e-6  # it knows no bound: nothing falls at no slip
    _, state = prepared(MODELS[name])
    state = slipping(state, part)
    falling = {"mu": mu0, "falling": {"ratio": ratio, "decay": decay}}
    found = patches({**MODELS[name], "contact.friction": falling}, state)
    constant = patches({**MODELS[name], "contact.friction": mu0}, state)
    for rows, same in zip(found, constant, strict=True):
        for row, other in zip(rows, same, strict=True):
            slip = abs(state[7]) * np.hypot(other[columns.XI], other[columns.ETA])
            mu = mu0 * ((1.0 - ratio) * np.exp(-decay * slip) + ratio)
            size = np.hypot(*row[[columns.FX, columns.FY]])
            if name == "linear":
                assert size == pytest.approx(np.hypot(*other[[columns.FX, columns.FY]]), rel=1e-6)
            elif part > 0.1:
                assert size == pytest.approx(mu * row[columns.NORMAL], rel=0.03)  # all of the patch slides
            else:
                alone = patches({**MODELS[name], "contact.friction": float(mu)}, state)
                sizes = [np.hypot(*one[[columns.FX, columns.FY]]) for side in alone for one in side]
                # on strips w is that of the frame's origin, the row's that of the load's centroid
                assert np.min(np.abs(np.array(sizes) / size - 1.0)) < (
                    1e-3 if "contact.patch" in MODELS[name] else 1e-9
                )


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("speed", [20.0, 0.02])
def test_rolling_back_is_the_mirror_image_of_rolling_ahead(name, speed):
    """x turned round: vx, pitch and yaw rates and yaw change their sign, and with them the accelerations."""
    equations, state = prepared({**MODELS[name], "speed": speed, "contact.detection": "spatial"})
    state = slipping(state, 3e-4)
    state[12] = 1e-3 * speed
    back = state.copy()
    back[[5, 6, 7, 11, 12]] *= -1.0
    rates, other = equations(0.0, state), equations(0.0, back)
    sign = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
    size = np.abs(rates[7:]).max()  # strips: forces are single precision
    np.testing.assert_allclose(other[7:], sign * rates[7:], rtol=1e-5, atol=2e-6 * size)
    assert np.abs(rates[[8, 10, 12]]).min() > 1e-4  # spin and lateral creep do something


def test_rolling_back_spins_the_other_way():
    """Contact angles make a centred wheelset's wheels pull outwards or inwards alike in both directions."""
    equations, state = prepared({"initial.y": 0.0, "initial.yaw": 0.0})
    for sign in (1.0, -1.0):
        state[[7, 11]] = sign * np.abs(state[[7, 11]])
        equations(0.0, state)
        left = equations.work.patches[0, 0, 0]
        lateral, spin = left[columns.FY], left[columns.PHI]
        if sign > 0:
            ahead = lateral, spin
    assert lateral == pytest.approx(ahead[0], rel=1e-6) and abs(lateral) > 100.0
    assert spin == pytest.approx(-ahead[1], rel=1e-6)


BAD = [
    ({"left": 0.3}, "contact.friction", "left and right"),
    ({"falling": {"ratio": 0.4, "decay": 0.6}}, "contact.friction", "left and right"),
    ({"mu": [0.3, 0.2]}, "contact.friction.mu", "arc_length"),
    ({"mu": 0.3, "arc_length": [0.0, 1.0]}, "contact.friction.mu", "arc_length"),
    ({"mu": [0.3, 0.2], "arc_length": [1.0, 1.0]}, "contact.friction.arc_length", "strictly rising"),
    ({"mu": [0.3, 0.2], "arc_length": [0.0, 1.0, 2.0]}, "contact.friction.mu", "3 values"),
    ({"left": 0.3, "right": {"arc_length": [1.0, 0.0], "mu": [0.1, 0.1]}}, "contact.friction.right.arc_length", "ris"),
    ({"mu": 2.0}, "contact.friction", "at most 1"),
]


@pytest.mark.parametrize(("spec", "field", "expected"), BAD)
def test_bad_friction_is_named(spec, field, expected):
    with pytest.raises(InputError) as caught:
        wr.load_scene(SCENE, {"contact.friction": spec})
    assert caught.value.field == field and expected in caught.value.expected
