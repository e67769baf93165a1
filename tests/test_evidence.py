"""reports/evidence.md: tests that it names exist and assert what it says; the page is that of its table."""

import pytest

from docs.evidence import PAGE, ROOT, page, read, source_of

ROWS = [row for section in read()["sections"] for row in section["rows"]]
ABSENT = (
    "shared_file", "uic519", "worn_on_uic60", "loaded_partial_slip", "one_pose_many_creepages", "contacts_files",
    "crossing_cases", "wheel_flat_cases",
)  # fmt: skip
"""What a test names that needs files which are not distributed."""


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["test"].rpartition("::")[2])
def test_named_tests_assert_what_the_page_says(row):
    source = source_of(row["test"])
    assert "assert" in source
    assert [piece for piece in row["code"] if piece not in source] == []
    assert bool(row.get("absent")) == any(name in source for name in ABSENT)


def test_what_is_said_to_be_reached_stands_in_a_report():
    pages = [ROOT / "README.md", *(path for path in (ROOT / "reports").glob("*.md") if path != PAGE)]
    text = " ".join(" ".join(path.read_text("utf-8").split()) for path in pages)
    quoted = [row["reached"] for row in ROWS if "reached" in row]
    assert len(quoted) > 5 and [quote for quote in quoted if quote not in text] == []


def test_the_page_is_that_of_the_table():
    assert PAGE.read_text("utf-8") == page(), "run: python -m docs.evidence"


def test_every_claim_is_complete_and_stands_once():
    assert len({row["claim"] for row in ROWS}) == len(ROWS) > 40
    assert all(row[key] for row in ROWS for key in ("claim", "against", "by", "asserted", "test"))


def test_a_test_that_is_gone_is_found():
    for name in ("contact/test_hertz.py::test_of_nothing", "contact/test_nothing.py::test"):
        with pytest.raises(LookupError):
            source_of(name)
