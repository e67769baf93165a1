"""What integrators keep of a model before a step is tried."""

import numpy as np
import pytest

import wrcore as wr
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.interface import after_rejection, before_attempt, kept_size
from wrcore.scene.compile import compile_scene


def work_of(patch):
    """Model and work of the suspended wheelset with a patch."""
    model, _ = compile_scene(wr.load_scene(wr.example("suspended_wheelset"), contact__patch=patch))
    return model, Equations(model).work


def test_a_rejected_step_leaves_no_solutions_of_patches():
    model, work = work_of("exact")
    kept, memory = np.zeros(kept_size(model, work)), work.strips.memory
    before = memory[...] = np.random.default_rng(1).normal(size=memory.shape)
    before_attempt(work, kept)
    memory[...] = 0.0
    work.arc_lengths[:] = 1.0
    after_rejection(work, kept)
    np.testing.assert_array_equal(memory, before)
    np.testing.assert_array_equal(work.arc_lengths, [1.0])  # near enough to go on from


@pytest.mark.parametrize("patch", ["moment", "tabulated"])
def test_what_costs_no_solution_is_not_copied(patch):
    assert kept_size(*work_of(patch)) == 1
