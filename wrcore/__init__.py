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

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wrcore.analysis.assessment.assess import Assessment as Assessment
    from wrcore.analysis.assessment.assess import assess as assess
    from wrcore.analysis.assessment.wheels import creep_power as creep_power
    from wrcore.analysis.assessment.wheels import wear_number as wear_number
    from wrcore.analysis.assessment.wheels import wheel_forces as wheel_forces
    from wrcore.analysis.assessment.wheels import wheel_table as wheel_table
    from wrcore.analysis.assessment.wheels import wheelset_channels as wheelset_channels
    from wrcore.analysis.contact.contact import contact_table as contact_table
    from wrcore.analysis.contact.patch import patch as patch
    from wrcore.analysis.pictures.draw import draw as draw
    from wrcore.analysis.pictures.plot_contact import plot_pair as plot_pair
    from wrcore.analysis.pictures.plot_creep import plot_creep_force as plot_creep_force
    from wrcore.analysis.pictures.plot_patch import plot_wheel_on_rail as plot_wheel_on_rail
    from wrcore.analysis.pictures.plot_run import plot_run as plot_run
    from wrcore.analysis.stability.limit_cycles import Settling as Settling
    from wrcore.analysis.stability.limit_cycles import limit_cycles as limit_cycles
    from wrcore.analysis.stability.stability import critical_speeds as critical_speeds
    from wrcore.analysis.stability.stability import modes as modes
    from wrcore.analysis.to_accuracy import simulate_to_accuracy as simulate_to_accuracy
    from wrcore.analysis.wear.damage import damage_table as damage_table
    from wrcore.analysis.wear.damage import plot_shakedown as plot_shakedown
    from wrcore.analysis.wear.evolve import evolve as evolve
    from wrcore.analysis.wear.local_wear import WheelWear as WheelWear
    from wrcore.analysis.wear.local_wear import local_wear as local_wear
    from wrcore.contact.conicity import conicity_curve as conicity_curve
    from wrcore.contact.first_touch import first_touch as first_touch
    from wrcore.contact.patch.result import Patch as Patch
    from wrcore.contact.wheel_on_rail import WheelsetOnTrack as WheelsetOnTrack
    from wrcore.creep.cases import creep_force as creep_force
    from wrcore.creep.halfspace import RollingContact as RollingContact
    from wrcore.creep.table import CreepTable as CreepTable
    from wrcore.creep.table import ensure_table as ensure_table
    from wrcore.errors import InputError as InputError
    from wrcore.geometry.standards import list_profiles as list_profiles
    from wrcore.geometry.standards import named_profile as named_profile
    from wrcore.run.motion import hunting_frequency as hunting_frequency
    from wrcore.run.results import load_run as load_run
    from wrcore.run.results import load_runs as load_runs
    from wrcore.run.results import write_run as write_run
    from wrcore.run.run import Run as Run
    from wrcore.run.simulate import simulate as simulate
    from wrcore.run.simulate import simulate_many as simulate_many
    from wrcore.scene.description import Scene as Scene
    from wrcore.scene.description import load_scene as load_scene
    from wrcore.scene.examples import example as example
    from wrcore.sweep.batch import run_sweep as run_sweep
    from wrcore.sweep.plan import load_sweep as load_sweep

__version__ = "0.1.0"

_PUBLIC = {
    "Assessment": "wrcore.analysis.assessment.assess",
    "CreepTable": "wrcore.creep.table",
    "InputError": "wrcore.errors",
    "Patch": "wrcore.contact.patch.result",
    "RollingContact": "wrcore.creep.halfspace",
    "Run": "wrcore.run.run",
    "Scene": "wrcore.scene.description",
    "Settling": "wrcore.analysis.stability.limit_cycles",
    "WheelWear": "wrcore.analysis.wear.local_wear",
    "WheelsetOnTrack": "wrcore.contact.wheel_on_rail",
    "assess": "wrcore.analysis.assessment.assess",
    "conicity_curve": "wrcore.contact.conicity",
    "contact_table": "wrcore.analysis.contact.contact",
    "creep_force": "wrcore.creep.cases",
    "creep_power": "wrcore.analysis.assessment.wheels",
    "critical_speeds": "wrcore.analysis.stability.stability",
    "damage_table": "wrcore.analysis.wear.damage",
    "draw": "wrcore.analysis.pictures.draw",
    "ensure_table": "wrcore.creep.table",
    "evolve": "wrcore.analysis.wear.evolve",
    "example": "wrcore.scene.examples",
    "first_touch": "wrcore.contact.first_touch",
    "hunting_frequency": "wrcore.run.motion",
    "limit_cycles": "wrcore.analysis.stability.limit_cycles",
    "list_profiles": "wrcore.geometry.standards",
    "load_run": "wrcore.run.results",
    "load_runs": "wrcore.run.results",
    "load_scene": "wrcore.scene.description",
    "load_sweep": "wrcore.sweep.plan",
    "local_wear": "wrcore.analysis.wear.local_wear",
    "modes": "wrcore.analysis.stability.stability",
    "named_profile": "wrcore.geometry.standards",
    "patch": "wrcore.analysis.contact.patch",
    "plot_creep_force": "wrcore.analysis.pictures.plot_creep",
    "plot_pair": "wrcore.analysis.pictures.plot_contact",
    "plot_run": "wrcore.analysis.pictures.plot_run",
    "plot_shakedown": "wrcore.analysis.wear.damage",
    "plot_wheel_on_rail": "wrcore.analysis.pictures.plot_patch",
    "run_sweep": "wrcore.sweep.batch",
    "simulate": "wrcore.run.simulate",
    "simulate_many": "wrcore.run.simulate",
    "simulate_to_accuracy": "wrcore.analysis.to_accuracy",
    "wear_number": "wrcore.analysis.assessment.wheels",
    "wheel_forces": "wrcore.analysis.assessment.wheels",
    "wheel_table": "wrcore.analysis.assessment.wheels",
    "wheelset_channels": "wrcore.analysis.assessment.wheels",
    "write_run": "wrcore.run.results",
}
__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> object:
    """Public names are loaded on first use, so that ``import wrcore`` costs nothing."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'wrcore' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
