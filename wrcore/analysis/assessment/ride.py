"""Ride of a run's bodies: frequency weightings of accelerations, comfort and Sperling's index.

Accelerations are what accelerometers on a body's floor show: in the body's own axes, with the part of gravity that its
and the track's roll and pitch bring in. A signal is weighted whole, before what is evaluated is cut out of it.

Sources. Weightings Wk and Wd: table of ISO 8041 as an instrument's manual prints it (Larson Davis HVM200, table 3.1;
read). Wb of EN 12299: two public codes that cite this standard and agree (pyridy; comfpy of tobias-bettinger), with
qualities 0.63, 0.8, 0.8 and the gain 0.4 below its step. ISO 8041's Wb, that of ISO 2631-4 and BS 6841, has the same
corners and gain but 0.55, 0.9, 0.95: Wb here is 13 % larger at 16 Hz and
8 % smaller at 4 Hz. Recalled, not read: ISO 2631-1:1997 (weighted rms, vibration total value with factors 1 as
for comfort of the seated, crest factor, MTVV over 1 s, VDV); EN 12299:2009 (mean comfort N_MV = 6 sqrt(sum of the
squares of the 95th percentiles of weighted rms values over 5 s)); Sperling and Betzhold (1956), Wz = 0.896 (a^3
F(f)/f)^(1/10) of a sine of amplitude a in cm/s^2, in the form of Garg and Dukkipati (1984), (a B)^(3/10), whose squares
add up over frequencies. The tests hold Wk and Wd against values of ISO 2631-1's table 3, recalled too, and Wz against
the older form.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.wheels import output_times_after, wheelsets_of
from wrcore.errors import InputError, one_of
from wrcore.geometry.path import track_frame
from wrcore.run.motion import path_of
from wrcore.vehicle.description import GRAVITY

BLOCK = 5.0  # length of the stretches that comfort is evaluated over, s
LEAST_RATE = 200.0  # weightings end at 100 Hz, 1/s


class Weighting(NamedTuple):
    """Corner frequencies (Hz) and qualities of a weighting's factors; without a step those of 5 and 6 are None."""

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
        """Complex response at frequencies (array_like, Hz)."""
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
    """Weighting B of Sperling's index: the filter without delay that has Garg and Dukkipati's B(f), times a factor."""

    factor: float

    def response(self, frequency):
        """As of :class:`Weighting`."""
        s = 1j * np.asarray(frequency, float)
        return self.factor * s * (np.sqrt(1.911) + 0.25 * s) / (1.0 + s * (1.563 + s * (0.277 + s * 0.0368)))


WEIGHTINGS = {
    "Wk": Weighting(0.4, 100.0, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),
    "Wd": Weighting(0.4, 100.0, 2.0, 2.0, 0.63),
    "Wb": Weighting(0.4, 100.0, 16.0, 16.0, 0.63, 2.5, 0.8, 4.0, 0.8, 1.024),
    "B vertical": Comfort(0.588),
    "B lateral": Comfort(0.737),
}
"""By name: vertical and horizontal of ISO 2631-1, vertical of EN 12299, both of Sperling."""

DIRECTIONS = {"ax_m_per_s2": "Wd", "ay_m_per_s2": "Wd", "az_m_per_s2": "Wb"}
"""Weighting of each acceleration in EN 12299."""

DIRECTIONS_ISO = DIRECTIONS | {"az_m_per_s2": "Wk"}  # the same in ISO 2631-1

SOURCES = {
    "EN 12299": "weightings and N_MV of public codes, Wz recalled",
    "ISO 2631": "weightings read, formulas recalled",
}
"""What each table stands on: no text of the standards was read."""

NEEDED = (*DIRECTIONS, "roll_rad", "pitch_rad", "yaw_rad")
"""Channels of a body whose ride is evaluated; one that spins has no pitch."""

RUNNING = 1.0  # time of the running rms of ISO 2631-1, s

SETTLED = 1.0
"""From this time after its start on a signal under Sperling's weighting has settled (slowest decay: 4 1/s), s."""


def weighted(values, rate, weighting):
    """A signal (n,) of a rate (1/s) after one of the `WEIGHTINGS`, as if it had always been at its first value."""
    if weighting not in WEIGHTINGS:
        raise InputError("weighted", "weighting", one_of(WEIGHTINGS, weighting))
    values = np.asarray(values, float)
    size = 2 * len(values)  # nothing comes back from the end
    spectrum = np.fft.rfft(values - values[0], size) * WEIGHTINGS[weighting].response(np.fft.rfftfreq(size, 1.0 / rate))
    return np.fft.irfft(spectrum, size)[: len(values)]


