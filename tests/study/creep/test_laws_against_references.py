"""Tables of error and cost of the creep laws: against CONTACT's files, the exact solver and plain numpy."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from study.creep.laws import (
    REFERENCE_FILES,
    ReferenceCases,
    contact_points,
    error_table,
    exact_forces,
    laws_markdown,
    laws_table,
    read_reference,
    time_models,
    timed_table,
)
from study.creep.smoothness import error_map, sized_creepages, smoothness, smoothness_table
from tests.conftest import ROOT
from wrcore.analysis.creep_curves import creep_curves, creep_models, law_forces, table_model
from wrcore.contact.rolling.ellipse import RollingContact
from wrcore.creep import table as table_module
from wrcore.creep.axes import scales
from wrcore.creep.build import Resolution
from wrcore.creep.kalker import coefficients_at, kalker_data
from wrcore.creep.table import build_table, ensure_table, table_path
from wrcore.errors import InputError

DATA = ROOT / "tests" / "data" / "creep"
NU = 0.28


@pytest.fixture(scope="module")
def tables():
    """The coarse ones of the tests' runs: they are in the cache."""
    return {planes: ensure_table(NU, planes, 0.05) for planes in ("ellipse", "sdec")}


@pytest.fixture(scope="module")
def models(tables):
    return creep_models(NU, tables, [10])


@pytest.fixture(scope="module")
def reference():
    """Every fourth case of each file."""
    return {name: ReferenceCases(*(v[::4] for v in cases)) for name, cases in read_reference(DATA).items()}


@pytest.fixture(scope="module")
def errors(reference, models):
    return error_table(reference, models, NU, [12, 16])


@pytest.fixture(scope="module")
def costs(reference, models):
    few = ReferenceCases(*(values[:3] for values in reference["ellipse"]))
    return time_models(models, few, NU, [12, 16], passes=2)


def test_reference_is_contacts(reference):
    cases = read_reference(DATA)
    assert {name: len(c.g) for name, c in cases.items()} == {"ellipse": 200, "sdec": 150, "extremes": 50}
    # E000 of ellipse_cases.csv: Fy = -14168.53098 N, mu N = 0.4794597789 x 124431.4442 N, Mz = -83.34726229 Nm
    first, size = cases["ellipse"], 0.4794597789 * 124431.4442
    c = np.sqrt(0.009868715807 * 0.00934581959)
    assert first.case_id[0] == "E000"
    assert first.forces[0] == pytest.approx([0, -14168.53098 / size, -83.34726229 / (size * c)], rel=1e-12)
    assert first.creepages[0, 2] == pytest.approx(0.1287533764 * 8.2e10 * c**3 / size, rel=1e-12)


def test_missing_reference_names_the_file(tmp_path):
    with pytest.raises(InputError, match=REFERENCE_FILES["ellipse"]):
        read_reference(tmp_path)


def test_errors_are_those_of_the_forces(reference, models, errors):
    cases = reference["sdec"]
    references = {"CONTACT": cases.forces, "exact": exact_forces(cases, NU, 16)}
    for model in models:
        forces, outside = law_forces(model, cases.g, cases.psi, cases.creepages)
        rows = errors[(errors.cases == "sdec") & (errors.model == model.name)]
        for against, right in references.items():
            part = rows[rows.against == against]
            assert part.case_id.tolist() == cases.case_id.tolist()
            assert part.force_error.to_numpy() == pytest.approx(np.linalg.norm((forces - right)[:, :2], axis=1))
            assert part.moment_error.to_numpy() == pytest.approx(abs((forces - right)[:, 2]))
        assert set(rows.out_of_range) == {outside}


