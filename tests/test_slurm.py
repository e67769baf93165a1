"""The workflow on a real SLURM of one node; skipped, with the reason, where none can be started."""

import subprocess
import sys

import pandas as pd
import pytest
import slurm_node
import yaml

from tests.conftest import ROOT
from wrcore.sweep.batch import load_table, run_sweep

REASON = slurm_node.missing()


def test_profile_names_the_executor_and_asks_for_time_and_memory():
    profile = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text())
    assert profile["executor"] == "slurm" and profile["rerun-incomplete"]
    assert {"mem_mb", "runtime"} <= set(profile["default-resources"])


@pytest.fixture(scope="module")
def node(tmp_path_factory):
    with slurm_node.slurm_node(tmp_path_factory.mktemp("slurm")) as environment:
        yield environment


@pytest.mark.skipif(bool(REASON), reason=REASON)
def test_a_sweep_runs_as_slurm_jobs_and_gives_the_same_table(node, tmp_path):
    places = ", ".join(f"{name}: {tmp_path}/{name}" for name in ("results", "logs", "benchmarks"))
    command = [sys.executable, "-m", "snakemake", "sweeps", "--workflow-profile", "profiles/slurm", "--nolock"]
    command += ["--configfile", "config/smoke.yaml", "--config", f"pathvars={{{places}}}"]
    done = subprocess.run(command, cwd=ROOT, env=node, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    jobs = subprocess.run(["squeue", "-h", "-t", "all", "-o", "%T"], env=node, capture_output=True, text=True)
    assert jobs.stdout.split() == ["COMPLETED"] * 3  # two batches and their table
    table = load_table(tmp_path / "results" / "sweeps" / "smoke.csv")
    alone = run_sweep(ROOT / "config" / "sweeps" / "smoke.yaml")
    pd.testing.assert_frame_equal(table, alone, check_dtype=False)
