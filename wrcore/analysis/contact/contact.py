"""Table of the contact patches of a wheelset over its lateral position and yaw."""

from typing import Annotated

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from wrcore.analysis.contact.contacts import contacts
from wrcore.analysis.contact.poses import POSE_FLAGS, STILL
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.contact.search.reduction import REDUCTIONS
from wrcore.errors.checked_calls import OneOf, Within, checked
from wrcore.geometry.track import SIDES


@checked
def contact_table(
    pair: WheelsetOnTrack,
    shifts: Annotated[ArrayLike, Within(-0.1, 0.1, "m")],
    yaws: Annotated[ArrayLike, Within(-0.5, 0.5, "rad")] = 0.0,
    wheel_load: Annotated[float, Within(1e-9, 1e6, "N")] = 1e-3,
    detection: Annotated[str, OneOf(("planar", "spatial"))] = "spatial",
    patch: Annotated[str, OneOf(REDUCTIONS)] = "moment",
) -> pd.DataFrame:
    """Return all contact patches of both wheels over lateral position and yaw of a wheelset, at a load per wheel.

    Parameters
    ----------
    pair : WheelsetOnTrack
    shifts, yaws : array_like
        Lateral positions (within 0.1 m) and yaw angles (within 0.5 rad) of the wheelset; all combinations.
    wheel_load : float
        Vertical load of each wheel, N; with the default the wheelset just touches the rails.
    detection : {"planar", "spatial"}
    patch : {"moment", "maximum"}

    Returns
    -------
    pandas.DataFrame
        y_m, yaw_rad and the columns of ``wrcore contact``, a row per patch. A wheel without contact, or without a
        height at which it carries the load, has no row.

    Raises
    ------
    InputError
        If a position or angle is out of these bounds, a choice is unknown, or a load has another unit.

    Examples
    --------
    >>> import wrcore as wr
    >>> pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    >>> wr.contact_table(pair, [0.0, 0.002], wheel_load=5e4)[["y_m", "side", "patch"]].values.tolist()
    [[0.0, 'left', 1], [0.0, 'right', 1], [0.002, 'left', 1], [0.002, 'right', 1]]
    """
    yaw, y = (grid.ravel() for grid in np.meshgrid(np.atleast_1d(yaws), np.atleast_1d(shifts), indexing="ij"))
    found = contacts(pair, y, yaw=yaw, load=wheel_load, detection=detection, patch=patch)
    there = np.isfinite(found.N_N)
    limits = {name: np.broadcast_to(_of_patches(found[name], there), there.shape)[there] for name in POSE_FLAGS}
    pose, side, number = np.nonzero(there)
    table = {"y_m": y[pose], "yaw_rad": yaw[pose], "side": np.array(list(SIDES), object)[side], "patch": number + 1}
    table |= {"y_contact_m" if name == "y_m" else name: found[name][there] for name in (*STILL, "p_max_Pa")}
    table |= {"roll_rad": found.roll_rad[pose], "z_wheelset_m": found.z_wheelset_m[pose, side]}
    table |= {"load_residual_N": found.load_residual_N[pose, side]}
    return pd.DataFrame(table | {name: values.astype(int) for name, values in limits.items()})


def _of_patches(flag, there):
    """Reshape a flag of positions (n,), wheels (n, 2) or patches (n, 2, 3), so that it broadcasts to patches."""
    return flag.reshape(flag.shape + (1,) * (there.ndim - flag.ndim))
