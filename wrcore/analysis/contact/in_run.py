"""Exact contact patches at the output times of a run with any patch model: ``wr.patch_in_run``.

Position and velocity of a wheel relative to its rail are the channels ``wheel_motion``. The vertical force of the run
is kept: the height of the wheel is changed until its exact patches carry this force, or nearly this force at a jump of
the force. This also applies to runs with exact patches: with a damping factor their contact is softer than the
material, and the penetration in the run is larger.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from wrcore.analysis.contact.loaded import GRIDS, Found, LoadedWheels
from wrcore.contact.normal.strips import STEPS
from wrcore.contact.patch.result import Patch
from wrcore.contact.rigid.height_at_load import height_of_zero
from wrcore.contact.search.reduction import ANGLE, PENETRATION
from wrcore.errors import InputError
from wrcore.errors.checked_calls import OneOf, checked
from wrcore.errors.input_files import digest_of_all
from wrcore.errors.messages import warn
from wrcore.geometry.track import SIDES
from wrcore.run.output.compute import ON_RAIL
from wrcore.run.output.run import Run
from wrcore.scene.description import Scene, Source, scene_of
from wrcore.wheels.motion import WheelMotion

PARTS = "vehicle", "wheel", "rail", "track", "contact"
"""Parts of a scene on which contact depends."""

CARRIED = 1e-3
"""Relative error of F^(2/3) at which the search for a height ends."""

NEAR = 2e-8
"""Difference of successive heights, m, at which the search ends, too: the force has a jump there, which is smaller than
the error of strips."""

SAID = 1e-2
"""Relative error of the patches' vertical force above which wrcore warns."""

ROUNDING = 1e-9
"""Tolerance of times for rounding errors, s."""


class WheelInRun:
    """A wheel of a run of a scene, whose exact patches are solved at output times.

    Errors name ``asker``; ``steps`` is that of `LoadedWheels`. InputError if the run has no ``wheel_motion``, or if
    rails or wheels vary along the track or the circumference.
    """

    def __init__(self, run: Run, scene: Scene, wheelset: str, side: str, resolution: str, asker: str,
                 steps: int = STEPS) -> None:  # fmt: skip
        wheel = run.groups.get(f"{wheelset}/{side}", {})
        if not {*ON_RAIL, "N_N"} <= wheel.keys():
            expected = f"expected contact and wheel_motion among them for the exact patches of {wheelset}/{side}"
            raise InputError(asker, "output.channels", expected)
        check_same_everywhere(scene, asker, "run")
        contact = scene.data["contact"]
        friction = scene.friction
        pair = scene.pair(side, scene.vehicle.wheelset_names.index(wheelset))
        self._wheels = LoadedWheels(
            pair.geometry, "exact", resolution, contact["slip"], **contact["material"],
            detection="planar" if scene.detection == "planar" else "spatial", steps=steps,
            friction_ratio=friction.ratio, friction_decay=friction.decay, friction_factors=friction.factors,
            friction_across=friction.across_of(list(SIDES).index(side)),
        )  # fmt: skip
        self._motions = np.column_stack([np.full(len(run.t), SIDES[side]), *(wheel[name] for name in ON_RAIL)])
        rows = (wheel[name].reshape(len(run.t), -1) for name in ("N_N", "Fy_N", "contact_angle_rad"))
        normal, lateral, angle = rows
        self._loads = np.nansum(normal * np.cos(angle) + lateral * np.sin(angle), axis=1)
        self._presses = np.nansum(normal, axis=1) > 0.0
        self.missed = 0.0  # relative error of the vertical force of the patches found last

    def at(self, i: int) -> list[Found]:
        """Return patches with their fields at the i-th output time; empty if the wheel has no contact."""
        self.missed = 0.0
        if not self._presses[i]:
            return []
        m, load, self.missed = WheelMotion(*self._motions[i].tolist()), float(self._loads[i]), np.inf
        goal, before, best = max(load, 0.0) ** (2.0 / 3.0), np.nan, []
        first = self._wheels.in_motion(m._replace(friction=0.0))  # start of later ones

        def excess(z):
            nonlocal before, best
            tried = self._carrying(m._replace(z=z))
            carried = sum(one.vertical for one in tried)
            if load > 0.0 and abs(carried / load - 1.0) < self.missed:
                best, self.missed = tried, abs(carried / load - 1.0)
            rest = max(carried, 0.0) ** (2.0 / 3.0) - goal
            near, before = abs(z - before) < NEAR, z
            return 0.0 if near or abs(rest) < CARRIED * goal else rest

        if load > 0.0:
            height_of_zero(excess, m.z + _lift(first, load))
        return best or self._carrying(m)

    def _carrying(self, m: WheelMotion) -> list[Found]:
        """Return patches with their fields, without patches of zero load: a grid may have no element in contact."""
        return [one for one in self._wheels.in_motion(m, fields=True, warm=True) if one.load > 0.0]


