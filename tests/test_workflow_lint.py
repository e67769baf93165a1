"""`snakemake --lint` finds nothing but what CONTRIBUTING.md says is left out on purpose."""

import re
import subprocess
import sys

from tests.conftest import ROOT

EXCEPTIONS = {
    "Specify a conda environment or container for each rule.",
    "Mixed rules and functions in same snakefile.",
    "Param reference is a prefix of input or output file but hardcoded",
}


def test_only_the_stated_exceptions_are_left():
    done = subprocess.run([sys.executable, "-m", "snakemake", "--lint"], cwd=ROOT, capture_output=True, text=True)
    found = set(re.findall(r"^\s+\* (.+?):$", done.stdout + done.stderr, re.MULTILINE))
    assert found, done.stdout + done.stderr
    assert found <= EXCEPTIONS
