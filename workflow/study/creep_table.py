"""Use of the study's creep table in scenes whose contact reads a creep table."""

import os

from wrcore.analysis.wear.evolve import load_wear_plan
from wrcore.contact.search.reduction import REDUCTIONS
from wrcore.creep.table import DEFAULT_TOLERANCE
from wrcore.scene.description import load_scene


def reads_default_table(contact):
    """Whether the contact of a scene reads a creep table with default planes and tolerance and names no file for it."""
    creep = contact["creep"]
    wanted = {"model": "table", "planes": "ellipse", "tolerance": DEFAULT_TOLERANCE}
    is_default = all(creep[key] == value for key, value in wanted.items())
    return contact["patch"] in REDUCTIONS and is_default and "table" not in creep


def with_creep_table(source, changes, table):
    """Return the changes of a scene, with ``contact.creep.table`` added if its contact reads a default creep table.

    A default creep table has the default planes and tolerance. ``changes`` are a list of ``key=value`` or values by
    key. Paths in a scene are relative to its folder.
    """
    if not reads_default_table(load_scene(source, changes).data["contact"]):
        return changes
    path = os.path.relpath(table, os.path.dirname(source))
    if isinstance(changes, dict):
        return {**changes, "contact.creep.table": path}
    return [*changes, f"contact.creep.table={path}"]


def plan_with_creep_table(plan, changes, table):
    """Return the changes of a wear plan, with ``contact.creep.table`` added in scenes that read a default creep table.

    A default creep table has the default planes and tolerance.
    """
    data, scenes = load_wear_plan(plan, changes)
    given = {"contact.creep.table": os.path.abspath(table)}
    parts = [
        part | {"set": part["set"] | given} if reads_default_table(scene.data["contact"]) else part
        for part, scene in zip(data["scenes"], scenes, strict=True)
    ]
    return {**changes, "scenes": parts}
