"""reports/co_simulation.md works as written and prints what it shows."""

import pytest

from tests.pages import blocks, run_blocks

PAGE = "co_simulation.md"


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """Lines that the page prints, and the folder in which it ran."""
    place = tmp_path_factory.mktemp("stepped")
    with pytest.MonkeyPatch.context() as patch:
        lines: list[list[str]] = []
        patch.chdir(place)
        patch.setattr("builtins.print", lambda *words, **_: lines.append(" ".join(map(str, words)).split()))
        run_blocks(PAGE)
    assert (place / "stepped.png").read_bytes().startswith(b"\x89PNG")
    return [line for line in lines if line[:1] and line[0] in ("off", "on")]


def test_it_prints_what_it_shows(printed):
    shown = [line.split() for kind, text in blocks(PAGE) if kind == "text" for line in text.strip().splitlines()]
    assert [line[0] for line in printed] == [line[0] for line in shown] == ["off", "on"] * 2
    for mine, theirs in zip(printed, shown, strict=True):
        mine, theirs = ([float(word) for word in line[1:]] for line in (mine, theirs))
        assert mine == pytest.approx(theirs, rel=0.05, abs=0.02)


def test_controllers_do_what_they_are_for(printed):
    hunting, steady, spinning, held = ([float(word) for word in line[1:]] for line in printed)
    assert min(hunting) > 1.9 and max(steady[1:]) < 0.01  # mm
    assert spinning[0] > 20 and held[0] < 1.0  # m/s
    assert held[1] >= spinning[1] and held[2] < 0.01 * spinning[2]
