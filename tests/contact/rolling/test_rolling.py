"""Rolling of patches given as strips: against CONTACT, the solver for ellipses, limits, symmetries, refinement."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wrcore.analysis.contact.rolling_field import solve_patch
from wrcore.contact.rolling.ellipse import RollingContact
from wrcore.contact.rolling.influence import _add_strip, _add_strip_exactly
from wrcore.contact.rolling.library import ellipse_strips, make_library
from wrcore.contact.rolling.rolling import (
    AUTO,
    BAND,
    DIRECT,
    FASTEST,
    LEVELS,
    LIBRARY,
    LIMIT,
    Level,
    roll_again,
    rolling_force,
    rolling_work,
)
from wrcore.creep.cases import check_cases
from wrcore.creep.kalker import kalker_coefficients, kalker_data
from wrcore.errors import InputError
from wrcore.kernels.jit import jit

DATA = Path(__file__).parents[2] / "data" / "creep"
G, NU, MU = 82e9, 0.28, 0.3
REFINED = Level(32, 20, 30, 99)
REFINED_SLENDER = Level(16, 40, 30, 99)


def strips_of(square, load, windows, count, middle=lambda s: 0 * s, force=50e3):
    """Strips of a patch with squared half length, relative load and middle as functions of s, carrying a force."""
    parts = []
    for low, high in windows:
        edge = np.linspace(low, high, count + 1)
        s = edge[:-1, None] + np.diff(edge)[:, None] * (np.arange(60) + 0.5) / 60
        weight = load(s)
        half_length = np.sqrt(square(s).mean(axis=1))
        centroid = (weight * middle(s)).mean(axis=1) / weight.mean(axis=1)
        parts.append(((edge[1:] + edge[:-1]) / 2, np.diff(edge), half_length, centroid, weight.mean(1) / half_length))
    centre, width, half_length, middle, peak = (np.concatenate(part) for part in zip(*parts, strict=True))
    peak *= force / (np.pi / 2 * peak * half_length * width).sum()
    return centre, width, half_length, middle, peak


def sdec(count, a, b, psi=0.0, skew=0.0, force=50e3):
    """Simple double ellipse between -b and b (psi = 0: ellipse), its middles running from -skew a to skew a."""

    def square(s):
        t = s + psi * b
        return a * a * (1 - (t / (b * (1 + psi * np.sign(t)))) ** 2)

    return strips_of(square, square, [(-b, b)], count, lambda s: skew * a * s / b, force)


def lobes(count, distance, ratio=0.7, waist=0.0, a=5e-3, b=2e-3, force=50e3):
    """Two elliptic lobes, the right one ``ratio`` as large, that overlap, or a window each where they do not."""

    def bump(t):
        return np.maximum(1 - t * t, 0)

    low, high = -distance - b, distance + ratio * b
    middle, half = (low + high) / 2, (high - low) / 2

    def square(s):
        left, right = bump((s + distance) / b), ratio**2 * bump((s - distance) / (ratio * b))
        return a * a * (left + right + waist * bump((s - middle) / half))

    apart = 2 * distance > (1 + ratio) * b
    windows = [(low, -distance + b), (distance - ratio * b, high)] if apart else [(low, high)]
    return strips_of(square, square, windows, count, force=force)


def slip_of(strips, xi, eta, phi):
    """Rigid slip of one set of creepages at the frame's origin."""
    centre, _, _, middle, _ = strips
    zero = np.zeros_like(centre)
    return xi - phi * centre, zero, eta + phi * middle, zero + phi


def load_of(strips):
    _, width, half_length, _, peak = strips
    return (np.pi / 2 * peak * half_length * width).sum()


def solve(strips, creepages, level="middle", method=AUTO, mu=MU, shear_modulus=G, nu=NU):
    return solve_patch(strips, slip_of(strips, *creepages), shear_modulus, mu, level, nu, method)


def force(strips, *arguments, mu=MU, **options):
    """(Fx, Fs) over mu N."""
    found = solve(strips, *arguments, mu=mu, **options)
    return np.array([found.Fx, found.Fs]) / (mu * load_of(strips))


