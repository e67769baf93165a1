"""Wheels out of round: against analytic cases, round wheels, and CONTACT."""

import math

import numpy as np
import pandas as pd
import pytest

from tests.analysis.contact.test_on_slices import PROFILES, RADIUS, REFUSED, crown, rail
from tests.analysis.contact.test_poses import command
from tests.contact.patch import contact_reference as contact
from wrcore.analysis.contact.loaded import LoadedWheels
from wrcore.analysis.contact.on_slices import LoadedOnSlices
from wrcore.cli import main
from wrcore.contact.changing_rails.sections import WheelOnSlices
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search import reduction as columns
from wrcore.errors import InputError
from wrcore.geometry.changing_rails.files import read_slices
from wrcore.geometry.changing_rails.slices import RailSlices
from wrcore.geometry.profiles.files import read_profile
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import named_profile

LOAD = 5e4


def wheel(folder, deviation_at, angles, u=None, f=None):
    """Wheel of slices whose radius is larger by a deviation at each angle, through files."""
    u = np.linspace(-0.05, 0.06, 221) if u is None else u
    rows = ["angle_rad,profile"]
    for k, angle in enumerate(angles):
        points = np.column_stack([u, (0.0 * u if f is None else f) - deviation_at(angle)])
        np.savetxt(folder / f"w{k}.csv", points, fmt="%.12g", delimiter=",", header="u_m,f_m", comments="")
        rows.append(f"{angle:.12g},w{k}.csv")
    (folder / "wheel.csv").write_text("\n".join(rows))
    return read_slices(folder / "wheel.csv", "wheel")


def head():
    u = np.linspace(-0.03, 0.03, 121)
    return RailSlices.of(ProfileCurve.from_points(u, crown(u), "rail"))


@pytest.mark.parametrize("turned", [0.0, 0.4, 1.5, 3.0, 7.0])
def test_eccentric_wheel_touches_below_its_own_centre(tmp_path, turned):
    e = 1e-3
    around = np.linspace(-math.pi, math.pi, 121)
    eccentric = wheel(
        tmp_path, lambda a: e * math.cos(a) + math.sqrt(RADIUS**2 - (e * math.sin(a)) ** 2) - RADIUS, around
    )
    pair = WheelOnSlices(eccentric.round(), head(), out_of_round=eccentric)
    geometry, touch = pair.under("right", 0.0, 0.0, turned=turned)
    # the circle's centre has rolled forward about the axle: cos below it, sin behind it
    assert touch == pytest.approx(RADIUS + e * math.cos(turned), abs=2e-8)
    ahead, bend, _, lean, _ = geometry.along[round(-geometry.rail_start / geometry.rail_step)]
    assert lean == 0.0  # the rail under it stays level
    assert ahead == pytest.approx(-e * math.sin(turned), abs=2e-6)
    radius = pair.wheel.f[np.argmin(np.abs(pair.wheel.u))]
    assert 0.5 / (RADIUS - radius) + bend == pytest.approx(0.5 / RADIUS, rel=1e-3)


@pytest.mark.parametrize("closed", [False, True])
def test_a_turn_closes_without_a_step(tmp_path, closed):
    """Whether the first slice is given once or again at the end; half a slice before it angles begin anew."""
    around = np.linspace(0.0, 2.0 * math.pi, 17)[: None if closed else -1]
    made = wheel(tmp_path, lambda a: 3e-4 * math.cos(3.0 * a), around)
    seam = around[0] - 0.5 * (2.0 * math.pi - 15 * math.pi / 8) * (not closed)
    places = seam + np.array([-1e-9, 1e-9])
    before, behind = made.heights(places, np.array([-0.01, 0.01]))[0]
    assert behind == pytest.approx(before, abs=5e-9)


def test_slices_that_are_alike_are_a_round_wheel(tmp_path):
    s1002 = named_profile("S1002", "wheel")
    part = (s1002.u > -0.03) & (s1002.u < 0.05)
    made = wheel(tmp_path, lambda angle: 0.0, [0.0, 1.0, 2.0], s1002.u[part][::10], s1002.f[part][::10])
    rail_head = named_profile("UIC60-MBench", "rail", 1 / 40)
    plain = LoadedWheels(WheelOnRail(made.round(), rail_head).geometry)
    distance = WheelOnRail(made.round(), rail_head).rail_distance
    sliced = LoadedOnSlices(
        WheelOnSlices(made.round(), RailSlices.of(rail_head), rail_distance=distance, out_of_round=made)
    )
    sliced.turned = 0.7
    heights = [one.height("right", 1e-3, LOAD) for one in (plain, sliced)]
    assert heights[1] == pytest.approx(heights[0], abs=1e-8)
    (one,), (other,) = (w.at_height("right", 1e-3, z) for w, z in zip((plain, sliced), heights, strict=True))
    assert other.row[columns.P_MAX] == pytest.approx(one.row[columns.P_MAX], rel=2e-3)


