"""Contacts of many poses: each is what one pose by itself gives, in the shape that was asked for, at its price."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from wrcore.analysis.contact import contacts as module
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.analysis.contact.poses import POSE_FLAGS, ROLLING, STILL, loaded_poses
from wrcore.cli import main
from wrcore.contact.search.reduction import FX, FY, NORMAL

RADIUS = 0.46


@pytest.fixture(scope="module")
def pair():
    return wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))


def scattered(count=12):
    """Poses without order, tread and flange."""
    random = np.random.default_rng(3)
    return random.uniform(-7e-3, 7e-3, count), random.uniform(-8e-3, 8e-3, count)


def same(found, poses, pair, load=1.0, **options):
    """Whether contacts are those that ``wrcore contact`` finds pose by pose."""
    rows = loaded_poses(pd.DataFrame(poses), pair.left.geometry, load, **options)
    there = np.isfinite(found.N_N)
    pose, side, patch = np.nonzero(there)
    assert (pose == rows["pose_id"]).all() and (np.array(["left", "right"])[side] == rows["side"]).all()
    assert (patch + 1 == rows["patch"]).all() and len(rows) >= 2 * len(found.roll_rad)
    for name in (*STILL, "p_max_Pa", *(ROLLING if "xi" in found else ())):
        # forces of creep pass through a sum in another order
        np.testing.assert_allclose(found[name][there], rows[name], rtol=1e-9, atol=1e-9, err_msg=name)
    np.testing.assert_array_equal(found.roll_rad[pose], rows["roll_rad"])
    np.testing.assert_array_equal(found.z_wheelset_m[pose, side], rows["z_wheelset_m"])


def table_of(y, yaw, **more):
    return {"pose_id": range(len(y)), "y_m": y, "yaw_rad": yaw, "roll_rad": np.nan, "z_m": np.nan} | more


@pytest.mark.parametrize("options", [{}, {"detection": "planar", "patch": "maximum"}])
def test_loaded_poses_are_those_of_the_command(pair, options):
    y, yaw = scattered()
    same(wr.contacts(pair, y, yaw=yaw, load=5e4, **options), table_of(y, yaw), pair, 5e4, **options)
    roll = 1e-3 * np.sin(np.arange(12))
    found = wr.contacts(pair, y, roll=roll, yaw=yaw, load=5e4, **options)
    same(found, table_of(y, yaw, roll_rad=roll), pair, 5e4, **options)
    assert np.abs(np.diff(found.z_wheelset_m)).max() > 1e-4  # each wheel at its own height


def test_given_heights_and_motions_are_those_of_the_command(pair):
    y, yaw = scattered()
    at_rest = wr.contacts(pair, y, yaw=yaw, load=5e4)
    z, roll = at_rest.z_wheelset_m[:, 0], at_rest.roll_rad
    same(wr.contacts(pair, y, z, roll, yaw), table_of(y, yaw, roll_rad=roll, z_m=z), pair)
    motion = {"V_m_per_s": 20.0, "vy_m_per_s": 0.01 * np.cos(y), "yaw_rate_rad_per_s": 0.02, "mu": 0.25}
    moving = {"speed": 20.0, "vy": 0.01 * np.cos(y), "yaw_rate": 0.02, "mu": 0.25}
    for omega in (20.0 / RADIUS + np.linspace(-0.1, 0.1, 12), None):
        rate = np.nan if omega is None else omega
        poses = table_of(y, yaw, roll_rad=roll, z_m=z, omega_rad_per_s=rate, **motion)
        same(wr.contacts(pair, y, z, roll, yaw, omega=omega, **moving), poses, pair)


def test_shapes_broadcast(pair):
    y = np.linspace(-2e-3, 2e-3, 3)
    found = wr.contacts(pair, y[:, None], yaw=[0.0, 1e-3], load=5e4)
    assert found.N_N.shape == (3, 2, 2, 3) and found.roll_rad.shape == (3, 2) and found.z_wheelset_m.shape == (3, 2, 2)
    one = wr.contacts(pair, y[2], yaw=1e-3, load=5e4)
    assert one.N_N.shape == (2, 3) and one.roll_rad.shape == ()
    for name in found:
        np.testing.assert_array_equal(found[name][2, 1], one[name])
    assert "Fx_N" not in found


def test_sides_that_differ(pair):
    """The right wheel of a wheelset whose left one is smaller stays where it is, at given heights."""
    other = dataclasses.replace(pair, left=dataclasses.replace(pair.left, rolling_radius=RADIUS - 1e-4))
    z = wr.contacts(pair, 1e-3, load=5e4).z_wheelset_m[0]
    one, two = (wr.contacts(each, 1e-3, z, 0.0) for each in (pair, other))
    np.testing.assert_array_equal(one.N_N[1], two.N_N[1])
    assert np.isfinite(one.N_N[0, 0]) and np.isnan(two.N_N[0]).all()
    carried = wr.contacts(other, 1e-3, load=5e4)
    vertical = np.nansum(carried.N_N * np.cos(carried.contact_angle_rad), axis=-1)
    np.testing.assert_allclose(vertical, 5e4, rtol=1e-8)
    assert carried.roll_rad != wr.contacts(pair, 1e-3, load=5e4).roll_rad


def test_a_batch_is_one_call_and_a_second_call_makes_nothing_anew(pair, monkeypatch):
    """A table of a single pose took as long as 150 poses of a batch: its model was packed anew, its frames merged."""
    made, pressed = [], []

    class Counted(module.LoadedWheels):
        def __init__(self, *arguments, **options):
            made.append(arguments)
            super().__init__(*arguments, **options)

    def counted(*arguments, original=module.wheel_wrenches):
        pressed.append(len(arguments[1]))
        return original(*arguments)

    module._wheels.cache_clear()
    monkeypatch.setattr(module, "LoadedWheels", Counted)
    monkeypatch.setattr(module, "wheel_wrenches", counted)
    for _ in range(3):
        wr.contact_table(pair, np.linspace(-2e-3, 2e-3, 50), wheel_load=5e4)
    assert len(made) == 1 and pressed == [50, 50, 50]
    wr.contacts(pair, np.zeros(7), 0.47)
    assert len(made) == 1 and pressed[3:] == [7, 7]  # where they are, and whether any lies too deep
    module._wheels.cache_clear()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"y": 0.0}, "contacts: z load: expected either heights or a load"),
        ({"y": 0.0, "z": 0.46, "load": 5e4}, "contacts: z load: expected either heights or a load, got both"),
        ({"y": 0.0, "load": 5e4, "omega": 40.0}, "contacts: speed: expected a speed beside omega, vy or yaw_rate"),
        ({"y": 0.0, "load": 5e4, "vy": [0.0, 0.1]}, "contacts: speed: expected a speed beside omega, vy or yaw_rate"),
        ({"y": [0.0, 1.0], "load": 5e4}, "contacts: y: expected"),
        ({"y": [0.0, np.nan], "load": 5e4}, "contacts: y: expected"),
        ({"y": [0.0, 0.0], "yaw": [0.0, 0.0, 0.0], "load": 5e4}, "expected arrays of one shape"),
        ({"y": [0.0, 0.0], "z": [0.46, 0.45]}, "contacts: z: expected at most 1 mm of overlap, got z = 0.45 m in pose"),
        ({"y": 0.0, "z": 0.2}, "expected at most 1 mm of overlap"),
        ({"y": 0.0, "load": 5e4, "patch": "exact"}, "contacts: patch: expected one of"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(pair, arguments, message):
    with pytest.raises(wr.InputError, match=message.replace("(", r"\(")):
        wr.contacts(pair, **arguments)


def test_looked_up_contact_at_a_height_that_was_sought_has_creep_forces(pair):
    # seeking it leaves numbers of the solver where runs tell the table that they want no rows
    rows = []
    for patch in ("exact", "tabulated"):
        wheels = LoadedWheels(pair.left.geometry, patch)
        z = wheels.height("left", 1e-3, 5e4, 0.0, 0.0)
        (found,) = wheels.at_height("left", 1e-3, z, 0.0, 0.0, Rolling(20.0, 1.001 * 20.0 / RADIUS), 0.3)
        rows.append(found.row[[NORMAL, FX, FY]])
    assert rows[0][1] > 3e3
    np.testing.assert_allclose(rows[1], rows[0], atol=0.01 * 0.3 * 5e4)


def load_carried(found):
    return np.nansum(found.N_N * np.cos(found.contact_angle_rad), axis=-1)


def test_loads_are_carried_where_overlaps_merge(pair):
    # 11 of 10 000 random poses missed their load by up to 2.2 %: two heights carry it, and roll was sought across both
    y = np.array([0.005381245484329061, -0.005298930604514381, -0.0052552280584740796, 0.005060122308563741])
    yaw = np.array([0.0018594242906076856, -0.003858632548236483, -0.003800161182978952, -0.009115244382291861])
    load = np.array([41307.90427724308, 33762.621089828426, 30223.008409080005, 34650.691300739374])
    found = wr.contacts(pair, y, yaw=yaw, load=load)
    np.testing.assert_allclose(load_carried(found), np.stack([load, load], axis=1), rtol=1e-7)
    assert not found.not_loaded.any() and abs(found.load_residual_N).max() < 1e-7 * load.max()


def test_a_load_that_no_height_carries_is_flagged(pair):
    # the force of the reduction `maximum` jumps over the load at the height that is found
    random = np.random.default_rng(1)
    y, yaw, load = random.uniform(-6e-3, 6e-3, 400), random.uniform(-0.01, 0.01, 400), random.uniform(3e4, 1e5, 400)
    found = wr.contacts(pair, y, yaw=yaw, load=load, patch="maximum")
    residual = load_carried(found) - load[:, None]
    np.testing.assert_allclose(found.load_residual_N, residual, rtol=1e-9, atol=1e-6)
    missed = abs(residual) > 1e-3 * load[:, None]
    assert missed.any() and (found.not_loaded == missed).all()
    fallen = wr.contacts(pair, 0.1, roll=0.0, load=5e4)  # the right wheel is beside its rail
    assert fallen.not_loaded.tolist() == [0.0, 1.0] and fallen.load_residual_N[1] == -5e4
    assert np.isnan(wr.contacts(pair, 0.0, z=0.4599).load_residual_N).all()  # no load was asked


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """A wheel whose profile ends 12 mm outside its tape circle."""
    path = tmp_path_factory.mktemp("short") / "wheel.csv"
    wheel = wr.named_profile("S1002", "wheel")
    u = np.arange(-54.5, 12.0, 0.2)
    pd.DataFrame({"u_mm": u, "f_mm": 1e3 * np.interp(1e-3 * u, wheel.u, wheel.f)}).to_csv(path, index=False)
    return path


def test_patches_on_the_end_of_a_profile_are_flagged(short, tmp_path, capsys):
    rail, poses = wr.named_profile("60E1", "rail", 1 / 20), tmp_path / "poses.csv"
    pair = wr.WheelsetOnTrack.alike(wr.named_profile(str(short), "wheel"), rail)
    found = wr.contacts(pair, [0.0, -0.0055], load=5e4)
    assert found.profile_edge[0, :, 0].tolist() == [1.0, 1.0] and not found.profile_edge[0, :, 1:].any()
    assert found.profile_edge[1, 0, 0] == 1.0 and found.profile_edge[1, 1, 0] == 0.0  # one wheel alone
    table = wr.contact_table(pair, [0.0, -0.0055], wheel_load=5e4)
    table = table[table.patch == 1]
    assert table.profile_edge.tolist() == [1, 1, 1, 0]
    pd.DataFrame({"pose_id": ["a"], "y_m": [0.0], "yaw_rad": [0.0]}).to_csv(poses, index=False)
    sets = ["--rail", "60E1", "--inclination", "1/20", "--wheel-load", "5e4", "--poses", str(poses)]
    assert main(["contact", "--wheel", str(short), *sets, "--out", str(tmp_path / "out.csv")]) == 0
    assert pd.read_csv(tmp_path / "out.csv").profile_edge.tolist() == [1, 1]
    assert "warning: patches beyond the models' limits: profile_edge 2" in capsys.readouterr().err
    assert main(["contact", "--wheel", "S1002", *sets, "--out", str(tmp_path / "out.csv")]) == 0
    whole = pd.read_csv(tmp_path / "out.csv")
    assert not whole[list(POSE_FLAGS)].to_numpy().any() and abs(whole.load_residual_N).max() < 1e-3
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("patch", ["maximum", "moment"])
def test_overlap_that_reaches_the_end_of_a_profile_is_flagged(short, patch):
    wheel, rail = wr.named_profile(str(short), "wheel"), wr.named_profile("60E1", "rail", 1 / 40)
    found = wr.contacts(wr.WheelsetOnTrack.alike(wheel, rail), 0.0, roll=[0.0, 5e-4, -5e-4], load=6e4, patch=patch)
    assert found.profile_edge[0, :, 0].tolist() == [1.0, 1.0]  # its ellipse ends 0.5 mm before the profile, or more
    loads = [1e4, 6e4]
    light = wr.contacts(wr.WheelsetOnTrack.alike(wheel, rail), [0.0, 0.0], load=loads, patch="moment")
    assert light.profile_edge[:, 0, 0].tolist() == [0.0, 1.0]
    whole = wr.contacts(
        wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), rail), [-0.006, 0.0, 0.006], load=6e4
    )
    assert not whole.profile_edge.any()


def test_flags_of_a_pose_are_those_of_a_run(pair):
    turned = wr.contacts(pair, [0.0, 0.0, 0.00625], yaw=[0.0, 0.016, 0.0], load=5e4)
    assert turned.search_fallback.tolist() == [0.0, 1.0, 0.0]
    assert set(POSE_FLAGS) <= set(turned) and turned.conformal[2, 0].any() and not turned.conformal[0].any()
    tight = wr.WheelsetOnTrack.alike(pair.left.wheel, pair.left.rail, gauge=1.42)
    assert wr.contacts(tight, 0.0, load=5e4).both_flanges == 1.0


def test_a_patch_states_its_flags_and_its_residual(pair, short):
    cut = wr.WheelsetOnTrack.alike(wr.named_profile(str(short), "wheel"), wr.named_profile("60E1", "rail", 1 / 20))
    assert wr.patch(cut, load=5e4)[0].flags == ("profile_edge",)
    whole, placed = wr.patch(pair, load=5e4)[0], wr.patch(pair, z=0.45976)[0]
    assert whole.flags == () and abs(whole.load_residual) < 1.0 and np.isnan(placed.load_residual)
