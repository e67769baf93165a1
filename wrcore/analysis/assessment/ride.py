"""Ride comfort of a run's bodies: frequency weightings of accelerations, comfort indices and Sperling's index.

Accelerations are those measured by accelerometers on a body's floor: in the axes of the body, with the component of
gravity due to roll and pitch of the body and the track. The whole signal is weighted before the evaluated part is
selected.

Sources. Weightings Wk and Wd: table of ISO 8041 as an instrument's manual prints it (Larson Davis HVM200, table 3.1;
read). Wb of EN 12299: two public codes that cite this standard and agree (pyridy; comfpy of tobias-bettinger), with
qualities 0.63, 0.8, 0.8 and the gain 0.4 below its step. ISO 8041's Wb, that of ISO 2631-4 and BS 6841, has the same
corners and gain but 0.55, 0.9, 0.95: Wb here is 13 % larger at 16 Hz and
8 % smaller at 4 Hz. Recalled, not read: ISO 2631-1:1997 (weighted rms, vibration total value with factors 1 as
for comfort of the seated, crest factor, MTVV over 1 s, VDV); EN 12299:2009 (mean comfort N_MV = 6 sqrt(sum of the
squares of the 95th percentiles of weighted rms values over 5 s)); Sperling and Betzhold (1956), Wz = 0.896 (a^3
F(f)/f)^(1/10) of a sine of amplitude a in cm/s^2, in the form of Garg and Dukkipati (1984), (a B)^(3/10), whose squares
add up over frequencies. The tests compare Wk and Wd with values of ISO 2631-1's table 3, also recalled, and Wz with the
older form.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.wheels import output_times_after, wheelsets_of
from wrcore.errors import InputError, one_of
from wrcore.geometry.path import track_frame
from wrcore.run.motion import path_of
from wrcore.vehicle.description import GRAVITY

BLOCK = 5.0  # length of the blocks over which comfort is evaluated, s
LEAST_RATE = 200.0  # smallest output rate, 1/s: weightings end at 100 Hz


class Weighting(NamedTuple):
    """Corner frequencies (Hz), quality factors and gain of a frequency weighting; ``f5`` to ``q6`` are None without a
    step."""

    low: float
    high: float
    f3: float
    f4: float
    q4: float
    f5: float | None = None
    q5: float | None = None
    f6: float | None = None
    q6: float | None = None
    gain: float = 1.0

    def response(self, frequency):
        """Return the complex response at frequencies (array_like, Hz)."""
        s = 1j * np.asarray(frequency, float)

        def pair(corner, quality):
            return 1.0 + s / (quality * corner) + (s / corner) ** 2

        flat = np.sqrt(0.5)  # Butterworth
        out = self.gain * (s / self.low) ** 2 / pair(self.low, flat) / pair(self.high, flat)
        out *= (1.0 + s / self.f3) / pair(self.f4, self.q4)
        if self.f5 is not None:
            out *= pair(self.f5, self.q5) / pair(self.f6, self.q6) * (self.f5 / self.f6) ** 2
        return out


class Comfort(NamedTuple):
    """Weighting B of Sperling's index: the minimum-phase filter with Garg and Dukkipati's B(f), times a factor."""

    factor: float

    def response(self, frequency):
        """Return the complex response at frequencies (array_like, Hz)."""
        s = 1j * np.asarray(frequency, float)
        return self.factor * s * (np.sqrt(1.911) + 0.25 * s) / (1.0 + s * (1.563 + s * (0.277 + s * 0.0368)))


WEIGHTINGS = {
    "Wk": Weighting(0.4, 100.0, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),
    "Wd": Weighting(0.4, 100.0, 2.0, 2.0, 0.63),
    "Wb": Weighting(0.4, 100.0, 16.0, 16.0, 0.63, 2.5, 0.8, 4.0, 0.8, 1.024),
    "B vertical": Comfort(0.588),
    "B lateral": Comfort(0.737),
}
"""Weightings by name: vertical and horizontal of ISO 2631-1, vertical of EN 12299, vertical and lateral of Sperling."""

DIRECTIONS = {"ax_m_per_s2": "Wd", "ay_m_per_s2": "Wd", "az_m_per_s2": "Wb"}
"""Weighting of each acceleration in EN 12299."""

DIRECTIONS_ISO = DIRECTIONS | {"az_m_per_s2": "Wk"}  # weighting of each acceleration in ISO 2631-1

SOURCES = {
    "EN 12299": "weightings and N_MV of public codes, Wz recalled",
    "ISO 2631": "weightings read, formulas recalled",
}
"""Sources of each table: no text of the standards was read."""

NEEDED = (*DIRECTIONS, "roll_rad", "pitch_rad", "yaw_rad")
"""Channels that the evaluation of a body's ride needs; spinning bodies have no pitch and are not evaluated."""

