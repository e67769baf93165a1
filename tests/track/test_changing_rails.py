"""Runs over rails that change along the track."""

import math
import re
import time

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, ROOT, SCENES
from tests.track.crossing_rails import write_rail
from wrcore.analysis.pictures.plot_crossing import plot_crossing
from wrcore.bodies.body import STATE_SIZE, VELOCITY
from wrcore.contact.changing_rails.section_table import ROWS, section_table
from wrcore.contact.changing_rails.sections import WheelOnSlices
from wrcore.contact.search.reduction import ANGLE, FX, FY, SEMI_A, SEMI_B, U_WHEEL
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import parse_value
from wrcore.geometry.changing_rails.crossing import Crossing
from wrcore.geometry.changing_rails.joint import Joint
from wrcore.geometry.changing_rails.made_rails import whole_head
from wrcore.geometry.changing_rails.switch import Switch
from wrcore.geometry.profiles.standards import named_profile
from wrcore.geometry.track import SIDES
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.track.changing_rails import BEGIN, interpolate, layout_of_rail, with_copied_arrays
from wrcore.wheels.contact_model import SOLVED

CROSSING = SCENES / "crossing.yaml"
ROUND = {"wheel.profile": "cone:1/20", "rail": {"profile": "circle:0.3", "inclination": 0}, "initial.y": 0.0}
MASS, PITCH_INERTIA, GRAVITY, SPEED = 1813.0, 112.0, 9.81, 5.0


def loads(run, side):
    """Normal force of a wheel, N."""
    return np.nansum(run[f"wheelset/{side}"]["N_N"], axis=1)


def hump(s):
    """Up 1:10 for a metre, with a metre of transition before and behind, and down again."""
    s = min(max(s, 0.0), 7.0)
    s = s if s < 3.5 else 7.0 - s
    if s < 1.0:
        return 0.1 * (s**3 - 0.5 * s**4)
    return 0.1 * (s - 0.5) if s < 2.0 else 0.2 - 0.1 * ((3.0 - min(s, 3.0)) ** 3 - 0.5 * (3.0 - min(s, 3.0)) ** 4)


@pytest.fixture(scope="module")
def over_a_hump(tmp_path_factory):
    """Run of a wheelset that rolls, free, over a hump of both rails."""
    arc_lengths = np.append(np.arange(-0.1, 3.0, 0.05), np.arange(3.0, 7.1001, 0.05))
    path = write_rail(tmp_path_factory.mktemp("hump"), arc_lengths, hump)
    changes = {
        "track.crossing": {"slices": str(path), "at": 1.0, "rail": "both"}, "speed": SPEED,
        "contact.normal.damping.c_e": 1.0, "integration": {"duration": 0.7, "method": "tsit5", "rtol": 1e-6},
        "output": {"rate": 500, "channels": ["pose", "velocity", "acceleration", "contact"]},
    }  # fmt: skip
    return simulate(load_scene(SCENES / "wheelset.yaml", ROUND | changes))


def test_what_a_wheelset_gains_in_height_it_loses_in_speed(over_a_hump):
    motion = over_a_hump["wheelset"]
    lifted = MASS * GRAVITY * (motion["z_m"] - motion["z_m"][0])
    moving = 0.5 * MASS * (motion["vx_m_per_s"] ** 2 + motion["vz_m_per_s"] ** 2)
    turning = 0.5 * PITCH_INERTIA * motion["wy_rad_per_s"] ** 2
    total = moving + turning + lifted
    assert lifted[-1] > 3000.0
    assert np.abs(total - total[0]).max() < 3e-4 * lifted[-1]


