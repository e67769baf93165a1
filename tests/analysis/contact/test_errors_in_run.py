"""Errors of a run's contact model at its own output times."""

import numpy as np
import pytest

import wrcore as wr
from wrcore.errors import InputError

CHANNELS = {"output.channels": ["contact", "wheel_motion"], "integration.duration": 0.2, "output.rate": 50.0}
HUNTING = {"speed": 40.0, "initial.y": 0.003, "initial.yaw": 0.002} | CHANNELS


def run_with(patch, **more):
    return wr.simulate(wr.load_scene(wr.example("suspended_wheelset"), {"contact.patch": patch} | HUNTING | more))


@pytest.fixture(scope="module")
def errors():
    return {patch: wr.contact_errors(run_with(patch), 6) for patch in ("moment", "surrogate")}


def test_surrogate_is_closer_to_exact_contact_than_ellipses(errors):
    for column, bound in (("N_error", 0.004), ("creep_force_error", 0.02)):
        worst = {patch: found[column].abs().max() for patch, found in errors.items()}
        assert worst["surrogate"] < bound < worst["moment"]


def test_rows_are_wheels_at_output_times(errors):
    found = errors["moment"]
    assert list(found["t_s"].unique()) == pytest.approx([0.0, 0.04, 0.08, 0.12, 0.16, 0.2])
    assert set(zip(found["wheelset"], found["side"], strict=True)) == {("wheelset", "left"), ("wheelset", "right")}


def test_reference_is_the_exact_patch_of_the_wheel(errors):
    """`wr.patch_in_run` solves the patch for the load of the run, the reference for its position: 2 % apart."""
    run = run_with("surrogate")
    found = wr.contact_errors(run, 6)
    for row in found.itertuples():
        patch = max(wr.patch_in_run(run, row.t_s, row.wheelset, row.side), key=lambda one: one.normal)
        assert row.N_N == pytest.approx(patch.normal, rel=0.02)
        assert row.p_max_Pa == pytest.approx(patch.p_max, rel=0.03)


def test_run_with_exact_contact_is_refused():
    run = run_with("moment")
    run.scene["contact"]["patch"] = "exact"
    with pytest.raises(InputError, match="contact_errors: run: expected a run with another contact.patch than exact"):
        wr.contact_errors(run)


def test_run_without_wheel_motion_is_refused():
    run = run_with("moment", **{"output.channels": ["contact"]})
    with pytest.raises(InputError, match=r"output\.channels: expected contact and wheel_motion"):
        wr.contact_errors(run)


def test_other_creep_law_is_compared_with_exact_contact():
    run = run_with("moment", **{"contact.creep": {"model": "polach"}})
    found = wr.contact_errors(run, 2)
    assert np.isfinite(found["creep_force_error"]).all()
