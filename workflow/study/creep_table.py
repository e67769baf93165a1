"""The study's creep table, for scenes whose contact reads one."""

import os

from wrcore.contact.search.reduction import REDUCTIONS
from wrcore.creep.table import DEFAULT_TOLERANCE
from wrcore.scene.description import load_scene


def reads_default_table(contact):
    """Whether the contact of a scene reads a creep table of the default planes and tolerance, and names no other."""
    creep = contact["creep"]
    wanted = {"model": "table", "planes": "ellipse", "tolerance": DEFAULT_TOLERANCE}
    is_default = all(creep[key] == value for key, value in wanted.items())
    return contact["patch"] in REDUCTIONS and is_default and "table" not in creep


def with_creep_table(source, changes, table):
    """Changes of a scene, and ``contact.creep.table`` where its contact reads a table of the default planes and
    tolerance. ``changes`` are a list of ``key=value`` or values by key; a scene names files relative to its folder.
    """
    if not reads_default_table(load_scene(source, changes).data["contact"]):
        return changes
    path = os.path.relpath(table, os.path.dirname(source))
    if isinstance(changes, dict):
        return {**changes, "contact.creep.table": path}
    return [*changes, f"contact.creep.table={path}"]