def test_a_normal_force_on_a_ramp_has_no_moment_about_the_axle(over_a_hump):
    # as a body rolls up an inclined plane: only friction turns the wheels, N is that of the plane
    motion, patch = over_a_hump["wheelset"], over_a_hump["wheelset/right"]
    s = motion["x_m"] - 1.0
    on = (s > 1.2) & (s < 1.8)
    radius = SPEED / motion["wy_rad_per_s"][0]
    slope, inertia = math.atan(0.1), PITCH_INERTIA / (MASS * radius**2)
    down = GRAVITY * math.sin(slope) / (1.0 + inertia)
    along = motion["ax_m_per_s2"] * math.cos(slope) + motion["az_m_per_s2"] * math.sin(slope)
    assert np.mean(along[on]) == pytest.approx(-down, rel=5e-3)
    assert np.mean(patch["N_N"][on, 0]) == pytest.approx(0.5 * MASS * GRAVITY * math.cos(slope), rel=5e-3)
    assert np.mean(patch["Fx_N"][on, 0]) == pytest.approx(0.5 * MASS * inertia * down, rel=5e-3)
    assert np.mean(patch["x_m"][on, 0]) == pytest.approx(radius * math.sin(slope), rel=1e-3)


@pytest.fixture(scope="module", params=[Crossing(), Switch()], ids=["crossing", "switch"])
def pair(request):
    plain = named_profile("60E1", "rail", 0.0)
    slices = request.param.rail("made").along(plain)
    return WheelOnSlices(named_profile("S1002", "wheel"), slices, rail_distance=0.7175 + plain.gauge_offset())


@pytest.fixture(scope="module")
def table(pair):
    return section_table(pair, named_profile("60E1", "rail", 0.0))


@pytest.mark.parametrize(
    ("y", "yaw", "bound"), [(0.0, 0.0, 0.1e-6), (0.003, 0.0, 0.3e-6), (-0.003, 0.0, 0.3e-6), (0.0, 0.003, 0.2e-6)]
)
def test_the_table_holds_what_a_wheel_sees(pair, table, y, yaw, bound):
    # along the normal, where the wheel is within 1 mm when it touches; 95 % of places
    geometry = with_copied_arrays(table.geometry)
    u = geometry.rail_start + geometry.rail_step * np.arange(len(geometry.rail))
    low, high = pair.rail.s[[0, -1]]
    worst = []
    for s in np.random.default_rng(1).uniform(low + 0.05, high, 40):
        exact, touch = pair.under("right", s, y, 0.0, yaw)
        place = (s + pair.half_distance * math.sin(yaw) - table.begin) / table.step
        scratch = np.zeros((ROWS + 4, len(u)))
        laid = np.array(layout_of_rail(table, table.begin, pair.half_distance))
        turn, whole = math.sin(yaw) / table.step, (0, geometry.scan_rail.shape[1])
        interpolate(table.sections, table.strips, laid, place, turn, 1.0, scratch, geometry, False, *whole)
        at = exact.rail_start + exact.rail_step * np.arange(len(exact.rail))
        f, slope = (np.interp(u, at, exact.rail[:, column]) for column in (0, 1))
        wheel = u + pair.rail_distance - pair.half_distance + y
        height = touch - pair.rolling_radius + pair.wheel(wheel)
        near = (height - f < 1e-3) & (wheel < pair.wheel.u[-1] - 2e-3)
        worst.append(np.abs((geometry.rail[:, 0] - f) / np.sqrt(1.0 + slope**2))[near].max(initial=0.0))
    assert np.quantile(worst, 0.95) < bound


@pytest.mark.parametrize("changes", [
    {}, {"contact.detection": "auto"}, {"track.crossing.slices": "switch:760"},
])  # fmt: skip
def test_what_was_seen_before_does_not_matter(changes):
    # of a section only what may touch the wheel is laid: whatever lies beside it is never looked at
    model, start = compile_scene(load_scene(CROSSING, changes))
    states = poses_over_it(start, 4000)
    forth, back = (Equations(model).at(0.0, states[::turn])[::turn] for turn in (1, -1))
    np.testing.assert_array_equal(forth, back)
    mixed = np.random.default_rng(8).permutation(len(states))
    np.testing.assert_array_equal(Equations(model).at(0.0, states[mixed]), forth[mixed])
    assert len(np.unique(forth[:, VELOCITY + 1])) == len(states)