RUNNING = 1.0  # averaging time of the running rms of ISO 2631-1, s

SETTLED = 1.0
"""Settling time of Sperling's weighting, s (slowest decay: 4 1/s)."""


def weighted(values, rate, weighting):
    """Apply one of the `WEIGHTINGS` to a signal (n,) with a rate (1/s), initially steady at its first value."""
    if weighting not in WEIGHTINGS:
        raise InputError("weighted", "weighting", one_of(WEIGHTINGS, weighting))
    values = np.asarray(values, float)
    size = 2 * len(values)  # padding, so that the end does not wrap around to the beginning
    spectrum = np.fft.rfft(values - values[0], size) * WEIGHTINGS[weighting].response(np.fft.rfftfreq(size, 1.0 / rate))
    return np.fft.irfft(spectrum, size)[: len(values)]


def block_rms(values, rate, block=BLOCK):
    """Return the root mean squares of values (n,) with a rate (1/s) over each complete block (s)."""
    length = round(block * rate)
    count = len(values) // length
    return np.sqrt(np.mean(np.square(np.asarray(values, float)[: count * length]).reshape(count, length), axis=1))


def sperling(values, rate, vertical, late=True):
    """Return Sperling's ride index Wz of an acceleration (n,), m/s^2, at the times ``late``: (sum of a^2 B^2)^(3/20),
    with the amplitudes a of its frequency components in cm/s^2.

    The sum is twice the mean square of the weighted signal after settling. The literature mostly rounds 3/20 to 1/6.67.
    """
    felt = 100.0 * weighted(values, rate, "B vertical" if vertical else "B lateral")
    settled = np.arange(len(felt)) >= min(SETTLED * rate, len(felt) // 2)
    return float((2.0 * np.mean(felt[settled & late] ** 2)) ** 0.15)


def floor_accelerations(run, body):
    """Return accelerations that accelerometers on a body's floor measure at its centre of mass, in the axes of the
    body.

    They are in m/s^2, by the keys of `DIRECTIONS`, and zero at rest on level track. The body needs the channels
    `NEEDED`.
    """
    from scipy.spatial.transform import Rotation

    channels = run[body]
    moved = np.stack([channels[name] for name in DIRECTIONS], axis=-1) + GRAVITY * _upright(run, channels)
    axes = Rotation.from_euler("ZXY", np.stack([channels[f"{name}_rad"] for name in ("yaw", "roll", "pitch")], axis=-1))
    return dict(zip(DIRECTIONS, (axes.inv().apply(moved) - [0.0, 0.0, GRAVITY]).T, strict=True))


def _upright(run, channels):
    """Return the vertical direction in the axes of the track at a body's position, shape (n, 3)."""
    out, frame = np.tile([0.0, 0.0, 1.0], (len(run.t), 1)), np.empty((3, 3))
    if "s_m" in channels:
        path = path_of(run)
        for row, s in zip(out, channels.s_m, strict=True):
            track_frame(path, s, frame)
            row[:] = frame[2]
    return out


def ride_table(run, begin=0.0):
    """Return the comfort of a run's bodies from ``begin`` (s) on, with a row per body.

    Columns are the number of blocks, 95th percentiles of the weighted accelerations over them (m/s^2), N_MV of EN
    12299, Sperling's Wz lateral and vertical, and their source.
    """
    rate, late, bodies = _bodies(run, begin, BLOCK)
    rows = []
    for body in bodies:
        felt = floor_accelerations(run, body)
        blocks = {name: block_rms(weighted(felt[name], rate, DIRECTIONS[name])[late], rate) for name in DIRECTIONS}
        high = {f"{name[:2]}_weighted_95_m_per_s2": float(np.percentile(b, 95.0)) for name, b in blocks.items()}
        rows.append({
            "body": body, "blocks": len(blocks["ax_m_per_s2"]), **high,
            "N_MV": 6.0 * float(np.sqrt(sum(value**2 for value in high.values()))),
            "Wz_lateral": sperling(felt["ay_m_per_s2"], rate, False, late),
            "Wz_vertical": sperling(felt["az_m_per_s2"], rate, True, late), "source": SOURCES["EN 12299"],
        })  # fmt: skip
    return pd.DataFrame(rows)


def whole_body_table(run, begin=0.0):
    """Return whole-body vibration by ISO 2631-1 from ``begin`` (s) on, with a row per body and direction x, y, z.

    Columns are weighting, weighted rms (m/s^2), crest factor (largest weighted value over the rms), MTVV (largest
    running rms over 1 s, m/s^2) and VDV (fourth root of the integral of the fourth power, m/s^1.75). The vibration
    total value of the body is the root of the sum of the squares of the rms (m/s^2). ``source`` names that of
    weightings and formulas.
    """
    rate, late, bodies = _bodies(run, begin, RUNNING)
    rows = []
    for body in bodies:
        directions, felt = [], floor_accelerations(run, body)
        for name, weighting in DIRECTIONS_ISO.items():
            values = weighted(felt[name], rate, weighting)[late]
            rms = float(np.sqrt(np.mean(values**2)))
            window = round(RUNNING * rate)
            sums = np.cumsum(np.concatenate([[0.0], values**2]))
            directions.append({
                "body": body, "direction": name[1], "weighting": weighting, "rms_m_per_s2": rms,
                "crest_factor": float(np.abs(values).max()) / rms if rms > 0.0 else np.nan,
                "MTVV_m_per_s2": float(np.sqrt(max((sums[window:] - sums[:-window]).max(), 0.0) / window)),
                "VDV_m_per_s1_75": float((np.sum(values**4) / rate) ** 0.25),
            })  # fmt: skip
        total = float(np.sqrt(sum(row["rms_m_per_s2"] ** 2 for row in directions)))
        rows += [row | {"total_value_m_per_s2": total, "source": SOURCES["ISO 2631"]} for row in directions]
    return pd.DataFrame(rows)


def _bodies(run, begin, least):
    """Return output rate (1/s), which output times are evaluated, and the bodies without wheels that have the channels
    `NEEDED`."""
    rate, late = rate_of(run, LEAST_RATE, "ride"), output_times_after(run, begin, "ride")
    bodies = [group for group in run if group not in wheelsets_of(run) and set(NEEDED) <= set(run[group])]
    if not bodies:
        raise InputError("ride", "channels", f"expected a body without wheels that has {', '.join(NEEDED)}")
    if np.count_nonzero(late) < least * rate:
        raise InputError("ride", "begin", f"expected at least {least:g} s of the run after it, got {begin:g} s")
    return rate, late, bodies


def rate_of(run, least, what):
    """Return the output rate of a run, 1/s; refuse a rate below ``least`` and times that are not equally spaced."""
    steps = np.diff(run.t)
    if len(steps) == 0 or np.ptp(steps) > 1e-6 * steps[0]:
        raise InputError(what, "run", "expected at least two output times, equally spaced")
    rate = float((len(run.t) - 1) / (run.t[-1] - run.t[0]))
    if rate < least * (1.0 - 1e-9):
        raise InputError(what, "output.rate", f"expected at least {least:g} 1/s in the scene, got {rate:g} 1/s")
    return rate