def test_linear_law_errs_as_by_hand(reference, errors):
    """Case with the smallest creepages: -C11 xi', -C22 eta' - C23 phi', C23 eta' - C33 phi'."""
    cases = reference["ellipse"]
    i = int(np.argmin(np.linalg.norm(cases.creepages, axis=1)))
    c11, c22, c23, c33 = coefficients_at(np.log(cases.g[i]), kalker_data(NU))
    xi, eta, phi = cases.creepages[i]
    off = np.array([-c11 * xi, -c22 * eta - c23 * phi, c23 * eta - c33 * phi]) - cases.forces[i]
    rows = errors[(errors.cases == "ellipse") & (errors.model == "linear") & (errors.against == "CONTACT")]
    row = rows[rows.case_id == cases.case_id[i]].iloc[0]
    assert row.force_error == pytest.approx(np.hypot(*off[:2])) and row.moment_error == pytest.approx(abs(off[2]))


def test_exact_is_never_compared_with_itself(errors):
    exact = errors[errors.family == "exact"]
    assert set(map(tuple, exact[["model", "against"]].to_numpy())) == {
        ("exact, level 12", "CONTACT"),
        ("exact, level 12", "exact"),
        ("exact, level 16", "CONTACT"),
    }


def test_patches_that_a_table_does_not_cover_are_counted(reference, errors):
    """The plane of ellipses covers no double ellipse; a law without a table covers all."""
    counts = errors.groupby(["cases", "model"]).out_of_range.first()
    assert counts["sdec", "ellipse"] == len(reference["sdec"].g) and counts["ellipse", "ellipse"] == 0
    assert counts["sdec", "sdec"] == 0 and counts["sdec", "FASTSIM 10 x 10"] == 0


def test_laws_stand_in_the_expected_order(errors, costs):
    """Issue's bars in the exact column (1 % in all cases of level 16, tests/creep/test_halfspace.py), laws 2-20 %."""
    laws = laws_table(errors, costs, pd.DataFrame({"name": ["sdec"], "memory_MB": [2.8], "build_s": [1.7]}))
    error = laws[(laws.cases == "ellipse") & (laws.against == "CONTACT")].set_index("model").force_q95
    order = ["exact, level 16", "sdec", "FASTSIM 10 x 10", "Polach", "SHE", "linear"]
    assert error[order].is_monotonic_increasing
    assert error["exact, level 16"] < 0.006 and error["FASTSIM 10 x 10"] > 0.02


def test_quantiles_and_medians_are_numpys(errors, costs):
    tables = pd.DataFrame({"name": ["sdec"], "memory_MB": [2.8], "build_s": [1.7]})
    laws = laws_table(errors, costs, tables)
    assert len(laws) == 3 * (2 * 8 - 1)
    row = laws[(laws.cases == "sdec") & (laws.against == "exact") & (laws.model == "sdec")].iloc[0]
    part = errors[(errors.cases == "sdec") & (errors.against == "exact") & (errors.model == "sdec")]
    for name in ("force", "moment"):
        values = part[f"{name}_error"]
        found = [row[f"{name}_{q}"] for q in ("median", "q95", "q99", "max")]
        assert found == pytest.approx([*np.percentile(values, [50, 95, 99]), values.max()])
    assert row.us_per_case == pytest.approx(1e6 * costs[costs.model == "sdec"].s_per_case.median())
    assert (row.memory_MB, row.build_s) == (2.8, 1.7) and np.isnan(row.us_from_nothing)
    text = laws_markdown(laws)
    assert f"{100 * row.force_q95:.3g}" in text and "## sdec cases against the exact solver" in text
    assert "nan" not in text


def test_every_model_is_timed_in_every_pass(models, costs):
    names = [model.name for model in models] + ["exact, level 12", "exact, level 16"]
    assert costs.groupby("pass").model.unique().map(set).tolist() == [set(names)] * 2
    assert (costs.s_per_case > 0).all()
    seconds = costs.groupby(["model", "work"]).s_per_case.median()
    assert seconds["exact, level 16", "from nothing"] > seconds["exact, level 16", "ready"]


