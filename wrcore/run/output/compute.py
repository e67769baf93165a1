"""Compute the output channels of states of a compiled scene."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import numpy as np

from wrcore.bodies.body import STATE_SIZE, angles, matrix_of
from wrcore.contact.search import reduction
from wrcore.equations.energy import energy_channels
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import Model, independent_at, workspace
from wrcore.equations.outputs import check_rail_history, drive_history, evaluations_at, motion_history
from wrcore.forces.control import OUTPUTS, OUTPUTS_END, STATES, STATES_END
from wrcore.geometry.irregularity import irregularity_extents
from wrcore.geometry.track import SIDES
from wrcore.integrate.trajectory import Trajectory
from wrcore.run.checks.shape_along import ShapesAlong
from wrcore.run.checks.validity import exceeded, look_up_errors
from wrcore.run.output.derived import OF_WHEELS, OF_WHEELSETS, asked_for
from wrcore.run.output.run import Run
from wrcore.scene.description import Scene
from wrcore.track.flexible_track import track_places
from wrcore.track.track import track_poses
from wrcore.wheels.contact_model import is_elliptic, shaped
from wrcore.wheels.motion import MOTION

TRACK_CHANNELS = (
    "rail_y_left_m", "rail_z_left_m", "rail_y_right_m", "rail_z_right_m",
    "sleeper_y_m", "sleeper_z_m", "sleeper_roll_rad",
)  # fmt: skip
"""Channels of a flexible track, in the order of its degrees of freedom (:mod:`wrcore.track.flexible_track`)."""

ON_RAIL = tuple(
    f"on_rail_{name}" for name in (
        "y_m", "z_m", "axle_x", "axle_y", "axle_z", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s", "wx_rad_per_s",
        "wy_rad_per_s", "wz_rad_per_s", "bend_y_per_m", "bend_z_per_m", "friction",
    )
)  # fmt: skip
"""Channels of a wheel's `WheelMotion`, in the order of its fields, without its side."""


class ArcLengths(NamedTuple):
    """Arc lengths from which the search for those of the next output starts on a curved track, m."""

    wheelsets: np.ndarray
    """Arc lengths of the wheelsets, shape (k,); NaN: not known yet."""
    bodies: np.ndarray
    """Arc lengths of the bodies, shape (n,)."""