@pytest.mark.parametrize("slices", ["crossing:1/12", "switch:500", "switch:760", "joint:0.01"])
def test_no_contact_is_found_twice(slices):
    # the reserve of a head's steep side lets the search begin far off, but not look for lowest gaps across the head
    model, start = compile_scene(load_scene(CROSSING, {"track.crossing.slices": slices}))
    equations = Equations(model)
    for state in poses_over_it(start, 6000):
        equations(0.0, state)
        patches = equations.work.patches[0, 1, : equations.work.counts[0, 1]]
        assert (np.abs(np.diff(np.sort(patches[:, U_WHEEL]))) > 1e-6).all(), state[:7]


def poses_over_it(start, size):
    """States of a wheelset all over a crossing that begins at 6 m, (size, states)."""
    random, states = np.random.default_rng(7), np.repeat(start[None, :], size, axis=0)
    states[:, 0] = random.uniform(5.5, 8.0, size)
    states[:, 1] += random.uniform(-0.008, 0.008, size)
    states[:, 2] -= random.uniform(-0.001, 0.002, size)
    states[:, 6] += random.uniform(-0.004, 0.004, size)  # half of a yaw
    return states


def test_wheels_by_the_surrogate_that_roll_back_see_their_rail_mirrored(tmp_path):
    """A wheelset that rolls back at s over a rail that is its own mirror image does what one does ahead at -s."""
    at, near = 6.0, np.linspace(-0.6, 0.6, 49)
    rail = write_rail(tmp_path, near, lambda s: -3e-3 * math.cos(math.pi * s / 1.2) ** 4)
    changes = {"contact.patch": "surrogate", "track.crossing": {"slices": str(rail), "at": at, "rail": "both"}}
    model, start = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", ROUND | changes))
    random, size, wrenches = np.random.default_rng(3), 60, []
    states = np.repeat(start[None, :], size, axis=0)
    states[:, 0] = at + random.uniform(-0.5, 0.5, size)
    states[:, 1] += random.uniform(-0.004, 0.004, size)
    states[:, 2] -= 1e-4 + 3e-3 * np.cos(math.pi * (states[:, 0] - at) / 1.2) ** 4
    states[:, 6] += random.uniform(-0.002, 0.002, size)  # half of a yaw
    mirrored, of_motion, of_wrench = states.copy(), np.array([-1, 1, 1, 1, -1, -1]), np.array([-1, 1, 1, 1, -1, -1])
    mirrored[:, 0] = 2.0 * at - states[:, 0]
    mirrored[:, 5:7] *= -1.0
    mirrored[:, VELOCITY : VELOCITY + 6] *= of_motion
    equations = Equations(model)
    for some in (states, mirrored):
        wrenches.append(np.array([equations(0.0, state) is None or equations.work.rail_wrenches[0].copy()
                                  for state in some]))  # fmt: skip
    ahead, back = wrenches[0], wrenches[1] * of_wrench
    assert np.median(np.abs(ahead[:, :, 0])) > 100.0 and (ahead[:, :, 2] != 0.0).mean() > 0.5
    np.testing.assert_allclose(back, ahead, rtol=0.0, atol=1e-6 * np.abs(ahead).max())


STIFFNESS = 8.1e7


def over_a_joint(folder, kink, speed, rail, rate):
    """Times since a dipped joint (s), loads of a wheel beyond that before it (N), and the stiffness of its contact
    (N/m) under the mean of both, of a wheelset whose half falls onto the rails' springs at 2 ``kink`` V."""

    def dip(s):
        """Two straights inclined by ``kink`` against each other's mirror image, that level out over 2 m each."""
        beyond = min(max(abs(s) - 2.0, 0.0), 2.0)
        return kink * (min(abs(s), 2.0) + beyond - 0.25 * beyond**2 - 3.0)

    near = np.array([1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, *np.arange(0.1, 4.01, 0.1), 4.2])
    path = write_rail(folder, np.concatenate([-near[::-1], [0.0], near]), dip)
    changes = {
        "track.crossing": {"slices": str(path), "at": 6.0, "rail": "both"}, "contact.normal.damping.c_e": 1.0,
        "track.support.rail": rail, "speed": speed, "integration": {"duration": 6.5 / speed, "rtol": 1e-6},
        "output": {"rate": rate, "channels": ["pose", "contact"]},
    }  # fmt: skip
    run = simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", ROUND | changes))
    load, patch, s = loads(run, "right"), run["wheelset/right"], run["wheelset"]["x_m"] - 6.0
    load = load - np.mean(load[(s > -0.4) & (s < -0.05)])
    k = [0, np.argmax(load)]
    radius = np.mean([patch[name][k, 0] for name in ("a_m", "b_m")])
    contact = 2.0 * 82e9 / (1.0 - 0.28) * radius  # dN/d(delta) of Hertz, of a circle: 2 G a/(1 - nu)
    return (s[s > 0.0]) / speed, load[s > 0.0], contact


