"""What a function of a user's own sees of channels."""

import pytest

from wrcore.errors import InputError
from wrcore.run.asked import told_by


def find(name):
    if name != "wheelset/left.Q_N":
        raise InputError("session", name, "expected a channel")
    return {name: 5e4}


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        (lambda values: values["wheelset/left.Q_N"] > 4e4, True),
        (lambda values: values.get("wheelset/left.Q_N", 0.0) > 4e4, True),
        (lambda values: "wheelset/left.Q_N" in values, True),
        (lambda values: values.get("wheelset.y_m", 0.0) > 0.5, True),
        (lambda values: values.get("nothing", 0.0) > 0.5, False),
        (lambda values: "nothing" in values, False),
    ],
)
def test_condition_sees_what_follows_from_channels_however_it_asks(condition, holds):
    assert told_by(condition, {"wheelset.y_m": 1.0}, find) is holds
