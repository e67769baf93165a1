"""Contact geometry is made once for the same profiles and lengths."""

from dataclasses import replace

import numpy as np

from wrcore.contact.rigid.wheel_on_rail import WheelOnRail, _geometry_of
from wrcore.geometry.profiles.standards import named_profile


def test_scenes_with_the_same_profiles_have_one_geometry_made_and_others_do_not():
    one, other = (WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40)) for _ in range(2))
    made = _geometry_of.cache_info().misses
    assert one.wheel is not other.wheel and one.geometry.block == other.geometry.block
    assert _geometry_of.cache_info().misses <= made + 1
    other.geometry.wheel[:] = 0.0  # nobody else's
    np.testing.assert_array_equal(replace(one).geometry.wheel, one.geometry.wheel)
    assert one.geometry.wheel.any()
    heights = one.wheel.f.copy()
    heights[100] = np.nextafter(heights[100], 1.0)
    changed = replace(one, wheel=replace(one.wheel, f=heights))
    assert changed.geometry.wheel[100, 0] == -heights[100] != one.geometry.wheel[100, 0]
    assert replace(one, rolling_radius=0.45).geometry.rolling_radius == 0.45
