"""Use of the study's creep table in wear plans."""

import os

from study.creep_table import reads_default_table
from wrcore.analysis.wear.evolve import load_wear_plan


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
