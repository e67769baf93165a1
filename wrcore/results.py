"""Runs in HDF5 files: every dataset says its unit and its meaning, every file how it came about."""

import json
import os
from pathlib import Path

import h5py
import numpy as np

from wrcore import __version__
from wrcore.errors import InputError
from wrcore.simulate import Run

FORMAT = "wrcore run"
FORMAT_VERSION = 1

UNIT_SUFFIXES = {
    "_m_per_s2": "m/s^2",
    "_m_per_s": "m/s",
    "_rad_per_s": "rad/s",
    "_per_m": "1/m",
    "_Nm": "N m",
    "_rad": "rad",
    "_Pa": "Pa",
    "_J": "J",
    "_W": "W",
    "_N": "N",
    "_m": "m",
    "_s": "s",
}
"""Unit by the end of a channel's name, longest ends first; a name without one of these is a pure number."""

DESCRIPTIONS = {
    "t": "time",
    "x_m": "position along the track (body: centre of mass; contact: contact point), forward positive",
    "s_m": "arc length along the track's centre line (tracks that are not tangent)",
    "y_m": "lateral position in the track frame, left positive",
    "z_m": "height above the plane of the rails' highest points",
    "roll_rad": "roll about x, right-handed",
    "pitch_rad": "pitch about y, right-handed",
    "yaw_rad": "yaw about z, right-handed",
    "vx_m_per_s": "velocity along x",
    "vy_m_per_s": "velocity along y",
    "vz_m_per_s": "velocity along z",
    "ax_m_per_s2": "acceleration of the centre of mass along x",
    "ay_m_per_s2": "acceleration of the centre of mass along y",
    "az_m_per_s2": "acceleration of the centre of mass along z",
    "wx_rad_per_s": "angular velocity about x",
    "wy_rad_per_s": "angular velocity about y",
    "wz_rad_per_s": "angular velocity about z",
    "planar_error_left_m": "bound of the penetration that planar detection misses, left wheel",
    "planar_error_right_m": "bound of the penetration that planar detection misses, right wheel",
    "spatial_left": "1 where detection auto chose spatial for the left wheel, else 0",
    "spatial_right": "1 where detection auto chose spatial for the right wheel, else 0",
    "u_wheel_m": "lateral coordinate of the contact point on the wheel profile, field side positive",
    "s_wheel_rad": "angular coordinate of the contact point on the wheel",
    "u_rail_m": "lateral coordinate of the contact point on the rail profile, field side positive",
    "contact_angle_rad": "angle of the contact plane to the track plane in the cross-section",
    "penetration_m": "penetration along the contact normal, positive in contact",
    "a_m": "semi-axis of the contact ellipse along rolling",
    "b_m": "semi-axis of the contact ellipse across rolling",
    "N_N": "normal force on the wheel",
    "Fx_N": "longitudinal creep force on the wheel",
    "Fy_N": "lateral creep force on the wheel, in the contact plane",
    "Mz_Nm": "spin moment on the wheel about the contact normal",
    "xi": "longitudinal creepage, wheel relative to rail",
    "eta": "lateral creepage, wheel relative to rail",
    "phi_per_m": "spin creepage, wheel relative to rail",
    "kinetic_J": "kinetic energy of all bodies",
    "gravitational_J": "gravitational energy of all bodies, from z = 0",
    "springs_J": "energy of all springs, those in series with dampers too, from nominal position",
    "elastic_contact_J": "2/5 of elastic normal force times penetration, all patches",
    "input_by_frame_W": "power of the moving frame through the elements that lead to it",
    "input_by_joints_W": "power of the joints' reactions: what they drive, and what holds them together against drift",
    "dissipated_by_dampers_W": "power lost in dampers and friction elements",
    "dissipated_by_creep_W": "power lost in the contact patches by creep forces and spin moments",
    "dissipated_by_contact_damping_W": "power lost by the damping of the normal forces",
    "stored_by_springs_W": "power that goes into the springs' energy",
    "stored_by_gravity_W": "power that goes into the gravitational energy",
    "stored_by_elastic_contact_W": "power against the elastic normal forces",
}


