"""Local wear against Hertz's numbers, exact sums of volume, mirror images and published branches of the law."""

import numpy as np
import pytest

from tests.analysis.assessment.test_assess import synthetic
from tests.conftest import ELLIPTIC
from wrcore.analysis.contact.in_run import WheelInRun
from wrcore.analysis.contact.patch import patch as wr_patch
from wrcore.analysis.wear.local_wear import BIN, friction_work, local_wear
from wrcore.analysis.wear.wear_laws import LAWS, Sliding, sheffield, wear_law
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.creep.fastsim import FastsimData, fastsim
from wrcore.creep.kalker import kalker_data
from wrcore.errors import InputError
from wrcore.geometry.profiles.standards import named_profile
from wrcore.run.output.derived import creep_work
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene
from wrcore.wheels.exact_force import group_wrench
from wrcore.wheels.table_force import tabulated_wrench

G, NU, MU = 8.2e10, 0.28, 0.3
RADIUS = 0.46


def patches(seed=0, count=40):
    """Rows whose forces are FASTSIM's own."""
    rng = np.random.default_rng(seed)
    rows = {"a_m": rng.uniform(3e-3, 9e-3, count), "b_m": rng.uniform(2e-3, 9e-3, count), "N_N": np.full(count, 6e4)}
    rows |= {
        "xi": rng.normal(0, 3e-3, count),
        "eta": rng.normal(0, 3e-3, count),
        "phi_per_m": rng.normal(0, 0.5, count),
    }
    forces = []
    for a, b, load, xi, eta, phi in zip(
        *(rows[k] for k in ("a_m", "b_m", "N_N", "xi", "eta", "phi_per_m")), strict=True
    ):
        c = np.sqrt(a * b)
        scale = G * a * b / (MU * load)
        found = fastsim(FastsimData(100, 101, 0), kalker_data(NU), a / b, 0.0, xi * scale, eta * scale, phi * scale * c)
        forces.append(MU * load * np.array(found) * [1.0, 1.0, c])
    return rows | dict(zip(("Fx_N", "Fy_N", "Mz_Nm"), np.array(forces).T, strict=True))


def test_work_is_that_of_the_forces_and_where_nothing_slides_none():
    rows = patches()
    y, dy, dx, work = friction_work(rows, MU, G, NU)
    total = np.sum(np.sum(work, axis=-1) * dx * dy, axis=1)
    known = creep_work(*(rows[k][:, None] for k in ("Fx_N", "Fy_N", "Mz_Nm", "xi", "eta", "phi_per_m")))[2]
    np.testing.assert_allclose(total, known, rtol=1e-12)
    assert work.min() >= 0.0 and y.shape == dx.shape and dy.shape == (40, 1)
    leading = work[..., 0].sum() / work.sum()
    assert leading < 0.5  # adhesion is at the leading edge


def test_distribution_converges():
    """Where friction works across the patch, with the usual steps and with fine ones."""
    rows = patches(1)
    found = [friction_work(rows, MU, G, NU, *steps) for steps in ((51, 200), (25, 20))]
    centre = []
    for y, _, dx, work in found:
        across = np.sum(work, axis=-1) * dx
        centre.append(np.sum(across * y, axis=1) / across.sum(axis=1) / rows["b_m"])
    assert np.abs(centre[0]).max() > 0.2 and np.abs(centre[0] - centre[1]).max() < 0.03


@pytest.mark.parametrize(("side", "outwards"), [("left", 1.0), ("right", -1.0)])
def test_wear_lies_where_creepage_and_spin_add_up(side, outwards):
    """Rigid slip along the rail is xi - phi y, y to the left: with xi > 0 > phi it is largest on the patch's left."""
    run = worn_run(left=0.0, right=0.0)
    channels = run.groups[f"wheelset/{side}"]
    channels["xi"][:, 0], channels["phi_per_m"][:, 0], channels["Fx_N"][:, 0] = 4e-3, -0.8, -1.2e4
    channels["u_wheel_m"][:, 0] = channels["contact_angle_rad"][:, 0] = 0.0
    wear = local_wear(run)["wheelset", side]
    for edges, depth in ((wear.wheel_edges, wear.wheel_depth), (wear.rail_edges, wear.rail_depth)):
        centre = np.sum(0.5 * (edges[1:] + edges[:-1]) * depth) / depth.sum()
        assert outwards * centre > 3e-4  # u counts to the field side, which is left on the left wheel only


