"""One HTML page with all vehicle files: each value with the comment that states its source."""

import html
import re
from pathlib import Path

MARKS = ("RECALLED", "CHOSEN")
"""Words in a vehicle file's comments that mark a value without a published source."""

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Vehicle values and their sources</title>
<style>body {{font-family: sans-serif}} pre {{font-size: 13px; line-height: 1.35}} mark {{font-weight: bold}}</style>
</head><body>
<h1>Vehicle values and their sources</h1>
<p>SI units. {marks} stand where no published source confirms a value.</p>
{vehicles}
</body></html>
"""


def vehicle_page(paths):
    """Return an HTML page with the whole content of vehicle files; the words of `MARKS` are highlighted."""
    parts = []
    for path in map(Path, paths):
        text = html.escape(path.read_text(encoding="utf-8"), quote=False)
        text = re.sub(rf"\b({'|'.join(MARKS)})\b", r"<mark>\1</mark>", text)
        parts.append(f"<h2>{html.escape(path.name)}</h2>\n<pre>{text}</pre>")
    marks = " and ".join(f"<mark>{mark}</mark>" for mark in MARKS)
    return _PAGE.format(marks=marks, vehicles="\n".join(parts))
