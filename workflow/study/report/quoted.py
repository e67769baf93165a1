"""Numbers that pages quote from tables of the study: compared with the tables, or written into the pages.

``python -m study.report.quoted [FOLDER]`` prints each number of a page that differs from its table in the folder of
results (``results``), and ends with status 1 if there is one. ``--write`` writes the numbers of the tables into the
pages instead and keeps a copy of each table in ``reports/tables/`` (`make tables`).

``reports/quoted.yaml`` lists the sentences and tables. A sentence of a page is given word by word with ``#`` for each
number; ``values`` says in order where each number stands. A value has the keys

``table``     path below the results; that of the sentence if left out
``where``     values of columns that choose the rows, or a query of pandas
``column``    column of the number; ``columns`` gives several numbers of one row
``of``        what of several rows: ``min``, ``max``, ``median``, ``sum``, ``count`` or ``first``
``best``      columns: of each group the row with the largest ``column`` counts before ``of``
``times``     factor to the printed unit
``over``      a value by which the number is divided
``size``      true: without its sign
``within``    accepted relative deviation of a number that depends on the machine; others agree as far as they are
              printed
"""

import argparse
import re
import shutil
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import yaml

from study.report import page_tables

ROOT = Path(__file__).resolve().parents[3]
SOURCE, KEPT = ROOT / "reports/quoted.yaml", ROOT / "reports/tables"
PACKAGE = {"accuracy/accuracy_front.csv": ROOT / "wrcore/run/accuracy_front.csv"}
"""Kept tables that the package carries."""

NUMBER = r"([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)"
ROUNDING = 0.51
"""Accepted deviation of a printed number, units of its last digit."""


class Difference(NamedTuple):
    """A number of a page that is not that of its table."""

    page: str
    sentence: str
    printed: str
    found: float

    def __str__(self):
        return f"{self.page}: {self.sentence!r}: {self.printed} is printed, the table has {self.found:.6g}"


def read():
    """Content of the list: ``sentences`` and ``tables``."""
    return yaml.safe_load(SOURCE.read_text("utf-8"))


def kept_path(table):
    """Where the copy of a table of the study is kept."""
    return PACKAGE.get(table, KEPT / table)


def tables_of(entry):
    """Paths, below the results, of all tables that an entry of the list reads."""
    if "make" in entry:
        return list(page_tables.TABLES[entry["make"]].reads)
    found = []
    for value in entry["values"]:
        found += [value.get("table", entry.get("table"))]
        if "over" in value:
            found += [value["over"].get("table", found[-1])]
    return list(dict.fromkeys(found))


def numbers(value, entry, load):
    """Numbers of a value of a sentence; ``load`` returns a table by its path."""
    path = value.get("table", entry.get("table"))
    rows, where = load(path), value.get("where", {})
    if isinstance(where, str):
        rows = rows.query(where)
    else:
        for name, wanted in where.items():
            here = rows[name]
            rows = rows[np.isclose(here, wanted) if isinstance(wanted, float) else here == wanted]
    columns = value.get("columns") or [value["column"]]
    if not len(rows):
        raise LookupError(f"{path}: no row with {where}")
    if "best" in value:
        rows = rows.loc[rows.groupby(value["best"])[columns[0]].idxmax()]
    if "of" not in value and len(rows) > 1:
        raise LookupError(f"{path}: {len(rows)} rows with {where}, expected one or a key `of`")
    found = rows[columns].agg(value["of"]) if value.get("of", "first") != "first" else rows[columns].iloc[0]
    result = [float(x) * value.get("times", 1.0) for x in found]
    result = [abs(x) for x in result] if value.get("size") else result
    if "over" in value:
        (divisor,) = numbers({"table": path} | value["over"], entry, load)
        result = [x / divisor for x in result]
    return result


def last_digit(printed):
    """Unit of the last digit of a printed number; zeros at the end of a whole number are not digits."""
    mantissa, _, exponent = printed.lstrip("+-").partition("e")
    _, point, decimals = mantissa.partition(".")
    zeros = 0 if point else len(mantissa) - len(mantissa.rstrip("0")) if mantissa.strip("0") else 0
    return 10.0 ** (int(exponent or 0) - len(decimals) + zeros)


def as_printed(number, printed):
    """A number with the last digit of a printed one, or with two digits where that would leave none."""
    unit = last_digit(printed)
    if abs(number) < unit and number != 0.0:
        return f"{float(f'{number:.2g}'):f}".rstrip("0").rstrip(".")
    decimals = len(printed.partition("e")[0].partition(".")[2])
    if "e" in printed:
        return f"{number:.{decimals}e}".replace("e-0", "e-").replace("e+0", "e+")
    return f"{round(number / unit) * unit:.{decimals}f}"


def pattern(sentence):
    """Regular expression of a sentence with ``#`` for numbers; any white space stands for any other."""
    pieces = [r"\s+".join(map(re.escape, re.split(r"\s+", piece))) for piece in sentence.split("#")]
    return re.compile(NUMBER.join(pieces))


def place(entry, text):
    """Match of the sentence of an entry in the text of its page; LookupError if it does not stand there once."""
    found = list(pattern(entry["says"]).finditer(text))
    if len(found) != 1:
        raise LookupError(f"{entry['page']}: {entry['says']!r} stands {len(found)} times")
    return found[0]


