"""Parts of an HTML page: escaped texts, numbers, tables, figures and the page around them.

Every text is escaped unless it is `Markup`. A number is an element ``data`` whose attribute ``value`` is the number in
SI units.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from typing import NamedTuple

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
"""Content security policy of a page: browsers execute no script and load nothing from elsewhere."""


LONG = 24
"""Number of rows above which a table may be printed on several pages."""


class Markup(str):
    """Text that is HTML already."""


def html(value: object) -> Markup:
    """Return a value as HTML: `Markup` unchanged, any other value as escaped text."""
    return value if isinstance(value, Markup) else Markup(escape(str(value)))


def join(parts: Iterable[object], between: str = "") -> Markup:
    """Return parts as HTML, one after the other."""
    return Markup(between.join(map(html, parts)))


def element(name: str, *content: object, **attributes: object) -> Markup:
    """Return an HTML element; attributes that are None are omitted, ``class_`` and ``data_row`` become ``class`` and
    ``data-row``."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{name}{written}>{join(content)}</{name}>")


def number(value: float, factor: float = 1.0, digits: int = 3) -> Markup:
    """Return a number in SI units as HTML, printed with a factor and a number of significant digits; a count, which is
    an int, with all digits; NaN as a dash."""
    if isinstance(value, int) and factor == 1.0:
        return element("data", value, value=repr(value))
    value = float(value)
    if math.isnan(value):
        return Markup('<span class="none">–</span>')
    return element("data", figures(factor * value, digits), value=repr(value))


def figures(value: float, digits: int = 3) -> str:
    """Return a number with some significant digits; a large one without exponent, a very small one as a power of 10.

    Examples
    --------
    >>> figures(54612.3), figures(0.00123456), figures(-2.5e-9), figures(0.0), figures(100.0)
    ('54612', '0.00123', '−2.5·10⁻⁹', '0', '100')
    """
    if not math.isfinite(value):
        return "∞" if value > 0.0 else "−∞" if value < 0.0 else "–"
    if value == 0.0:
        return "0"
    power = math.floor(math.log10(abs(value)))
    if power < -5 or power > 8:
        mantissa = f"{value / 10.0**power:.{digits - 1}f}".rstrip("0").rstrip(".")
        return f"{mantissa.replace('-', '−')}·10{raised(power)}"
    return f"{value:.{max(digits - 1 - power, 0)}f}".replace("-", "−")


def raised(power: int) -> str:
    """Return an exponent as text."""
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


class Row(NamedTuple):
    """A row of a table of quantities: a number or text for each run."""

    key: str
    """Name of the row for programs (attribute ``data-row``)."""
    name: str
    definition: str
    unit: str
    factor: float
    """Factor from SI to the printed unit."""
    values: Sequence[object]
    """Numbers in SI units, or texts."""


def quantities(rows: Sequence[Row], labels: Sequence[object], title: str = "quantity") -> Markup:
    """Return a table with a row for each quantity and a column for each run; empty without rows."""
    if not rows:
        return Markup("")
    has_units = any(row.unit for row in rows)
    texts = not any(isinstance(value, int | float) for row in rows for value in row.values)
    heads = [element("th", title, scope="col"), *(element("th", label, scope="col", class_="run") for label in labels)]
    heads += [element("th", "unit", scope="col", class_="unit")] if has_units else []
    lines = []
    for row in rows:
        about = element("small", row.definition) if row.definition else ""
        cells = [element("th", element("div", element("span", row.name), about, class_="named"), scope="row")]
        cells += [
            element("td", number(value, row.factor) if isinstance(value, int | float) else value, class_="run")
            for value in row.values
        ]
        cells += [element("td", row.unit, class_="unit")] if has_units else []
        differs = "differs" if texts and len({str(value) for value in row.values}) > 1 else None
        lines.append(element("tr", *cells, data_row=row.key, class_=differs))
    head, body = element("thead", element("tr", *heads)), element("tbody", *lines)
    several = " several" if len(labels) > 1 else ""
    return element("table", head, body, class_=f"quantities {'texts' if texts else 'values'}{several}")


def table(heads: Sequence[object], rows: Iterable[Sequence[object]], caption: object = "", texts: int = 1) -> Markup:
    """Return a table whose first columns (``texts``) are texts, and the others numbers."""
    lines = [element("tr", *(element("th", head, scope="col") for head in heads))]
    body = [
        element("tr", *(element("td", cell, class_="text" if at < texts else None) for at, cell in enumerate(row)))
        for row in rows
    ]
    title = element("caption", caption) if caption else ""
    long = " long" if len(body) > LONG else ""
    return element("table", title, element("thead", *lines), element("tbody", *body), class_=f"numbers{long}")


def figure(picture: Markup, caption: object, wide: bool = False) -> Markup:
    """Return a figure with its caption."""
    return element("figure", picture, element("figcaption", caption), class_="wide" if wide else None)


def grid(parts: Iterable[object], columns: str = "") -> Markup:
    """Return parts in up to three columns, as the page has room, or in up to two (``"two"``); empty without parts."""
    parts = [part for part in parts if part]
    return element("div", *parts, class_=f"grid {columns}".strip()) if parts else Markup("")


def paragraph(*content: object, class_: str | None = None) -> Markup:
    """Return a paragraph."""
    return element("p", *content, class_=class_)


def page(title: str, header: Markup, sections: Sequence[tuple[str, str, Markup]], footer: Markup) -> str:
    """Return a whole page from its sections (anchor, title, content)."""
    style = files("wrcore.reporting").joinpath("style.css").read_text("utf-8")
    links = [element("a", name, href=f"#{anchor}") for anchor, name, _ in sections]
    parts = [element("section", element("h2", name), content, id=anchor) for anchor, name, content in sections]
    body = join([header, element("nav", *links), element("main", *parts), footer], "\n")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{escape(POLICY)}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )
