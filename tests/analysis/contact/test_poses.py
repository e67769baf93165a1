"""``wrcore contact`` and ``wr.patch``: real patches, at a height or under a load, against CONTACT."""

import math

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from tests.contact.grid.test_grid import some_cases
from tests.contact.patch import contact_reference as contact
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.analysis.contact.poses import STILL, loaded_poses
from wrcore.cli import main
from wrcore.contact.hertz import contact_modulus, hertz_table
from wrcore.contact.rigid.height_at_load import static_wheel_force
from wrcore.contact.rigid.pose_file import read_poses
from wrcore.contact.search import reduction as columns
from wrcore.geometry.track import SIDES

PAIR = ["--wheel", "S1002", "--rail", "UIC60-MBench", "--inclination", "1/40"]


def command(folder, poses, *options, load=54.5e3, pair=PAIR):
    """Table that ``wrcore contact`` writes for poses."""
    pd.DataFrame(poses).to_csv(folder / "poses.csv", index=False)
    files = ["--poses", str(folder / "poses.csv"), "--out", str(folder / "out.csv")]
    assert main(["contact", *files, *pair, "--wheel-load", str(load), *options]) == 0
    return pd.read_csv(folder / "out.csv")


def pose_of(case, height=True):
    """A case of CONTACT as a row of poses."""
    return {
        "pose_id": case.name, "y_m": case.y, "yaw_rad": case.yaw, "roll_rad": case.roll,
        "z_m": case.z if height else math.nan, "V_m_per_s": case.vx, "omega_rad_per_s": case.rolling_rate,
        "vy_m_per_s": case.vy, "mu": contact.FRICTION,
    }  # fmt: skip


def nearest(table, case):
    """The row of a case's patch."""
    rows = table[(table.pose_id.astype(str) == case.name) & (table.side == case.side)]
    return rows.loc[(rows.y_m - case.origin[1]).abs().idxmin()]


def outcome(row, case):
    """`contact.Outcome` of a row, in CONTACT's plane and about its point."""
    x, s = place(row, case)
    extent = row.x_min_m - case.origin[0], row.x_max_m - case.origin[0], math.nan, math.nan
    moment = row.Mz_Nm + x * row.Fy_N - s * row.Fx_N
    cosine, sine = math.cos(row.contact_angle_rad), math.sin(row.contact_angle_rad)
    track = row.Fx_N, row.Fy_N * cosine - row.N_N * sine, row.Fy_N * sine + row.N_N * cosine
    return contact.Outcome(row.N_N, row.p_max_Pa, extent, row.Fx_N, row.Fy_N, moment, track=track)


def place(row, case):
    """x and s of a row's point in CONTACT's plane."""
    x, y, z = row.x_m - case.origin[0], row.y_m - case.origin[1], row.z_m - case.origin[2]
    return x, y * math.cos(case.angle) + z * math.sin(case.angle)


def by_command(folder, cases, *options, height=True, pair=PAIR):
    """Errors of the command's table for cases of one load: `contact.compare`, and of the width (m)."""
    parts = []
    for load in sorted({case.load for case in cases}):
        some = [case for case in cases if case.load == load]
        table = command(folder, [pose_of(case, height) for case in some], *options, load=load, pair=pair)
        errors = contact.compare(lambda case, _, table=table: outcome(nearest(table, case), case), some, None)
        widths = [nearest(table, case).width_m - (case.extent[3] - case.extent[2]) for case in some]
        heights = [nearest(table, case).z_wheelset_m - case.z for case in some]
        parts.append(errors.assign(width=widths, height=heights))
    return pd.concat(parts, ignore_index=True)


def single(name, every=1):
    """CONTACT's cases that are one patch also in reality; between 4.7 and 5.3 mm it joins two in an averaged plane."""
    return [c for c in some_cases(name, every) if c.patches == 1 and not -5.26e-3 < c.sign * -c.y < -4.74e-3]


def with_creepages(wheels):
    """Solver for `contact.compare`: with the motion that gives the patch CONTACT's creepages, by three trials."""

    def solve(case, _):
        def at(motion):
            rolling = Rolling(case.speed, *motion)
            found = wheels.at_height(case.side, case.y, case.z, case.roll, case.yaw, rolling, contact.FRICTION)
            return row_of(min(found, key=lambda one: abs(one.row[columns.Y] - case.origin[1])))

        motion, trials = np.array([case.rolling_rate, case.vy, 0.0]), np.diag([1e-2, 1e-3, 1e-3])
        first = at(motion)
        change = np.stack([creepages_of(at(motion + trial)) - creepages_of(first) for trial in trials], axis=1)
        x, s = place(first, case)
        wanted = np.array([case.xi - case.phi * s, case.eta + case.phi * x, case.phi])
        return outcome(at(motion + trials @ np.linalg.solve(change, wanted - creepages_of(first))), case)

    return solve