def random_creepages(rng, strips, number, spin=(0.02, 0.4)):
    """Creepages from 0.05 to 2 of saturation in any direction, with spin; spin over mu N/(G c^3)."""
    _, width, half_length, _, _ = strips
    a, b = 1.1 * half_length.max(), width.sum() / 2
    c = np.sqrt(a * b)
    c11, c22, _, _ = kalker_coefficients(np.clip(a / b, 0.1, 10), kalker_data(NU))
    scale = MU * load_of(strips) / (G * c * c)
    far, angle = np.exp(rng.uniform(np.log(0.05), np.log(2), number)), rng.uniform(0, 2 * np.pi, number)
    turn = np.exp(rng.uniform(*np.log(spin), number)) * rng.choice([-1, 1], number)
    return scale * np.stack([3 * far * np.cos(angle) / c11, 3 * far * np.sin(angle) / c22, turn / c], axis=1)


def tread_shapes(rng, number, sizes=(0.3, 3)):
    """Arguments of patches as they occur on the tread: one-sided, skew, with a waist."""
    for i in range(number):
        ratio = np.exp(rng.uniform(*np.log(sizes)))
        a, b = 4e-3 * np.sqrt(ratio), 4e-3 / np.sqrt(ratio)
        odd = rng.uniform(-0.6, 0.6)
        yield (
            lambda n, a=a, b=b, odd=odd: sdec(n, a, b, psi=odd),
            lambda n, a=a, b=b, odd=odd: sdec(n, a, b, skew=0.5 * odd),
            lambda n, odd=odd: lobes(n, 1.5e-3, 0.8, 0.2 + 0.2 * abs(odd), a=3e-3),
        )[i % 3]


def flange_shapes(rng, number):
    for i in range(number):
        ratio = np.exp(rng.uniform(np.log(5), np.log(15)))
        a, b = 4e-3 * np.sqrt(ratio), 4e-3 / np.sqrt(ratio)
        odd = rng.uniform(-0.4, 0.4)
        yield (
            lambda n, a=a, b=b, odd=odd: sdec(n, a, b, psi=odd),
            lambda n, a=a, b=b, odd=odd: sdec(n, a, b, skew=odd),
        )[i % 2]