def test_contacts_points_are_the_published_ones():
    """contact_timing.csv: 30 x 30 elements, given pressure, GDsteady 0.0223079 s and 1.363 %; FASTSIM 10: 78.04 us."""
    points = contact_points(DATA).set_index(["program", "n_across"])
    assert points.loc[("CONTACT", 30)].tolist() == [0.01363, pytest.approx(22307.9)]
    assert points.loc[("CONTACT", 10)].tolist() == [0.04409, pytest.approx(598.226)]  # the other solver is faster here
    assert points.loc[("its FASTSIM", 10)].tolist() == [0.05337, pytest.approx(78.0402)]
    assert len(points) == 8


def test_curves_start_linear_and_end_at_coulomb(models):
    curves = creep_curves(models, NU, 1.0, 12, 41)
    c11 = coefficients_at(0.0, kalker_data(NU))[0]
    part = curves[curves.line == "longitudinal"]
    assert part[part.model == "linear"].fx.to_numpy() == pytest.approx(-c11 * part[part.model == "linear"].xi)
    exact, table = (part[part.model == name] for name in ("exact, level 12", "sdec"))
    assert exact.fx.iloc[-1] == pytest.approx(-1, abs=1e-3)
    assert abs(exact.fx.to_numpy() - table.fx.to_numpy()).max() < 0.02
    spin = curves[(curves.line == "spin") & (curves.model == "exact, level 12")]
    assert spin.fy.iloc[7] == pytest.approx(RollingContact(1.0, 0.0, NU, 12).solve(0.0, 0.0, spin.phi.iloc[7])[1])


@pytest.mark.parametrize("g", [0.2, 5.0])
def test_size_of_creepage_counts_the_linear_force(g):
    """Without spin the linear force is 3 r mu N."""
    kalker = kalker_data(NU)
    c11, c22, *_ = coefficients_at(np.log(g), kalker)
    creepages = sized_creepages(g, np.full(5, 0.7), np.linspace(-3, 3, 5), np.zeros(5), kalker)
    assert np.hypot(c11 * creepages[:, 0], c22 * creepages[:, 1]) == pytest.approx(np.full(5, 2.1))
    assert scales(g, c11, c22, 1.0)[0] == pytest.approx(c11 / 3)


def test_error_map_covers_the_range_with_the_tables_error(tables):
    model = table_model("sdec", tables["sdec"])
    errors = error_map(model, (8, 3), 12)
    assert errors.a_over_b.nunique() == 24 and errors.a_over_b.between(0.05, 20).all()
    assert set(np.floor(errors.psi / 0.95 * 8)) == set(range(8))
    row = errors.iloc[1234]
    creepages = sized_creepages(row.a_over_b, row["size"], row.alpha, row.beta, model.data.table.kalker)[None]
    exact = RollingContact(row.a_over_b, row.psi, NU, 12).solve_many(creepages)[0]
    off = (law_forces(model, row.a_over_b, row.psi, creepages)[0] - exact)[0]
    assert [row.force_error, row.moment_error] == pytest.approx([np.hypot(*off[:2]), abs(off[2])], abs=2e-4)
    assert (error_map(table_model("ellipse", tables["ellipse"]), (2, 1), 8).psi == 0).all()


@pytest.fixture(scope="module")
def lines(tables):
    return smoothness(table_model("sdec", tables["sdec"]), 12, 1601, 11)


