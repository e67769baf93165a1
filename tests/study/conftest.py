"""Every figure that a test of the study draws is looked at: no text overlaps another or leaves the page."""

import pytest
from matplotlib.figure import Figure

from wrcore.analysis.legible import findings


@pytest.fixture(autouse=True)
def legible_figures(monkeypatch):
    drawn, begin = [], Figure.__init__

    def remember(figure, *args, **kwargs):
        begin(figure, *args, **kwargs)
        drawn.append(figure)

    monkeypatch.setattr(Figure, "__init__", remember)
    yield
    found = [finding for figure in drawn for finding in findings(figure)]
    assert found == []
