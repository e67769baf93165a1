"""Folder of a wear plan: its completed steps, and the digests of the files on which they depend."""

import hashlib
import io
import json

import pandas as pd

from wrcore.errors import InputError
from wrcore.errors.input_files import check_regular, digest_of_file
from wrcore.errors.new_files import appearing

TABLE, PLAN = "steps.csv", "plan.json"


def claim(folder, mark, plan):
    """Reserve a folder for the plan with the digest ``mark``, or refuse a folder of another plan."""
    if not any((folder / name).exists() for name in (PLAN, TABLE)):
        _write_plan(folder, {"digest": mark, "plan": plan, "files": {}})
    elif _read_plan(folder)["digest"] != mark:
        expected = "expected a folder of this plan, of the same input files and version, or an empty one; remove it"
        raise InputError(folder, "", expected)


def _read_plan(folder):
    path = folder / PLAN
    try:
        check_regular(path)
        plan = json.loads(path.read_text(encoding="utf-8"))
        return {"digest": str(plan["digest"]), "plan": plan["plan"], "files": dict(plan["files"])}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        expected = "expected the plan of this folder with the digests of its files; remove the folder to begin anew"
        raise InputError(path, "", expected) from None


def _write_plan(folder, plan):
    with appearing(folder / PLAN) as file:
        file.write(json.dumps(plan, indent=2, sort_keys=True).encode())


def rows_of(folder):
    """Return the rows of completed steps; InputError if a file differs from its digest."""
    path, files = folder / TABLE, _read_plan(folder)["files"]
    if not files:
        return []
    changed = "expected what an earlier step has written; it was changed since"
    try:
        check_regular(path)
        table = path.read_text(encoding="utf-8")
        before = table[: table.rfind("\n", 0, -1) + 1]  # the last row may be written, but not completed
        table = next(text for text in (table, before) if _digest(text) == files[TABLE])
        rows = pd.read_csv(io.StringIO(table)).to_dict("records")
    except (OSError, ValueError, KeyError, StopIteration):
        raise InputError(path, "", changed) from None
    for name, digest in files.items():
        if name != TABLE and digest_of_file(folder / name) != digest:
            raise InputError(folder / name, "", changed)
    return rows


def _digest(text):
    return hashlib.sha256(text.encode()).hexdigest()


def write_rows(folder, rows):
    """Write the table and complete its last row: store the digests of the files of its step and of the next step."""
    text, step, plan = pd.DataFrame(rows).to_csv(index=False, lineterminator="\n"), len(rows) - 1, _read_plan(folder)
    with appearing(folder / TABLE) as file:
        file.write(text.encode())
    new = [path for k in (step, step + 1) for path in sorted(folder.glob(f"*_{k:03d}.csv"))]
    plan["files"] |= {path.name: digest_of_file(path) for path in new if path.name not in plan["files"]}
    _write_plan(folder, plan | {"files": plan["files"] | {TABLE: _digest(text)}})
