"""Nothing that is handed in crashes, hangs or is taken for something else; see `tests/attack_inputs.py`."""

import os

import pytest

from tests.attack_inputs import ATTACKS


@pytest.mark.parametrize("name", ATTACKS)
def test_attack(name):
    count, attack = ATTACKS[name]
    assert attack(count if os.environ.get("WRCORE_ATTACK") == "full" else count // 10, seed=0) == []
