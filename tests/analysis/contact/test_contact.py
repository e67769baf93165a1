"""Contact over position and yaw: every pose that is asked for is in the table, or refused."""

import math

import pytest

import wrcore as wr
from wrcore.errors import InputError


@pytest.fixture(scope="module")
def pair():
    return wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))


def test_all_combinations(pair):
    table = wr.contact_table(pair, [0.0, 0.002], [0.0, 0.01], wheel_load=5e4)
    assert len(table.groupby(["y_m", "yaw_rad"])) == 4


@pytest.mark.parametrize(("shifts", "yaws", "name"), [
    ([0.0, math.nan], 0.0, "shifts"), (0.0, [math.nan], "yaws"), (2.0, 0.0, "shifts"), (0.0, -0.6, "yaws"),
])  # fmt: skip
def test_a_pose_that_is_none_is_refused(pair, shifts, yaws, name):
    with pytest.raises(InputError, match=f"contact_table: {name}: expected a number or an array.*at least -"):
        wr.contact_table(pair, shifts, yaws)