def unit_of(channel):
    """Unit that a channel's name states.

    Parameters
    ----------
    channel : str
        Name such as ``penetration_m``.

    Returns
    -------
    str
        Unit, ``1`` for a pure number.
    """
    if channel == "t":
        return "s"
    return next((unit for end, unit in UNIT_SUFFIXES.items() if channel.endswith(end)), "1")


def write_run(path, run):
    """Write a run; the file appears under its name only when it is complete.

    The same run gives the same bytes: no date, host or path is stored.

    Parameters
    ----------
    path : path-like
        File to write (HDF5); its folder is created if needed.
    run : Run
        What to write.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with h5py.File(part, "w") as file:
            _write_attributes(file, run)
            _write_channels(file, run)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _write_attributes(file, run):
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["wrcore_version"] = __version__
    file.attrs["status"] = run.status
    file.attrs["reason"] = run.reason
    for name in ("scene", "settings", "counters"):
        file.attrs[name] = json.dumps(getattr(run, name), sort_keys=True, default=_plain)


def _plain(value):
    """What JSON does not know: numpy's numbers and arrays."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be written to a run file")


def _write_channels(file, run):
    time = _write_dataset(file, "t", run.t)
    time.make_scale("t")
    for group in sorted(run.groups):
        for name in sorted(run.groups[group]):
            dataset = _write_dataset(file.require_group(group), name, run.groups[group][name])
            dataset.dims[0].attach_scale(time)


def _write_dataset(group, name, values):
    dataset = group.create_dataset(name, data=np.asarray(values), compression="gzip", shuffle=True)
    dataset.attrs["units"] = unit_of(name)
    dataset.attrs["description"] = DESCRIPTIONS.get(name, name.replace("_", " "))
    return dataset


def load_run(path):
    """Read a run that `write_run` wrote.

    Parameters
    ----------
    path : path-like
        HDF5 file.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If the file is absent, truncated, not HDF5, or HDF5 of another kind or version.
    """
    try:
        with h5py.File(path, "r") as file:
            _check_format(path, file)
            return _read(file)
    except FileNotFoundError:
        raise InputError(path, "", "expected a run file (HDF5), got no such file") from None
    except (OSError, RuntimeError, KeyError, json.JSONDecodeError) as error:
        raise InputError(path, "", f"expected a complete run file (HDF5), got: {error}") from None


def load_runs(paths):
    """Read several runs that lie as ``<case>/<name>.h5``.

    Parameters
    ----------
    paths : iterable of path-like

    Returns
    -------
    dict of str to dict of str to Run
        Runs by folder name and by file name without its ending, in the order of the paths.

    Raises
    ------
    InputError
        As `load_run`.
    """
    cases = {}
    for path in map(Path, paths):
        cases.setdefault(path.parent.name, {})[path.stem] = load_run(path)
    return cases


def _check_format(path, file):
    found = file.attrs.get("format", "none")
    if found != FORMAT:
        raise InputError(path, "attribute format", f"expected {FORMAT!r}, got {found!r}")
    version = int(file.attrs["format_version"])
    if version != FORMAT_VERSION:
        raise InputError(path, "attribute format_version", f"expected {FORMAT_VERSION}, got {version}")


def _read(file):
    groups = {}

    def _collect(name, item):
        if isinstance(item, h5py.Dataset) and "/" in name:
            group, channel = name.rsplit("/", 1)
            groups.setdefault(group, {})[channel] = item[()]

    file.visititems(_collect)
    records = {name: json.loads(file.attrs[name]) for name in ("scene", "settings", "counters")}
    return Run(status=file.attrs["status"], reason=file.attrs["reason"], t=file["t"][()], groups=groups, **records)