def test_a_wheel_and_a_rail_may_change_at_once(tmp_path):
    """What the wheel has less the rail has more: a bump that fits into the dent."""
    depth = 3e-4
    dented = wheel(tmp_path, lambda a: -depth * math.exp(-((a / 0.05) ** 2)), np.linspace(-0.3, 0.3, 121))
    u = np.linspace(-0.03, 0.03, 121)
    s = np.linspace(-0.14, 0.14, 113)
    reach = depth * np.exp(-((np.arcsin(s / RADIUS) / 0.05) ** 2))
    lower = np.sqrt(RADIUS**2 - s**2) - np.sqrt((RADIUS - reach) ** 2 - s**2)
    bump = rail(tmp_path, lambda at: (u, crown(u) + np.interp(at, s, lower)), s)
    pair = WheelOnSlices(dented.round(), bump, out_of_round=dented)
    _, touch = pair.under("left", 0.0, 0.0)
    assert touch == pytest.approx(RADIUS, abs=2e-7)
    alone = WheelOnSlices(dented.round(), head(), out_of_round=dented)
    assert alone.under("left", 0.0, 0.0)[1] < RADIUS - 0.4 * depth


def bumpy(folder, length, height=4e-5):
    """Wheel with a bump of a length (m) on its head, and a grid's and strips' `LoadedOnSlices` of it."""
    made = wheel(folder, lambda a: height * math.exp(-((a * RADIUS / length) ** 2)), np.linspace(-0.2, 0.2, 801))
    pair = WheelOnSlices(made.round(), head(), out_of_round=made)
    return LoadedOnSlices(pair, "grid", "middle"), LoadedOnSlices(pair)


def test_exact_contact_on_a_bump_shorter_than_its_patch_is_the_grids(tmp_path):
    grid, exact = bumpy(tmp_path, 2.5e-3)
    z = grid.height("right", 0.0, LOAD)
    assert exact.height("right", 0.0, LOAD) == pytest.approx(z, abs=2e-7)
    (one,), (other,) = (wheels.at_height("right", 0.0, z) for wheels in (grid, exact))
    assert other.on_grid
    assert other.row[columns.P_MAX] == pytest.approx(one.row[columns.P_MAX], rel=0.02)
    exact.turned = 0.15  # round again
    (other,) = exact.at_height("right", 0.0, exact.height("right", 0.0, LOAD))
    assert not other.on_grid


def test_strips_stay_on_a_bump_much_longer_than_the_patch(tmp_path):
    grid, exact = bumpy(tmp_path, 0.04)
    z = grid.height("right", 0.0, LOAD)
    (one,), (other,) = (wheels.at_height("right", 0.0, z) for wheels in (grid, exact))
    assert not other.on_grid
    assert other.row[columns.P_MAX] == pytest.approx(one.row[columns.P_MAX], rel=0.03)


def test_command_takes_wheels_out_of_round(tmp_path):
    u, f = named_profile("S1002", "wheel").u[::10], named_profile("S1002", "wheel").f[::10]
    wheel(tmp_path, lambda a: -5e-4 * math.exp(-((a / 0.06) ** 2)), np.linspace(-0.3, 0.3, 61), u, f)
    pair = ["--wheel", str(tmp_path / "wheel.csv"), "--rail", "UIC60-MBench", "--inclination", "1/40"]
    found = command(tmp_path, {"pose_id": ["a", "b"], "y_m": [0.0] * 2, "yaw_rad": [0.0] * 2, "pitch_rad": [0.0, 1.0]},
                    pair=pair)  # fmt: skip
    heights = found.groupby("pose_id").z_wheelset_m.first()
    assert 1e-4 < heights["b"] - heights["a"] < 5e-4


def test_a_wheel_without_its_angle_is_refused(tmp_path, capsys):
    wheel(tmp_path, lambda a: 0.0, [0.0, 1.0])
    u = np.linspace(-0.03, 0.03, 61)
    rail(tmp_path, lambda s: (u, crown(u) + 1e-3 * s), [0.0, 1.0])
    poses = pd.DataFrame({"pose_id": ["a"], "y_m": [0.0], "yaw_rad": [0.0], "s_m": [0.5]})
    poses.to_csv(tmp_path / "poses.csv", index=False)
    files = ["--poses", str(tmp_path / "poses.csv"), "--out", str(tmp_path / "out.csv")]
    pair = ["--wheel", str(tmp_path / "wheel.csv"), "--rail", str(tmp_path / "rail.csv")]
    assert main(["contact", *files, *pair, "--rail-distance", "0.75", "--wheel-load", "5e4"]) == 2
    assert "pitch_rad, row 1: expected the wheel's angle" in capsys.readouterr().err


