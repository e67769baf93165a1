"""The page's table of counters names every counter that a run has."""

import re

from docs.counters import PAGE, counters_table
from tests.conftest import ROOT
from wrcore.run.checks.validity import LIMITS, LOOK_UP_ERRORS, MEANINGS
from wrcore.run.simulation import COUNTERS


def test_every_counter_of_a_run_is_explained():
    assert set(MEANINGS) == {"patches", *COUNTERS, *LIMITS, *LOOK_UP_ERRORS}


def test_page_has_the_table_of_counters():
    assert counters_table() in PAGE.read_text("utf-8"), "run: python -m docs.counters"


def test_counters_that_pages_name_exist():
    pages = [*(ROOT / "reports").glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]
    named = set()
    for page in pages:
        named |= set(re.findall(r"`((?:patches|look_up)_\w+)`", page.read_text("utf-8")))
    assert len(named) > 3 and named <= set(MEANINGS)
