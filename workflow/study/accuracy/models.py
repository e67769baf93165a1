"""The error of a model apart from the error of its integration: tight runs of every model, and runs with exact contact.

A run differs from the truth by what its integrator errs and by what its model leaves out. The first is its difference
from a tight run of the same model, its twin; the second is the twin's difference from a run with exact contact.
"""

import pandas as pd

from study.accuracy.errors import SHOWN, Choice, part_of, run_errors
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

MODEL = ("detection", "patch", "creep")
"""What makes a choice's model."""


def model_of(choice):
    """Detection, patch and creep of a choice or a row of choices."""
    return tuple(getattr(choice, name) for name in MODEL)


def twins(source, overrides, choices, reference, method, rtol):
    """A tight run of every model of the choices, by `model_of`; ``reference`` is one that is there, (Choice, Run)."""
    found = {model_of(reference[0]): reference[1]}
    for choice in choices:
        if model_of(choice) not in found:
            tight = choice._replace(method=method, rtol=rtol)
            found[model_of(choice)] = simulate(load_scene(source, [*overrides, *tight.overrides()]))
    return found


def exact_runs(source, overrides, exact, duration):
    """Runs with exact contact over a duration (s) at two resolutions, finer and coarser: the changes to the scene of
    these names in ``exact``, beside its method and rtol.
    """
    rtol = exact["rtol"]
    common = [*overrides, f"integration.duration={duration}", f"integration.method={exact['method']}"]
    common += [f"integration.rtol={rtol:g}", "integration.atol=0"]
    changes = [
        [f"{key}={value}" for key, value in exact[name].items() if value is not None] for name in ("finer", "coarser")
    ]
    return tuple(simulate(load_scene(source, [*common, "contact.detection=spatial", *some])) for some in changes)


def exact_row(finer, coarser):
    """What exact contact's resolution does to a run, and what the runs cost: a table of one row."""
    costs = {f"{name}_wall_s": run.counters["wall_s"] for name, run in (("finer", finer), ("coarser", coarser))}
    return pd.DataFrame([{"duration_s": finer.t[-1]} | part_of(run_errors(coarser, finer), "model") | costs])


def with_model_errors(table, tight, exact=None):
    """Table of `study.accuracy.errors.study` with columns of the model's errors, the same for all choices of a model,
    from the tight runs of `twins`; NaN without a run with exact contact, compared up to its end.
    """
    until = float("inf") if exact is None else float(exact.t[-1])
    found = {
        model: {f"model_{name}": float("nan") for name in SHOWN} if exact is None
        else part_of(run_errors(run, exact, until), "model")
        for model, run in tight.items()
    }  # fmt: skip
    return table.join(pd.DataFrame([found[model_of(row)] for row in table.itertuples()], index=table.index))


def model_table(tables, exacts):
    """Errors of all models of all scenes (tables of `with_model_errors` by title), with what exact contact's own
    resolution does (`exact_row`) in front; scenes without the latter are left out.
    """
    columns = [f"model_{name}" for name in SHOWN]
    parts = []
    for title, exact in exacts.items():
        own = exact[columns].assign(detection="spatial", patch="exact, coarser", creep="exact")
        models = tables[title].drop_duplicates(list(MODEL))
        parts.append(pd.concat([own, models[[*MODEL, *columns]]]).assign(scene=title))
    return pd.concat(parts)[["scene", *MODEL, *columns]] if parts else pd.DataFrame(columns=["scene", *MODEL, *columns])


def reference_choice(reference):
    """`Choice` of the reference run; arguments as in the configuration."""
    return Choice("spatial", "moment", reference["creep"], reference["methods"][0], reference["rtols"][0])
