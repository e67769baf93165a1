"""What a unit does with a master's calls, without the binary between them."""

import json

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from wrcore.errors import InputError
from wrcore.errors.input_files import digest_of_file
from wrcore.run.fmu import INTERFACE, SteppedScene, _pack_scene

TORQUE = {"time": [0.0, 1.0, 1.2, 3.0], "torque": [0.0, 0.0, 4e3, 4e3]}


class Slave:
    def __init__(self, **given):
        self.variables = {}

    def register_variable(self, variable, nested=False):
        self.variables[variable.name] = variable


class Number:
    def __init__(self, name, **more):
        self.name, self.getter, self.setter = name, more["getter"], more["setter"]


class Unit(SteppedScene, Slave):
    number, held = Number, [{}]
    causality = variability = dict.fromkeys(("input", "output", "continuous", "independent"))


@pytest.fixture
def scene():
    brake = {"name": "b", "bodies": ["wheelset", "frame"], "torque": TORQUE}
    return wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"contact.patch": "moment", "drive.brakes": [brake]})


@pytest.fixture
def unit(scene, tmp_path):
    _pack_scene(scene, tmp_path)
    told = {"fmi": 2, "description": "", "inputs": {}, "outputs": {"wheelset.y_m": "", "drive/b.torque_Nm": ""}}
    told["sha256"] = {path.name: digest_of_file(path) for path in tmp_path.iterdir()}
    (tmp_path / INTERFACE).write_text(json.dumps(told))
    return Unit(resources=str(tmp_path))


def test_unit_reads_tables_at_the_start_time_of_the_master(unit):
    unit.setup_experiment(1.2)
    unit.exit_initialization_mode()
    assert unit.do_step(1.2, 0.01) is True
    assert unit.variables["drive/b.torque_Nm"].getter() == pytest.approx(-4e3, abs=1.0)
    assert unit._present().time == pytest.approx(1.21)


def test_jump_of_the_communication_point_is_discarded(unit, capfd):
    assert unit.do_step(0.0, 0.01) is True
    before = unit.variables["wheelset.y_m"].getter()
    for jump in (0.5, 0.0, -1.0):
        assert unit.do_step(jump, 0.01) is False
        assert "expected a step from 0.01 s on" in capfd.readouterr().err
    assert unit.variables["wheelset.y_m"].getter() == before
    assert unit.do_step(0.01, 0.01) is True


def test_bad_step_is_discarded_in_one_line(unit, capfd):
    for step in (0.0, -0.01, np.nan):
        assert unit.do_step(0.0, step) is False
        assert len(capfd.readouterr().err.strip().splitlines()) == 1


def test_unit_whose_files_were_changed_is_refused(unit, tmp_path):
    file = tmp_path / "scene.yaml"
    file.write_text(file.read_text() + "\n# edited\n")
    with pytest.raises(InputError, match="scene.yaml: expected the file with which the unit was written"):
        unit.exit_initialization_mode()
