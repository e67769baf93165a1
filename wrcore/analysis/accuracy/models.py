"""Errors of models, separated from errors of their integration.

The error of integration of a run is its difference from a run of the same model at tight tolerance, its twin. The
error of a model is the difference of its twin from a run with exact contact.
"""

import pandas as pd

from wrcore.analysis.accuracy.choices import SHOWN, Choice, part_of, run_errors
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

MODEL = ("detection", "patch", "creep")
"""Fields of a choice that define its model."""


def model_of(choice):
    """Return detection, patch and creep of a choice or of a row of a table of choices."""
    return tuple(getattr(choice, name) for name in MODEL)


def twins(source, overrides, choices, reference, method, rtol):
    """Return a run at tight tolerance for each model of the choices, by `model_of`.

    ``reference`` is a pair (Choice, Run) that is used without a new run.
    """
    found = {model_of(reference[0]): reference[1]}
    for choice in choices:
        if model_of(choice) not in found:
            tight = choice._replace(method=method, rtol=rtol)
            found[model_of(choice)] = simulate(load_scene(source, [*overrides, *tight.overrides()]))
    return found


def exact_runs(source, overrides, exact, duration):
    """Return runs with exact contact over a duration (s) at two resolutions, finer and coarser.

    ``exact`` contains method, rtol, and the changes to the scene under ``finer`` and ``coarser``.
    """
    rtol = exact["rtol"]
    common = [*overrides, f"integration.duration={duration}", f"integration.method={exact['method']}"]
    common += [f"integration.rtol={rtol:g}", "integration.atol=0"]
    changes = [
        [f"{key}={value}" for key, value in exact[name].items() if value is not None] for name in ("finer", "coarser")
    ]
    return tuple(simulate(load_scene(source, [*common, "contact.detection=spatial", *some])) for some in changes)


def exact_row(finer, coarser):
    """Return one row with differences of the coarser from the finer run with exact contact, and wall times (s)."""
    costs = {f"{name}_wall_s": run.counters["wall_s"] for name, run in (("finer", finer), ("coarser", coarser))}
    return pd.DataFrame([{"duration_s": finer.t[-1]} | part_of(run_errors(coarser, finer), "model") | costs])


def with_model_errors(table, tight, exact=None):
    """Add columns with the errors of the model to a table of `wrcore.analysis.accuracy.choices.run_choices`.

    They compare the tight runs of `twins` with the run with exact contact up to its end; NaN without such a run.
    All choices of a model have equal values.
    """
    until = float("inf") if exact is None else float(exact.t[-1])
    found = {
        model: {f"model_{name}": float("nan") for name in SHOWN} if exact is None
        else part_of(run_errors(run, exact, until), "model")
        for model, run in tight.items()
    }  # fmt: skip
    return table.join(pd.DataFrame([found[model_of(row)] for row in table.itertuples()], index=table.index))


def model_table(tables, exacts):
    """Return errors of all models of all scenes, from tables of `with_model_errors` by title.

    The first row of each scene is the effect of the resolution of exact contact (`exact_row`). Scenes without this row
    are omitted.
    """
    columns = [f"model_{name}" for name in SHOWN]
    parts = []
    for title, exact in exacts.items():
        own = exact[columns].assign(detection="spatial", patch="exact, coarser", creep="exact")
        models = tables[title].drop_duplicates(list(MODEL))
        parts.append(pd.concat([own, models[[*MODEL, *columns]]]).assign(scene=title))
    return pd.concat(parts)[["scene", *MODEL, *columns]] if parts else pd.DataFrame(columns=["scene", *MODEL, *columns])


def reference_choice(reference):
    """Return the `Choice` of the reference run from its entry in the configuration."""
    return Choice("spatial", "moment", reference["creep"], reference["methods"][0], reference["rtols"][0])
