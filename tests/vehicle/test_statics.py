"""Preloads in nominal position against statics by hand (forces N, lengths m)."""

import numpy as np
import pytest

from tests.vehicle.conftest import element
from wrcore.errors import InputError
from wrcore.vehicle.description import GRAVITY, build_vehicle
from wrcore.vehicle.element_parts import parts_of
from wrcore.vehicle.layout import Layout
from wrcore.vehicle.statics import preloads

CAR, BOGIE = 32000 * GRAVITY, 2615 * GRAVITY


def preloads_by_name(data):
    """Vertical preloads of a vehicle's springs by the names of their elements."""
    vehicle = build_vehicle(data, "test", axle_boxes=False)
    found = {}
    for row in vehicle.elements.springs:
        found[tuple(np.round(row[12:15], 6))] = None
    layout = Layout(
        "test", vehicle.body_names, vehicle.positions, vehicle.bodies.mass, vehicle.bodies.spins.astype(bool),
        {name: part["wheelset"] for name, part in data["bodies"].items() if part["kind"] == "axle_box"},
    )  # fmt: skip
    parts = [part for item in vehicle.data["elements"] for part in parts_of(item, layout)]
    shares = preloads(parts, layout, data.get("joints", []), GRAVITY)
    for name, force in shares.items():  # what the kernels get is what statics found
        stated = tuple(np.round([0.0, 0.0, force], 6))
        assert stated in found, name
    return shares


def test_trailer_vehicle(trailer):
    shares = preloads_by_name(trailer)
    for name, force in shares.items():
        expected = {"secondary": CAR / 4, "primary": -(CAR + 2 * BOGIE) / 8}.get(name.split("_")[0], 0.0)
        assert force == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_centre_of_mass_off_the_centre(trailer):
    x, y = 0.6, 0.08
    trailer["bodies"]["car_body"]["position"] = [x, y, 1.8]
    shares = preloads_by_name(trailer)
    for bogie, ahead in ((1, 9.5), (2, -9.5)):
        for side, left in (("left", 1.0), ("right", -1.0)):
            # four equal springs at (+-9.5, +-1): W/4 (1 +- x/9.5 +- y/1)
            load = CAR / 4 * (1 + x / ahead + y / left)
            assert shares[f"secondary_spring_{bogie}_{side}"] == pytest.approx(load, rel=1e-9)
            for wheelset in (
                2 * bogie - 1,
                2 * bogie,
            ):  # the springs stand over the bogie's centre, at +-1 m like these
                assert shares[f"primary_spring_{wheelset}_{side}"] == pytest.approx(-(load + BOGIE / 2) / 2, rel=1e-9)
    for name in ("coupler", "traction_rod_1"):  # horizontal springs carry nothing
        assert shares[name] == 0.0


def test_stated_preloads_leave_the_rest_to_the_others(trailer):
    # one of four springs loaded by d more: the others' change is -d, -d and, across, +d
    d = 5000.0
    element(trailer, "secondary_spring_1_left")["preload"] = [0.0, 0.0, CAR / 4 + d]
    shares = preloads_by_name(trailer)
    assert "secondary_spring_1_left" not in shares
    for name, change in (("1_right", -d), ("2_left", -d), ("2_right", d)):
        assert shares[f"secondary_spring_{name}"] == pytest.approx(CAR / 4 + change, rel=1e-9)
    assert shares["primary_spring_1_left"] == pytest.approx(-(CAR / 4 + d + BOGIE / 2) / 2, rel=1e-9)


def statics_of(bodies, items, joints=()):
    """Preloads of a few bodies, each given as (position, mass), that stand on the frame; g = 10 m/s^2."""
    layout = Layout(
        "test", tuple(bodies), np.array([place for place, _ in bodies.values()], float),
        np.array([mass for _, mass in bodies.values()]), np.zeros(len(bodies), bool), {},
    )  # fmt: skip
    items = [{"name": f"s{k}", **item} for k, item in enumerate(items)]
    joints = [{"name": f"j{k}", **item} for k, item in enumerate(joints)]
    return preloads([part for item in items for part in parts_of(item, layout)], layout, joints, 10.0)


def spring(bodies, at, k=1e5):
    return {"kind": "spring_damper", "bodies": bodies, "at": at, "stiffness": [0.0, 0.0, k]}


def test_a_bolster_on_a_pivot_is_carried_with_its_car():
    # a car of 20 t on two bolsters of 1 t that turn under it; the springs stand beneath the bolsters
    bodies = {"car": ((0, 0, 2), 20e3), "front": ((8, 0, 1), 1e3), "rear": ((-8, 0, 1), 1e3)}
    for kind in ("revolute", "spherical"):
        joints = [
            {"kind": kind, "axis": "z", "bodies": ["car", name], "at": [x, 0, 1.2]}
            for name, x in (("front", 8), ("rear", -8))
        ]
        items = [spring([name, "frame"], [x, y, 0.8]) for name, x in (("front", 8), ("rear", -8)) for y in (1, -1)]
        shares = statics_of(bodies, items, joints)
        np.testing.assert_allclose(list(shares.values()), (20e3 / 2 + 1e3) * 10.0 / 2, rtol=1e-9)