def test_full_sliding_wears_as_the_pressure_is_spread():
    rows = {"a_m": [5e-3], "b_m": [4e-3], "N_N": [5e4], "xi": [0.05], "eta": [0.0], "phi_per_m": [0.0]}
    rows = {name: np.array(values) for name, values in rows.items()}
    rows |= {"Fx_N": np.array([-MU * 5e4]), "Fy_N": np.zeros(1), "Mz_Nm": np.zeros(1)}
    y, dy, dx, work = friction_work(rows, MU, G, NU, 51, 200)
    expected = (1 - (y / 4e-3) ** 2) ** 1.5  # a parabolic bound, summed along x
    found = np.sum(work, axis=-1) * dx
    np.testing.assert_allclose(found / found.max(), expected / expected.max(), atol=0.01)


def test_branches_of_the_law():
    ug = 1e-3  # kg/m/m^2 per ug/m/mm^2
    np.testing.assert_allclose(sheffield(np.array([5e6, 10.4e6, 50e6, 77.2e6, 87.2e6])),
                               ug * np.array([26.5, 55.12, 55.12, 55.12, 55.12 + 619.0]))  # fmt: skip
    assert LAWS["energy"](50e6) == pytest.approx(ug * 265.0)


def full_sliding(xi=0.05, speed=10.0, load=5e4):
    """One patch of 5 x 4 mm that slides everywhere."""
    rows = {"a_m": 5e-3, "b_m": 4e-3, "N_N": load, "xi": xi, "eta": 0.0, "phi_per_m": 0.0, "Fx_N": -MU * load}
    rows = {name: np.array([value]) for name, value in rows.items()} | {"Fy_N": np.zeros(1), "Mz_Nm": np.zeros(1)}
    return Sliding(rows, *friction_work(rows, MU, G, NU, 51, 200), MU, np.array([speed]))


def volume(sliding, law):
    return float(np.sum(np.sum(wear_law(law)(sliding), axis=-1) * sliding.dx * sliding.dy))


def test_archard_takes_off_k_times_load_times_slip_over_hardness():
    """Full sliding: k N xi/H, k that of the sliding speed; the pressure decides where it passes its bound."""

    def law(*rows, **bounds):
        return {"archard": {"hardness": 2e9, "coefficients": [list(row) for row in rows]} | bounds}

    sliding = full_sliding()
    whole = 1e-3 * 5e4 * 0.05 / 2e9
    assert volume(sliding, law([1e-3])) == pytest.approx(whole, rel=1e-9)
    assert volume(sliding, law([1e-3, 7e-3], speeds=[2.0])) == pytest.approx(whole, rel=1e-9)
    # FASTSIM's slip is xi but for the elastic part, which is 15 % of it at most: at 10 m/s 0.43 to 0.57 m/s
    assert volume(sliding, law([9e-3, 1e-3, 7e-3], speeds=[0.4, 0.6])) == pytest.approx(whole, rel=0.03)
    peak = 1.5 * 5e4 / (np.pi * 5e-3 * 4e-3)
    assert volume(sliding, law([1e-3], [0.9], pressures=[1.01 * peak])) == pytest.approx(whole, rel=1e-9)
    # a parabola holds 1 - (1 - r^2)^2 of itself inside the radius r; Hertz's pressure is half its peak at r^2 = 3/4
    found = volume(sliding, law([0.0], [1e-3], pressures=[0.5 * peak]))
    assert found == pytest.approx(whole * (1 - (1 - 0.75) ** 2), rel=0.01)


def test_volume_over_t_gamma_is_the_table_s():
    sliding = full_sliding()  # T gamma: 0.3 * 5e4 * 0.05 = 750 N
    law = {"t_gamma": [[0.0, 0.0], [700.0, 7e-12], [800.0, 9e-12]]}
    assert volume(sliding, law) == pytest.approx(8e-12, rel=1e-9)
    taken = wear_law(law)(sliding)
    np.testing.assert_allclose(taken / taken.max(), sliding.work / sliding.work.max(), rtol=1e-12)
    assert volume(full_sliding(), {"t_gamma": [[0.0, 1e-12], [10.0, 1e-12]]}) == pytest.approx(1e-12, rel=1e-9)


def worn_run(left=3e-3, right=-2e-3):
    run = synthetic(lambda t, sign: (np.full_like(t, 6e4), np.zeros_like(t)), duration=0.05)
    run.scene["contact"] = {"friction": MU, "material": {"shear_modulus": G, "poisson_ratio": NU}}
    run.groups["wheelset"]["z_m"] = np.full_like(run.t, RADIUS)
    for side, xi, turn in (("left", 4e-3, 1.0), ("right", -4e-3, -1.0)):
        channels = run.groups[f"wheelset/{side}"]
        channels["xi"][:, 0], channels["Fx_N"][:, 0] = xi, -np.sign(xi) * 1.2e4
        channels["u_wheel_m"][:, 0] = left + 1e-3 * np.sin(100 * run.t)
        channels["u_rail_m"][:, 0] = right
        channels["contact_angle_rad"][:, 0] = 0.5 * turn
        channels["b_m"][:, 0] = 3e-3
    return run


MAP = {
    "archard": {"hardness": 2.5e9, "speeds": [0.05], "pressures": [1e9], "coefficients": [[1e-4, 3e-3], [2e-4, 5e-3]]}
}
TABLE = {"t_gamma": [[0.0, 0.0], [40.0, 1e-12], [80.0, 5e-12]]}
"""Made up."""


@pytest.mark.parametrize("law", [*LAWS, MAP, TABLE])
def test_volume_is_the_sum_of_the_depths(law):
    for wear in local_wear(worn_run(), law=law).values():
        assert wear.volume > 0.0
        assert wear.wheel_depth.sum() * BIN * 2 * np.pi * RADIUS == pytest.approx(wear.volume, rel=1e-9)
        assert wear.rail_depth.sum() * BIN == pytest.approx(wear.volume, rel=1e-9)
        assert wear.work == pytest.approx(1.2e4 * 4e-3, rel=1e-9)
        width = np.ptp(wear.rail_edges[np.flatnonzero(wear.rail_depth > 1e-18)])
        assert width == pytest.approx(2 * 3e-3 * np.cos(0.5), abs=3 * BIN)  # the patch, seen from above


def test_a_metre_counts_as_one_whether_it_is_run_fast_or_slowly():
    """Half of the time at 30 m/s with a patch at one place, half at 10 m/s with three times the creepage elsewhere."""
    run = worn_run()
    body, late = run.groups["wheelset"], run.t > 0.5 * run.t[-1]
    body["vx_m_per_s"] = np.where(late, 10.0, 30.0)
    slow = np.count_nonzero(late) * 10.0
    way = slow + np.count_nonzero(~late) * 30.0
    for side in ("left", "right"):
        channels = run.groups[f"wheelset/{side}"]
        channels["xi"][late, 0] *= 3.0
        channels["u_wheel_m"][:, 0] = channels["u_rail_m"][:, 0] = np.where(late, 0.02, -0.02)
    work = 1.2e4 * 4e-3 * (3.0 * slow + (way - slow)) / way
    share = 3.0 * slow / (3.0 * slow + (way - slow))
    for wear in local_wear(run, law="energy").values():
        assert wear.work == pytest.approx(work, rel=1e-9)
        assert wear.volume == pytest.approx(5.3e-9 * work / 7850.0, rel=1e-9)
        for edges, depth in ((wear.wheel_edges, wear.wheel_depth), (wear.rail_edges, wear.rail_depth)):
            assert depth[edges[1:] > 0.0].sum() / depth.sum() == pytest.approx(share, rel=1e-9)


@pytest.mark.parametrize("law", ["sheffield", MAP, TABLE])
def test_mirrored_wheels_wear_alike(law):
    found = local_wear(worn_run(), law=law)
    left, right = found["wheelset", "left"], found["wheelset", "right"]
    np.testing.assert_allclose(left.wheel_edges, right.wheel_edges, atol=1e-12)
    np.testing.assert_allclose(left.wheel_depth, right.wheel_depth, rtol=1e-6, atol=1e-9 * left.wheel_depth.max())