def row_of(found):
    """A patch as a row of the command's table."""
    names = columns.CHANNELS | {"p_max_Pa": columns.P_MAX}
    ends = dict(zip(("x_min_m", "x_max_m", "width_m"), found.extent, strict=True))
    return pd.Series({name: found.row[column] for name, column in names.items()} | ends)


def creepages_of(row):
    return row[["xi", "eta", "phi_per_m"]].to_numpy(float)


def test_still_ellipses_are_what_they_were(tmp_path, benchmark_pair):
    poses = pd.DataFrame({
        "pose_id": list("abcd"), "y_m": [0.0, 0.003, -0.0051, 0.006], "yaw_rad": [0.0, 0.005, 0.01, 0.0],
        "roll_rad": [math.nan, 1e-3, math.nan, 0.0], "z_m": [math.nan] * 3 + [0.45990],
    })  # fmt: skip
    poses.to_csv(tmp_path / "poses.csv", index=False)
    for reduction in ("moment", "maximum"):
        found = loaded_poses(read_poses(tmp_path / "poses.csv"), benchmark_pair, 54.5e3, reduction)
        for (pose, side), own in found.groupby(["pose_id", "side"]):
            y, yaw = poses.set_index("pose_id").loc[pose, ["y_m", "yaw_rad"]]
            z, roll = own[["z_wheelset_m", "roll_rad"]].iloc[0]
            rows = np.zeros((columns.MAX_PATCHES, columns.PATCH_COLUMNS))
            count, force = static_wheel_force(
                benchmark_pair, hertz_table(), contact_modulus(8.2e10, 0.28), SIDES[side], y, z, roll, yaw, True,
                columns.REDUCTIONS[reduction], rows,
            )  # fmt: skip
            expected = rows[:count, [columns.CHANNELS[name] for name in STILL]]
            np.testing.assert_allclose(own[list(STILL)].to_numpy(float), expected, rtol=1e-12, atol=1e-15)
            assert pose == "d" or force == pytest.approx(54.5e3, rel=1e-9)
        assert found.Fx_N.isna().all() and np.allclose(found.x_max_m - found.x_min_m, 2.0 * found.a_m)


def test_forces_at_contacts_height(tmp_path):
    # all 102 cases, 95 %: N 0.07 %, p_max 0.8 %. Track forces against CONTACT's curved contact (D = 4), not its D = 3
    # with one plane: 0.19 % of mu Fz in the median, x 0.35 % (95 %), total 0.8 % up to the flange root, in it 2.7 %
    table = by_command(tmp_path, single("loaded_partial_slip", 5), "--patch", "exact")
    found = contact.summary(table)
    assert found.loc["normal", "max"] < 5e-3 and found.loc["p_max", "q95"] < 0.012
    assert found.loc["curved_force", "median"] < 3e-3 and found.loc["curved_x", "q95"] < 5e-3
    assert table.curved_force[table.y.abs() < 5.3e-3].max() < 0.01 and found.loc["curved_force", "max"] < 0.03
    assert found.loc[["x_min", "x_max"], "max"].max() < 2e-4 and found.loc["width", "max"] < 4e-4


def test_a_load_is_carried_by_normal_and_creep_forces(tmp_path):
    # all 102 cases: height 0.12 um, normal force 0.11 %, forces 0.71 % of mu N (95 %)
    cases = single("loaded_partial_slip", 12)
    found = contact.summary(by_command(tmp_path, cases, "--patch", "exact", "--resolution", "middle", height=False))
    assert found.loc["height", "max"] < 1e-6 and found.loc["normal", "q95"] < 5e-3
    assert found.loc["surface_force", "q95"] < 0.012


@pytest.mark.parametrize("name", ["loaded_partial_slip", "one_pose_many_creepages"])
def test_forces_of_contacts_creepages(benchmark_pair, name):
    # 0.33 and 0.40 % of mu N (95 %) on the level fine
    wheels = LoadedWheels(benchmark_pair, "exact", "fine", "creepages")
    found = contact.summary(contact.compare(with_creepages(wheels), single(name, 7), benchmark_pair))
    assert found.loc["force", "q95"] < 5e-3 and found.loc["mn", "q95"] < 0.015


def test_the_grid_agrees_with_the_strips(benchmark_pair):
    found = [LoadedWheels(benchmark_pair, *model).height("left", 0.003, 54.5e3, yaw=0.005)
             for model in (("exact", "fine"), ("grid", "coarse"))]  # fmt: skip
    assert found[0] == pytest.approx(found[1], abs=3e-7)