def test_an_axle_box_with_a_trailing_arm_is_a_lever():
    # box of 100 kg on a fixed pivot at x = 0, its mass 0.1 m behind it, a bush 0.5 m ahead and a spring 0.3 m behind
    bodies = {"box": ((-0.1, 0, 0.5), 100.0), "frame_side": ((0, 0, 1), 2e3)}
    joint = {"kind": "revolute", "axis": "y", "bodies": ["box", "frame"], "at": [0, 0, 0.5]}
    items = [spring(["box", "frame_side"], [0.5, 0, 0.5], 1e7), spring(["box", "frame_side"], [-0.3, 0, 0.5])]
    items += [spring(["frame_side", "frame"], [x, y, 1.0], 1e3) for x in (0.6, -0.6) for y in (0.5, -0.5)]
    shares = statics_of(bodies, items, [joint])
    bush, coil = shares["s0"], shares["s1"]
    assert 0.3 * coil - 0.5 * bush - 0.1 * 1000.0 == pytest.approx(0.0, abs=1e-6)  # moments on the box about its pivot
    rest = [shares[f"s{k}"] for k in (2, 3, 4, 5)]
    assert sum(rest) - bush - coil == pytest.approx(2e4, rel=1e-9)  # forces on the frame, and moments about its centre
    assert 0.6 * (rest[0] + rest[1] - rest[2] - rest[3]) - 0.5 * bush + 0.3 * coil == pytest.approx(0.0, abs=1e-5)


def test_a_hinge_carries_moments_about_the_axes_it_does_not_turn_about():
    # 100 kg one metre outside a vertical hinge at the end of a beam of 400 kg: the beam's springs at +-1 m balance both
    bodies = {"beam": ((0, 0, 1), 400.0), "gate": ((3, 0, 1), 100.0)}
    hinge = {"kind": "revolute", "axis": "z", "bodies": ["beam", "gate"], "at": [2, 0, 1]}
    shares = statics_of(bodies, [spring(["beam", "frame"], [x, y, 0.5]) for x in (1, -1) for y in (0.5, -0.5)], [hinge])
    front, rear = shares["s0"] + shares["s1"], shares["s2"] + shares["s3"]
    assert front + rear == pytest.approx(5e3, rel=1e-9) and front - rear == pytest.approx(3 * 1e3, rel=1e-9)
    with pytest.raises(InputError, match="bodies.gate"):
        statics_of(bodies, [spring(["beam", "frame"], [x, 0, 0.5]) for x in (1, -1)], [{**hinge, "axis": "y"}])


def test_links_make_a_body_turn_about_the_point_where_they_meet():
    # two links at 45 degrees whose lines meet at y = z = 0; the weight 0.2 m, a spring 0.8 m beside that point
    bodies = {"body": ((0, 0.2, 1.5), 1e3)}
    ends = ([[0, 1, 1], [0, 2, 2]], [[0, -2, 2], [0, -3, 3]])
    links = [{"kind": "rigid_link", "bodies": ["body", "frame"], "at": at} for at in ends]
    shares = statics_of(bodies, [spring(["body", "frame"], [0, 0.8, 1.0])], links)
    assert shares["s0"] == pytest.approx(1e4 * 0.2 / 0.8, rel=1e-9)


def test_a_link_and_an_inclined_rod_carry_weight():
    # a beam of 1 t: one end hangs on a vertical link, the other stands on a spring; half of the weight each
    bodies = {"beam": ((0, 0, 1), 1e3)}
    link = {"kind": "rigid_link", "bodies": ["beam", "frame"], "at": [[1, 0, 1], [1, 0, 2]]}
    assert statics_of(bodies, [spring(["beam", "frame"], [-1, 0, 1])], [link])["s0"] == pytest.approx(5e3, rel=1e-9)
    # a rod at 30 degrees to the ground with 2 kN of thrust lifts by 1 kN
    rod = {
        "kind": "traction_rod", "bodies": ["beam", "frame"], "stiffness": 1e6, "preload": 2e3,
        "at": [[0, 0, 1], [-3**0.5, 0, 0]],
    }  # fmt: skip
    assert statics_of(bodies, [spring(["beam", "frame"], [0, 0, 1]), rod])["s0"] == pytest.approx(9e3, rel=1e-9)


def test_a_welded_body_is_carried_like_a_part():
    # the gate of above, welded: springs of the beam alone carry both, moments included
    bodies = {"beam": ((0, 0, 1), 400.0), "gate": ((3, 0, 1), 100.0)}
    weld = {"kind": "rigid", "bodies": ["beam", "gate"], "at": [2, 0, 1]}
    shares = statics_of(bodies, [spring(["beam", "frame"], [x, y, 0.5]) for x in (1, -1) for y in (0.5, -0.5)], [weld])
    assert shares["s0"] + shares["s1"] - shares["s2"] - shares["s3"] == pytest.approx(3 * 1e3, rel=1e-9)
    assert sum(shares.values()) == pytest.approx(5e3, rel=1e-9)


def test_a_wheelset_cannot_be_welded(trailer):
    weld = {"name": "weld", "kind": "rigid", "bodies": ["wheelset_1", "bogie_1"], "at": [10.78, 0.0, 0.46]}
    trailer["joints"] = [weld | {"at": element_at(trailer)}]
    with pytest.raises(InputError, match="joints.weld.bodies: expected no wheelset"):
        build_vehicle(trailer, "test", axle_boxes=False)


def element_at(data):
    """The centre of the first wheelset."""
    return data["bodies"]["wheelset_1"]["position"]
