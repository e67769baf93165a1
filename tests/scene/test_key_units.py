"""Every number that a file may hold has a unit, stated once: in its schema."""

import h5py
import pandas as pd
import pytest

from wrcore.cli import main
from wrcore.errors.checked_yaml import schema_of
from wrcore.errors.schema_keys import _unit, keys_of, unit_of_key
from wrcore.forces.kinds import KINDS
from wrcore.run.output.channels import UNIT_SUFFIXES
from wrcore.sweep.batch import column_unit, write_table

SCHEMAS = ("scene", "track", "vehicle", "sweep", "wear", "wear_law")
COMPOUND = {
    "1/s",
    "s/m",
    "N/m",
    "N s/m",
    "N/m^3",
    "N m/rad",
    "N m/rad^3",
    "N m s/rad",
    "kg",
    "kg m^2",
    "kg/m",
    "N, m^3/m",
}
KNOWN = {"1", "that of the key", "that of the law", *UNIT_SUFFIXES.values(), *COMPOUND}


def has_numbers(part):
    """Whether a part of a schema is a number, or a list of them on any level, or may be one of these."""
    kinds = [part["type"]] if isinstance(part.get("type"), str) else part.get("type", [])
    inner = [*part.get("anyOf", []), *([part["items"]] if "items" in part else [])]
    return "number" in kinds or "integer" in kinds or any(map(has_numbers, inner))


def named_parts(part, path=""):
    """All parts of a schema that have a name, wherever they are."""
    for name, inner in part.get("properties", {}).items():
        yield f"{path}.{name}".strip("."), inner
        yield from named_parts(inner, f"{path}.{name}")
    for inner in [part.get("additionalProperties"), part.get("items"), *part.get("anyOf", [])]:
        if isinstance(inner, dict):
            yield from named_parts(inner, f"{path}.*")


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_number_has_a_unit(name):
    units = {path: _unit(part) for path, part in named_parts(schema_of(name)) if has_numbers(part)}
    assert len(units) >= 3 and {path: unit for path, unit in units.items() if unit not in KNOWN} == {}


def test_every_number_of_a_force_element_has_a_unit():
    units = {(kind, key): _unit(part) for kind, said in KINDS.items() for key, part in said.keys.items()
             if has_numbers(part)}  # fmt: skip
    assert len(units) >= 30 and {key: unit for key, unit in units.items() if unit not in KNOWN} == {}


def test_a_pure_number_is_one_where_the_schema_says_so_only():
    assert _unit({"type": "number", "description": "a ratio"}) == ""
    assert _unit({"type": "number", "description": "a ratio", "x-unit": "1"}) == "1"
    assert _unit({"type": "number", "description": "a stiffness in N/m of a spring in m"}) == "N/m"
    assert _unit({"type": "string", "description": "a file in m"}) == ""
    assert _unit({"type": "number", "description": "a number in steps"}) == ""


def test_units_of_keys_reach_the_files(tmp_path):
    numbers = {f"{prefix}{path}".replace("*", "car"): unit for kind, prefix in (("scene", ""), ("track", "track."))
               for path, *_, unit in keys_of(kind) if unit and "[]" not in path}  # fmt: skip
    assert len(numbers) > 60
    table = pd.DataFrame({name: [1.0] for name in [*numbers, "y_rms_m", "frequency_Hz", "steps"]})
    write_table(tmp_path / "table.h5", table)
    with h5py.File(tmp_path / "table.h5") as file:
        found = {name: item.attrs["units"] for name, item in file.items()}
    assert found == {**numbers, "y_rms_m": "m", "frequency_Hz": "Hz", "steps": "1"}
    assert found["integration.atol"] == found["track.gauge_depth"] == "m" and found["speed"] == "m/s"
    assert found["initial.bodies.car.wx"] == "rad/s" and found["contact.friction.falling.decay"] == "s/m"
    assert column_unit("contact.detection") == "1" and unit_of_key("contact.detection") == unit_of_key("x") == ""


def test_keys_are_listed_with_their_units(capsys):
    assert main(["keys", "scene", "integration"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert "integration.atol [m]" in listed and "integration.rtol [1]" in listed and "integration.method" in listed
