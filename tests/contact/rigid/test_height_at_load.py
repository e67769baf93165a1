"""A wheelset at rest: both wheels carry the load that was asked for, whichever way the solution was found."""

import numpy as np
import pytest

from wrcore.contact.hertz import contact_modulus, hertz_table
from wrcore.contact.rigid.height_at_load import settle, static_wheel_force
from wrcore.contact.search.reduction import MAX_PATCHES, MAXIMUM, MOMENT, PATCH_COLUMNS

MODULUS = 0.9 * contact_modulus(8.2e10, 0.28)


def forces(pair, y, z, roll, yaw, reduction):
    patches = np.empty((MAX_PATCHES, PATCH_COLUMNS))
    arguments = (y, z, roll, yaw, True, reduction, patches)
    return np.array([static_wheel_force(pair, hertz_table(), MODULUS, side, *arguments)[1] for side in (1.0, -1.0)])


def settled(pair, *pose_and_load):
    return settle(pair, pair, hertz_table(), MODULUS, *pose_and_load, 0.46)


def test_wheels_carry_their_load_at_random_poses(benchmark_pair):
    # A height is known to 1e-16 m in 50 um of penetration: the force to 1e-11.
    random = np.random.default_rng(0)
    for _ in range(200):
        y, yaw, load = random.uniform(-0.008, 0.008), random.uniform(-0.01, 0.01), 10 ** random.uniform(3.5, 5.0)
        roll, z = settled(benchmark_pair, y, yaw, True, MOMENT, load)
        np.testing.assert_allclose(forces(benchmark_pair, y, z, roll, yaw, MOMENT), load, rtol=1e-8)


@pytest.mark.parametrize(
    ("y", "yaw", "load"),
    [(0.006363, 0.0092133, 25456.8), (-0.00108376, 0.00024298, 6193.18), (-0.00342871, 0.00525636, 3360.4)],
)
def test_where_the_force_jumps_the_load_lies_between_both_sides_of_the_jump(benchmark_pair, y, yaw, load):
    roll, z = settled(benchmark_pair, y, yaw, True, MAXIMUM, load)
    lower, upper = (forces(benchmark_pair, y, z + dz, roll, yaw, MAXIMUM) for dz in (-1e-10, 1e-10))
    assert np.all(lower >= load) and np.all(upper <= load)


def test_a_mirrored_pose_has_the_mirrored_solution_bit_by_bit(benchmark_pair):
    for y, yaw in ((0.001, 0.0), (0.004, 0.003), (0.007, -0.002)):
        roll, z = settled(benchmark_pair, y, yaw, True, MOMENT, 1e4)
        assert settled(benchmark_pair, -y, -yaw, True, MOMENT, 1e4) == (-roll, z)


def test_no_solution_is_nan(benchmark_pair):
    assert np.isnan(settled(benchmark_pair, 0.019, 0.0, True, MOMENT, 1e13)).any()
