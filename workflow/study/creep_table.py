"""The study's creep table, for scenes whose contact reads one."""

import os

from wrcore.contact.reduction import REDUCTIONS
from wrcore.creep.table import DEFAULT_TOLERANCE
from wrcore.scene.description import load_scene


def with_creep_table(source, changes, table):
    """Changes of a scene, and ``contact.creep.table`` where its contact reads a table of the default planes and
    tolerance. ``changes`` are a list of ``key=value`` or values by key; a scene names files relative to its folder.
    """
    contact = load_scene(source, changes).data["contact"]
    creep, path = contact["creep"], os.path.relpath(table, os.path.dirname(source))
    wanted = {"model": "table", "planes": "ellipse", "tolerance": DEFAULT_TOLERANCE}
    if contact["patch"] not in REDUCTIONS or any(creep[key] != value for key, value in wanted.items()):
        return changes
    if isinstance(changes, dict):
        return {**changes, "contact.creep.table": path}
    return [*changes, f"contact.creep.table={path}"]
