"""Worst values by EN 14363 over the output rate, for reports/assessment.md.

``python -m tests.analysis.assessment.sampling``
"""

from unittest import mock

import wrcore as wr
from tests.conftest import ELLIPTIC as EXAMPLES

SPECTRUM = {"level": "low", "seed": 1, "length": 2000.0, "begin": 20.0}
CURVE = [{"tangent": 20}, {"transition": 40}, {"curve": 250, "radius": 300, "cant": 0.1}, {"transition": 40},
         {"tangent": 100}]  # fmt: skip
SCENES = {
    "40 m/s, low irregularity": {"speed": 40, "track.irregularity": {"spectrum": SPECTRUM}},
    "85 m/s, hunting on the flanges": {"speed": 85, "initial.y": 0.005},
    "curve": {"speed": 16.7, "track.path": CURVE, "track.irregularity": {"spectrum": SPECTRUM}},
}


def main():
    for name, changes in SCENES.items():
        for rate in (200, 500, 1000, 4000):
            changes |= {"integration.duration": 20.0, "output.rate": rate}
            run = wr.simulate(wr.load_scene(EXAMPLES / "trailer_vehicle.yaml", changes))
            with mock.patch("wrcore.analysis.assessment.assess.LEAST_RATE", 1.0):
                table = wr.assess(run, begin=1.0).summary
            print(name, rate, dict(zip(table["quantity"], table["value"].round(3), strict=True)))


if __name__ == "__main__":
    main()
