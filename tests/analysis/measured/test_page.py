"""reports/signals.md works as written, and its numbers are those of its blocks."""

import re

import pytest

from tests.conftest import ROOT
from tests.pages import blocks, run_blocks

PAGE = "signals.md"


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What the page's blocks print, run in their order in an empty folder."""
    folder = tmp_path_factory.mktemp("signals")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.syspath_prepend(folder)
        lines = []
        patch.setattr("builtins.print", lambda *parts, **_: lines.append(" ".join(map(str, parts))))
        run_blocks(PAGE)
    assert {"overlay.png", "spectra.png", "compared"} <= {path.name for path in folder.iterdir()}
    return "\n".join(lines)


def test_the_file_read_is_the_one_on_the_page(printed):
    shown = next(text for kind, text in blocks(PAGE) if kind == "text" and text.startswith("Signal "))
    assert printed.startswith(shown.strip())


def test_the_fit_finds_the_values_on_the_page(printed):
    found = re.findall(r"(?:damping|cone:\{\}) +(\S+) +(\S+) ", printed.partition("standard_error")[2])
    (damping, damping_error), (conicity, conicity_error) = [tuple(map(float, pair)) for pair in found[:2]]
    assert damping == pytest.approx(20e3, abs=4 * damping_error) and damping_error < 400
    assert conicity == pytest.approx(0.15, abs=4 * conicity_error) and conicity_error < 1e-3


def test_the_page_is_short():
    text = re.sub(r"```.*?```", "", (ROOT / "reports" / PAGE).read_text("utf-8"), flags=re.DOTALL)
    assert len(text.split()) <= 600