def read_cases(name):
    frame = pd.read_csv(DATA / f"{name}.csv", comment="#")
    columns = check_cases(frame)
    return frame, [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def solve_case(case, level):
    """(Fx, Fy)/(mu N) of a row of CONTACT's cases."""
    b = (case["b_neg_m"] + case["b_pos_m"]) / 2
    psi = (case["b_pos_m"] - case["b_neg_m"]) / (2 * b)
    strips = sdec(LEVELS[level].strips, case["a_m"], b, psi, force=case["N_N"])
    options = dict(mu=case["mu"], shear_modulus=case["G_Pa"], nu=case["nu"])
    return force(strips, (case["xi"], case["eta"], case["phi_per_m"]), level, **options)


@pytest.mark.parametrize("name, bound_95, bound_max", [("ellipse_cases", 0.009, 0.018), ("sdec_cases", 0.009, 0.018)])
def test_agrees_with_contact(name, bound_95, bound_max):
    """Level fine, or slender for a/b > 3; CONTACT's extrapolated values claim 0.2 % of mu N."""
    frame, cases = read_cases(name)
    errors = []
    for row, case in zip(frame.itertuples(), cases, strict=True):
        ratio = case["a_m"] * 2 / (case["b_neg_m"] + case["b_pos_m"])
        if 0.2 < ratio < 8:
            found = solve_case(case, "slender" if ratio > 3 else "fine")
            errors.append(np.hypot(*(found - np.array([row.Fx_N, row.Fy_N]) / (row.mu * row.N_N))))
    assert len(errors) > 80
    assert np.percentile(errors, 95) < bound_95
    assert np.max(errors) < bound_max


@pytest.fixture(scope="module")
def on_ellipses():
    """Semi-axes, shape number, creepages and forces by the solver for ellipses of some patches."""
    rng, cases = np.random.default_rng(1), []
    for ratio, psi in ((0.3, 0.0), (0.7, 0.4), (1.3, 0.0), (2.5, -0.5)):
        a, b = 4e-3 * np.sqrt(ratio), 4e-3 / np.sqrt(ratio)
        strips = sdec(8, a, b, psi)
        scale, creepages = G * a * b / (MU * load_of(strips)), random_creepages(rng, strips, 6)
        reference = RollingContact(ratio, psi, NU, 20).solve_many(creepages * scale * [1, 1, 4e-3])[0]
        cases.append((a, b, psi, creepages, reference))
    return cases


@pytest.mark.parametrize("level, bound_95", [("coarse", 0.011), ("middle", 0.008), ("fine", 0.0065)])
def test_agrees_with_the_solver_for_ellipses(on_ellipses, level, bound_95):
    errors = []
    for a, b, psi, creepages, reference in on_ellipses:
        strips = sdec(LEVELS[level].strips, a, b, psi)
        found = [solve(strips, row, level) for row in creepages]
        forces = np.array([(f.Fx, f.Fs, f.Mn / 4e-3) for f in found]) / (MU * load_of(strips))
        errors += list(np.hypot(*(forces - reference)[:, :2].T))
        assert abs(forces - reference)[:, 2].max() < 0.012
    assert np.percentile(errors, 95) < bound_95


@pytest.mark.parametrize("ratio", [0.2, 1.0, 3.0])
def test_small_creepage_is_linear_theory(ratio):
    """Kalker's coefficients at level fine, signs of the force on the wheel included: 1 % (C11, C22), 2 % (C23, C33)."""
    a, b = 4e-3 * np.sqrt(ratio), 4e-3 / np.sqrt(ratio)
    c11, c22, c23, c33 = kalker_coefficients(ratio, kalker_data(NU))
    strips = ellipse_strips(a, b, 16)
    unit = G * a * b
    response = [solve(strips, row, "fine", mu=1e3 / load_of(strips) * unit) for row in np.diag([1e-3, 1e-3, 1e-3])]
    matrix = np.array([(f.Fx, f.Fs, f.Mn) for f in response]).T / (1e-3 * unit)
    c = np.sqrt(a * b)
    expected = np.array([[-c11, 0, 0], [0, -c22, -c23 * c], [0, c23 * c, -c33 * c * c]])
    tolerance = np.array([[0.01, 0, 0], [0, 0.01, 0.02], [0, 0.02, 0.02]])
    assert np.all(abs(matrix - expected) <= tolerance * abs(expected) + 1e-5)


@pytest.fixture(scope="module")
def refined():
    """Odd single patches, creepages, and forces on 32 strips x 20 panels."""
    rng, cases = np.random.default_rng(5), []
    for shape in tread_shapes(rng, 9):
        fine = shape(REFINED.strips)
        cases += [(shape, row, force(fine, row, REFINED, method=BAND)) for row in random_creepages(rng, fine, 3)]
    return cases


@pytest.mark.parametrize("level, bound", [("coarse", 0.008), ("middle", 0.005), ("fine", 0.0035)])
def test_refined_strips_change_little(refined, level, bound):
    """95 % of random cases: the levels' promise."""
    errors = [np.hypot(*(force(shape(LEVELS[level].strips), row, level) - fine)) for shape, row, fine in refined]
    assert np.percentile(errors, 95) < bound


def test_refined_slender_patches_change_little():
    rng, errors = np.random.default_rng(6), []
    for shape in flange_shapes(rng, 8):
        fine = shape(REFINED_SLENDER.strips)
        for row in random_creepages(rng, fine, 3, (0.1, 0.4)):
            coarse = force(shape(LEVELS["slender"].strips), row, "slender")
            errors.append(np.hypot(*(coarse - force(fine, row, REFINED_SLENDER, method=BAND))))
    assert np.median(errors) < 0.004
    assert np.percentile(errors, 95) < 0.009


@pytest.mark.parametrize("level", LEVELS)
def test_library_band_and_direct_agree(level):
    """Three resolvents, one fixed point: 0.05 % of mu N on patches that differ from the library's."""
    rng = np.random.default_rng(7)
    count = LEVELS[level].strips
    shapes = [*tread_shapes(rng, 6), lambda n: lobes(n, 2e-3, 0.6, a=3e-3)]
    for shape in shapes:
        strips = shape(count)
        for row in random_creepages(rng, strips, 2):
            direct = solve(strips, row, level, DIRECT)
            assert direct.residual < 1e-3 and direct.method == DIRECT
            for method in (LIBRARY, BAND):
                other = solve(strips, row, level, method)
                assert other.method == method
                assert np.hypot(other.Fx - direct.Fx, other.Fs - direct.Fs) < 5e-4 * MU * load_of(strips)


def test_slender_and_skew_patches_take_the_band():
    skew, plain, slender = sdec(8, 12e-3, 1.5e-3, skew=0.5), sdec(8, 5e-3, 2e-3), sdec(8, 30e-3, 1.5e-3)
    methods = [solve(strips, (1e-4, 1e-4, 0.1), "slender").method for strips in (skew, plain, slender)]
    assert methods == [BAND, LIBRARY, BAND]
    strips = sdec(11, 5e-3, 2e-3)
    assert solve(strips, (1e-4, 1e-4, 0.1), "slender").method == BAND  # not the library's number of strips


def test_falls_back_where_iterations_do_not_suffice():
    """The library far from the patch diverges; the automatic choice then repeats with the whole matrix and says so."""
    strips = sdec(8, 5e-3, 2.5e-3, 0.3)
    hasty = Level(8, 8, 2, 2)
    found = solve(strips, (3e-4, 2e-4, 0.1), hasty)
    direct = solve(strips, (3e-4, 2e-4, 0.1), "coarse", DIRECT)
    assert (found.method, found.Fx, found.Fs) == (DIRECT, direct.Fx, direct.Fs)
    assert solve(strips, (3e-4, 2e-4, 0.1), hasty, LIBRARY).residual > LIMIT


SHAPES = [
    lambda n: sdec(n, 5e-3, 3e-3, 0.4),
    lambda n: sdec(n, 5e-3, 5e-3, skew=0.3),
    lambda n: lobes(n, 1.4e-3, 0.7, 0.2),
    lambda n: lobes(n, 2.5e-3, 0.6),
]


@pytest.mark.parametrize("shape", SHAPES)
def test_fast_slip_is_coulomb(shape):
    """abs(F) = mu N against the slip, also where the slip is reduced before it is iterated, without a step there."""
    strips = shape(12)
    assert force(strips, (3.0, -4.0, 0.0)) == pytest.approx([-0.6, 0.8], abs=1e-4)
    c = np.sqrt((strips[1] * strips[2]).sum() / 2)
    unit = FASTEST * MU * load_of(strips) / (G * c * c)
    below, above = (force(strips, (f * unit, 0.1 * f * unit, 0.2 * f * unit / c)) for f in (0.9999999, 1.0000001))
    assert below == pytest.approx(above, abs=1e-5)
    farther, farthest = (force(strips, (f * unit, 0.1 * f * unit, 0.2 * f * unit / c)) for f in (10, 1e6))
    assert np.all(abs(below - farthest) > 1e-5)
    assert np.all(abs(farther - farthest) < 0.2 * abs(below - farthest))


@pytest.mark.parametrize("shape", SHAPES)
def test_field_adds_up_and_dissipates(shape):
    strips = shape(12)
    centre, width, half_length, middle, peak = strips
    creepages = (4e-4, 2e-4, 0.25)
    found = solve(strips, creepages)
    edges = np.cos(np.pi * np.arange(11) / 10)
    area = -np.diff(edges) * (half_length * width)[:, None]
    assert (found.pressure * area).sum() == pytest.approx(load_of(strips))
    assert (found.traction_x * area).sum() == pytest.approx(found.Fx, rel=1e-5)
    assert (found.traction_s * area).sum() == pytest.approx(found.Fs, rel=1e-5)
    moment = (found.x * found.traction_s - found.s * found.traction_x) * area
    assert moment.sum() == pytest.approx(found.Mn, rel=1e-4, abs=1e-4)
    assert found.pressure.max() == pytest.approx(peak.max(), rel=0.03)
    traction, slip = np.hypot(found.traction_x, found.traction_s), np.hypot(found.slip_x, found.slip_s)
    assert np.all(traction <= MU * found.pressure * (1 + 1e-5))
    assert np.all(slip[~found.slides] == 0) and 0.02 < found.slides.mean() < 0.98
    assert np.all(found.power >= 0)
    cosine = found.power[found.slides] / (traction * slip)[found.slides]
    assert cosine.min() > 0.9999
    slip_x, _, slip_s, turn = (part[:, None] for part in slip_of(strips, *creepages))
    rigid = found.traction_x * slip_x + found.traction_s * (slip_s + turn * (found.x - middle[:, None]))
    assert (found.power * area).sum() == pytest.approx(-(rigid * area).sum(), rel=1e-4)
    work = found.Fx * creepages[0] + found.Fs * creepages[1] + found.Mn * creepages[2]
    assert work == pytest.approx((rigid * area).sum(), rel=0.01) and work < 0
    fine = solve(shape(16), creepages, Level(16, 40, 20, 99))
    power = -(fine.traction_x * fine.slip_x + fine.traction_s * fine.slip_s)
    assert power.sum() / fine.power.sum() == pytest.approx(1, abs=0.08)  # the factor goes to 1 with the panels' size


@pytest.mark.parametrize("shape", SHAPES)
def test_mirror_symmetry(shape):
    """s -> -s: Fs and Mn change sign; turning all slip round turns the force."""
    strips = shape(12)
    centre, width, half_length, middle, peak = (part[::-1] for part in strips)
    mirror = (-centre, width, half_length, middle, peak)
    size = MU * load_of(strips)
    found, other = solve(strips, (3e-4, -2e-4, 0.2)), solve(mirror, (3e-4, 2e-4, -0.2))
    assert (other.Fx, -other.Fs) == pytest.approx((found.Fx, found.Fs), abs=1e-5 * size)
    assert -other.Mn == pytest.approx(found.Mn, abs=1e-7 * size)
    turned = solve(strips, (-3e-4, 2e-4, -0.2))
    assert (-turned.Fx, -turned.Fs) == pytest.approx((found.Fx, found.Fs), abs=1e-6 * size)


def test_origin_does_not_matter():
    """The same patch and slip from another origin: same force, moment moved by the lever."""
    strips = sdec(12, 5e-3, 3e-3, 0.3, skew=0.2)
    centre, width, half_length, middle, peak = strips
    moved = (centre + 0.02, width, half_length, middle - 0.03, peak)
    xi, eta, phi = 3e-4, -2e-4, 0.2
    one, two = solve(strips, (xi, eta, phi)), solve(moved, (xi + phi * 0.02, eta + phi * 0.03, phi))
    size = MU * load_of(strips)
    assert (two.Fx, two.Fs) == pytest.approx((one.Fx, one.Fs), abs=1e-5 * size)
    assert two.Mn == pytest.approx(one.Mn - 0.03 * one.Fs - 0.02 * one.Fx, abs=1e-6 * size)


def test_lobes_far_apart_do_not_notice_each_other():
    """Two windows 1 m apart: the sum of the two alone; 4 mm apart they couple."""
    one, two = sdec(12, 5e-3, 3e-3, 0.2), sdec(12, 3e-3, 2e-3, -0.3, force=20e3)

    def pair(distance):
        return tuple(np.concatenate(p) for p in zip((one[0] - distance, *one[1:]), (two[0], *two[1:]), strict=True))

    def same_slip(strips, distance=0.0):
        return tuple(np.full_like(strips[0], value) for value in (3e-4, 0.0, -2e-4, 0.1))

    def parts(strips):
        f = solve_patch(strips, same_slip(strips), G, MU)
        return np.array([f.Fx, f.Fs])

    size = MU * 70e3
    alone = parts(one) + parts(two)
    assert parts(pair(1.0)) == pytest.approx(alone, abs=2e-4 * size)
    assert np.hypot(*(parts(pair(5.5e-3)) - alone)) > 5e-3 * size


def test_strips_without_load_do_not_matter():
    """A strip about to leave contact: the limit of a small load is no load, and no load at all is no force."""
    strips = sdec(12, 5e-3, 3e-3)
    row = (3e-4, -2e-4, 0.1)
    forces = []
    for share in (1e-2, 1e-4, 0.0):
        half_length, peak = strips[2].copy(), strips[4].copy()
        half_length[0] *= share
        peak[0] *= share
        forces.append(force((strips[0], strips[1], half_length, strips[3], peak), row))
    assert np.isfinite(forces).all()
    assert forces[1] == pytest.approx(forces[2], abs=1e-4)
    found = solve((*strips[:4], 0 * strips[4]), row)
    assert (found.Fx, found.Fs, found.Mn) == (0, 0, 0)


@pytest.mark.parametrize("level", ["coarse", "middle"])
@pytest.mark.parametrize(
    "path",
    [
        lambda n, t: sdec(n, 5e-3 + t, 4e-3, 0.2 + 30 * t),
        lambda n, t: lobes(n, 1.7e-3 + t, 0.8, 0.15, a=3e-3),
        lambda n, t: lobes(n, 2e-3 + t, 0.7, a=3e-3),
    ],
)
def test_small_changes_of_shape_change_the_force_smoothly(path, level):
    """1 um steps: increments of the force change by less than 0.3 of themselves (95 % of the steps: 0.05)."""
    forces = []
    for step in range(60):
        t = 1e-6 * step
        forces.append(force(path(LEVELS[level].strips, t), (3e-4, 2e-4 + 0.02 * t, 0.1), level))
    increments = np.diff(forces, axis=0)
    change = np.hypot(*np.diff(increments, axis=0).T) / np.median(np.hypot(*increments.T))
    assert np.percentile(change, 95) < 0.05
    assert change.max() < 0.3


@jit
def solve_twice(one, slip_one, two, slip_two, library, work):
    """`rolling_force` from another kernel: the first patch, the second, the first again."""
    first = rolling_force(*one, *slip_one, G, MU, library, work, AUTO)
    rolling_force(*two, *slip_two, G, MU, library, work, AUTO)
    return first, rolling_force(*one, *slip_one, G, MU, library, work, AUTO)


def test_no_history():
    library, work = make_library("coarse"), rolling_work(16, 8)
    one, two = sdec(8, 5e-3, 3e-3, 0.2), lobes(8, 2.5e-3, 0.6)
    first, again = solve_twice(one, slip_of(one, 3e-4, 0, 0.1), two, slip_of(two, 0, 3e-4, 0.3), library, work)
    assert first == again
    found = solve(one, (3e-4, 0, 0.1), "coarse")
    assert first[:3] == pytest.approx((found.Fx, found.Fs, found.Mn), rel=1e-6)


@pytest.mark.parametrize(("patch", "level"), [(lobes(8, 2.5e-3, 0.6), "coarse"), (sdec(8, 5e-3, 3e-3, 0.2), "slender")])
def test_other_slips_of_the_same_patch_at_once(patch, level):
    """An odd number of them, in two windows and in one, by the library and by factors; one of them slides fast."""
    creepages = [(3e-4, 1e-4, 0.1), (0.0, -2e-4, 0.4), (0.5, 0.2, -0.1)]
    library = make_library(level)
    work = rolling_work(patch[0].size, library.panels.n, 4)
    rolling_force(*patch, *slip_of(patch, 1e-3, 0.0, 0.0), G, MU, library, work, AUTO)
    forces = np.zeros((3, 3, patch[0].size))
    roll_again(np.array([slip_of(patch, *each) for each in creepages]), library, work, forces)
    for found, each in zip(forces, creepages, strict=True):
        alone = solve(patch, each, level)
        np.testing.assert_allclose(found.sum(axis=1), alone.force.sum(axis=1), rtol=1e-4)


def test_influence_integrals():
    """Closed form and midpoint rule with second-order term against quadrature over the width."""
    dx, nu = np.array([-1.3, -0.2, 0.05, 0.4, 2.0]), 0.3
    for near, far, tolerance in ((-0.1, 0.15, 1e-4), (0.4, 0.6, 1e-6), (-0.6, -0.4, 1e-6)):
        y = near + (far - near) * (np.arange(20000) + 0.5) / 20000
        radius = np.hypot(dx[:, None], y)
        log = np.arcsinh(dx[:, None] / abs(y))
        expected = [
            part.mean(axis=1)
            for part in (log - nu * dx[:, None] / radius, (1 - nu) * log + nu * dx[:, None] / radius, -nu * y / radius)
        ]
        found = np.zeros((3, dx.size))
        _add_strip_exactly(dx, far, near, nu, *found)
        assert found == pytest.approx(np.array(expected), abs=tolerance)
        if near * far > 0:
            found = np.zeros((3, dx.size))
            _add_strip(dx, (near + far) / 2, far - near, 1.0, nu, *found)
            assert found == pytest.approx(np.array(expected), abs=2e-4)


def test_odd_number_of_panels_is_refused():
    with pytest.raises(InputError, match="even number of panels"):
        make_library(Level(8, 9, 14, 3))