def test_ellipses_stand_for_a_patch_on_the_tread(tmp_path):
    poses = [{"pose_id": y, "y_m": y, "yaw_rad": 0.0, "roll_rad": 0.0, "V_m_per_s": 20.0, "omega_rad_per_s": 43.3,
              "vy_m_per_s": 0.01} for y in (0.0025, 0.003, 0.0035)]  # fmt: skip
    tables = {model: command(tmp_path, poses, "--patch", model) for model in ("exact", "moment", "maximum")}
    exact = tables["exact"]
    left = exact.side == "left"
    for model, bound in (("moment", 0.06), ("maximum", 0.3)):
        other = tables[model]
        np.testing.assert_allclose(other.N_N, exact.N_N, rtol=2e-3)
        error = np.hypot(other.Fx_N - exact.Fx_N, other.Fy_N - exact.Fy_N) / (0.3 * exact.N_N)
        assert error[left].max() < bound, model
        vertical = other.N_N * np.cos(other.contact_angle_rad) + other.Fy_N * np.sin(other.contact_angle_rad)
        np.testing.assert_allclose(vertical, 54.5e3, rtol=1e-8)


@pytest.mark.parametrize("model", ["exact", "moment"])
def test_mirrored_sides(tmp_path, model):
    pose = {"pose_id": "a", "y_m": 0.0042, "yaw_rad": 0.004, "roll_rad": 1e-3, "V_m_per_s": 20.0, "vy_m_per_s": 0.05}
    pose["yaw_rate_rad_per_s"] = 0.02
    turned = {key: -value if key.split("_")[0] in ("y", "yaw", "roll", "vy") else value for key, value in pose.items()}
    here, there = (command(tmp_path, [one], "--patch", model, "--resolution", "coarse") for one in (pose, turned))
    least = {"Fx_N": 0.01, "Fy_N": 0.01, "Mz_Nm": 1e-4}
    for side, other in (("left", "right"), ("right", "left")):
        a, b = here[here.side == side].iloc[0], there[there.side == other].iloc[0]
        for name in ("N_N", "p_max_Pa", "Fx_N", "x_min_m", "width_m", "z_wheelset_m", "xi"):
            assert a[name] == pytest.approx(b[name], rel=1e-5, abs=least.get(name, 1e-9)), name
        for name in ("Fy_N", "Mz_Nm", "eta", "phi_per_m", "y_m", "contact_angle_rad"):
            assert a[name] == pytest.approx(-b[name], rel=1e-5, abs=least.get(name, 1e-9)), name


@pytest.mark.parametrize("model", ["exact", "moment", "grid"])
def test_free_rolling_has_no_mean_longitudinal_slip(benchmark_pair, model):
    wheels = LoadedWheels(benchmark_pair, model, "coarse")
    for y, side in ((0.0, "left"), (0.0051, "left"), (0.0051, "right")):
        z = LoadedWheels(benchmark_pair).height(side, y, 54.5e3)
        found = wheels.at_height(side, y, z, rolling=Rolling(20.0))
        loads, slips = np.array([(one.load, one.slip) for one in found]).T
        assert abs(loads @ slips) < (1e-12 if model != "grid" else 1e-6) * loads.sum()


@pytest.mark.parametrize("model", ["exact", "moment"])
def test_steady_rolling_does_not_depend_on_the_speed(benchmark_pair, model):
    """Slip over speed is what counts, at 20 m/s and at 10 um/s, ahead of free rolling and to the side."""
    wheels, rows = LoadedWheels(benchmark_pair, model, "coarse"), []
    for speed in (20.0, 1e-5):
        rolling = Rolling(speed, speed / 0.459, 1e-3 * speed, 1e-3 * speed)
        (found,) = wheels.at_height("left", 0.003, 0.4598, rolling=rolling)
        rows.append(found.row[columns.FX : columns.PHI + 1])
    assert rows[0][0] > 0.0 > rows[0][3]  # a wheel that turns too fast slides back (-) and is pushed ahead (+)
    assert rows[0][1] < 0.0 < rows[0][4]  # one that moves to the left is held back
    np.testing.assert_allclose(rows[1], rows[0], rtol=1e-5, atol=1e-9)


def test_only_what_moves_has_creep_forces(tmp_path):
    poses = [{"pose_id": k, "y_m": 0.002, "yaw_rad": 0.0, "V_m_per_s": v, "mu": mu}
             for k, (v, mu) in enumerate(((math.nan, 0.3), (10.0, 0.0), (10.0, 0.4)))]  # fmt: skip
    table = command(tmp_path, poses, "--patch", "exact", "--resolution", "coarse", "--load-by", "normal")
    np.testing.assert_allclose(table.N_N, 54.5e3, rtol=1e-8)
    still, smooth, rough = (table[table.pose_id == k] for k in range(3))
    assert still.Fx_N.isna().all() and (smooth.Fy_N == 0.0).all() and (rough.Fy_N != 0.0).all()


