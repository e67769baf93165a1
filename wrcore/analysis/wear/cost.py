"""Cost of a long distance, extrapolated: ``python -m wrcore.analysis.wear.cost config/wear/trailer_vehicle.yaml``."""

import argparse
import time
from tempfile import TemporaryDirectory

import pandas as pd

from wrcore.analysis.wear.evolve import evolve

WHOLE = 1e8
"""Distance to which the cost is extrapolated, m."""


def cost_table(plan, distance, whole=WHOLE, threads=1):
    """Return the cost of a distance (m) of a plan by its parts, extrapolated to the distance ``whole`` (m).

    Rows ``simulate`` (all runs), ``wear`` (their local wear), ``rest`` (smoothing, profiles, conicity, files) and
    ``all``: cpu_s (processor time), share, extrapolated_cpu_h of the whole; wall_s and steps of all.
    """
    with TemporaryDirectory() as folder:
        evolve(plan, folder, changes={"distance": 1.0})  # compiles
    spent, began, started = {}, time.perf_counter(), time.process_time()
    with TemporaryDirectory() as folder:
        table = evolve(plan, folder, changes={"distance": distance}, threads=threads, spent=spent)
    total, wall = time.process_time() - started, time.perf_counter() - began
    parts = spent | {"rest": total - sum(spent.values()), "all": total}
    rows = [{"part": part, "cpu_s": seconds, "share": seconds / total} for part, seconds in parts.items()]
    found = pd.DataFrame(rows)
    return found.assign(
        extrapolated_cpu_h=found["cpu_s"] * whole / distance / 3600.0, wall_s=wall, steps=len(table) - 1
    )


def main():
    """Run the command that prints the table of costs."""
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