def test_a_dipped_joint_is_a_blow_to_a_mass_on_a_spring(tmp_path):
    # half the wheelset on the track's and the contact's springs, one behind the other, with next to no damping: the
    # load grows by 2 KINK V sqrt(K M)
    soft = {"stiffness": STIFFNESS, "damping": 1e3}
    t, load, contact = over_a_joint(tmp_path, 0.004, 20.0, {"lateral": soft, "vertical": soft}, 4000)
    springs = 1.0 / (1.0 / STIFFNESS + 1.0 / contact)
    assert t[np.argmax(load)] < 0.01
    assert load.max() == pytest.approx(2.0 * 0.004 * 20.0 * math.sqrt(springs * 0.5 * MASS), rel=0.05)


@pytest.mark.parametrize(
    ("mass", "stiffness", "damping"), [(79.0, 8.1e7, 3e4), (150.0, 8.1e7, 6e4), (40.0, 6e7, 4e4), (79.0, 4e7, 3e4)]
)
def test_the_peaks_at_a_dipped_joint_are_p1_and_p2(tmp_path, mass, stiffness, damping):
    # Jenkins, Stephenson, Clayton, Morland and Lyon, Railway Engineering Journal 3 (1974) 2-16. P1: wheel and rail meet
    # at 2 alpha V on the spring of their contact. P2: both together, slowed down by the rail's mass, on the track's
    kink, speed, wheel = 0.001, 40.0, 0.5 * MASS
    spring = {"stiffness": stiffness, "damping": damping}
    rail = {"mass": mass, "lateral": spring, "vertical": spring}
    t, load, contact = over_a_joint(tmp_path, kink, speed, rail, 20000)
    blow, both = 2.0 * kink * speed, math.sqrt(stiffness * (wheel + mass))
    first = blow * math.sqrt(contact * mass / (1.0 + mass / wheel))
    second = blow * wheel / (wheel + mass) * both * (1.0 - 0.25 * math.pi * damping / both)
    period = 2.0 * math.pi * math.sqrt(mass / (1.0 + mass / wheel) / contact)
    assert load[t < period].max() == pytest.approx(first, rel=0.06)
    count = round(period / (t[1] - t[0]))
    evened = np.convolve(load, np.ones(count) / count, "same")  # of the contact's own vibration
    assert evened[(t > 1.5 * period) & (t < 0.01)].max() == pytest.approx(second, rel=0.1)


def test_slices_that_are_alike_run_as_the_plain_rail(tmp_path):
    path = write_rail(tmp_path, [0.0, 1.0, 2.0], lambda s: 0.0)
    short = {"integration.duration": 0.1, "integration.method": "tsit5"}
    runs = [
        simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", ROUND | short | more))
        for more in ({}, {"track.crossing": {"slices": str(path), "at": 0.3}})
    ]
    for name in ("y_m", "z_m", "yaw_rad", "vx_m_per_s"):
        np.testing.assert_array_equal(*(run["wheelset"][name] for run in runs))


