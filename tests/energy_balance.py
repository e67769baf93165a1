"""Energy balance of runs, with which tests check the powers of all forces."""

from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_simpson


class EnergyBalance(NamedTuple):
    """Energy balance of a run over time; all arrays have shape (n,)."""

    turned_over: np.ndarray
    """Energy exchanged between stores, sources and sinks: half the integral of the sum of |powers|, J."""
    imbalance: np.ndarray
    """Error of the balance: change of the stores plus losses minus inputs, J. The contact's store is integrated from
    its power."""
    contact_remainder: np.ndarray
    """Change of 2/5 N_el delta minus the integral of the power of the elastic contact forces, J."""


def energy_balance(channels, times):
    """Compute the `EnergyBalance` of a run from its `energy_channels` by Simpson's rule.

    Output times (s) are uniform and must resolve the fastest changes of the powers."""

    def gone(name):
        return cumulative_simpson(channels[name], x=times, initial=0.0)

    stores = sum(channels[name] - channels[name][0] for name in ("kinetic_J", "gravitational_J", "springs_J"))
    losses = sum(gone(name) for name in channels if name.startswith("dissipated"))
    inputs = sum(gone(name) for name in channels if name.startswith("input"))
    contact = gone("stored_by_elastic_contact_W")
    names = [name for name in channels if name.endswith("_W")]
    powers = np.array([channels[name] for name in names])
    kinetic = np.array([1.0 if name.startswith("input") else -1.0 for name in names]) @ powers
    turned_over = 0.5 * cumulative_simpson(np.abs(powers).sum(axis=0) + np.abs(kinetic), x=times, initial=0.0)
    remainder = channels["elastic_contact_J"] - channels["elastic_contact_J"][0] - contact
    return EnergyBalance(turned_over, stores + contact + losses - inputs, remainder)
