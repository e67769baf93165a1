"""Compare numbers on pages with the study's tables from which they are quoted, or write them into the pages.

``python -m docs.quoted [FOLDER]`` prints each number of a page that differs from its table in the folder of
results (``results``), and ends with status 1 if there is one. ``--write`` writes the numbers of the tables into the
pages instead and keeps a copy of each table in ``reports/tables/`` (`make tables`).

``reports/quoted.yaml`` lists the sentences and tables. A sentence of a page is quoted verbatim with ``#`` for each
number. ``values`` lists the source of each number, in the order of the sentence. A value has the keys

``table``     path below the results; that of the sentence if omitted
``where``     values of columns that select the rows, or a query of pandas
``column``    column of the number; ``columns`` gives several numbers of one row
``of``        reduction of several rows: ``min``, ``max``, ``median``, ``sum``, ``count`` or ``first``
``best``      columns of groups; each group is reduced to the row with the maximum ``column``, before ``of``
``times``     factor to the printed unit
``over``      a value by which the number is divided
``size``      true: absolute value
``within``    accepted relative deviation of a number that depends on the machine; other numbers must agree to the
              printed digits
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

from docs import page_tables

ROOT = Path(__file__).resolve().parents[1]
SOURCE, KEPT = ROOT / "reports/quoted.yaml", ROOT / "reports/tables"
PACKAGE = {"accuracy/accuracy_front.csv": ROOT / "wrcore/run/accuracy_front.csv"}
"""Paths of the kept tables that are part of the package wrcore."""

NUMBER = r"([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)"
ROUNDING = 0.51
"""Accepted deviation of a printed number, in units of its last digit."""


class Difference(NamedTuple):
    """A number on a page that differs from its table."""

    page: str
    sentence: str
    printed: str
    found: float

    def __str__(self):
        return f"{self.page}: {self.sentence!r}: {self.printed} is printed, the table has {self.found:.6g}"


def read():
    """Return the content of ``reports/quoted.yaml``: ``sentences`` and ``tables``."""
    return yaml.safe_load(SOURCE.read_text("utf-8"))


def kept_path(table):
    """Return the path of the kept copy of a table of the study."""
    return PACKAGE.get(table, KEPT / table)


def tables_of(entry):
    """Return the paths, below the results, of all tables that an entry of the list reads."""
    if "make" in entry:
        return list(page_tables.TABLES[entry["make"]].reads)
    found = []
    for value in entry["values"]:
        found += [value.get("table", entry.get("table"))]
        if "over" in value:
            found += [value["over"].get("table", found[-1])]
    return list(dict.fromkeys(found))


def numbers(value, entry, load):
    """Return the numbers for one value of a sentence; ``load`` returns a table by its path."""
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
    """Return the unit of the last significant digit of a printed number.

    Zeros at the end of a whole number are not significant."""
    mantissa, _, exponent = printed.lstrip("+-").partition("e")
    _, point, decimals = mantissa.partition(".")
    zeros = 0 if point else len(mantissa) - len(mantissa.rstrip("0")) if mantissa.strip("0") else 0
    return 10.0 ** (int(exponent or 0) - len(decimals) + zeros)


def as_printed(number, printed):
    """Return a number rounded to the last digit of a printed one, or to two digits if it is smaller than that."""
    unit = last_digit(printed)
    if abs(number) < unit and number != 0.0:
        return f"{float(f'{number:.2g}'):f}".rstrip("0").rstrip(".")
    decimals = len(printed.partition("e")[0].partition(".")[2])
    if "e" in printed:
        return f"{number:.{decimals}e}".replace("e-0", "e-").replace("e+0", "e+")
    return f"{round(number / unit) * unit:.{decimals}f}"


def pattern(sentence):
    """Return the regular expression of a sentence with ``#`` for numbers; all white space is equivalent."""
    pieces = [r"\s+".join(map(re.escape, re.split(r"\s+", piece))) for piece in sentence.split("#")]
    return re.compile(NUMBER.join(pieces))


def place(entry, text):
    """Return the match of an entry's sentence in the text of its page; LookupError unless it occurs exactly once."""
    found = list(pattern(entry["says"]).finditer(text))
    if len(found) != 1:
        raise LookupError(f"{entry['page']}: {entry['says']!r} stands {len(found)} times")
    return found[0]


def sentence_values(entry, load):
    """Return number and accepted relative deviation (None: to the printed digits) for each ``#`` of a sentence."""
    pairs = []
    for value in entry["values"]:
        within = value.get("within", entry.get("within"))
        pairs += [(number, within) for number in numbers(value, entry, load)]
    if len(pairs) != entry["says"].count("#"):
        raise LookupError(f"{entry['page']}: {entry['says']!r}: {len(pairs)} values")
    return pairs


def agrees(printed, found, within):
    """Whether a printed number agrees with the number from a table."""
    if not np.isfinite(found):
        return False
    deviation = abs(float(printed) - found)
    return deviation <= ROUNDING * last_digit(printed) or (within is not None and deviation <= within * abs(found))


def block(text, head):
    """Return begin and end of the Markdown table with this head in a text; LookupError unless it occurs once."""
    found = [match.start() for match in re.finditer(rf"^{re.escape(head)}$", text, re.MULTILINE)]
    if len(found) != 1:
        raise LookupError(f"table {head!r} stands {len(found)} times")
    end = re.compile(r"^(?!\|)", re.MULTILINE).search(text, found[0]).start()
    return found[0], end


def differences(entry, load, text):
    """Return the differences between the text of an entry's page and the tables from ``load``.

    In whole tables, numbers that depend on the machine may deviate by `PageTable.within`.
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
    """Return the text of a page with the numbers of the tables inserted."""
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
    """Return all entries of the list, sentences and tables."""
    content = read()
    return [*content["sentences"], *content["tables"]]


def loader(path_of):
    """Return a function that reads a table by its path below the results; FileNotFoundError if there is no file."""
    read_before = {}

    def load(table):
        if table not in read_before:
            read_before[table] = pd.read_csv(path_of(table))
        return read_before[table]

    return load


def compare(path_of, progress=print):
    """Print and return all differences of all pages, and return the number of entries without a table."""
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
    """Copy the quoted tables of a folder of results to the kept tables, and write their numbers into the pages."""
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
    """Run the command and return its exit status."""
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