def test_slope_through_zero_is_kalkers(lines):
    """The line through zero is (0.3, 0.2, 0.3) x at a/b = 1.3."""
    c11, c22, c23, c33 = coefficients_at(np.log(1.3), kalker_data(NU))
    table = lines[(lines.line == "zero") & (lines.source == "table")]
    middle = table.iloc[len(table) // 2]
    assert middle.x == pytest.approx(0, abs=1e-12)
    wanted = [-0.3 * c11, -0.2 * c22 - 0.3 * c23, 0.2 * c23 - 0.3 * c33]
    # at the distance of one point the force is off by its quadratic term
    assert middle[["dfx", "dfy", "dmz"]].tolist() == pytest.approx(wanted, abs=0.01)


def test_table_has_no_jump_in_slope_along_any_line(lines):
    table = smoothness_table(lines)
    assert set(table.line) == {"cells", "border", "axis", "zero"}
    steps = table[table.source == "table"].set_index(["line", "output"]).step_ratio
    assert (steps < 0.6).all(), steps
    assert table[table.source == "exact"].step_ratio.isna().all()
    along = lines[(lines.line == "axis") & (lines.source == "table")]
    fx = table[(table.line == "axis") & (table.source == "table") & (table.output == "fx")].iloc[0]
    assert fx.variation == pytest.approx(np.ptp(along.dfx.iloc[1:-1]) / abs(along.dfx.iloc[1:-1]).max())


@pytest.mark.parametrize(("force", "ratio"), [(np.abs, 1.0), (np.square, 0.5)])
def test_step_ratio_tells_a_jump_from_a_bend(force, ratio):
    x = np.linspace(-1, 1, 402)
    slopes = np.gradient(force(x), x)
    frame = pd.DataFrame({"x": x, "dfx": slopes, "dfy": slopes, "dmz": slopes, "line": "made", "source": "table"})
    assert smoothness_table(frame).step_ratio.tolist() == pytest.approx([ratio] * 3, abs=0.01)


TINY = ((0.5, Resolution(4, 1, 5, 8, 5, 6)),)


@pytest.fixture
def tiny(monkeypatch):
    """Tables of ellipses are tiny, and checked by a coarse solver."""
    monkeypatch.setattr(table_module, "RESOLUTIONS", {"ellipse": TINY})
    monkeypatch.setattr(table_module, "CHECK_LEVEL", 6)


def test_timed_table_is_the_built_one(tiny):
    table, row = timed_table("one", 0.3, "ellipse", 0.5)
    built = build_table(0.3, "ellipse", 0.5)
    assert np.array_equal(table.data.coefficients, built.data.coefficients)
    assert row["name"] == "one" and row["build_s"] > 0 and row["memory_MB"] == table.data.coefficients.nbytes / 1e6
    assert row["force_error_99 %"] == table.force_error[2]


KILLED = """
import os, signal, sys
from contextlib import contextmanager
from wrcore.creep import table
os.environ["WRCORE_CACHE"] = sys.argv[1]
table.RESOLUTIONS, table.CHECK_LEVEL = {{"ellipse": ((0.5, table.Resolution(4, 1, 5, 8, 5, 6)),)}}, 6
def kill(*_):
    os.kill(os.getpid(), signal.SIGKILL)
def half(patches):
    for i, patch in enumerate(patches):
        {solving}
        yield patch
whole = table.new_hdf5
@contextmanager
def half_written(path):
    with whole(path) as file:
        file["begun"] = 1
        kill()
        yield file
{writing}
table.ensure_table(0.33, "ellipse", 0.9, half)
"""


@pytest.mark.parametrize(
    ("solving", "writing"), [("kill() if i == 2 else None", ""), ("", "table.new_hdf5 = half_written")]
)
def test_killed_build_starts_over_and_the_table_is_found_again(tmp_path, monkeypatch, tiny, solving, writing):
    """A table of another nu, killed while solving or while writing, then built, cached and found again."""
    script = KILLED.format(solving=solving or "pass", writing=writing)
    died = subprocess.run([sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True)
    assert died.returncode == -9, died.stderr
    monkeypatch.setenv("WRCORE_CACHE", str(tmp_path))
    assert not table_path(0.33, "ellipse", 0.9).exists()
    built = ensure_table(0.33, "ellipse", 0.9)
    assert built.nu == 0.33 and table_path(0.33, "ellipse", 0.9).is_file()
    monkeypatch.setattr(table_module, "build_data", None)
    assert np.array_equal(ensure_table(0.33, "ellipse", 0.9).data.coefficients, built.data.coefficients)
