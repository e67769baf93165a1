"""The study's creep table, for wear plans."""

import os

from study.creep_table import reads_default_table
from wrcore.analysis.wear.evolve import load_wear_plan


def plan_with_creep_table(plan, changes, table):
    """Changes of a wear plan, and ``contact.creep.table`` in scenes whose contact reads a table of default planes and
    tolerance.
    """
    data, scenes = load_wear_plan(plan, changes)
    given = {"contact.creep.table": os.path.abspath(table)}
    parts = [
        part | {"set": part["set"] | given} if reads_default_table(scene.data["contact"]) else part
        for part, scene in zip(data["scenes"], scenes, strict=True)
    ]
    return {**changes, "scenes": parts}
