"""Ride of a run's bodies: frequency weightings of accelerations, comfort and Sperling's index.

Sources. Weightings Wk, Wd and Wb with its gain: table of ISO 8041 as an instrument's manual prints it (Larson Davis
HVM200, table 3.1; read). Recalled, not read: ISO 2631-1:1997 (weighted rms, vibration total value with factors 1 as
for comfort of the seated, crest factor, MTVV over 1 s, VDV); EN 12299:2009 (mean comfort N_MV = 6 sqrt(sum of the
squares of the 95th percentiles of weighted rms values over 5 s)); Sperling and Betzhold (1956) in the form of Garg and
Dukkipati (1984). The tests hold Wk and Wd against values of ISO 2631-1's table 3, recalled too.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from wrcore.errors import InputError, one_of

BLOCK = 5.0
"""Length of the stretches that comfort is evaluated over, s."""

LEAST_RATE = 200.0
"""Weightings end at 100 Hz, 1/s."""


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
        """Complex response at frequencies.

        Parameters
        ----------
        frequency : array_like
            Hz.

        Returns
        -------
        numpy.ndarray
        """
        s = 1j * np.asarray(frequency, float)

        def pair(corner, quality):
            return 1.0 + s / (quality * corner) + (s / corner) ** 2

        flat = np.sqrt(0.5)  # Butterworth
        out = self.gain * (s / self.low) ** 2 / pair(self.low, flat) / pair(self.high, flat)
        out *= (1.0 + s / self.f3) / pair(self.f4, self.q4)
        if self.f5 is not None:
            out *= pair(self.f5, self.q5) / pair(self.f6, self.q6) * (self.f5 / self.f6) ** 2
        return out


WEIGHTINGS = {
    "Wk": Weighting(0.4, 100.0, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),
    "Wd": Weighting(0.4, 100.0, 2.0, 2.0, 0.63),
    "Wb": Weighting(0.4, 100.0, 16.0, 16.0, 0.55, 2.5, 0.9, 4.0, 0.95, 1.024),
}
"""By name: vertical and horizontal of ISO 2631-1, vertical of EN 12299."""

DIRECTIONS = {"ax_m_per_s2": "Wd", "ay_m_per_s2": "Wd", "az_m_per_s2": "Wb"}
"""Weighting of each acceleration in EN 12299."""

DIRECTIONS_ISO = DIRECTIONS | {"az_m_per_s2": "Wk"}
"""The same in ISO 2631-1."""

RUNNING = 1.0
"""Time of the running rms of ISO 2631-1, s."""


def weighted(values, rate, weighting):
    """A signal after a weighting, by its response in frequency; from rest, without periodic continuation.

    Parameters
    ----------
    values : array_like, shape (n,)
    rate : float
        1/s.
    weighting : {"Wk", "Wd", "Wb"}

    Returns
    -------
    numpy.ndarray, shape (n,)

    Raises
    ------
    InputError
        For an unknown weighting.
    """
    if weighting not in WEIGHTINGS:
        raise InputError("weighted", "weighting", one_of(WEIGHTINGS, weighting))
    values = np.asarray(values, float)
    size = 2 * len(values)
    spectrum = np.fft.rfft(values, size) * WEIGHTINGS[weighting].response(np.fft.rfftfreq(size, 1.0 / rate))
    return np.fft.irfft(spectrum, size)[: len(values)]


def block_rms(values, rate, block=BLOCK):
    """Root mean squares over whole blocks.

    Parameters
    ----------
    values : array_like, shape (n,)
    rate : float
        1/s.
    block : float
        s.

    Returns
    -------
    numpy.ndarray
        One per whole block.
    """
    length = round(block * rate)
    count = len(values) // length
    return np.sqrt(np.mean(np.square(np.asarray(values, float)[: count * length]).reshape(count, length), axis=1))


def sperling(values, rate, vertical):
    """Sperling's ride index Wz of an acceleration: (integral of a^2 B^2)^(1/6.67), a in cm/s^2 rms.

    Parameters
    ----------
    values : array_like, shape (n,)
        m/s^2.
    rate : float
        1/s.
    vertical : bool

    Returns
    -------
    float
    """
    values = 100.0 * np.asarray(values, float)
    spectrum = np.abs(np.fft.rfft(values - values.mean())) ** 2 / len(values) ** 2
    spectrum[1 : len(values) - len(spectrum) + 1] *= 2.0  # the negative frequencies
    f = np.fft.rfftfreq(len(values), 1.0 / rate)
    square = (1.911 * f**2 + (0.25 * f**2) ** 2) / ((1.0 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2)
    return float(np.sum(spectrum * (0.588 if vertical else 0.737) ** 2 * square) ** (1.0 / 6.67))


def ride_table(run, begin=0.0):
    """Comfort of a run's bodies at their centres of mass.

    Parameters
    ----------
    run : Run
        With the channels ax, ay and az.
    begin : float
        Start of the evaluation, s.

    Returns
    -------
    pandas.DataFrame
        A row per body: number of blocks, 95th percentiles of the weighted accelerations over them (m/s^2), N_MV of
        EN 12299, Sperling's Wz lateral and vertical.

    Raises
    ------
    InputError
        Without such a body, with less than one block, or with too low a rate.
    """
    rate, late, bodies = _bodies(run, begin, BLOCK)
    rows = []
    for body in bodies:
        blocks = {
            name: block_rms(weighted(run[body][name][late], rate, weighting), rate)
            for name, weighting in DIRECTIONS.items()
        }
        high = {f"{name[:2]}_weighted_95_m_per_s2": float(np.percentile(b, 95.0)) for name, b in blocks.items()}
        rows.append(
            {"body": body, "blocks": len(blocks["ax_m_per_s2"])}
            | high
            | {
                "N_MV": 6.0 * float(np.sqrt(sum(value**2 for value in high.values()))),
                "Wz_lateral": sperling(run[body].ay_m_per_s2[late], rate, vertical=False),
                "Wz_vertical": sperling(run[body].az_m_per_s2[late], rate, vertical=True),
            }
        )
    return pd.DataFrame(rows)


def whole_body_table(run, begin=0.0):
    """Whole-body vibration at the centres of mass of a run's bodies by ISO 2631-1.

    Parameters
    ----------
    run : Run
        With the channels ax, ay and az.
    begin : float
        Start of the evaluation, s.

    Returns
    -------
    pandas.DataFrame
        A row per body and direction x, y, z: weighting, weighted rms (m/s^2), crest factor (largest weighted value over
        the rms), MTVV (largest running rms over 1 s, m/s^2), VDV (fourth root of the integral of the fourth power,
        m/s^1.75), and the vibration total value of the body, root of the sum of the squares of the rms (m/s^2).

    Raises
    ------
    InputError
        As for `ride_table`.
    """
    rate, late, bodies = _bodies(run, begin, RUNNING)
    rows = []
    for body in bodies:
        own = []
        for name, weighting in DIRECTIONS_ISO.items():
            values = weighted(run[body][name][late], rate, weighting)
            rms = float(np.sqrt(np.mean(values**2)))
            window = round(RUNNING * rate)
            sums = np.cumsum(np.concatenate([[0.0], values**2]))
            own.append({
                "body": body, "direction": name[1], "weighting": weighting, "rms_m_per_s2": rms,
                "crest_factor": float(np.abs(values).max()) / rms if rms > 0.0 else np.nan,
                "MTVV_m_per_s2": float(np.sqrt(max((sums[window:] - sums[:-window]).max(), 0.0) / window)),
                "VDV_m_per_s1_75": float((np.sum(values**4) / rate) ** 0.25),
            })  # fmt: skip
        total = float(np.sqrt(sum(row["rms_m_per_s2"] ** 2 for row in own)))
        rows += [row | {"total_value_m_per_s2": total} for row in own]
    return pd.DataFrame(rows)


def _bodies(run, begin, least):
    """Output rate, times that count, and the bodies without wheels that have accelerations."""
    rate, late = rate_of(run, LEAST_RATE, "ride"), run.t >= begin
    wheels = {group.split("/")[0] for group in run if "/" in group}
    bodies = [group for group in run if group not in wheels and set(DIRECTIONS) <= set(run[group])]
    if not bodies:
        raise InputError("ride", "channels", f"expected a body without wheels that has {', '.join(DIRECTIONS)}")
    if np.count_nonzero(late) < least * rate:
        raise InputError("ride", "begin", f"expected at least {least:g} s of the run after it, got {begin:g} s")
    return rate, late, bodies


def rate_of(run, least, what):
    """Output rate of a run, 1/s.

    Raises
    ------
    InputError
        If it is below ``least``, or its times are not equally spaced.
    """
    steps = np.diff(run.t)
    if len(steps) == 0 or np.ptp(steps) > 1e-6 * steps[0]:
        raise InputError(what, "run", "expected at least two output times, equally spaced")
    rate = float((len(run.t) - 1) / (run.t[-1] - run.t[0]))
    if rate < least * (1.0 - 1e-9):
        raise InputError(what, "output.rate", f"expected at least {least:g} 1/s in the scene, got {rate:g} 1/s")
    return rate
