"""Pairs of profiles on which patch models are compared, and errors of the rows of their patches."""

import numpy as np

from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search import reduction
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import named_profile

SPEED, FRICTION = 20.0, 0.3


def worn(depth, place, width):
    """S1002 with a hollow, m."""
    new = named_profile("S1002", "wheel")
    u = np.linspace(-0.06, 0.055, 1151)
    f = new(u) + depth * np.exp(-(((u - place) / width) ** 2))
    return ProfileCurve.from_points(u, f - np.interp(0.0, u, f), "wheel", "hollow")


PAIRS = {
    "S1002 / 60E1 1:40": lambda: WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40)),
    "S1002 / 60E1 1:20": lambda: WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 20)),
    "S1002 / 54E1 1:40": lambda: WheelOnRail(named_profile("S1002", "wheel"), named_profile("54E1", "rail", 1 / 40)),
    "hollow 1 mm / 60E1 1:40": lambda: WheelOnRail(worn(1e-3, 0.0, 0.015), named_profile("60E1", "rail", 1 / 40)),
}


def errors(exact, table):
    """Columns of errors in %."""
    limit = FRICTION * exact[:, reduction.NORMAL]
    c = np.sqrt(exact[:, reduction.SEMI_A] * exact[:, reduction.SEMI_B])
    difference = table - exact
    return {
        "N": 100.0 * abs(difference[:, reduction.NORMAL]) / exact[:, reduction.NORMAL],
        "F": 100.0 * np.hypot(difference[:, reduction.FX], difference[:, reduction.FY]) / limit,
        "M": 100.0 * abs(difference[:, reduction.MZ]) / (limit * c),
        "p_max": 100.0 * abs(difference[:, reduction.P_MAX]) / exact[:, reduction.P_MAX],
    }
