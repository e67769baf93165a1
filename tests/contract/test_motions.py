"""What all integrators have in common, whichever contact models: motions of short runs."""

import numpy as np
import pytest

import wrcore as wr
from tests.contract.combinations import MOTIONS, scene_of

RATE = 200.0
STEPS = {"exact": 4}
"""Output times of a run after its first one; exact contact takes a hundred times as long."""

combined = pytest.mark.parametrize(("patch", "law", "detection", "method"), MOTIONS, ids=map("-".join, MOTIONS))


def scene(patch, law, detection, method, **changes):
    steps = STEPS.get(patch, 20)
    settings = {"integration__method": method, "integration__duration": steps / RATE, "output__rate": RATE}
    return scene_of(patch, law, detection, **({"speed": 40.0, "initial__y": 0.003} | settings | changes))


WHOLE = {}


def whole(*models):
    """The run of these models, once for all tests."""
    if models not in WHOLE:
        WHOLE[models] = wr.simulate(scene(*models), progress=False)
    return WHOLE[models]


def assert_same(one, other, since=0):
    """Two runs with bitwise identical channels, the other from its output number ``since`` on."""
    assert one.keys() == other.keys() and np.array_equal(one.t, other.t[since:])
    for group in one:
        for name in one[group]:
            np.testing.assert_array_equal(one[group][name], other[group][name][since:], f"{group}.{name}")


@combined
def test_run_that_goes_on_from_a_checkpoint_is_bitwise_one_run(patch, law, detection, method, tmp_path):
    once = whole(patch, law, detection, method)
    half = (len(once.t) - 1) // 2
    first = wr.simulate(scene(patch, law, detection, method, integration__duration=half / RATE), progress=False)
    first.save(tmp_path / "first.h5")  # the state of patches, too, goes through the file
    second = scene(patch, law, detection, method, integration__duration=(len(once.t) - 1 - half) / RATE)
    rest = wr.simulate(second, start=first.end, progress=False)
    assert once.status == rest.status == "completed"
    assert_same(rest, once, half)


@combined
def test_session_is_bitwise_one_run(patch, law, detection, method):
    once = whole(patch, law, detection, method)
    session = wr.start(scene(patch, law, detection, method))
    for _ in once.t[1:]:
        session.step(1.0 / RATE)
    assert_same(session.run(), once)
    np.testing.assert_array_equal(session.state, once.end_state)


@combined
def test_motion_of_the_mirror_image_is_the_mirror_image(patch, law, detection, method):
    # Every operation is mirrored. Rounding differs, and grows until a step is rejected on one side alone: from then on
    # both runs are as far apart as either is from the exact motion, which a tighter run stands for.
    once = whole(patch, law, detection, method)["wheelset"].y_m
    mirrored, tight = (
        wr.simulate(scene(patch, law, detection, method, **changes), progress=False)["wheelset"].y_m
        for changes in ({"initial__y": -0.003}, {"integration__rtol": 1e-6})
    )
    error = np.abs(once - tight).max()
    assert np.ptp(once) > 20.0 * error  # it moves, and accurately
    assert np.abs(once + mirrored).max() <= 3.0 * error + 1e-12
    rounding = 1e-8 if patch == "exact" else 1e-9  # m: exact rolling contact counts in single precision
    np.testing.assert_allclose(mirrored[:3], -once[:3], rtol=0.0, atol=rounding)
