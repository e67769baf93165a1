"""What a long distance costs, from its beginning: ``python -m study.wear.cost config/wear/trailer_vehicle.yaml``."""

import argparse
import time
from tempfile import TemporaryDirectory

import pandas as pd

from wrcore.analysis.evolve import evolve

WHOLE = 1e8
"""m."""


def cost_table(plan, distance, whole=WHOLE, threads=1):
    """How the cost of a distance splits, and what the whole would cost at the same rate.

    Parameters
    ----------
    plan : path-like or dict
        See `wrcore.analysis.evolve.load_wear_plan`.
    distance, whole : float
        m.
    threads : int

    Returns
    -------
    pandas.DataFrame
        Rows ``simulate`` (all runs), ``wear`` (their local wear), ``rest`` (smoothing, profiles, conicity, files) and
        ``all``: wall_s, share, and extrapolated_h of the whole. With several threads the first two add up the threads'
        times, and the rest is not known. Column steps: how many there were.
    """
    with TemporaryDirectory() as folder:
        evolve(plan, folder, changes={"distance": 1.0})  # compiles
    spent, began = {}, time.perf_counter()
    with TemporaryDirectory() as folder:
        table = evolve(plan, folder, changes={"distance": distance}, threads=threads, spent=spent)
    total = time.perf_counter() - began
    if threads == 1:
        spent["rest"] = total - sum(spent.values())
    parts = spent | {"all": total}
    hours = {part: seconds * whole / distance / 3600.0 for part, seconds in parts.items()}
    rows = [
        {"part": part, "wall_s": seconds, "share": seconds / total, "extrapolated_h": hours[part]}
        for part, seconds in parts.items()
    ]
    return pd.DataFrame(rows).assign(steps=len(table) - 1)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("plan", metavar="PLAN.yaml")
    parser.add_argument("--distance", type=float, default=2e7, metavar="m")
    parser.add_argument("--whole", type=float, default=WHOLE, metavar="m")
    parser.add_argument("--threads", type=int, default=1, metavar="n")
    options = parser.parse_args()
    table = cost_table(options.plan, options.distance, options.whole, options.threads)
    print(table.to_string(index=False, float_format=lambda value: f"{value:.3g}"))


if __name__ == "__main__":
    main()