class Outputs:
    """Output channels of a scene's compiled ``model``.

    On a curved track the arc lengths of the next output are searched near ``arc_lengths``, those of the last output.
    """

    def __init__(self, scene: Scene, model: Model) -> None:
        self.scene, self.model, self._shapes = scene, model, ShapesAlong(scene)
        unknown = np.full(len(model.bodies.wheelsets), np.nan)
        self.arc_lengths = ArcLengths(unknown, scene.vehicle.positions[:, 0].astype(float))

    @property
    def places(self) -> np.ndarray:
        """Arc lengths (k,) of the wheelsets at the last output, m."""
        return self.arc_lengths.bodies[self.model.bodies.wheelsets]

    def observe(self, model: Model, times: np.ndarray, states: np.ndarray) -> Run:
        """Return a run with the channels of states (n, size) at times (n,), s, of a variant of the scene's model."""
        variant = copy.copy(self)
        variant.model = model
        groups, _ = variant.channels(Trajectory("", times, states, "completed", ""))
        return Run(self.scene.data, "completed", "", times, groups)

    def channels(
        self, trajectory: Trajectory, equations: Equations | None = None
    ) -> tuple[dict[str, dict[str, np.ndarray]], dict[str, Any]]:
        """Return output channels by group, and counters of exceeded limits.

        Contacts are evaluated again at the output times, with ``equations`` of this model if they are given.
        """
        model, states, equations = self.model, trajectory.states, self._from_here(equations)
        evaluations = patches, _, _ = evaluated(model, trajectory, equations)
        poses, axes = self._poses(states, range(len(model.bodies.mass)))
        energies = energy_channels(model, self._workspace(), trajectory.t, states) if self._wants("energy") else None
        if len(states):
            self.arc_lengths = ArcLengths(equations.work.arc_lengths.copy(), poses[-1, :, 0].copy())
        groups = self._of_bodies(range(len(model.bodies.mass)), states, evaluations, poses, axes)
        self._add_wheel_motions(groups, trajectory, equations)
        self._add_check_rails(groups, trajectory, equations)
        if energies is not None:
            groups["energy"] = energies
        groups |= self._drive_channels(trajectory, equations)
        standing = poses[:, model.bodies.wheelsets]
        extents = irregularity_extents(model.track.irregularity)
        first, last = extents[:, 0].min(initial=np.inf), extents[:, 1].max(initial=-np.inf)
        beyond = np.sum(standing[..., 0] > last) if len(extents) else 0
        before = np.sum(standing[..., 0].max(axis=1, initial=-np.inf) < first) if len(extents) else 0
        limits = exceeded(model.contact, patches, standing[..., 3], standing[..., 4])
        limits |= self._shapes.counts(patches, standing[..., 0], standing[..., 4])
        limits |= {"before_irregularity": int(before), "beyond_irregularity": int(beyond)}
        return groups, limits | look_up_errors(equations.arguments[1].value.contact, patches)

    def present(
        self, trajectory: Trajectory, asked: set[str], places: np.ndarray, equations: Equations
    ) -> dict[str, dict[str, np.ndarray]]:
        """Return channels of the requested groups, and of groups of the same bodies, with ``equations`` of this model.

        ``places`` are approximate arc lengths (k,) of its wheelsets, m.
        """
        names, wheelsets = self.scene.vehicle.body_names, self.model.bodies.wheelsets
        if len(places) and np.isfinite(places[0]):
            nominal = self.scene.vehicle.positions[:, 0]
            self.arc_lengths = ArcLengths(places.copy(), nominal + places[0] - nominal[wheelsets[0]])
        bodies = [body for body, name in enumerate(names) if any(group.split("/")[0] == name for group in asked)]
        groups: dict[str, dict[str, np.ndarray]] = {}
        if bodies:
            evaluations = evaluated(self.model, trajectory, self._from_here(equations))
            groups = self._of_bodies(bodies, trajectory.states, evaluations, *self._poses(trajectory.states, bodies))
            self._add_wheel_motions(groups, trajectory, equations)
            self._add_check_rails(groups, trajectory, equations)
        if any(group.startswith(("drive/", "control/")) for group in asked):
            groups |= self._drive_channels(trajectory, equations)
        if "energy" in asked and self._wants("energy"):
            groups["energy"] = energy_channels(self.model, self._workspace(), trajectory.t, trajectory.states)
        return groups

    def _wants(self, *kinds: str) -> bool:
        """Whether the scene requests at least one of some kinds of channels (``output.channels``)."""
        return not set(kinds).isdisjoint(self.scene.data["output"]["channels"])

    def _of_bodies(self, bodies, states, evaluations, poses, axes):
        """Return channels of bodies, by number, and of their wheels by group, from `evaluated` and `_poses`."""
        scene, model, (patches, bounds, rates) = self.scene, self.model, evaluations
        wanted, wheelsets = scene.data["output"]["channels"], model.bodies.wheelsets
        groups, numbers = {}, {int(body): k for k, body in enumerate(wheelsets)}
        for body in bodies:
            name = scene.vehicle.body_names[body]
            part, k = slice(STATE_SIZE * body, STATE_SIZE * (body + 1)), numbers.get(body)
            motion = states[:, part], rates[:, part], poses[:, body], axes[:, body]
            groups[name] = _body_channels(*motion, wanted, pitches=not model.bodies.spins[body])
            if "pose" in wanted and not model.track.tangent:
                groups[name]["s_m"] = poses[:, body, 0]
            if "pose" in wanted and k is not None and len(model.flexible_track.mass):
                groups[name] |= self._track_places(states, k)
            if "velocity" in wanted and body in wheelsets[model.bodies.independent[:, 0]]:
                groups[name] |= self._rolling_rates(states, body)
            if k is None or not self._wants("contact", *OF_WHEELS, *OF_WHEELSETS):
                continue
            contacts = self._contact_channels(name, patches[:, k])
            if "contact" in wanted:
                groups |= contacts
            moving = {name: _body_channels(*motion, ("pose", "velocity"))}
            for group, channels in asked_for(wanted, contacts | moving, scene.data["speed"]).items():
                groups[group] = groups.get(group, {}) | channels
            if "contact" in wanted and scene.detection == "auto":
                groups[name] |= {f"planar_error_{side}_m": bounds[:, k, i] for i, side in enumerate(SIDES)}
                spatial = bounds[:, k] > scene.data["contact"]["detection_tolerance"]
                groups[name] |= {f"spatial_{side}": spatial[:, i].astype(float) for i, side in enumerate(SIDES)}
        return groups

    def _contact_channels(self, name, patches):
        """Return channels of the contacts of a wheelset's wheels, by group."""
        groups = {}
        for side, rows in zip(SIDES, np.moveaxis(patches, 1, 0), strict=True):
            channels = {key: rows[..., column] for key, column in reduction.CHANNELS.items()}
            if not is_elliptic.py_func(self.model.contact):
                channels["p_max_Pa"] = rows[..., reduction.P_MAX]
            if shaped(self.model.contact):
                channels["psi"] = rows[..., reduction.PSI]
            groups[f"{name}/{side}"] = channels
        return groups

    def _rolling_rates(self, states, body):
        """Return channels of the rolling rates of independently rotating wheels, rad/s."""
        bodies = self.model.bodies
        j = int(np.flatnonzero(bodies.wheelsets[bodies.independent[:, 0]] == body)[0])
        part = states[:, STATE_SIZE * body : STATE_SIZE * (body + 1)]
        mean = np.array([matrix_of(one[3:7])[:, 1] @ one[10:13] for one in part])
        half = states[:, independent_at(bodies, j)]
        return {f"rolling_rate_{side}_rad_per_s": mean + sign * half for side, sign in zip(SIDES, (1, -1), strict=True)}

    def _track_places(self, states, k):
        """Return channels of the displacements of rails and sleeper under the k-th wheelset, m and rad."""
        places = track_places(self.model)[k, : len(self.model.flexible_track.mass)]
        return dict(zip(TRACK_CHANNELS, states[:, places].T, strict=False))

    def _add_wheel_motions(self, groups, trajectory, equations):
        """Add channels of position and velocity of wheels relative to their rails, if the scene requests them."""
        if not self._wants("wheel_motion"):
            return
        motions = motion_history(self._from_here(equations), trajectory.t, trajectory.states)
        for k, body in enumerate(self.model.bodies.wheelsets):
            name = self.scene.vehicle.body_names[body]
            for i, side in enumerate(SIDES if name in groups else ()):
                groups[f"{name}/{side}"] |= dict(zip(ON_RAIL, motions[:, k, i, MOTION.y :].T, strict=True))

    def _add_check_rails(self, groups, trajectory, equations):
        """Add channels of the forces of check rails, N, to the groups of wheelsets, if the scene has check rails."""
        if not len(self.model.check_rails.rows) or not self._wants("contact"):
            return
        forces = check_rail_history(self._from_here(equations), trajectory.t, trajectory.states)
        for k, body in enumerate(self.model.bodies.wheelsets):
            group = groups.get(self.scene.vehicle.body_names[body])
            if group is not None:
                group |= {f"check_rail_{side}_N": forces[:, k, i] for i, side in enumerate(SIDES)}

    def _drive_channels(self, trajectory, equations):
        """Return channels of motors and brakes (torque, power), speed controller (force, speed) and control laws
        (outputs, states), by group; empty if the scene has none of them."""
        spec, laws = self.scene.data.get("drive") or {"motors": [], "brakes": []}, self.scene.data.get("control", {})
        if not any(spec.values()) and not laws:
            return {}
        found = drive_history(self._from_here(equations), trajectory.t, trajectory.states)
        torques, rates, control, outputs = found
        groups = {
            f"drive/{item['name']}": {"torque_Nm": torques[:, i], "power_W": torques[:, i] * rates[:, i]}
            for i, item in enumerate([*spec["motors"], *spec["brakes"]])
        }
        if "controller" in spec:
            groups["drive/controller"] = {"force_N": control[:, 0], "wanted_m_per_s": control[:, 1]}
        motors = [item["name"] for item in spec["motors"]]
        for (name, item), row in zip(sorted(laws.items()), self.model.controls.rows, strict=True):
            given = outputs[:, row[OUTPUTS] : row[OUTPUTS_END]].T
            names = [f"{output}_{'Nm' if output in motors else 'N'}" for output in item["outputs"]]
            states = trajectory.states[:, row[STATES] : row[STATES_END]].T
            numbered = {f"state_{k}": values for k, values in enumerate(states)}
            groups[f"control/{name}"] = dict(zip(names, given, strict=True)) | numbered
        return groups

    def _workspace(self):
        work = workspace(self.model)
        work.arc_lengths[:] = self.arc_lengths.wheelsets
        return work

    def _from_here(self, equations, model=None):
        """Return equations that search arc lengths near those of the last output; new ones if none are given."""
        if equations is None:
            return Equations(model or self.model, self._workspace())
        equations.work.arc_lengths[:] = self.arc_lengths.wheelsets
        return equations

    def _poses(self, states, bodies):
        """Return arc length, y, z, roll, yaw and pitch of bodies in the track's axes, shape (n, all bodies, 6), and
        these axes, shape (n, all bodies, 3, 3); only the bodies with the given numbers are filled."""
        count = len(self.model.bodies.mass)
        poses, axes = np.empty((len(states), count, 6)), np.broadcast_to(np.eye(3), (len(states), count, 3, 3))
        if not self.model.track.tangent:
            axes = axes.copy()
        for body in bodies:
            at = STATE_SIZE * body
            if self.model.track.tangent:
                roll, pitch, yaw = angles(states[:, at + 3 : at + 7])
                poses[:, body] = np.column_stack([states[:, at : at + 3], roll, yaw, pitch])
            else:
                poses[:, body], axes[:, body] = track_poses(self.model.track, states, at, self.arc_lengths.bodies[body])
        return poses, axes


