"""Read the parts of a report that tests compare: tags, attributes, and the numbers of its tables."""

from html.parser import HTMLParser


class Parts(HTMLParser):
    """Tags and attributes of a page, and the numbers of each table row that has a name (``data-row``)."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.attributes, self.rows, self.links, self.sections = set(), set(), {}, [], []
        self.title, self._row, self._inside = "", None, []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.tags.add(tag)
        self.attributes |= given.keys()
        self.links += [value for name, value in attributes if name in ("href", "src", "xlink:href", "srcset", "data")]
        if tag == "section":
            self.sections.append(given["id"])
        if tag in ("tr", "div") and "data-row" in given:
            self._row = self.rows.setdefault(given["data-row"], [])
        elif tag == "tr" and self._row is not self.rows.get("contact_errors"):
            self._row = None
        if tag == "data" and self._row is not None:
            self._row.append(float(given["value"]))
        self._inside.append(tag)

    def handle_data(self, data):
        if self._inside and self._inside[-1] == "title":
            self.title += data

    def handle_endtag(self, tag):
        if self._inside:
            self._inside.pop()


HARMLESS = {
    "a", "body", "caption", "clippath", "data", "defs", "div", "figcaption", "figure", "footer", "g", "h1", "h2", "h3",
    "head", "header", "html", "li", "line", "main", "meta", "nav", "p", "path", "rect", "section", "small", "span",
    "strong", "style", "svg", "table", "tbody", "td", "text", "th", "thead", "title", "tr", "ul", "use",
}  # fmt: skip
"""Tags that a report may have: none of them executes or loads anything."""