def test_what_cannot_be_worn_is_refused():
    with pytest.raises(InputError, match="expected one of sheffield, energy"):
        local_wear(worn_run(), law="archard")
    archard = MAP["archard"]
    for law, says in (
        ({"archard": archard, "energy": {}}, "law.energy: unknown key"),
        ({"archard": archard | TABLE}, "law.archard.t_gamma: unknown key"),
        ({}, "law: expected a mapping with either"),
        ({"archard": {"coefficients": [[1e-4]]}}, "law.archard.hardness: expected a hardness"),
        ({"archard": archard | {"hardness": 2.5}}, "law.archard.hardness: expected a hardness in Pa"),
        ({"archard": archard | {"speeds": [0.7, 0.2]}}, "law.archard.speeds: expected rising"),
        ({"archard": archard | {"speeds": []}}, "expected 2 rows of 1 numbers"),
        ({"t_gamma": [[50.0, 1e-12], [10.0, 0.0]]}, "law.t_gamma: expected rising"),
    ):
        with pytest.raises(InputError, match=says):
            local_wear(worn_run(), law=law)
    run = worn_run()
    run.scene["contact"]["friction"] = {"left": 0.1, "right": 0.4}
    with pytest.raises(InputError, match="one number with the law archard"):
        local_wear(run, law=MAP)
    run.groups["wheelset/left"] = {"Q_N": np.full_like(run.t, 6e4)}
    with pytest.raises(InputError, match="output.channels: expected contact"):
        local_wear(run)
    for begin, says in ((1.0, "0 to 0"), (np.nan, "a number, finite")):
        with pytest.raises(InputError, match=f"begin: expected {says}"):
            local_wear(worn_run(), begin=begin)
    for width in (-1.0, 0.0, np.nan):
        with pytest.raises(InputError, match="width: expected a number, at least 1e-06 and at most 0.1 m"):
            local_wear(worn_run(), width=width)


def run_with(patch, **changes):
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", {
        "contact.patch": patch, "integration.duration": 0.1, "output.rate": 100.0,
        "output.channels": ["pose", "velocity", "contact", "wheel_motion"], "initial.y": 0.004, "speed": 40.0,
    } | changes)  # fmt: skip
    return scene, simulate(scene)


def exact_run(**changes):
    return run_with("exact", **{"contact.resolution": "coarse"} | changes)


def test_exact_patches_lose_what_the_forces_of_an_exact_run_work():
    """Volumes and work of both ways agree, and so does where they are lost, but for what an ellipse does not know."""
    scene, run = exact_run()
    over_ellipses, found = local_wear(run, 0.02), local_wear(run, 0.02, patches="exact", scene=scene)
    for wheel, ellipse in over_ellipses.items():
        exact = found[wheel]
        assert exact.work == pytest.approx(ellipse.work, rel=1e-9)  # both are the run's own
        assert exact.volume == pytest.approx(ellipse.volume, rel=0.02)
        radius = run["wheelset"].z_m.mean()
        assert np.sum(exact.wheel_depth) * BIN * 2.0 * np.pi * radius == pytest.approx(exact.volume, rel=1e-3)
        assert np.sum(exact.rail_depth) * BIN == pytest.approx(exact.volume, rel=1e-12)
        middles = []
        for wear in (ellipse, exact):
            u = 0.5 * (wear.wheel_edges[1:] + wear.wheel_edges[:-1])
            middles.append(u @ wear.wheel_depth / wear.wheel_depth.sum())
        assert middles[1] == pytest.approx(middles[0], abs=1.5e-3)


def test_exact_patches_on_the_motion_of_ellipses():
    """Of the depth that an exact run leaves by exact patches they miss three fifths of what ellipses miss."""
    scene, exact = exact_run()
    other, ellipses = run_with("moment")
    ways = (
        local_wear(exact, 0.02, patches="exact", scene=scene),
        local_wear(ellipses, 0.02, patches="exact", scene=other),
    )
    u, depths = 0.25e-3 * np.arange(-240, 160), []
    for wears in (*ways, local_wear(ellipses, 0.02)):
        worn = sum(
            np.interp(u, 0.5 * (w.wheel_edges[1:] + w.wheel_edges[:-1]), w.wheel_depth, 0, 0) for w in wears.values()
        )
        depths.append(np.convolve(worn, np.ones(12) / 12, "same"))  # over 3 mm, as plans do
    true, mixed, plain = depths
    missed, plainly = (abs(one - true).max() / true.max() for one in (mixed, plain))
    assert missed < 0.6 * plainly and missed < 0.25


def test_exact_patches_work_where_a_uniform_grid_says():
    """A centred wheel on 60E1: half of the work is done in the eighth of its wide patch that is next to the flange."""
    pair = WheelsetOnTrack.alike(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40))
    shares = []
    for method, resolution in (("exact", "coarse"), ("exact", "middle"), ("grid", "middle")):
        (patch,) = wr_patch(pair, load=5.5e4, method=method, resolution=resolution)
        low, high, work = patch.s - 0.5 * patch.ds, patch.s + 0.5 * patch.ds, patch.friction_work * patch.cell_area
        ends = np.linspace(*patch.extent[2:], 9)
        parts = (
            np.clip(np.minimum(high, ends[1:, None]) - np.maximum(low, ends[:-1, None]), 0.0, None) / patch.ds @ work
        )
        shares.append(np.cumsum(parts) / parts.sum())
    assert 0.4 < shares[-1][0] < 0.55
    np.testing.assert_allclose(shares[0], shares[-1], atol=0.08)
    np.testing.assert_allclose(shares[1], shares[-1], atol=0.06)


