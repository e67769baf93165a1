"""What all contact models have in common, whichever patch model, creep law and detection: forces of one evaluation."""

from itertools import pairwise

import numpy as np
import pytest

from tests.contract.combinations import (
    FORCE_MIRROR,
    FORCES,
    MIRROR,
    REFUSED,
    STRIPS,
    equations_of,
    scene_of,
    states,
    wheel_patches,
)
from wrcore.contact.search import reduction as columns
from wrcore.errors import InputError

LOAD = 54546.0  # N, static wheel load
FRICTION = 0.3

CENTRE = 1e-4
"""Distance of the force's line of action from the point of a patch on strips at most, m. The patch follows the
surfaces and its forces have several directions: no single point carries their moment. 66 um were found, on a flange."""

combined = pytest.mark.parametrize(("patch", "law", "detection"), FORCES, ids=map("-".join, FORCES))


@combined
def test_forces_of_the_mirror_image_are_the_mirror_image(patch, law, detection):
    _, equations = equations_of(patch, law, detection)
    for state in states():
        equations(0.0, state)
        wrench, counts = equations.work.rail_wrenches[0].copy(), equations.work.counts[0].copy()
        equations(0.0, state * MIRROR)
        mirrored = equations.work.rail_wrenches[0] * FORCE_MIRROR
        assert equations.work.counts[0][::-1].tolist() == counts.tolist()
        np.testing.assert_allclose(mirrored[::-1], wrench, rtol=0.0, atol=1e-9 * np.abs(wrench).max())


@combined
def test_creep_forces_dissipate_power(patch, law, detection):
    _, equations = equations_of(patch, law, detection)
    slipping = 0
    for state in states():
        equations(0.0, state)
        for _, row in wheel_patches(equations):
            power = -(row[[columns.FX, columns.FY, columns.MZ]] @ row[[columns.XI, columns.ETA, columns.PHI]])
            assert power >= -1e-9 * FRICTION * row[columns.NORMAL], (state[1], power)
            slipping += power > 0.0
    assert slipping >= 2 * len(states())


@combined
def test_wrench_on_the_wheel_is_the_sum_over_its_patches(patch, law, detection):
    _, equations = equations_of(patch, law, detection)
    for state in states():
        equations(0.0, state)
        total = np.zeros((2, 6))
        for side, row in wheel_patches(equations):
            sine, cosine = row[columns.SINE], row[columns.COSINE]
            normal = np.array([0.0, -sine, cosine])
            lateral = np.array([0.0, cosine, sine])
            force = row[columns.NORMAL] * normal + row[columns.FY] * lateral + [row[columns.FX], 0.0, 0.0]
            arm = np.array([row[columns.X], row[columns.Y] - state[1], row[columns.Z] - state[2]])
            total[(1 - side) // 2] += np.concatenate([force, np.cross(arm, force) + row[columns.MZ] * normal])
        scale, found = np.abs(total).max(), equations.work.rail_wrenches[0]
        assert scale > 0.5 * LOAD
        np.testing.assert_allclose(found[:, :3], total[:, :3], rtol=0.0, atol=1e-9 * scale)
        arm = CENTRE if patch in STRIPS else 1e-9
        np.testing.assert_allclose(found[:, 3:], total[:, 3:], rtol=0.0, atol=arm * scale)


JUMPS = {"maximum": 0.5, "moment": 0.25, "exact": 0.02, "tabulated": 0.05, "surrogate": 0.02}
"""Jump of a wheel's force along a path at most, as a part of the static load: `maximum` jumps where another point
becomes the deepest one, `moment` where overlaps merge, `exact` where the number of strips changes."""


@pytest.mark.parametrize("detection", ["spatial", "planar", "auto"])
@pytest.mark.parametrize("patch", JUMPS)
def test_force_is_continuous_along_a_path_of_poses(patch, detection):
    _, equations = equations_of(patch, "table", detection)
    first, last = states()[[2, 3]]

    def force(t):
        equations(0.0, first + t * (last - first))
        return equations.work.rail_wrenches[0, :, :3].copy()

    def jump(pair):
        return np.abs(pair[1][1] - pair[0][1]).max()

    points = [(t, force(t)) for t in np.linspace(0.0, 1.0, 61)]
    assert np.ptp([f[:, 2] for _, f in points]) > 0.1 * LOAD  # there is something to follow
    for pair in sorted(pairwise(points), key=jump)[-2:]:
        for _ in range(22):
            t = 0.5 * (pair[0][0] + pair[1][0])
            middle = t, force(t)
            pair = max((pair[0], middle), (middle, pair[1]), key=jump)
        assert jump(pair) < JUMPS[patch] * LOAD, (pair[0][0], jump(pair))


@pytest.mark.parametrize(("patch", "law"), REFUSED, ids=map("-".join, REFUSED))
def test_combination_without_a_meaning_is_refused_in_one_line(patch, law):
    with pytest.raises(InputError) as caught:
        scene_of(patch, law)
    said = str(caught.value)
    assert caught.value.field == "contact.creep.model" and patch in said and law in said and "\n" not in said


@pytest.mark.parametrize("patch", ["maximum", "exact", "tabulated"])
def test_shape_numbers_are_refused_beside_other_patches_than_moment(patch):
    with pytest.raises(InputError) as caught:
        scene_of(patch, contact__creep__planes="sdec")
    assert caught.value.field == "contact.creep.planes" and "moment" in caught.value.expected
