"""Friction that varies across the rail, against CONTACT and in runs."""

import math

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.rail_friction import friction_at, friction_factor, friction_slope
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search import reduction
from wrcore.errors import InputError
from wrcore.geometry.profiles.standards import named_profile

TABLE = np.array([[math.radians(10.0), 1.0], [math.radians(20.0), 2.0 / 3.0]])
"""CONTACT's example mbench_a22_varfric: 0.3 up to 10 degrees, 0.2 from 20 degrees on."""

LUBRICATED = {"mu": 0.35, "across": {"angle": [0.2, 0.5], "factor": [1.0, 0.3]}}
CURVE = {
    "track.path": [{"tangent": 5}, {"transition": 30}, {"curve": 200, "radius": 350, "cant": 0.1}],
    "speed": 17.0, "integration.duration": 4.0, "contact.patch": "moment",
}  # fmt: skip


def test_factor_is_linear_between_points_and_constant_outside():
    angles = np.radians([-90.0, 10.0, 15.0, 20.0, 70.0])
    np.testing.assert_allclose([friction_factor(TABLE, a) for a in angles], [1.0, 1.0, 5 / 6, 2 / 3, 2 / 3])
    assert friction_at(np.zeros((0, 2)), 0.3, 0.8, 0.6) == 0.3
    assert friction_at(TABLE, 0.3, 0.8, 0.6) == pytest.approx(0.2)


def test_slope_is_the_derivative_of_the_logarithm_of_the_factor():
    for angle in np.radians([5.0, 12.0, 17.0, 25.0]):
        high, low = (math.log(friction_factor(TABLE, angle + step)) for step in (1e-6, -1e-6))
        slope = friction_slope(TABLE, math.cos(angle), math.sin(angle))
        assert slope == pytest.approx((high - low) / 2e-6, abs=1e-8)


def case_of_contact(patch, resolution="middle"):
    """Return the patch of CONTACT's case at y = 5.5 mm, yaw 13.2 mrad and 10 kN on the right wheel."""
    geometry = WheelOnRail(
        named_profile("S1002", "wheel"), named_profile("UIC60-MBench", "rail", 1 / 40), 0.46, 0.75
    ).geometry
    wheels = LoadedWheels(geometry, patch, resolution, friction_across=TABLE)
    low, high = 0.4585, 0.4615
    while high - low > 1e-10:
        z = 0.5 * (low + high)
        found = wheels.at_height("right", -5.5e-3, z, -0.0004777, -0.0132, Rolling(2.0, 4.3318864), 0.3)
        low, high = (z, high) if sum(one.vertical for one in found) > 10e3 else (low, z)
    (one,) = found
    return one.row


@pytest.mark.parametrize(("patch", "share"), [("exact", 0.01), ("surrogate", 0.02)])
def test_forces_are_those_of_contact_with_varying_friction(patch, share):
    # CONTACT, examples/mbench_a22_varfric.ref_out, conformal (D = 4): normal force 9897 N, creep force on the rail
    # longitudinally -613.9 N, laterally -1991 N; in one plane 9907, -608.6 and -1963 N
    row = case_of_contact(patch)
    bound = share * 0.2 * 9897.0
    assert row[reduction.NORMAL] == pytest.approx(9897.0, rel=0.005)
    assert row[reduction.FX] == pytest.approx(613.9, abs=bound)
    assert row[reduction.FY] == pytest.approx(-1991.0, abs=bound)


def test_sliding_ellipse_has_the_friction_at_its_contact_angle():
    row = case_of_contact("moment")
    friction = 0.3 * friction_factor(TABLE, abs(row[reduction.ANGLE]))
    assert math.hypot(row[reduction.FX], row[reduction.FY]) == pytest.approx(friction * row[reduction.NORMAL], rel=1e-3)


def forces(friction):
    """Return Y/Q maxima of the wheels of the first wheelset of a coach in a curve to the left."""
    run = wr.simulate(wr.load_scene(ELLIPTIC / "trailer_vehicle.yaml", CURVE | {"contact.friction": friction}))
    return wr.wheel_table(run)["Y_over_Q_max"].to_numpy()[:2]


def test_lubrication_of_one_rail_acts_on_its_wheels_alone():
    both, outer, inner = (
        forces(friction)
        for friction in (
            LUBRICATED,
            *({"mu": 0.35, "across": {side: LUBRICATED["across"]}} for side in ("right", "left")),
        )
    )
    dry = forces(0.35)
    np.testing.assert_allclose(outer, both, rtol=1e-6)  # only the outer, right wheel touches at more than 0.2 rad
    np.testing.assert_allclose(inner, dry, rtol=1e-6)
    assert abs(outer[1] - dry[1]) > 0.02


def test_table_of_exact_contact_refuses_varying_friction():
    with pytest.raises(InputError, match="contact.friction.across"):
        wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"contact": {"patch": "tabulated", "friction": LUBRICATED}})


@pytest.mark.parametrize(
    ("across", "says"),
    [
        ({"angle": [0.2, 0.1], "factor": [1.0, 0.5]}, ".across.angle: expected strictly rising"),
        ({"angle": [0.1, 0.2], "factor": [1.0]}, ".across.factor: expected 2 values"),
        ({"angle": [0.1, 0.2]}, ".across: expected angle and factor"),
        ({}, ".across: expected angle and factor"),
        ({"angle": [0.1, 0.2], "factor": [1.0, 1.5]}, ": expected a friction coefficient"),
        ({"left": {"angle": [0.1]}}, ": expected a friction coefficient"),
    ],
)
def test_faulty_factors_are_refused_with_their_key(across, says):
    with pytest.raises(InputError, match=f"contact.friction{says}"):
        wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"contact.friction": {"mu": 0.3, "across": across}})
