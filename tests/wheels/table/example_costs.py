"""What looked-up contact costs the examples: ``python -m tests.wheels.table.example_costs [EXAMPLE ...] [--passes N]``.

Each example runs with ``moment`` and with ``tabulated`` in turn, as it stands, on the nodes that come with the package.
Times are of the integration, ms; cells are put together anew in every run, as a first run does.
"""

import argparse
import gc

import numpy as np
import pandas as pd

import wrcore as wr

PATCHES = ("moment", "tabulated")
EXAMPLES = ("suspended_wheelset", "trailer_vehicle", "metro_car")


def costs(name, passes, **settings):
    """Times (passes,) of the integration by patch model, s; what is compiled first does not count."""
    scene, times = wr.example(name), {patch: [] for patch in PATCHES}
    for k in range(passes + 1):
        for patch, found in times.items():  # the other model in between: no pair of profiles is still in memory
            spent = wr.simulate(scene, contact__patch=patch, **settings).counters["wall_s"]
            gc.collect()
            found += [spent] * (k > 0)
    return {patch: np.array(found) for patch, found in times.items()}


def main():
    """Print a row per example."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("examples", nargs="*", default=list(EXAMPLES))
    parser.add_argument("--passes", type=int, default=7)
    arguments = parser.parse_args()
    rows = []
    for name in arguments.examples:
        moment, tabulated = costs(name, arguments.passes).values()
        rows.append(
            {
                "example": name,
                "moment, ms": 1e3 * np.median(moment),
                "tabulated, ms": 1e3 * np.median(tabulated),
                "ratio of medians": np.median(tabulated) / np.median(moment),
                "of least": tabulated.min() / moment.min(),
            }
        )
    print(pd.DataFrame(rows).to_markdown(index=False, floatfmt=".3g"))


if __name__ == "__main__":
    main()
