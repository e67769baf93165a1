"""Numbers that pages quote are those of the study's tables."""

import pandas as pd
import pytest
import yaml

from docs import quoted
from docs.page_tables import TABLES
from tests.conftest import ROOT
from wrcore.run.accuracy import measured_front

ENTRIES = quoted.entries()
RESULTS = ROOT / "results"
KEPT_ERROR = 0.05
"""Relative difference of a kept error to the study's that other processors may make; other code makes more."""


def name_of(entry):
    return f"{entry['page']}: {entry.get('make') or entry['says'][:40]}"


def text_of(entry):
    return (ROOT / entry["page"]).read_text("utf-8")


@pytest.mark.parametrize("entry", quoted.read()["sentences"], ids=name_of)
def test_quoted_sentence_stands_once_in_its_page(entry):
    match = quoted.place(entry, text_of(entry))
    assert len(match.groups()) == sum(len(value.get("columns", [1])) for value in entry["values"])


@pytest.mark.parametrize("entry", ENTRIES, ids=name_of)
def test_page_quotes_the_kept_table(entry):
    absent = [table for table in quoted.tables_of(entry) if not quoted.kept_path(table).is_file()]
    if absent:
        pytest.skip(f"not kept: {', '.join(absent)}; run: make tables")
    found = quoted.differences(entry, quoted.loader(quoted.kept_path), text_of(entry))
    assert found == [], "\n".join(map(str, found))


@pytest.mark.check
@pytest.mark.parametrize("entry", ENTRIES, ids=name_of)
def test_page_agrees_with_the_study(entry):
    absent = [table for table in quoted.tables_of(entry) if not (RESULTS / table).is_file()]
    if absent:
        pytest.skip(f"results/ lacks {', '.join(absent)}; run: make study")
    found = quoted.differences(entry, quoted.loader(lambda table: RESULTS / table), text_of(entry))
    assert found == [], "\n".join(map(str, found))


@pytest.mark.check
def test_kept_choices_have_the_errors_of_the_study():
    references = sorted((RESULTS / "accuracy").glob("*_reference.csv"))
    if not references:
        pytest.skip("results/accuracy has no references; run: make study")
    parts = []
    for path in references:
        facts = pd.read_csv(path).iloc[0]
        choices = pd.read_csv(path.with_name(path.name.replace("_reference", "")))
        parts.append(choices.assign(kind=facts["kind"], speed_m_per_s=facts["speed_m_per_s"]))
    keys = ["kind", "speed_m_per_s", "detection", "patch", "creep", "method", "rtol"]
    both = measured_front().merge(pd.concat(parts), on=keys, suffixes=("", "_study"))
    assert len(both) == len(measured_front())
    for column, least in (("y_rms_m", 1e-9), ("N_rms_relative", 1e-5)):
        off = (both[column] - both[f"{column}_study"]).abs()
        assert (off <= KEPT_ERROR * both[f"{column}_study"] + least).all(), both[off.gt(least)][[*keys, column]]


LINE = "It is 12.3 µm in 250 runs,\nof which 0.040 % fail.\n"
ENTRY = {
    "page": "a.md",
    "says": "It is # µm in # runs, of which # % fail",
    "table": "t.csv",
    "values": [
        {"where": {"name": "a"}, "column": "x", "times": 1e6},
        {"where": "name == 'b'", "column": "n", "within": 0.2},
        {"column": "share", "of": "max", "times": 100.0},
    ],
}
TABLE = pd.DataFrame({"name": ["a", "b"], "x": [1.234e-5, 1.0], "n": [1, 290], "share": [1e-4, 4.04e-4]})


def load(path):
    assert path == "t.csv"
    return TABLE


def test_numbers_agree_as_far_as_they_are_printed():
    assert quoted.differences(ENTRY, load, LINE) == []
    (one,) = quoted.differences(ENTRY, load, LINE.replace("12.3", "12.4"))
    assert one.printed == "12.4" and one.found == pytest.approx(12.34) and "a.md" in str(one)
    assert [d.printed for d in quoted.differences(ENTRY, load, LINE.replace("250", "200"))] == ["200"]
    assert [d.printed for d in quoted.differences(ENTRY, load, LINE.replace("0.040", "0.041"))] == ["0.041"]


def test_numbers_are_written_with_the_digits_of_the_page():
    new = quoted.written(ENTRY, load, LINE.replace("12.3", "99.9").replace("250", "17").replace("0.040", "0.999"))
    assert new == "It is 12.3 µm in 290 runs,\nof which 0.040 % fail.\n"
    assert quoted.differences(ENTRY, load, new) == []


@pytest.mark.parametrize(
    ("number", "printed", "expected"),
    [
        (1234.0, "3450", "1230"),
        (0.0123, "5", "0.012"),
        (2.5e-7, "3.1e-6", "2.5e-7"),
        (1.0, "0.99", "1.00"),
        (-0.3, "+0.5", "-0.3"),
    ],
)
def test_printed_digits_stay(number, printed, expected):
    assert quoted.as_printed(number, printed) == expected


def test_sentence_that_is_gone_and_rows_that_are_no_single_one_are_errors():
    with pytest.raises(LookupError, match="stands 0 times"):
        quoted.differences(ENTRY, load, "another page")
    several = ENTRY | {"values": [{"column": "x"}, *ENTRY["values"][1:]]}
    with pytest.raises(LookupError, match="expected one"):
        quoted.differences(several, load, LINE)


def test_whole_table_is_compared_cell_by_cell_and_rewritten():
    rows = pd.DataFrame({
        "model": ["exact", "moment"], "height_largest_m": [0.0, 1.2e-6], "goes_over_later_m": [0.0, 5e-5],
        "p_max_worst": [0.0, 0.13], "cpu_s": [2.0, 1.8],
    })  # fmt: skip
    entry = {"page": "b.md", "make": "crossings"}
    page = f"before\n\n{TABLES['crossings'].make(lambda path: rows)}\n\nafter\n"
    assert quoted.differences(entry, lambda path: rows, page) == []
    slower, other = rows.assign(cpu_s=[2.0, 1.5]), rows.assign(p_max_worst=[0.0, 0.15])
    assert quoted.differences(entry, lambda path: slower, page) == []
    (one,) = quoted.differences(entry, lambda path: other, page)
    assert one.printed == "13" and one.found == 15.0
    assert "| moment | 1.2 | 0.05 | 15 | 0.9 |" in quoted.written(entry, lambda path: other, page)


def test_half_of_the_examples_take_the_surrogate():
    scenes = [yaml.safe_load(path.read_text("utf-8")) for path in (ROOT / "config/scenes").glob("*.yaml")]
    taking = [scene for scene in scenes if scene.get("contact", {}).get("patch") == "surrogate"]
    page = " ".join((ROOT / "README.md").read_text("utf-8").split())
    assert len(scenes) == 2 * len(taking)
    assert "Half of the examples take exact contact from a trained network (`surrogate`)" in page
