"""All kinds of force elements by name: every file beside this one is a kind and holds its `KIND`.

So is a module that an installed package names as an entry point of the group ``wrcore.elements``; these are looked for
when a vehicle has a kind that is none of the others.
"""

from importlib import import_module
from pkgutil import iter_modules

from wrcore.elements.law import LAWS

_MODULES = {
    name: import_module(f"{__name__}.{name}") for name in sorted(found.name for found in iter_modules(__path__))
}

KINDS = {name: module.KIND for name, module in _MODULES.items()}

GROUP = "wrcore.elements"
"""Of entry points."""


def kind_named(name):
    """The `KIND` of a name, or None; those of other packages join `KINDS` when the first of them is asked for."""
    if name not in KINDS:
        from importlib.metadata import entry_points  # reads what is installed: some ten milliseconds

        for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
            if entry.name not in KINDS:
                kind = entry.load().KIND
                KINDS[entry.name] = kind
                LAWS.extend(kind.laws)
    return KINDS.get(name)


LAWS.extend(law for kind in KINDS.values() for law in kind.laws)

SCHEMAS = [
    {
        "properties": {"kind": {"description": f"'{name}': {_MODULES[name].__doc__.splitlines()[0]}"}, **kind.keys},
        "required": kind.needed,
    }
    for name, kind in KINDS.items()
]
"""Of elements by kind: the keys beside those that all have."""
