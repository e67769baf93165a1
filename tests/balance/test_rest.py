"""Where vehicles rest on wheels or rails that differ: from which places it is sought, and what counts as rest."""

import numpy as np
import pytest
import yaml

from tests.conftest import ELLIPTIC, ROOT
from wrcore.balance import initial
from wrcore.balance.equilibrium import Equilibrium
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene


@pytest.mark.parametrize("gauge", [1.0, 1.668, 1.9])
def test_a_gauge_that_does_not_fit_the_wheelset_is_named(gauge):
    with pytest.raises(InputError, match="expected a gauge that fits tape circles 1.5 m apart") as caught:
        compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"track.gauge": gauge}))
    assert caught.value.field == "track.gauge" and f"got {gauge:g} m" in str(caught.value)


def test_a_place_at_which_no_wheel_stands_is_still_the_initial_ones():
    with pytest.raises(InputError, match="expected a position in which both wheels stand") as caught:
        compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"track.gauge": 1.6, "initial.y": 0.02}))
    assert caught.value.field == "initial"


@pytest.mark.parametrize("mass", [1e-9, 1e-3, 0.09])
def test_a_rail_too_light_for_a_vehicle_to_rest_on_is_named(mass):
    spring = {"stiffness": 1e8, "damping": 1e5}
    support = {"rail": {"mass": mass, "lateral": spring, "vertical": spring}}
    with pytest.raises(InputError, match="expected at least 0.1 kg, or 0") as caught:
        load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"track.support": support})
    assert caught.value.field == "track.support.rail.mass"


UNLIKE = {"rail.left": {"profile": "54E1", "inclination": 0.025}}


def wheelset(**changes):
    return load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"contact.patch": "moment", **changes})


@pytest.mark.parametrize("rails", [{}, UNLIKE])
def test_a_vehicle_that_nothing_holds_is_refused(tmp_path, rails):
    """Two axle boxes push a wheelset of 1813 kg ahead with 1 kN, and no spring holds it."""
    vehicle = read_yaml(ROOT / "config" / "vehicles" / "suspended_wheelset.yaml")
    for box in vehicle["elements"]:
        if box["kind"] == "spring_damper":
            box["stiffness"][0], box["preload"][0] = 0.0, 500.0
    path = tmp_path / "vehicle.yaml"
    path.write_text(yaml.safe_dump(vehicle))
    with pytest.raises(InputError, match=r"rests on its wheels .* accelerations of 0\.[56]"):
        compile_scene(wheelset(**{"vehicle.parameters": str(path)}, **rails))


RESIDUALS = 0.5, 0.3, np.nan, 0.1, 9.0, 0.4, 0.2, 0.05, 0.9
"""Of the nine places to begin from, m/s^2."""


@pytest.mark.parametrize("fault", [None, np.linalg.LinAlgError("singular"), InputError("a", "b", "expected a place")])
def test_a_step_of_a_force_is_the_last_place_to_rest_at(monkeypatch, capsys, fault):
    """The eighth place lies at none, the third has no number, one has no equilibrium."""
    scene, begun = wheelset(**UNLIKE), []
    model, state = compile_scene(scene)

    def solved(*_):
        begun.append(len(begun))
        if fault and begun[-1] == 5:
            raise fault
        return Equilibrium(state, np.full((1, 2), 5e4), RESIDUALS[begun[-1]], at_a_step=begun[-1] != 7)

    monkeypatch.setattr(initial, "solve_equilibrium", solved)
    assert initial.equilibrium_positions(scene, model).residual == 0.1 and len(begun) == 9
    capsys.readouterr()
    begun.clear()
    monkeypatch.setattr(initial, "LARGEST_RESIDUAL_AT_A_STEP", 0.09)
    with pytest.raises(InputError, match="got accelerations of 0.05 m/s"):
        initial.equilibrium_positions(scene, model)