def block_rms(values, rate, block=BLOCK):
    """Root mean squares of values (n,) of a rate (1/s) over each whole block (s)."""
    length = round(block * rate)
    count = len(values) // length
    return np.sqrt(np.mean(np.square(np.asarray(values, float)[: count * length]).reshape(count, length), axis=1))


def sperling(values, rate, vertical, late=True):
    """Sperling's ride index Wz of an acceleration (n,), m/s^2, where ``late``: (sum of a^2 B^2)^(3/20), with the
    amplitudes a of its parts in cm/s^2.

    The sum is twice the mean square of the weighted signal, once that has settled. 3/20 is mostly rounded to 1/6.67.
    """
    felt = 100.0 * weighted(values, rate, "B vertical" if vertical else "B lateral")
    settled = np.arange(len(felt)) >= min(SETTLED * rate, len(felt) // 2)
    return float((2.0 * np.mean(felt[settled & late] ** 2)) ** 0.15)


def floor_accelerations(run, body):
    """What accelerometers on a body's floor show at its centre of mass, in its axes (m/s^2, by the keys of
    `DIRECTIONS`): nothing where it stands on level track. The body needs the channels `NEEDED`.
    """
    from scipy.spatial.transform import Rotation

    channels = run[body]
    moved = np.stack([channels[name] for name in DIRECTIONS], axis=-1) + GRAVITY * _upright(run, channels)
    axes = Rotation.from_euler("ZXY", np.stack([channels[f"{name}_rad"] for name in ("yaw", "roll", "pitch")], axis=-1))
    return dict(zip(DIRECTIONS, (axes.inv().apply(moved) - [0.0, 0.0, GRAVITY]).T, strict=True))


def _upright(run, channels):
    """The upright direction in the track's axes where a body is, shape (n, 3)."""
    out, frame = np.tile([0.0, 0.0, 1.0], (len(run.t), 1)), np.empty((3, 3))
    if "s_m" in channels:
        path = path_of(run)
        for row, s in zip(out, channels.s_m, strict=True):
            track_frame(path, s, frame)
            row[:] = frame[2]
    return out


def ride_table(run, begin=0.0):
    """Comfort of a run's bodies from ``begin`` (s) on, a row each: number of blocks, 95th percentiles of the weighted
    accelerations over them (m/s^2), N_MV of EN 12299, Sperling's Wz lateral and vertical, and the source of all these.
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
    """Whole-body vibration by ISO 2631-1 from ``begin`` (s) on, a row per body and direction x, y, z: weighting,
    weighted rms (m/s^2), crest factor (largest weighted value over the rms), MTVV (largest running rms over 1 s,
    m/s^2), VDV (fourth root of the integral of the fourth power, m/s^1.75), and the vibration total value of the body,
    root of the sum of the squares of the rms (m/s^2), and the source of weightings and formulas.
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
    """Output rate, times that count, and the bodies without wheels that have poses and accelerations."""
    rate, late = rate_of(run, LEAST_RATE, "ride"), output_times_after(run, begin, "ride")
    bodies = [group for group in run if group not in wheelsets_of(run) and set(NEEDED) <= set(run[group])]
    if not bodies:
        raise InputError("ride", "channels", f"expected a body without wheels that has {', '.join(NEEDED)}")
    if np.count_nonzero(late) < least * rate:
        raise InputError("ride", "begin", f"expected at least {least:g} s of the run after it, got {begin:g} s")
    return rate, late, bodies


def rate_of(run, least, what):
    """Output rate of a run, 1/s; one below ``least`` and times that are not equally spaced are refused."""
    steps = np.diff(run.t)
    if len(steps) == 0 or np.ptp(steps) > 1e-6 * steps[0]:
        raise InputError(what, "run", "expected at least two output times, equally spaced")
    rate = float((len(run.t) - 1) / (run.t[-1] - run.t[0]))
    if rate < least * (1.0 - 1e-9):
        raise InputError(what, "output.rate", f"expected at least {least:g} 1/s in the scene, got {rate:g} 1/s")
    return rate
