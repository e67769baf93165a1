"""The table of a run's counters in reports/how_runs_end.md, from `wrcore.run.checks.validity`.

``python -m docs.counters`` writes it into the page.
"""

from docs.page_tables import markdown
from docs.quoted import ROOT, block
from wrcore.run.checks.validity import LOOK_UP_ERRORS, MEANINGS
from wrcore.run.simulation import COUNTERS

PAGE = ROOT / "reports/how_runs_end.md"


def counted(name):
    """Return the part of a run in which a counter is counted, as the table shows it."""
    if name in LOOK_UP_ERRORS:
        return "output times, with `tabulated`"
    return "integration" if name in COUNTERS else "output times"


def counters_table():
    """Return the table of all counters in Markdown: name, part of the run, and meaning."""
    heads = ["counter", "from", "what it counts or measures"]
    return markdown(heads, [[f"`{name}`", counted(name), text] for name, text in MEANINGS.items()])


if __name__ == "__main__":
    text, made = PAGE.read_text("utf-8"), counters_table()
    begin, end = block(text, made.splitlines()[0])
    PAGE.write_text(text[:begin] + made + "\n" + text[end:], "utf-8")