def test_scenes_without_one_compile_nothing_of_it():
    model = Equations(compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml"))[0]).arguments[1].value
    assert (model.kernels.rail_sections_kernel, model.kernels.step_limit_kernel) == (0, 0)
    assert model.contact.geometries == ()
    assert model.contact.geometry.along == ()


BRIEF = {"integration.duration": 0.5, "output.rate": 2000}


@pytest.fixture(scope="module")
def facing():
    return simulate(load_scene(CROSSING, BRIEF))


def test_left_and_right_are_mirror_images(facing):
    other = simulate(load_scene(CROSSING, BRIEF, track__crossing__rail="left"))
    np.testing.assert_allclose(other["wheelset"]["y_m"], -facing["wheelset"]["y_m"], rtol=0.0, atol=2e-6)
    np.testing.assert_allclose(other["wheelset"]["z_m"], facing["wheelset"]["z_m"], rtol=0.0, atol=2e-6)


def test_no_step_passes_over_the_nose(facing):
    # the same impact with steps a fifth as long, and by an explicit method; the wheel lands on the nose, within mm
    finer = simulate(load_scene(CROSSING, BRIEF, integration__longest_step=2e-4, integration__rtol=1e-6))
    explicit = simulate(load_scene(CROSSING, BRIEF, integration__method="tsit5", integration__rtol=1e-6))
    s = facing["wheelset"]["x_m"]
    for run in (facing, explicit):
        assert loads(run, "right").max() == pytest.approx(loads(finer, "right").max(), rel=0.02)
        assert s[np.argmax(loads(run, "right"))] == pytest.approx(s[np.argmax(loads(finer, "right"))], abs=0.02)
    assert loads(facing, "right").max() > 2.0 * loads(facing, "right")[0]
    assert loads(facing, "right")[-1] == pytest.approx(loads(facing, "right")[0], rel=0.2)


def passed(rail, *path, **changes):
    """Run over a switch of 500 m that begins at 6 m."""
    switch = {
        "track.crossing": {"slices": "switch:500", "at": 6.0, "rail": rail},
        "track.path": list(path) or "tangent",
    }
    return simulate(load_scene(CROSSING, switch, integration__duration=1.0, output__rate=1000, **changes))


def test_a_switch_takes_wheels_through_and_off():
    # through, the blade takes the load over where it has risen; into the curve the outer flange runs on to it before
    through = passed("right")
    off, mirrored = (
        passed(rail, {"tangent": 5.75}, {"transition": 0.5}, {"curve": 100.0, "radius": radius})
        for rail, radius in (("right", 500.0), ("left", -500.0))
    )
    s = through["wheelset"]["x_m"]
    for run in (through, off):
        load, patch = loads(run, "right"), run["wheelset/right"]
        assert load.min() > 0.75 * load[0] and load.max() < 1.35 * load[0]
        where = np.nansum(patch["N_N"] * patch["u_rail_m"], axis=1) / load
        assert where[(s > 9.7) & (s < 9.9)].min() > 0.005  # on the stock rail
        assert where[s > 14.6].max() < 0.0  # on the blade, the plain rail by then
    inward = [np.nanmax(np.abs(run["wheelset/right"]["contact_angle_rad"])) for run in (through, off)]
    assert inward[0] < 0.3 < 0.8 < inward[1]
    assert off["wheelset"]["y_m"].min() < 1.5 * through["wheelset"]["y_m"].min() < 0.0
    np.testing.assert_allclose(mirrored["wheelset"]["y_m"], -off["wheelset"]["y_m"], rtol=0.0, atol=2e-6)


def test_a_crossing_is_the_same_for_the_route_that_leaves():
    curve = [{"tangent": 2.75}, {"transition": 0.5}, {"curve": 100.0}]
    runs = [
        simulate(
            load_scene(CROSSING, BRIEF, track__path=[*curve[:2], curve[2] | {"radius": r}], track__crossing__rail=rail)
        )
        for r, rail in ((500.0, "left"), (-500.0, "right"))
    ]
    assert loads(runs[0], "left").max() > 1.8 * loads(runs[0], "left")[0]
    np.testing.assert_allclose(runs[0]["wheelset"]["z_m"], runs[1]["wheelset"]["z_m"], rtol=0.0, atol=2e-6)


NOSE = {"slices": "crossing:1/12", "at": 6.0, "rail": "right"}


def test_stretches_of_a_rail_are_each_what_it_is_alone():
    # in any order of listing, poses back and forth; before the second stretch nothing of it is felt
    blade = NOSE | {"slices": "switch:190", "at": 30.0}
    (both, start), (nose, _), (switch, _) = (
        compile_scene(load_scene(CROSSING, {"track.crossing": what})) for what in ([blade, NOSE], NOSE, [blade])
    )
    both, nose, switch = (Equations(model) for model in (both, nose, switch))
    first = poses_over_it(start, 300)
    second = first.copy()
    second[:, 0] = 30.0 + 2.0 * (first[:, 0] - 6.0)
    for one, other in zip(first, second, strict=True):
        for alone, state in ((nose, one), (switch, other)):
            alone(0.0, state)
            both(0.0, state)
            np.testing.assert_allclose(both.work.rail_wrenches, alone.work.rail_wrenches, rtol=1e-6, atol=1.0)
    assert [len(one.arguments[1].value.crossing.sections) for one in (both, nose)] == [2, 1]
    again = [NOSE | {"at": at, "reversed": at > 80.0} for at in (6.0, 30.0, 60.0, 90.0, 120.0)]
    many, _ = compile_scene(load_scene(CROSSING, {"track.crossing": again}))
    assert many.crossing.tables[0, 1].tolist() == [0, 0, 0, 1, 1]  # what is the same is there once


def test_a_wheel_that_changes_stretches_forgets_the_one_it_was_on():
    # as far into the second one as it was into the first: what was laid, and bounds, are of another table
    other = NOSE | {"at": 40.0, "reversed": True}
    (both, start), (alone, _) = (
        compile_scene(load_scene(CROSSING, {"track.crossing": w})) for w in ([NOSE, other], other)
    )
    begins, models = both.crossing.laid[0, 1, :, BEGIN], [Equations(model) for model in (both, alone)]
    states = poses_over_it(start, 300)
    for state, far in zip(states, np.random.default_rng(3).uniform(0.3, 1.8, len(states)), strict=True):
        state[0] = begins[0] + far
        models[0](0.0, state)
        state[0] = begins[1] + far
        for one in models:
            one(0.0, state)
        np.testing.assert_allclose(*(one.work.rail_wrenches for one in models), rtol=1e-6, atol=1.0)


def test_a_turnout_is_run_in_one_scene():
    # the crossing of a switch of 190 m, 1:9, 23 m behind its toe, on the route that leaves
    switch, nose = NOSE | {"slices": "switch:190"}, NOSE | {"slices": "crossing:1/9", "at": 29.07}
    path = [
        {"tangent": 5.75},
        {"transition": 0.5},
        {"curve": 20.6, "radius": 190.0},
        {"transition": 0.5},
        {"tangent": 9},
    ]
    changes = {"track.crossing": [switch, nose], "track.path": path, "speed": 10.0, "integration.duration": 3.3}
    scene = load_scene(CROSSING, changes)
    run = simulate(scene)
    s, load = run["wheelset"]["s_m"], loads(run, "right")
    assert run.status == "completed" and len(scene.crossings) == 2
    assert load[(s > 6.0) & (s < 14.0)].max() > 1.15 * load[0]  # on the blade
    assert load[(s > 29.0) & (s < 30.5)].max() > 1.5 * load[0]  # on the nose
    assert load[(s > 20.0) & (s < 26.0)].max() < 1.2 * load[(s > 20.0) & (s < 26.0)].min()  # between them
    pictures = [plot_crossing(run, scene=scene, stretch=k) for k in (0, 1)]
    assert [round(picture.axes[4].get_xlim()[0]) for picture in pictures] == [5, 29]
    with pytest.raises(InputError, match="the number of one of 2, from 0, got 2"):
        plot_crossing(run, scene=scene, stretch=2)


def test_stretches_lie_apart_and_name_their_keys():
    with pytest.raises(InputError, match="stretches of the right rail apart") as error:
        load_scene(CROSSING, {"track.crossing": [NOSE | {"at": 7.0}, NOSE]})
    assert error.value.field == "track.crossing.0.at"
    load_scene(CROSSING, {"track.crossing": [NOSE | {"rail": "left"}, NOSE]})
    load_scene(CROSSING, {"track.crossing": NOSE | {"slices": {"slices": "switch:500"}}})  # a formula, no file
    with pytest.raises(InputError, match="'left', 'right' or 'both'") as error:
        load_scene(CROSSING, {"track.crossing": [NOSE, NOSE | {"at": 30.0, "rail": "inner"}]})
    assert error.value.field == "track.crossing.1.rail"
    with pytest.raises(InputError, match="from 1/30 to 1/5") as error:
        load_scene(CROSSING, {"track.crossing": [NOSE, NOSE | {"slices": "crossing:2"}]})
    assert error.value.field == "track.crossing.1.slices"
    with pytest.raises(InputError, match="such as joint:0.01"):
        load_scene(CROSSING, {"track.crossing": NOSE | {"slices": "joint:1"}})


def test_a_made_joint_dips_by_its_angle():
    joint = Joint(0.01)
    s = np.array([-joint.straight - joint.level, -0.8, -0.4, 0.0, 0.4, 0.8, joint.straight + joint.level])
    heights = joint.rail("joint").heights(s, np.array([0.0]))[0][:, 0]
    np.testing.assert_allclose(np.diff(heights)[1:5] / 0.4, [-0.005, -0.005, 0.005, 0.005], atol=2e-5)
    np.testing.assert_allclose(heights[[0, -1]], whole_head()[1].max(), atol=1e-5)


def test_its_picture_shows_the_load_going_over():
    scene = load_scene(CROSSING, BRIEF)
    figure = plot_crossing(simulate(scene), scene=scene)
    load, share = figure.axes[2], figure.axes[3]
    wing, nose = (line.get_ydata() for line in load.lines[:2])
    assert [text.get_text() for text in load.get_legend().get_texts()] == ["outer head", "inner head"]
    assert wing[0] == pytest.approx(54.5, abs=0.1) and wing[-1] == 0.0
    assert nose[0] == 0.0 and nose.max() > 100.0
    np.testing.assert_allclose(sum(line.get_ydata() for line in share.lines[:2])[:100], 1.0, rtol=1e-12)
    with pytest.raises(InputError, match="a run with track.crossing"):
        plot_crossing(
            simulate(load_scene(SCENES / "wheelset.yaml", integration__duration=0.01)), scene=SCENES / "wheelset.yaml"
        )


def test_its_page_is_read_and_run():
    text = (ROOT / "reports" / "crossings.md").read_text(encoding="utf-8")
    blocks = [parse_value(block) for block in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)]
    assert len(blocks) == 7
    for block in blocks:
        assert simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", block | BRIEF)).status == "completed"


