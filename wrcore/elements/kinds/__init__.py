"""All kinds of force elements by name: every file beside this one is a kind and holds its `KIND`.

So is a module that an installed package names as an entry point of the group ``wrcore.elements``; these are looked for
when a vehicle has a kind that is none of the others.
"""

from importlib import import_module
from pkgutil import iter_modules

from wrcore.elements.kind import Kind
from wrcore.elements.law import LAWS
from wrcore.errors import InputError

_MODULES = {
    name: import_module(f"{__name__}.{name}") for name in sorted(found.name for found in iter_modules(__path__))
}

KINDS = {name: module.KIND for name, module in _MODULES.items()}

GROUP = "wrcore.elements"
"""Of entry points."""


def kind_named(name):
    """The `KIND` of a name, or None; those of other packages join `KINDS` when the first of them is asked for. An
    InputError without a source where the package of this very kind cannot be loaded; others are left out then."""
    if name not in KINDS:
        from importlib.metadata import entry_points  # reads what is installed: some ten milliseconds

        for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
            if entry.name not in KINDS:
                kind, fault = _loaded(entry)
                if kind is not None:
                    KINDS[entry.name] = kind
                    LAWS.extend(kind.laws)
                elif entry.name == name:
                    raise InputError("", "", f"expected a module with a KIND as the entry point {entry.value}: {fault}")
    return KINDS.get(name)


def _loaded(entry):
    """The `KIND` that an entry point names, or None, and why."""
    try:
        kind = entry.load().KIND
    except (Exception, SystemExit) as error:  # whatever the other package does
        return None, f"{type(error).__name__}: {error}"
    return (kind, "") if isinstance(kind, Kind) else (None, f"its KIND is a {type(kind).__name__}")


LAWS.extend(law for kind in KINDS.values() for law in kind.laws)

SCHEMAS = [
    {
        "properties": {"kind": {"description": f"'{name}': {_MODULES[name].__doc__.splitlines()[0]}"}, **kind.keys},
        "required": kind.needed,
    }
    for name, kind in KINDS.items()
]
"""Of elements by kind: the keys beside those that all have."""