def _lift(found: list[Found], load: float) -> float:
    """Return the lift of a wheel, m, at which its patches carry a load, N, if force is proportional to depth^1.5."""
    most = max(found, key=lambda one: one.load, default=None)
    if most is None or not most.load > 0.0:
        return 0.0
    share = (load / sum(one.vertical for one in found)) ** (2.0 / 3.0)
    return (1.0 - share) * float(most.row[PENETRATION]) / math.cos(most.row[ANGLE])


def check_same_everywhere(scene: Scene, asker: str, field: str) -> None:
    """Raise InputError, named by ``asker`` and ``field``, if rails or wheels of a scene vary along track or rim."""
    parts = {"track.crossing": scene.crossings, "out_of_round": scene.out_of_round, "corrugation": scene.corrugation}
    if changing := [name for name, part in parts.items() if part]:
        expected = f"expected rails and wheels that are the same everywhere for exact patches, got {changing[0]}"
        use = "'wrcore contact --patch grid' on slices takes the real surfaces where the run counts not_parabolic"
        raise InputError(asker, field, f"{expected}; {use}")


def scene_in_run(run: Run, scene: Source | None, asker: str, trust: bool) -> Scene:
    """Return the scene of a run; InputError, named by ``asker``, if parts on which contact depends differ from the
    run's."""
    scene = scene_of(run, scene, asker, trust)
    other = [part for part in PARTS if scene.data.get(part) != run.scene.get(part)]
    if other:
        raise InputError(asker, "scene", f"expected that of the run, but {' and '.join(other)} of it differ")
    if digest_of_all(scene.files) != run.settings.get("files_sha256", ""):
        expected = f"expected the files of the run, but of {', '.join(scene.files)} some hold something else now"
        raise InputError(asker, "scene", expected)
    check_laws(run, scene, asker)
    return scene


def check_laws(run: Run, scene: Scene, asker: str) -> None:
    """Raise InputError, named by ``asker``, if the user's laws of a run's scene have changed after the run."""
    then, now = run.settings.get("laws_sha256", {}), scene.laws.digests
    changed = sorted(name for name in then.keys() | now.keys() if then.get(name) != now.get(name))
    if changed:
        expected = f"expected the laws of the run, but {' and '.join(changed)} of it changed since: run the scene again"
        raise InputError(asker, "scene", expected)


@checked
def patch_in_run(
    run: Run,
    t: float,
    wheelset: str,
    side: Annotated[str, OneOf(SIDES)] = "left",
    resolution: Annotated[str, OneOf(GRIDS)] = "middle",
    scene: Source | None = None,
    trust: bool = False,
) -> list[Patch]:
    """Return the exact contact patches of a wheel at a time of a run with any patch model.

    Parameters
    ----------
    run : Run
        Run of a scene whose ``output.channels`` contain ``contact`` and ``wheel_motion``.
    t : float
        Time, s; the nearest output time is used.
    wheelset : str
        Name of a wheelset.
    side : {"left", "right"}
    resolution : {"coarse", "middle", "fine"}
    scene : Scene, str, Path or dict, optional
        Scene of the run; by default it is read again from the description in the run.
    trust : bool
        Whether laws of the user that a run file names may be executed.

    Returns
    -------
    list of Patch
        Patches from the flange to the field side; empty if the wheel has no contact. Together they carry the vertical
        force of the wheel in the run, or a force close to it at a jump. Position and velocity are those of the run,
        except the height.

    Raises
    ------
    InputError
        If the time is outside the run, the run does not have the wheel or the channels, or the scene is not the run's.
        Also if rails or wheels vary along the track or the rim. For these, a run counts patches whose gap along the
        rail is not a parabola (``not_parabolic``), and ``wrcore contact --patch grid`` on slices uses the real
        surfaces.

    Examples
    --------
    >>> import wrcore as wr
    >>> channels = {"output.channels": ["pose", "contact", "wheel_motion"], "integration.duration": 0.1}
    >>> scene = wr.load_scene(wr.example("suspended_wheelset"), channels)
    >>> run = wr.simulate(scene)
    >>> (tread,) = wr.patch_in_run(run, 0.05, "wheelset", scene=scene)
    >>> round(1e-3 * tread.normal), tread.side
    (54, 'left')
    """
    if not len(run.t) or not run.t[0] - ROUNDING <= t <= run.t[-1] + ROUNDING:
        raise InputError("patch_in_run", "t", f"expected a time of the run, got {t:g} s")
    if wheelset not in run.groups or f"{wheelset}/{side}" not in run.groups:
        raise InputError("patch_in_run", "wheelset", f"expected a wheelset of the run with contacts, got {wheelset!r}")
    found = scene_in_run(run, scene, "patch_in_run", trust)
    wheel = WheelInRun(run, found, wheelset, side, resolution, "patch_in_run")
    patches = wheel.at(int(np.argmin(np.abs(run.t - t))))
    if wheel.missed > SAID:
        off = f"off by {wheel.missed:.2%}" if np.isfinite(wheel.missed) else "not the wheel's at any height"
        warn(f"patch_in_run: {wheelset}/{side}: at {t:g} s the patches' vertical force is {off}")
    return [one.patch for one in patches]