def test_right_hand_sides_on_a_crossing_cost_at_most_three_times_those_beside_it():
    # of a wheelset alone, by processor time
    model, state = compile_scene(load_scene(CROSSING))
    equations, tries = Equations(model), []
    beside, on_it = (np.repeat(state[None, :], 2000, axis=0) for _ in range(2))
    beside[:, 0] += np.linspace(0.0, 1.0, 2000)
    on_it[:, 0] += np.linspace(6.2, 6.6, 2000)
    on_it[:, 2] -= 1.2e-3  # both wheels bear
    assert (equations(0.0, on_it[1000]) is not None) and equations.work.counts.tolist() == [[1, 1]]
    for _ in range(15):  # in turn, as a machine's pace changes
        for states in (beside, on_it):
            began = time.process_time()
            equations.at(0.0, states)
            tries.append(time.process_time() - began)
    costs = min(tries[::2]), min(tries[1::2])
    assert costs[1] < 3.0 * costs[0]


@pytest.mark.parametrize(
    ("changes", "field", "expected"),
    [
        ({"slices": "no.csv"}, "track.crossing.slices", "existing file"),
        ({"slices": {"slices": "no.csv", "unit": "mm"}}, "track.crossing.slices", "existing file"),
        ({"slices": "crossing:2"}, "track.crossing.slices", "from 1/30 to 1/5"),
        ({"slices": "switch:50"}, "track.crossing.slices", "a switch of 100 to 5000 m"),
        ({"at": 0.0}, "track.crossing.at", "no wheelset on it at the beginning"),
        ({"rail": "inner"}, "track.crossing.rail", "'left', 'right' or 'both'"),
        ({"length": 1.0}, "track.crossing.length", "unknown key"),
    ],
)
def test_bad_input_names_its_key(changes, field, expected):
    with pytest.raises(InputError, match=expected) as error:
        load_scene(CROSSING, {f"track.crossing.{key}": value for key, value in changes.items()})
    assert error.value.field == field


