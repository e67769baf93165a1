"""What creep costs at a wheel: wear number T gamma and dissipated power.

With Fx, Fy, Mz the creep forces on the wheel and xi, eta, phi the creepages of a patch, its work per metre run is
-(Fx xi + Fy eta + Mz phi): what friction turns into heat and wear, never negative. T gamma is its amount without the
spin's part, as wear models for rails and wheels take it (T for the tangential force, gamma for the creepage), or with
it. The products carry signs: where spin drives the lateral force along its creepage (on a flange, mostly), one of them
gives work back, and a sum of their amounts is neither.

References
----------
Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), section 1.3 (power of the tangential traction).
Pearce and Sherratt, Wear 144 (1991) 343-351 (T gamma).
"""

import numpy as np


def creep_work(fx, fy, mz, xi, eta, phi):
    """Creep work of wheels, shape (...), from forces (N), spin moment (N m), creepages and spin (1/m) of patches (...,
    patches), NaN where there is none: sums of abs(Fx xi + Fy eta), N, of abs(Fx xi + Fy eta + Mz phi), N, and of -(Fx
    xi + Fy eta + Mz phi), J/m, which times the rolling speed is the dissipated power.
    """
    sliding = fx * xi + fy * eta
    whole = sliding + mz * phi
    return tuple(np.nansum(part, axis=-1) for part in (np.abs(sliding), np.abs(whole), -whole))
