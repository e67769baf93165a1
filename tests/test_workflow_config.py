"""The study's configuration: what is wrong stops before any job, what can be set is described."""

import subprocess
import sys

import pytest
import yaml

from tests.conftest import ROOT


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"paper": {"timing": {"repetitions": "five"}}}, "paper.timing.repetitions: 'five' is not of type 'integer'"),
        ({"paper": {"timing": {"repetition": 5}}}, "'repetition' was unexpected"),
        ({"creep": {"shown": "absent"}}, "creep.shown: expected a name under tables, got 'absent'"),
        (
            {"paper": {"timing": {"cases": ["absent"]}}},
            "paper.timing.cases: expected a name under paper.cases, got 'absent'",
        ),
        ({"paper": {"twins": {"rtol": "1e-9"}}}, "paper.twins.rtol: '1e-9' is not of type 'number'"),
        (
            {"paper": {"cases": {"wheelset_v20": {"scene": "absent.yaml"}}}},
            "paper.cases.wheelset_v20: absent.yaml: expected a readable file",
        ),
        (
            {"paper": {"cases": {"wheelset_v20": {"set": {"sped": 20.0}}}}},
            "paper.cases.wheelset_v20: changes: sped: unknown key",
        ),
    ],
)
def test_wrong_configuration_stops_before_any_job(tmp_path, change, message):
    (tmp_path / "wrong.yaml").write_text(yaml.safe_dump(change))
    command = [sys.executable, "-m", "snakemake", "--cores", "1", "--configfile", str(tmp_path / "wrong.yaml")]
    command += ["--config", f"pathvars={{results: {tmp_path}/r}}"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode != 0
    assert message in run.stdout + run.stderr
    assert not (tmp_path / "r").exists()


def test_every_key_of_the_study_is_described_and_smoke_adds_none():
    schema = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())

    def undescribed(part, key):
        if "$ref" in part:
            part = schema["$defs"][part["$ref"].rpartition("/")[2]]
        missing = [key] if part.get("type") != "object" and "description" not in part else []
        return missing + [
            m for name, inner in part.get("properties", {}).items() for m in undescribed(inner, f"{key}.{name}")
        ]

    def keys(data, prefix=""):
        for key, value in data.items():
            yield from keys(value, f"{prefix}{key}.") if isinstance(value, dict) else [prefix + key]

    assert undescribed(schema, "") == []
    study, smoke = (yaml.safe_load((ROOT / f"config/{name}.yaml").read_text()) for name in ("study", "smoke"))
    del smoke["pathvars"]
    assert set(keys(smoke)) <= set(keys(study))