def test_mirrored_scenes_wear_mirrored_wheels_on_exact_patches():
    moved = {y: {"initial.y": y, "initial.yaw": y, "integration.duration": 0.03} for y in (0.0066, -0.0066)}
    (one, run), (other, mirrored) = (exact_run(**changes) for changes in moved.values())
    left = local_wear(run, patches="exact", scene=one)["wheelset", "left"]
    right = local_wear(mirrored, patches="exact", scene=other)["wheelset", "right"]
    assert right.volume == pytest.approx(left.volume, rel=1e-3)
    lost = [np.cumsum(wear.wheel_depth) / np.sum(wear.wheel_depth) for wear in (left, right)]
    np.testing.assert_allclose(left.wheel_edges, right.wheel_edges, atol=1e-12)
    np.testing.assert_allclose(lost[0], lost[1], atol=2e-3)  # two runs, whose steps are not mirrored to the bit


def test_a_patch_on_a_grid_wears_where_its_strips_do(monkeypatch):
    scene, run = exact_run(**{"integration.duration": 0.02})
    strips = local_wear(run, patches="exact", scene=scene)["wheelset", "right"]
    at = WheelInRun.at

    def on_grids(wheel, i):
        wheel._wheels.always = True
        return at(wheel, i)

    monkeypatch.setattr(WheelInRun, "at", on_grids)
    grids = local_wear(run, patches="exact", scene=scene)["wheelset", "right"]
    assert grids.work == pytest.approx(strips.work, rel=1e-9)  # the run's own
    middles = []
    for wear in (strips, grids):
        for edges, depth in ((wear.wheel_edges, wear.wheel_depth), (wear.rail_edges, wear.rail_depth)):
            middles.append(0.5 * (edges[1:] + edges[:-1]) @ depth / depth.sum())
    assert middles[:2] == pytest.approx(middles[2:], abs=5e-4)


def test_ellipses_stand_in_where_exact_patches_do_not_carry_the_wheel(monkeypatch, capsys):
    """At three of eleven times here, which is said; what is lost there is what ellipses lose."""
    scene, run = exact_run()
    at, name = WheelInRun.at, ("wheelset", "right")

    def astray(wheel, i):
        found = at(wheel, i)
        wheel.missed = 0.2 if i in spoilt else wheel.missed
        return found

    monkeypatch.setattr(WheelInRun, "at", astray)
    wears = []
    for spoilt in ((), (3, 4, 7), range(11)):  # noqa: B007 (astray looks at it)
        wears.append(local_wear(run, patches="exact", scene=scene)[name])
    assert "wheelset/right: ellipses stand in at 3 of 11 output times" in capsys.readouterr().err
    exact, mixed, ellipses = wears
    assert mixed.work == pytest.approx(exact.work, rel=1e-9)
    np.testing.assert_array_equal(ellipses.wheel_depth, local_wear(run)[name].wheel_depth)
    places = [0.5 * (w.wheel_edges[1:] + w.wheel_edges[:-1]) @ w.wheel_depth / w.wheel_depth.sum() for w in wears]
    assert min(places[::2]) < places[1] < max(places[::2])


def test_exact_patches_want_a_motion_that_is_theirs_and_laws_over_work():
    scene, run = run_with("maximum", **{"integration.duration": 0.02})
    with pytest.raises(
        InputError, match=r"contact.patch: expected exact, surrogate, tabulated or moment where .*got maximum"
    ):
        local_wear(run, patches="exact", scene=scene)
    with pytest.raises(InputError, match="local_wear: scene: expected that of the run, but contact of it differ"):
        local_wear(run, patches="exact", scene=load_scene(scene, {"contact.patch": "exact"}))
    exact, run = exact_run(**{"integration.duration": 0.02})
    for law in ({"t_gamma": [[0, 0], [100, 1e-12]]}, "braghin"):
        with pytest.raises(InputError, match=r"local_wear: law: expected"):
            local_wear(run, law=law, patches="exact", scene=exact)


@pytest.mark.parametrize("kernel", [group_wrench, tabulated_wrench], ids=lambda kernel: kernel.py_func.__name__)
def test_patches_are_solved_without_the_lock_of_python(kernel):
    """Each scene of a wear plan has a thread: with it they would take turns."""
    assert kernel.targetoptions["nogil"]
