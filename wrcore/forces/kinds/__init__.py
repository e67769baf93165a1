"""All kinds of force elements by name: each module of this folder describes one kind in its `KIND`.

Installed packages add kinds: their modules are entry points of the group ``wrcore.elements``. wrcore loads such a
module when a vehicle has a kind of that name.
"""

from importlib import import_module
from pkgutil import iter_modules

from wrcore.errors import InputError
from wrcore.forces.kind import Kind
from wrcore.forces.law import LAWS
from wrcore.kernels.named_laws import entry_named, loaded, present_laws

_MODULES = {
    name: import_module(f"{__name__}.{name}") for name in sorted(found.name for found in iter_modules(__path__))
}

KINDS = {name: module.KIND for name, module in _MODULES.items()}

GROUP = "wrcore.elements"
"""Group of the entry points of kinds in other packages."""


_EXPECTED = "expected a module with a KIND as the entry point"


def kind_named(name):
    """Return the `KIND` of a name, or None if there is no such kind.

    A kind of another package is added to `KINDS` at its first use. An InputError without a source is raised for an
    entry point that holds no kind."""
    if name not in KINDS:
        entry = entry_named(GROUP, name, present_laws().trusted)
        if entry is None:
            return None
        try:
            kind = loaded(entry, GROUP).KIND
        except (InputError, AttributeError) as error:
            raise InputError("", "", f"{_EXPECTED} {entry.value}: {getattr(error, 'expected', error)}") from None
        if not isinstance(kind, Kind):
            raise InputError("", "", f"{_EXPECTED} {entry.value}: its KIND is a {type(kind).__name__}")
        KINDS[name] = kind
        LAWS.extend(kind.laws)
    return KINDS[name]


LAWS.extend(law for kind in KINDS.values() for law in kind.laws)

SCHEMAS = [
    {
        "properties": {"kind": {"description": f"'{name}': {_MODULES[name].__doc__.splitlines()[0]}"}, **kind.keys},
        "required": kind.needed,
    }
    for name, kind in KINDS.items()
]
"""JSON schemas of the kinds: the keys in addition to those of all elements."""
