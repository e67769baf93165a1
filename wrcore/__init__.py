"""wrcore: wheel-rail contact in railway dynamics.

Axes and signs (everywhere in the package)::

            z up                        x  forward along the track
            |   x forward               y  to the left
            |  /                        z  up, zero in the plane of the canted rails' highest points
            | /
    y ------o                           roll, pitch, yaw: right-handed about x, y, z
    left

Profiles use a lateral coordinate u, positive to the field side on both wheels and both rails, and an ordinate f,
positive up; for a wheel f(u) = -r(u) with r the rolling radius. ``left`` is y > 0 and comes first in arrays over
sides. Penetration is positive in contact. Creepages are velocities of the wheel relative to the rail over the
rolling speed; forces act on the wheel. Units are SI throughout.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wrcore.creep.halfspace import RollingContact as RollingContact
    from wrcore.creep.table import ensure_table as ensure_table
    from wrcore.errors import InputError as InputError
    from wrcore.geometry.standards import list_profiles as list_profiles
    from wrcore.geometry.standards import named_profile as named_profile
    from wrcore.results import load_run as load_run
    from wrcore.results import load_runs as load_runs
    from wrcore.results import write_run as write_run
    from wrcore.run import Run as Run
    from wrcore.scene import Scene as Scene
    from wrcore.scene import load_scene as load_scene
    from wrcore.simulate import simulate as simulate
    from wrcore.simulate import simulate_many as simulate_many
    from wrcore.sweep_batch import run_sweep as run_sweep
    from wrcore.sweep_plan import load_sweep as load_sweep

__version__ = "0.1.0"

_PUBLIC = {
    "InputError": "wrcore.errors",
    "RollingContact": "wrcore.creep.halfspace",
    "Run": "wrcore.run",
    "Scene": "wrcore.scene",
    "ensure_table": "wrcore.creep.table",
    "list_profiles": "wrcore.geometry.standards",
    "load_run": "wrcore.results",
    "load_runs": "wrcore.results",
    "load_scene": "wrcore.scene",
    "load_sweep": "wrcore.sweep_plan",
    "named_profile": "wrcore.geometry.standards",
    "run_sweep": "wrcore.sweep_batch",
    "simulate": "wrcore.simulate",
    "simulate_many": "wrcore.simulate",
    "write_run": "wrcore.results",
}
__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> object:
    """Public names are loaded on first use, so that ``import wrcore`` costs nothing."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'wrcore' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)


class _Package(ModuleType):
    """``wrcore.simulate`` is the function, also once the file ``simulate.py`` has been imported."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _PUBLIC and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
