"""All kinds of force elements by name: every file beside this one is a kind and holds its `KIND`."""

from importlib import import_module
from pkgutil import iter_modules

from wrcore.elements.law import LAWS

_MODULES = {
    name: import_module(f"{__name__}.{name}") for name in sorted(found.name for found in iter_modules(__path__))
}

KINDS = {name: module.KIND for name, module in _MODULES.items()}

LAWS.extend(law for kind in KINDS.values() for law in kind.laws)

SCHEMAS = [
    {
        "properties": {"kind": {"description": f"'{name}': {_MODULES[name].__doc__.splitlines()[0]}"}, **kind.keys},
        "required": kind.needed,
    }
    for name, kind in KINDS.items()
]
"""Of elements by kind: the keys beside those that all have."""