def evaluated(
    model: Model, trajectory: Trajectory, equations: Equations | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Evaluate the equations of motion again at a run's output times, with ``equations`` of this model if given.

    Return patches (n, wheelsets, 2, MAX_PATCHES, PATCH_COLUMNS), left first, NaN where absent; bounds (n, wheelsets, 2)
    of planar detection's error (``auto`` only), m; rates (n, size), time derivatives of the states.
    """
    shape = (len(trajectory.t), len(model.bodies.wheelsets), 2, reduction.MAX_PATCHES, reduction.PATCH_COLUMNS)
    patches, bounds = np.full(shape, np.nan), np.full(shape[:3], np.nan)
    rates = np.full(trajectory.states.shape, np.nan)
    arguments = (equations or Equations(model)).arguments
    evaluations_at(trajectory.t, trajectory.states, *arguments, rates, patches, bounds)
    return patches, bounds, rates


def _body_channels(state, rate, pose, axes, wanted, pitches=False):
    """Return channels of a body in the axes of the track at its position; a spinning body has no pitch."""
    channels: dict[str, np.ndarray] = {}
    if "pose" in wanted:
        names = ("x_m", "y_m", "z_m", "roll_rad", "yaw_rad", *(("pitch_rad",) if pitches else ()))
        channels |= dict(zip(names, pose.T, strict=False))
    kinds = {"velocity": (("v{}_m_per_s", state[:, 7:10]), ("w{}_rad_per_s", state[:, 10:13]))}
    kinds["acceleration"] = (("a{}_m_per_s2", rate[:, 7:10]),)
    for name, vectors in (pair for kind, pairs in kinds.items() if kind in wanted for pair in pairs):
        along = np.einsum("nij,ni->jn", axes, vectors)
        channels |= {name.format(axis): values for axis, values in zip("xyz", along, strict=True)}
    return channels