def sentence_values(entry, load):
    """Number and accepted relative deviation (None: as printed) for each ``#`` of a sentence."""
    pairs = []
    for value in entry["values"]:
        within = value.get("within", entry.get("within"))
        pairs += [(number, within) for number in numbers(value, entry, load)]
    if len(pairs) != entry["says"].count("#"):
        raise LookupError(f"{entry['page']}: {entry['says']!r}: {len(pairs)} values")
    return pairs


def agrees(printed, found, within):
    """Whether a printed number is that of a table."""
    if not np.isfinite(found):
        return False
    deviation = abs(float(printed) - found)
    return deviation <= ROUNDING * last_digit(printed) or (within is not None and deviation <= within * abs(found))


def block(text, head):
    """Beginning and end of the Markdown table with a head in a text; LookupError if it is not there once."""
    found = [match.start() for match in re.finditer(rf"^{re.escape(head)}$", text, re.MULTILINE)]
    if len(found) != 1:
        raise LookupError(f"table {head!r} stands {len(found)} times")
    end = re.compile(r"^(?!\|)", re.MULTILINE).search(text, found[0]).start()
    return found[0], end


def differences(entry, load, text):
    """Differences of an entry of the list between the text of its page and the tables of ``load``.

    Numbers of whole tables that depend on the machine (`PageTable.within`) are compared within that band.
    """
    if "make" not in entry:
        match, name = place(entry, text), entry["says"]
        pairs = zip(match.groups(), sentence_values(entry, load), strict=True)
        return [Difference(entry["page"], name, p, x) for p, (x, within) in pairs if not agrees(p, x, within)]
    table = page_tables.TABLES[entry["make"]]
    made = table.make(load)
    begin, end = block(text, made.splitlines()[0])
    old, new = text[begin:end].strip().splitlines(), made.strip().splitlines()
    if len(old) != len(new):
        return [Difference(entry["page"], made.splitlines()[0], f"{len(old) - 2} rows", len(new) - 2)]
    found, heads = [], [head.strip() for head in new[0].strip("|").split("|")]
    for mine, theirs in zip(old, new, strict=True):
        cells = zip(heads, mine.strip("|").split("|"), theirs.strip("|").split("|"), strict=True)
        for head, here, there in cells:
            within = table.within.get(head)
            parts = [re.sub(NUMBER, "#", cell).strip() for cell in (here, there)]
            pairs = list(zip(re.findall(NUMBER, here), re.findall(NUMBER, there), strict=False))
            same = parts[0] == parts[1] and all(agrees(p, float(x), within) for p, x in pairs)
            if not same and not (parts[0] != parts[1] and table.chosen):
                found.append(
                    Difference(entry["page"], f"{head} of {mine}", here.strip(), float((pairs or [(0, "nan")])[0][1]))
                )
    return found


def written(entry, load, text):
    """Text of a page with the numbers of the tables."""
    if "make" in entry:
        made = page_tables.TABLES[entry["make"]].make(load)
        begin, end = block(text, made.splitlines()[0])
        return text[:begin] + made.rstrip("\n") + "\n" + text[end:]
    match, parts, at = place(entry, text), [], 0
    for k, (number, _) in enumerate(sentence_values(entry, load), 1):
        parts += [text[at : match.start(k)], as_printed(number, match[k])]
        at = match.end(k)
    return "".join(parts) + text[at:]


def entries():
    """All entries of the list."""
    content = read()
    return [*content["sentences"], *content["tables"]]


def loader(path_of):
    """Function that reads a table by its path below the results; FileNotFoundError if it is not there."""
    read_before = {}

    def load(table):
        if table not in read_before:
            read_before[table] = pd.read_csv(path_of(table))
        return read_before[table]

    return load


def compare(path_of, progress=print):
    """All differences of all pages, and how many entries had no table; prints them."""
    load, found, absent = loader(path_of), [], 0
    for entry in entries():
        text = (ROOT / entry["page"]).read_text("utf-8")
        try:
            found += differences(entry, load, text)
        except FileNotFoundError:
            absent += 1
    for difference in found:
        progress(str(difference))
    return found, absent


def write(results):
    """Keep the tables of a folder of results that pages quote, and write their numbers into the pages."""
    for entry in entries():
        for table in tables_of(entry):
            source, target = Path(results) / table, kept_path(table)
            if source.is_file():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
    load = loader(kept_path)
    for entry in entries():
        if all(kept_path(table).is_file() for table in tables_of(entry)):
            page = ROOT / entry["page"]
            page.write_text(written(entry, load, page.read_text("utf-8")), "utf-8")


def main(arguments=None):
    """Command line; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", nargs="?", default="results", help="folder of the study's results")
    parser.add_argument("--write", action="store_true", help="write the numbers into the pages and keep the tables")
    options = parser.parse_args(arguments)
    if options.write:
        write(options.results)
        return 0
    found, absent = compare(lambda table: Path(options.results) / table)
    print(f"{len(entries())} sentences and tables: {len(found)} differences, {absent} without their table")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