@pytest.mark.parametrize(("columns_", "expected"), [
    ({"V_knots": 60}, "V_knots: unknown column"), ({"V_m_per_s": -3}, "V_m_per_s, row 1: expected 0 to 200"),
    ({"mu": 30}, "mu, row 1: expected 0 to 2"), ({"omega_rad_per_s": 3}, "V_m_per_s, row 1: expected a speed above 0"),
    ({"y_m": None}, "y_m, row 1: expected a number within 0.1, got nothing"),
])  # fmt: skip
def test_bad_motion(tmp_path, capsys, columns_, expected):
    pd.DataFrame([{"pose_id": 1, "y_m": 0.0, "yaw_rad": 0.0} | columns_]).to_csv(tmp_path / "poses.csv")
    files = ["--poses", str(tmp_path / "poses.csv"), "--out", str(tmp_path / "out.csv")]
    assert main(["contact", *files, *PAIR, "--wheel-load", "5e4"]) == 2
    assert expected in capsys.readouterr().err


def test_an_id_stands_for_one_pose(tmp_path):
    (tmp_path / "poses.csv").write_text("pose_id,y_m,yaw_rad\na,0,0\nb,0.001,0\na,0.002,0\n")
    with pytest.raises(wr.InputError, match="pose_id, row 3: expected an id that no row before has, got 'a'"):
        read_poses(tmp_path / "poses.csv")
    (tmp_path / "poses.csv").write_text("pose_id,y_m,yaw_rad\na,0,0\n,0.001,0\n")
    with pytest.raises(wr.InputError, match="pose_id, row 2: expected any text, got nothing"):
        read_poses(tmp_path / "poses.csv")


def test_a_patch_of_a_scene():
    (one,) = wr.patch(ELLIPTIC / "suspended_wheelset.yaml", y=0.003, vy=0.02)
    assert isinstance(one, wr.Patch) and one.side == "left" and one.friction == 0.3
    area = one.cell_area
    # cells lie in one plane; the forces have each strip's own, by the square of the tilts and friction along the normal
    assert (one.pressure * area).sum() == pytest.approx(one.normal, rel=5e-4)
    assert (one.traction_s * area).sum() == pytest.approx(one.fs, abs=5e-4 * one.friction * one.normal)
    assert np.all(np.hypot(one.traction_x, one.traction_s) <= one.friction * one.pressure * (1.0 + 1e-4))
    assert 0.0 < one.slip_area < one.area and np.all(one.slip_s[one.stick] == 0.0)
    assert one.pressure.max() <= one.p_max * 1.001 and one.centroid == pytest.approx((0.0, 0.0), abs=1e-5)
    assert (one.x - one.dx / 2).min() == pytest.approx(one.extent[0], abs=1e-9)
    (grid,) = wr.patch(ELLIPTIC / "suspended_wheelset.yaml", y=0.003, vy=0.02, method="grid", resolution="coarse",
                       roll=one.pose[2], z=one.pose[1])  # fmt: skip
    bound = one.friction * one.normal
    assert grid.normal == pytest.approx(one.normal, rel=2e-3)
    assert math.hypot(grid.fx - one.fx, grid.fs - one.fs) < 0.015 * bound
    assert one.track_force[2] == pytest.approx(wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml")
                                               .vehicle.nominal_wheel_load(0), rel=1e-6)  # fmt: skip


def test_bad_arguments_of_a_patch(benchmark_pair, s1002, uic60):
    pair = wr.WheelsetOnTrack.alike(s1002, uic60)
    bad = [{"speed": 0.0}, {"slip": "none"}, {"roll": "flat"}, {"y": 3.0}, {"method": "fine"}, {"side": "both"}]
    for changes in ({"load": math.nan}, *({"load": 5e4} | one for one in bad)):
        with pytest.raises(wr.InputError):
            wr.patch(pair, **changes)
    assert wr.patch(pair, z=0.47) == []


def test_a_pose_without_friction_has_patches_without_creep_forces(tmp_path):
    poses = {"pose_id": ["a", "b"], "y_m": 0.001, "yaw_rad": 0.0, "V_m_per_s": 10.0, "mu": [0.0, 0.3]}
    table = command(tmp_path, poses).set_index("pose_id")
    assert len(table.loc["a"]) == len(table.loc["b"])
    assert (abs(table.loc["a", "Fx_N"]) < 1e-3).all() and (abs(table.loc["a", "Fy_N"]) < 1e-3).all()
    np.testing.assert_allclose(table.loc["a", "N_N"], table.loc["b", "N_N"], rtol=0.02)