def test_rails_that_do_not_join_are_refused(tmp_path):
    path = write_rail(tmp_path, [0.0, 1.0, 2.0], lambda s: 2e-4 * s)
    with pytest.raises(InputError, match="a last slice within 0.1 mm of the scene's rail"):
        load_scene(SCENES / "wheelset.yaml", ROUND | {"track.crossing": {"slices": str(path), "at": 10.0}})


def test_rails_with_a_hole_or_a_wall_are_refused(tmp_path):
    wall = write_rail(tmp_path, 0.025 * np.arange(121), lambda s: 8e-3 * (abs(s - 1.0) < 1e-6))
    with pytest.raises(InputError, match=r"rise less than 0.2 along the track, got"):
        load_scene(SCENES / "wheelset.yaml", ROUND | {"track.crossing": {"slices": str(wall), "at": 10.0}})
    Crossing().write(tmp_path / "own", "crossing.csv")
    head, *rows = (tmp_path / "own" / "crossing.csv").read_text().splitlines()
    names = head.split(",")
    kept = [row for row in rows if not ("wing" in row and float(row.split(",")[names.index("s_m")]) > 0.2)]
    (tmp_path / "own" / "crossing.csv").write_text("\n".join([head, *kept]))
    with pytest.raises(InputError, match=r"a head under the wheels everywhere, got none at s = 0.4"):
        load_scene(CROSSING, {"track.crossing.slices": str(tmp_path / "own" / "crossing.csv")})


