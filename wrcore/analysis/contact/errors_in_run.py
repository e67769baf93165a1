"""Errors of a run's contact model at the run's own output times: ``wr.contact_errors``.

The wheels' motions on their rails are the channels ``wheel_motion``. Contact is evaluated for these motions twice: with
the contact model of the run, and with ``exact``. Both evaluations include the damping of the contact.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import pandas as pd

from wrcore.analysis.contact.in_run import check_same_everywhere, scene_in_run
from wrcore.contact.search import reduction
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError
from wrcore.errors.checked_calls import Within, checked
from wrcore.geometry.track import SIDES
from wrcore.run.output.compute import ON_RAIL
from wrcore.run.output.run import Run
from wrcore.scene.compile import model_of
from wrcore.scene.description import Scene, Source, load_scene
from wrcore.wheels.force import press_wheels
from wrcore.wheels.modes import FRESH
from wrcore.wheels.motion import MOTION

ASKER = "contact_errors"

TIMES = 20
"""Default number of output times."""


class _Wheels:
    """The wheels of a scene with one contact model."""

    def __init__(self, scene: Scene) -> None:
        self._equations = Equations(model_of(scene))

    def patches(self, motions: np.ndarray) -> list[list[np.ndarray]]:
        """Return the patches (n, PATCH_COLUMNS) of the left and the right wheel of each wheelset, from their motions
        (wheelsets, 2, 15)."""
        work = self._equations.work
        work.motions[:] = motions
        press_wheels(*self._equations.arguments[1:], FRESH)
        return [
            [work.patches[k, wheel, : work.counts[k, wheel]].copy() for wheel in range(2)] for k in range(len(motions))
        ]


def _motions(run, names, i):
    """Return the motions (wheelsets, 2, 15) of all wheels at the i-th output time."""
    motions = np.zeros((len(names), len(SIDES), len(MOTION)))
    for k, name in enumerate(names):
        for wheel, (side, sign) in enumerate(SIDES.items()):
            channels = run.groups[f"{name}/{side}"]
            motions[k, wheel] = [sign, *(channels[channel][i] for channel in ON_RAIL)]
    return motions


def _row(of_run, exact, friction):
    """Return the columns of one wheel: the patches (n, PATCH_COLUMNS) with the run's model and with the exact one."""
    heaviest = exact[exact[:, reduction.NORMAL].argmax()]
    judged = of_run[of_run[:, reduction.NORMAL].argmax()]
    normal, c = heaviest[reduction.NORMAL], np.sqrt(heaviest[reduction.SEMI_A] * heaviest[reduction.SEMI_B])
    if judged[reduction.P_MAX] == 0.0:  # kernels of ellipses leave it out
        area = np.pi * judged[reduction.SEMI_A] * judged[reduction.SEMI_B]
        judged[reduction.P_MAX] = 1.5 * judged[reduction.NORMAL] / area
    limit, difference = friction * normal, judged - heaviest
    return {
        "patches": len(of_run),
        "patches_exact": len(exact),
        "contact_angle_rad": heaviest[reduction.ANGLE],
        "N_N": normal,
        "p_max_Pa": heaviest[reduction.P_MAX],
        "N_error": difference[reduction.NORMAL] / normal,
        "creep_force_error": np.hypot(difference[reduction.FX], difference[reduction.FY]) / limit,
        "spin_moment_error": difference[reduction.MZ] / (limit * c),
        "contact_angle_error_rad": difference[reduction.ANGLE],
        "p_max_error": difference[reduction.P_MAX] / heaviest[reduction.P_MAX],
    }


def _exact_scene(scene):
    """Return the scene with exact contact and the creep law of exact contact."""
    changes: dict[str, Any] = {"contact.patch": "exact"}
    if scene.data["contact"]["creep"]["model"] != "table":
        changes["contact.creep"] = {"model": "table", "least_speed": scene.data["contact"]["creep"]["least_speed"]}
    return load_scene(scene, changes)


@checked
def contact_errors(
    run: Run, count: Annotated[int, Within(1, 10**6)] = TIMES, scene: Source | None = None, trust: bool = False
) -> pd.DataFrame:
    """Return the errors of a run's contact model relative to exact contact, at output times of the run.

    At each time the wheels have the positions and velocities of the run. Contact is evaluated with the run's model and
    with ``contact.patch: exact`` (resolution ``middle`` unless the scene has another one). The first call compiles the
    kernels of exact contact, which takes about a minute.

    Parameters
    ----------
    run : Run
        Run of a scene whose ``output.channels`` contain ``contact`` and ``wheel_motion``.
    count : int
        Number of output times, equally spaced over the run.
    scene : Scene, str, Path or dict, optional
        Scene of the run; by default it is read again from the description in the run.
    trust : bool
        Whether laws of the user that a run file names may be executed.

    Returns
    -------
    pandas.DataFrame
        One row per time and wheel that has contact with both models: ``t_s``, ``wheelset`` and ``side``; the number of
        patches with the run's model (``patches``) and with exact contact (``patches_exact``). Of the patch with the
        largest normal force: contact angle (rad, positive where the outer side of the left rail is higher), normal
        force N and maximum pressure by exact contact. Errors of the same patch, model of the run minus exact: of N
        relative to N; absolute difference of the creep force relative to the friction limit (friction times N); of the
        spin moment relative to friction times N times the root of both semi-axes' product; of the contact angle (rad);
        of the maximum pressure relative to it.

    Raises
    ------
    InputError
        If the run has exact contact already or does not have the channels, or if the scene is not the run's; also if
        rails or wheels vary along the track or the rim.

    Examples
    --------
    >>> import wrcore as wr
    >>> channels = {"output.channels": ["contact", "wheel_motion"], "integration.duration": 0.1}
    >>> scene = wr.load_scene(wr.example("suspended_wheelset"), {"contact.patch": "moment", **channels})
    >>> errors = wr.contact_errors(wr.simulate(scene), 5)
    >>> bool(errors.N_error.abs().max() < 0.05)
    True
    """
    if run.scene["contact"]["patch"] == "exact":
        raise InputError(ASKER, "run", "expected a run with another contact.patch than exact, which is the reference")
    found = scene_in_run(run, scene, ASKER, trust)
    check_same_everywhere(found, ASKER, "run")
    names = found.vehicle.wheelset_names
    if not names or not {*ON_RAIL, "N_N"} <= run.groups.get(f"{names[0]}/left", {}).keys():
        raise InputError(ASKER, "output.channels", "expected contact and wheel_motion among the channels of the run")
    of_run, exact, rows = _Wheels(found), _Wheels(_exact_scene(found)), []
    for i in np.unique(np.linspace(0, len(run.t) - 1, min(count, len(run.t))).astype(int)):
        motions = _motions(run, names, i)
        both = zip(names, motions, of_run.patches(motions), exact.patches(motions), strict=True)
        for name, motion, patches, patches_exact in both:
            for wheel, side in enumerate(SIDES):
                if len(patches[wheel]) and len(patches_exact[wheel]):
                    row = _row(patches[wheel], patches_exact[wheel], motion[wheel, MOTION.friction])
                    rows.append({"t_s": run.t[i], "wheelset": name, "side": side, **row})
    return pd.DataFrame(rows)
