"""Kinds of model in the figure of speed against error."""

import pytest

from wrcore.analysis.accuracy.plot_choices import MODELS, model_kind

FINEST = "table 0.003"


@pytest.mark.parametrize(
    ("detection", "patch", "creep", "kind"),
    [
        ("spatial", "moment", FINEST, "spatial, fine table"),
        ("spatial", "moment", "table 0.01", "spatial, default table"),
        ("spatial", "moment", "table 0.05", "spatial, coarse table"),
        ("spatial", "moment", "polach", "spatial, formula or FASTSIM"),
        ("planar", "moment", FINEST, "planar"),
        ("spatial", "tabulated", FINEST, "exact contact, looked up"),
        ("spatial", "maximum", FINEST, "reduction to the maximum"),
    ],
)
def test_every_choice_has_its_kind(detection, patch, creep, kind):
    assert model_kind({"detection": detection, "patch": patch, "creep": creep}, FINEST) == kind
    assert kind in [label for label, *_ in MODELS]