def test_a_rail_that_swings_out_between_far_slices_is_told(tmp_path, capsys):
    path = write_rail(tmp_path, [0.0, 0.5, 1.0, 1.05, 1.5, 2.0, 2.5], lambda s: -1e-3 * (1.0 < s < 2.0))
    load_scene(SCENES / "wheelset.yaml", ROUND | {"track.crossing": {"slices": str(path), "at": 10.0}})
    assert re.search(r"the rail swings out by \d.\d mm .* add slices", capsys.readouterr().err)
    load_scene(CROSSING)
    assert "swings out" not in capsys.readouterr().err


@pytest.mark.parametrize("side", SIDES)
def test_tables_serve_the_plain_rail_and_the_solver_the_crossing(side):
    changes, on = {"track.crossing.at": 3.0, "track.crossing.rail": side}, list(SIDES).index(side)
    (exact, state), (table, _) = (compile_scene(load_scene(CROSSING, changes, contact__patch=patch))
                                  for patch in ("exact", "tabulated"))  # fmt: skip
    equations = [Equations(model) for model in (exact, table)]
    for s in (0.0, 2.95):  # before it, and where the wing leads the wheel outwards
        moved = state.copy()
        moved[STATE_SIZE * exact.bodies.wheelsets[0]] += s
        solved = equations[1].work.counters[SOLVED]
        for one in equations:
            one(0.0, moved)
        solution, found = (one.work.rail_wrenches[0] for one in equations)
        assert np.abs(found[1 - on] - solution[1 - on]).max() < 5e-4 * solution[1 - on].max()
        assert np.abs(found[on] - solution[on]).max() < (1e-9 if s else 5e-4) * solution[on].max()
        assert equations[1].work.counters[SOLVED] - solved == (s > 0.0)
        rows = [one.work.patches[0, 1 - on, 0] for one in equations]  # the other wheel's are its own
        assert rows[1][ANGLE] == pytest.approx(rows[0][ANGLE], abs=2e-4)
        assert rows[1][[SEMI_A, SEMI_B]] == pytest.approx(rows[0][[SEMI_A, SEMI_B]], rel=0.02)
        assert rows[1][[FX, FY]] == pytest.approx(rows[0][[FX, FY]], abs=2e-3 * solution[1 - on].max())


def test_impact_on_rigid_rails_is_told(capsys):
    data = load_scene(CROSSING).data
    del data["track"]["support"]
    data["vehicle"]["parameters"] = str(ELLIPTIC.parent / data["vehicle"]["parameters"])
    compile_scene(load_scene(data))
    assert "impact on rigid rails is no result" in capsys.readouterr().err
