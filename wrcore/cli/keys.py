"""``wrcore keys``: list the keys of input files."""

import textwrap

from wrcore.errors import InputError, similar
from wrcore.errors.schema_keys import keys_of

KINDS = ("scene", "track", "vehicle", "sweep", "wear")

ABOUT = """
List the keys of a kind of file, each with its unit, what is expected there and its default; 'needed' marks those that
their mapping must have. '*' stands for any name, '[]' for the items of a list. 'track' is what a scene has
below the key track.
"""


def add(commands):
    command = commands.add_parser("keys", help="list the keys of scenes, vehicles, sweeps", description=ABOUT)
    command.add_argument("kind", choices=KINDS, help="kind of file")
    command.add_argument("below", nargs="?", metavar="key.path", help="only this key and those below it")
    command.set_defaults(run=run)


def run(options):
    every = keys_of(options.kind)
    if options.kind == "scene" and options.below:
        every = [*every, *((f"track.{path}", *rest) for path, *rest in keys_of("track"))]
    rows = [row for row in every if _is_below(row[0], options.below)]
    if not rows:
        known = {row[0] for row in every}
        raise InputError(
            "wrcore keys", options.below, f"expected a key of {options.kind}{similar(options.below, known)}"
        )
    for path, description, needed, default, unit in rows:
        remark = " (needed)" if needed else f" (default: {_yaml(default)})" if default is not None else ""
        print(f"{path} [{unit}]" if unit else path)
        print(textwrap.fill(description + remark, 100, initial_indent="    ", subsequent_indent="    "))
    return 0


def _is_below(path, key):
    return key is None or path == key or path.startswith((f"{key}.", f"{key}["))


def _yaml(value):
    """Return a default value in the form of YAML."""
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else value