SLCW = " 0.0 {scale} OFFSET, SCALE\n 2 NSLC\n 0 0 0 NFEAT\n {method} INTPOL\n 0.0 'a.txt'\n {second} 'a.txt'\n"


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        ({"scale": "2.0"}, "line 1", "a scale of 1"),
        ({"method": "3"}, "line 4", "slices as control points"),
        ({"second": "6.4"}, "angle_rad", "within one turn"),
        ({"second": "-1.0"}, "line 6", "that increases"),
    ],
)
def test_faults_name_file_and_line(tmp_path, change, where, what):
    u = np.linspace(-30.0, 30.0, 121)
    np.savetxt(tmp_path / "a.txt", np.column_stack([u, 0.0 * u]))
    (tmp_path / "w.slcw").write_text(SLCW.format(**{"scale": "1.0", "method": "1", "second": "1.0", **change}))
    with pytest.raises(InputError) as error:
        read_slices(tmp_path / "w.slcw", "wheel")
    assert "w.slcw" in str(error.value)
    assert where in str(error.value)
    assert what in str(error.value)


def flat(name, path, wavelength, distance, spec):
    """Wheels with a flat, and CONTACT's cases, of the file at the path (None: absent), without the flags that its
    README distrusts, of those."""
    files = PROFILES.parents[1]
    found = {p.name: p for p in (*files.rglob("*.slcw"), *files.rglob("*.prr"))} if path is not None else {}
    if f"{name}.slcw" not in found:
        pytest.skip("needs wheel_flat_cases.csv (WRCORE_REFERENCE) and CONTACT's repository (WRCORE_CONTACT)")
    made = read_slices({"slices": str(found[f"{name}.slcw"]), "wavelength": wavelength}, "wheel")
    head = read_profile({"points": str(found[spec["rail"]]), "inclined": False}, "rail", spec["inclination"])
    distance = 0.7175 + head.gauge_offset() if distance is None else distance
    table = pd.read_csv(path)
    table = table[(table.set == spec["set"]) & ~table.flag.fillna("").str.contains(REFUSED)]
    return WheelOnSlices(made.round(), RailSlices.of(head), spec["radius"], 0.75, distance, made), table.iloc[::3]


FLATS = {
    "flat_d09": (0.0, 0.75, {"set": "rounded_flat_d09", "radius": 0.45, "rail": "circ_r300.prr", "inclination": 0.0}),
    "S1002_flat": (9.4e-3, None, {"set": "S1002_flat", "radius": 0.49, "rail": "r300_wide.prr", "inclination": 0.02}),
}
"""Wavelength of the smoothing: CONTACT's parameter 5 mm^3 of points 1 mm apart, 2 pi (5 mm^3 1 mm)^(1/4) = 9.4 mm."""

PEAKED = ((80, 80),)
"""Elements on which pressures beside the edges of flats have settled to a percent."""


@pytest.mark.parametrize("name", FLATS)
def test_flats_against_contact(name):
    pair, cases = flat(name, contact.reference_path("wheel_flat_cases"), *FLATS[name])
    wheels, rows = {model: LoadedOnSlices(pair, model, "fine") for model in ("exact", "grid")}, []
    for case in cases.itertuples():
        for model, one in wheels.items():
            one.turned = -case.pitch_rad
            z, grids = one.height("right", 0.0, case.Fz_wheel_N), one.grids
            one.grids = PEAKED
            found = max(one.at_height("right", 0.0, z), key=lambda patch: patch.load)
            one.grids = grids
            rows.append([model, 1e6 * (pair.rolling_radius - z) - 1e3 * case.z_ws_mm,
                         1e3 * found.row[columns.X] - case.x_tr_pc_mm,
                         1e-6 * found.row[columns.P_MAX] / case.pmax_MPa - 1.0])  # fmt: skip
    worst = pd.DataFrame(rows, columns=["model", "height", "x", "p_max"]).groupby("model").agg(
        lambda values: np.quantile(np.abs(values), 0.95)
    )  # fmt: skip
    assert worst.height["exact"] < 0.5
    assert worst.p_max["exact"] < 0.1
    assert worst.height["grid"] < 0.3
    assert worst.x["grid"] < 0.05
    assert worst.p_max["grid"] < 0.04
