"""The stability study: families of hard cases from the configuration, their table, and its summary."""

import pandas as pd

from study.hard_cases import contact, flange, friction, integration, long, low_speed, profiles, track
from study.hard_cases.cases import table
from wrcore.errors import InputError

FAMILIES = {
    "low_speed": {
        "ladder": low_speed.ladder, "slow_path": low_speed.slow_path, "regularisation": low_speed.regularisation,
        "braking": low_speed.braking,
    },
    "contact": {
        "pose_sweeps": contact.pose_sweeps, "slow_push": contact.slow_push, "impacts": contact.impacts,
        "drops": contact.drops, "crests": contact.crests,
    },
    "flange": {"derailments": flange.derailments, "nadal": flange.nadal},
    "profiles": {"profiles": profiles.profiles},
    "friction": {
        "friction_ladder": friction.friction_ladder, "frictionless": friction.frictionless,
        "friction_step": friction.friction_step, "law_ends": friction.law_ends,
    },
    "integration": {
        "tolerance_ladder": integration.tolerance_ladder, "stability_map": integration.stability_map,
        "baumgarte": integration.baumgarte, "long_run": integration.long_run, "restarts": integration.restarts,
    },
    "streaming": {"hunting": long.hunting},
    "track": {"irregular": track.irregular, "curve": track.curve},
}  # fmt: skip
"""Functions of each family by the name of their settings. The vehicles are the first argument, except of
``pose_sweeps``."""


def run_family(family, vehicles, settings, progress=None):
    """Run one of the `FAMILIES` of hard cases; return its table and, by function, the curves for figures.

    The table has the columns :data:`study.hard_cases.cases.COLUMNS`. ``settings`` are the arguments of each of the
    family's functions. For functions that run all given vehicles, the setting ``vehicles`` selects some by name.
    ``progress`` wraps the functions' names. InputError if settings are missing or unknown.
    """
    if set(settings) != set(FAMILIES[family]):
        expected = f"expected settings for {', '.join(FAMILIES[family])}"
        raise InputError("hard cases", family, f"{expected}, got {', '.join(settings)}")
    found, curves = [], {}
    for name in progress(list(settings)) if progress else settings:
        function, given = FAMILIES[family][name], dict(settings[name])
        chosen = {key: vehicles[key] for key in given.pop("vehicles", vehicles)}
        result = function(**given) if function is contact.pose_sweeps else function(chosen, **given)
        rows, curve = result if isinstance(result, tuple) else (result, [])
        found += rows
        if curve:
            curves[name] = curve
    return table(found), curves


def summary(found):
    """Return the summary of all families: one row per case with its runs by outcome and its checks.

    Columns: family, case, runs, survived, refused, failed, checks, passed, known (failed checks with a known limit),
    steps (maximum), smallest_step_s, wall_s (sum of all runs).
    """
    rows = []
    keys = ["condition", "vehicle", "detection", "integrator"]
    for (family, case), part in found.groupby(["family", "case"], sort=False):
        runs = part.drop_duplicates(keys)
        outcomes = runs["outcome"].value_counts()
        known = part["known_limit"].fillna("") != ""
        rows.append({
            "family": family, "case": case, "runs": len(runs),
            **{name: int(outcomes.get(name, 0)) for name in ("survived", "refused", "failed")},
            "checks": len(part), "passed": int(part["passed"].sum()), "known": int(known.sum()),
            "steps": runs["steps"].max(), "smallest_step_s": runs["smallest_step_s"].min(),
            "wall_s": runs["wall_s"].sum(),
        })  # fmt: skip
    return pd.DataFrame(rows)


def known_limits(found):
    """Return the known limits of the models that cases have exceeded: case, number (times), and worst value."""
    met = found[found["known_limit"].fillna("") != ""]
    columns = ["family", "case", "invariant", "known_limit"]
    if met.empty:
        return pd.DataFrame(columns=[*columns, "value", "limit", "times"])
    excess = (met["value"] / met["limit"]).groupby([met[name] for name in columns]).idxmax()
    times = met.groupby(columns).size()
    worst = met.loc[excess.to_numpy(), [*columns, "value", "limit"]].set_index(columns)
    return worst.assign(times=times).reset_index()


def unexplained(found):
    """Return the rows of failed checks that have no known limit."""
    return found[~found["passed"].astype(bool) & (found["known_limit"].fillna("") == "")]


def report_text(found):
    """Return the study's summary in Markdown: totals, cases, known limits and failures without a known reason."""
    cases, limits, open_rows = summary(found), known_limits(found), unexplained(found)
    totals = cases[["runs", "survived", "refused", "failed", "checks", "passed", "known"]].sum()
    lines = [
        f"{totals.runs} runs: {totals.survived} survived, {totals.refused} refused with a reason,"
        f" {totals.failed} failed. {totals.checks} checks: {totals.passed} passed, {totals.known} beyond a known limit"
        f" of the models, {len(open_rows)} unexplained.",
        "", _markdown(cases), "", "Known limits:", "", _markdown(limits),
    ]  # fmt: skip
    if len(open_rows):
        shown = ["case", "condition", "vehicle", "detection", "integrator", "invariant", "value", "limit", "reason"]
        lines += ["", "Unexplained:", "", _markdown(open_rows[shown])]
    return "\n".join(lines) + "\n"


def _markdown(frame):
    """Return a table in Markdown."""

    def cell(value):
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    lines = [list(map(str, frame.columns)), ["---"] * len(frame.columns)]
    lines += [[cell(value) for value in row] for row in frame.itertuples(index=False)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
