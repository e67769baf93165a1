"""Runs over corrugated rails: against geometry, and linear oscillators."""

import math

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, SCENES
from tests.track.test_wheels_out_of_round import FLAT, RADIUS, SOFT, contact_stiffness, load_of, load_over_a_wave
from wrcore.contact.changing_rails.section_table import HEIGHT, U_STEP, shape_table
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.errors import InputError
from wrcore.geometry.corrugation import Corrugation
from wrcore.geometry.profiles.standards import named_profile
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene


@pytest.mark.parametrize(
    ("wavelength", "amplitude", "bound"),
    [(0.03, 2e-5, 0.1e-6), (0.1, 1e-4, 0.1e-6), (0.03, 6e-5, 1e-6), (0.1, 1e-3, 2e-5)],
)
def test_a_wheel_rides_on_a_wave_as_geometry_has_it(wavelength, amplitude, bound):
    # where R A (2 pi/L)^2 > 1, in the last two cases, the wheel does not get into the troughs
    pair = WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40))
    table = shape_table(pair, Corrugation(wavelength, amplitude, 0.0, 10.0, 1.0, ("left",)))
    middle = round(-table.geometry.rail_start / U_STEP)
    s, x = (table.begin + table.step * np.arange(len(table.sections)))[2:-2], np.linspace(-0.09, 0.09, 18001)
    rise = table.sections[2:-2, 0, HEIGHT, middle] - table.geometry.rail[middle, 0]
    wheel = RADIUS - np.sqrt(RADIUS**2 - x**2)
    expected = [(amplitude * np.cos(2.0 * math.pi / wavelength * (at + x)) - wheel).max() for at in s]
    assert rise == pytest.approx(np.array(expected), abs=bound)
    short = RADIUS * amplitude * (2.0 * math.pi / wavelength) ** 2 > 1.0
    assert (np.ptp(expected) < 1.99 * amplitude) == short


def rolling(**corrugation):
    changes = {
        "wheel.profile": "cone:1/20", "rail": {"profile": "circle:0.3", "inclination": 0}, "initial.y": 0.0,
        "track.support": SOFT, "track.corrugation": {"begin": 1.0, "length": 8.0} | corrugation, "speed": 10.0,
        "contact.normal.damping.c_e": 1.0, "integration": {"duration": 0.7, "rtol": 1e-6}, "output.rate": 20000.0,
    }  # fmt: skip
    run = simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))
    assert run.status == "completed", run.reason
    return run


@pytest.mark.parametrize(("wavelength", "amplitude"), [(0.2, 5e-5), (0.08, 1e-5)])
def test_it_drives_a_mass_on_springs(wavelength, amplitude):
    run = rolling(wavelength=wavelength, amplitude=amplitude)
    s = run["wheelset"]["x_m"]
    late = s > 4.0
    phase = 2.0 * math.pi * (s[late] - 1.0) / wavelength
    waves = np.column_stack([np.ones(phase.size), np.cos(phase), np.sin(phase)])
    _, cosine, sine = np.linalg.lstsq(waves, load_of(run)[late])[0]
    expected = load_over_a_wave(amplitude, 2.0 * math.pi / wavelength, 10.0, contact_stiffness(run))
    assert cosine - 1j * sine == pytest.approx(expected, rel=5e-3)


def test_one_rail_may_be_smooth_and_it_ends():
    run = rolling(wavelength=0.2, amplitude=2e-5, length=3.0, rail="right")
    s = run["wheelset"]["x_m"]
    left, right = (run[f"wheelset/{side}"]["x_m"][:, 0] for side in ("left", "right"))
    on, off = (s > 2.0) & (s < 3.0), (s < 0.9) | (s > 5.0)
    assert np.ptp(right[on]) == pytest.approx(2.0 * RADIUS * 2e-5 * 2.0 * math.pi / 0.2, rel=0.05)
    assert np.ptp(left[on]) < 2e-5
    assert np.ptp(right[off]) < 2e-5
    assert np.std(load_of(run)[s < 0.9]) < 1e-3 * np.mean(load_of(run))


def test_what_does_not_go_together_is_refused():
    wave = {"track.corrugation": {"wavelength": 0.05, "amplitude": 2e-5, "begin": 1.0, "length": 3.0}}
    with pytest.raises(InputError, match="no track.crossing on the right rail"):
        load_scene(SCENES / "crossing.yaml", wave)
    with pytest.raises(InputError, match="no wheels out of round on the left rail"):
        load_scene(ELLIPTIC / "suspended_wheelset.yaml", wave | {"wheel.left.out_of_round": FLAT})
    with pytest.raises(InputError, match="rises less than 0.2, got 0.377"):
        load_scene(ELLIPTIC / "suspended_wheelset.yaml", wave | {"track.corrugation.amplitude": 3e-3})
