"""Every key of wear plans and laws has an effect: another value changes the worn profiles, or what a law takes off.

Plans are worked on as they are, but no scene is simulated: local wear is made up, another amount for each scene and for
each argument.
"""

import hashlib
from itertools import count
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from tests.conftest import ELLIPTIC
from tests.scene.test_every_key import has_effect, leaves
from wrcore.analysis.wear import evolve as ev
from wrcore.analysis.wear.local_wear import WheelWear, friction_work
from wrcore.analysis.wear.wear_laws import Sliding, wear_law
from wrcore.analysis.wear.worn_profiles import flange
from wrcore.errors.checked_yaml import schema_of
from wrcore.geometry.profiles.standards import named_profile
from wrcore.geometry.track import SIDES

EDGES = 2.5e-4 * np.arange(-300, 301)
"""Edges of the bins of wear, m."""


def hump(place, width):
    return np.exp(-(((0.5 * (EDGES[1:] + EDGES[:-1]) - place) / width) ** 2))


WHEEL = 5e-9 * (hump(0.0, 5e-3) + 3.0 * hump(-0.0375, 3e-3))
"""Depth per metre of the tread and of the flank, so that all limits are reached within 1 mm of wear."""
RAIL = 1e-8 * hump(0.0, 5e-3)


def made_up_wear(run, begin, law, *, patches, scene):
    asked = hashlib.sha256(repr((begin, law, patches, scene.data)).encode()).hexdigest()
    size = 1.0 + 0.1 * int(asked[:8], 16) / 2**32
    wear = WheelWear(EDGES, size * WHEEL, EDGES, size * RAIL, 1e-11 * size, 1.0)
    return {("wheelset", side): wear for side in SIDES}


@pytest.fixture(scope="module")
def loaded():
    """Scenes by file and changes."""
    return {}


@pytest.fixture
def worn(monkeypatch, tmp_path, loaded):
    """Function of a plan: its steps, and the profiles of wheels and rails that it leaves."""
    load, numbers = ev.changed_by_file, count()

    def once(path, changes, folder):
        key = str(path), repr(changes)
        if key not in loaded:
            loaded[key] = load(path, changes, folder)
        return loaded[key]

    def record(plan):
        folder = tmp_path / str(next(numbers))
        table = ev.evolve(plan, folder)
        profiles = [*folder.glob("profile_*.csv"), *folder.glob("rail_*.csv")]
        return table.to_csv(), [(path.name, path.read_bytes()) for path in sorted(profiles)]

    conicity = pd.DataFrame({"equivalent_conicity": [0.1]})
    monkeypatch.setattr(ev, "changed_by_file", once)
    monkeypatch.setattr(ev, "load_scene", lambda scene, changes: scene)
    monkeypatch.setattr(ev, "simulate", lambda scene, progress: SimpleNamespace(status="completed"))
    monkeypatch.setattr(ev, "local_wear", made_up_wear)
    monkeypatch.setattr(ev, "conicity_curve", lambda pair, amplitudes: conicity)
    return record


def plan_bases():
    run = {"integration.duration": 0.6}
    plan = {
        "name": "p", "scene": str(ELLIPTIC / "suspended_wheelset.yaml"), "distance": 2e5, "largest_wear": 1e-3,
        "largest_step": 1e5, "law": "sheffield", "patches": "ellipse", "smoothing": 3e-3, "begin": 0.2, "rate": 100.0,
        "set": {"contact.friction": 0.3},
        "scenes": [{"share": 3.0, "set": {**run, "speed": 30}}, {"share": 1.0, "set": {**run, "speed": 20}}],
    }  # fmt: skip
    new = flange(named_profile("S1002", "wheel"))
    limits = {"Sh": new["Sh_m"] + 4e-4, "hollow": 2e-4, "Sd": new["Sd_m"] - 2e-4, "qR": new["qR_m"] - 2e-4}
    return [
        plan, {**plan, "largest_wear": 4e-4}, {**plan, "rails": {"tonnage": 100.0, "renewal": 7e4}},
        *({**plan, "limits": {name: limit}} for name, limit in limits.items()),
        {**plan, "limits": {"Sh": limits["Sh"]}, "turning": True},
    ]  # fmt: skip


@pytest.mark.parametrize("key", leaves("wear"))
def test_key_of_a_wear_plan_changes_the_worn_profiles(key, worn):
    special = {
        "scene": [str(ELLIPTIC / "wheelset.yaml")], "set": [{"contact.friction": 0.25}], "law": ["energy"],
        "scenes[].set": [{"integration.duration": 0.6, "speed": 31}],
        "limits.Sh": [0.09], "limits.hollow": [0.09], "limits.Sd": [0.005], "limits.qR": [0.005],
    }  # fmt: skip
    assert has_effect(key, plan_bases(), worn, schema_of("wear"), special)


@pytest.fixture(scope="module")
def sliding():
    """Friction's work over three patches that slide in part."""
    size = np.array([4e-3, 6e-3, 8e-3])
    rows = {
        "a_m": size, "b_m": size[::-1], "N_N": np.full(3, 5e4), "Fx_N": np.full(3, -1e4), "Fy_N": np.full(3, 2e3),
        "Mz_Nm": np.zeros(3), "xi": np.array([1e-3, 2e-3, 4e-3]), "eta": np.full(3, -5e-4), "phi_per_m": np.zeros(3),
    }  # fmt: skip
    return Sliding(rows, *friction_work(rows, 0.3, 8.2e10, 0.28), 0.3, np.array([10.0, 20.0, 40.0]))


LAWS = [
    {"archard": {"hardness": 2e9, "speeds": [0.02], "pressures": [5e8],
                 "coefficients": [[1e-4, 2e-4], [3e-4, 4e-4]]}},
    {"t_gamma": [[0.0, 0.0], [20.0, 1e-12], [100.0, 5e-11]]},
]  # fmt: skip


@pytest.mark.parametrize("key", leaves("wear_law"))
def test_key_of_a_wear_law_changes_what_it_takes_off(key, sliding):
    special = {"archard.speeds": [[0.05]], "archard.pressures": [[4e8]]}

    def record(law):
        return wear_law(law)(sliding).tobytes()

    assert has_effect(key, LAWS, record, schema_of("wear_law"), special)
