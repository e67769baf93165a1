"""What a patch costs: one evaluation of the equations of motion with each patch model at the states of one run."""

import numpy as np
import pandas as pd

from study.cost.recorded import evaluation, record
from study.cost.timing import QUARTILES, take_turns
from wrcore.equations.equations_of_motion import Equations
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene


def patches_per_evaluation(recorded):
    """Mean number of patches of all wheels at the states."""
    equations, counts = Equations(recorded.model), []
    for state in recorded.states:
        equations(0.0, state)
        counts.append(equations.work.counts.sum())
    return float(np.mean(counts))


def patch_costs(source, overrides, models, states, passes):
    """Time per patch of each model (arguments of `LoadedWheels` by name), all in turn, at
    states of a run on tangent, perfect track by the scene's own model: patches per evaluation, us_per_patch (median;
    all of the evaluation, its patches aside some 0.5 us), us_low and us_high (quartiles).
    """
    scene = load_scene(source, overrides)
    recorded = record(scene, scene.data["integration"]["duration"], states)
    contenders, counts = [], []
    for name, settings in models.items():
        keys = {"patch" if key == "model" else key: value for key, value in settings.items()}
        own = load_scene(source, [*overrides, *(f"contact.{key}={value}" for key, value in keys.items())])
        same = recorded._replace(model=compile_scene(own)[0])
        counts.append(patches_per_evaluation(same))
        contenders.append(evaluation(name, same))
    times = 1e6 * take_turns(contenders, passes) / counts
    low, middle, high = np.percentile(times, QUARTILES, axis=0)
    columns = {"model": list(models), "patches": counts, "us_per_patch": middle, "us_low": low, "us_high": high}
    return pd.DataFrame(columns)
