"""Contacts of many poses: each is what one pose by itself gives, in the shape that was asked for, at its price."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from wrcore.analysis.contact import contacts as module
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.analysis.contact.poses import ROLLING, STILL, loaded_poses
from wrcore.contact.reduction import FX, FY, NORMAL

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
