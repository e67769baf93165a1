"""wrcore: wheel-rail contact in railway dynamics.

Axes and signs (everywhere in the package)::

            z up                        x  forward along the track
            |   x forward               y  to the left
            |  /                        z  up, zero in the plane of the canted rails' highest points
            | /
    y ------o                           roll, pitch, yaw: right-handed about x, y, z
    left

Profiles use a lateral coordinate u, positive to the field side on both wheels and both rails, and an ordinate f,
positive up; for a wheel f(u) = r0 - r(u) with r the radius and r0 that at the tape circle, where f is 0. ``left`` is
y > 0 and comes first in arrays over sides. Penetration is positive in contact. Creepages are velocities of the wheel
relative to the rail over the rolling speed; forces act on the wheel. Units are SI throughout.
"""

from importlib import import_module
from pathlib import Path

__version__ = "0.2.0"

_LINES = map(str.split, Path(__file__).with_suffix(".pyi").read_text("utf-8").splitlines())
_PUBLIC = {words[3]: words[1] for words in _LINES if words[:1] == ["from"]}
"""Public names and their modules, as the stub beside this file imports them."""

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> object:
    """Public names are loaded on first use, so that ``import wrcore`` costs nothing."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'wrcore' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
