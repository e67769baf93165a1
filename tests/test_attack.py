"""Every attack of tests/attack.py at a tenth of its size; ``WRCORE_ATTACK=full``: all of it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.attack import ATTACKS

SHARE = "1" if os.environ.get("WRCORE_ATTACK") == "full" else "0.1"


@pytest.mark.parametrize("name", ATTACKS)
def test_nothing_breaks(name):
    script = Path(__file__).with_name("attack.py")
    done = subprocess.run([sys.executable, script, name, "--share", SHARE], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith(f"{name}: "), done.stdout + done.stderr
