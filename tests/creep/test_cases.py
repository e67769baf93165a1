"""Lists of cases in SI units: every model, the order of rows, mixed materials, and refusals."""

import numpy as np
import pandas as pd
import pytest

from wrcore.creep import cases as cases_module
from wrcore.creep.cases import MODELS, NUMBERS, creep_force, read_cases, solve_cases
from wrcore.creep.table import ensure_table
from wrcore.errors import InputError

GOOD = {
    "case_id": "one", "a_m": 5e-3, "b_neg_m": 4e-3, "b_pos_m": 6e-3, "N_N": 8e4, "mu": 0.3, "G_Pa": 82e9, "nu": 0.28,
    "xi": 1e-3, "eta": -5e-4, "phi_per_m": 0.2,
}  # fmt: skip


def frame(**changes):
    return pd.DataFrame([{**GOOD, **changes}])


@pytest.fixture(scope="module")
def table():
    """The one of the tests' runs, too: it is in the cache."""
    return ensure_table(0.28, "sdec", 0.05)


def test_exact_model_gives_contacts_forces(sdec_cases):
    """In newtons and newton metres about the middle of the bounding box; 1 % of mu N (c)."""
    some = sdec_cases.frame.iloc[::12]
    out = solve_cases(some, "exact", level=16)
    size = some.mu * some.N_N
    for name, unit in (("Fx_N", size), ("Fy_N", size), ("Mz_Nm", size * sdec_cases.c[::12])):
        assert abs(out[name].to_numpy() - some[name].to_numpy()).max() < 0.01 * unit.max()
        assert (abs(out[name].to_numpy() - some[name].to_numpy()) / unit).max() < 0.01
    assert list(out.columns) == ["case_id", "Fx_N", "Fy_N", "Mz_Nm"]
    assert list(out.case_id) == list(some.case_id)
    assert out.attrs == {"not_converged": 0, "out_of_range": 0}


@pytest.mark.parametrize("model", MODELS)
def test_rows_keep_their_order_with_mixed_materials(model, table, ellipse_cases):
    """A shuffled list gives the shuffled result; nu differs from row to row where the model allows it."""
    some = ellipse_cases.frame.head(12).copy()
    if model != "table":
        some["nu"] = np.tile([0.0, 0.3, 0.5], 4)
    order = np.random.default_rng(0).permutation(12)
    straight = solve_cases(some, model, table, level=8)
    shuffled = solve_cases(some.iloc[order], model, table, level=8)
    pd.testing.assert_frame_equal(shuffled, straight.iloc[order].reset_index(drop=True), rtol=1e-3)


def test_table_agrees_with_exact(table):
    """1 % of mu N = 240 N."""
    exact, looked = (solve_cases(frame(), model, table, level=20).iloc[0] for model in ("exact", "table"))
    assert [looked.Fx_N, looked.Fy_N] == pytest.approx([exact.Fx_N, exact.Fy_N], abs=240)


def test_creepages_by_their_other_names_are_the_same():
    other = frame().rename(columns={"xi": "ux", "eta": "uy"})
    pd.testing.assert_frame_equal(solve_cases(other, "linear"), solve_cases(frame(), "linear"))


def test_out_of_range_patches_are_counted(table):
    assert solve_cases(frame(a_m=0.2), "table", table).attrs["out_of_range"] == 1
    assert solve_cases(frame(), "table", table).attrs["out_of_range"] == 0
    assert solve_cases(frame(a_m=0.2), "linear").attrs["out_of_range"] == 1


def test_tables_are_made_for_each_material(table, monkeypatch):
    """Without a table each nu gets its own from the cache, of ellipses where all patches are."""
    asked = []
    monkeypatch.setattr(cases_module, "_OPEN", {})
    monkeypatch.setattr(cases_module, "ensure_table", lambda nu, planes, *rest: asked.append((nu, planes)) or table)
    both = pd.concat([frame(), frame(nu=0.3)], ignore_index=True)
    solve_cases(both, "table")
    solve_cases(frame(b_neg_m=6e-3), "table")
    assert asked == [(0.28, "sdec"), (0.3, "sdec"), (0.28, "ellipse")]


def test_a_table_is_read_once_for_all_calls(table, monkeypatch):
    """Reading it took five times as long as a look-up."""
    asked = []
    monkeypatch.setattr(cases_module, "_OPEN", {})
    monkeypatch.setattr(cases_module, "ensure_table", lambda *what: asked.append(what) or table)
    patch = {"a": 6e-3, "b": 4e-3, "normal_force": 5e4, "xi": 1e-3, "eta": 2e-4, "phi": 0.1}
    forces = [creep_force("table", **patch) for _ in range(3)]
    assert len(asked) == 1 and forces[0] == forces[1] == forces[2] == creep_force("table", **patch, table=table)
    creep_force("table", **patch, psi=0.1)
    assert len(asked) == 2 and cases_module._OPEN.keys() == {(0.28, "ellipse"), (0.28, "sdec")}


def test_forces_of_arrays_are_those_of_a_list_of_cases(table):
    many = pd.concat([frame()] * 6, ignore_index=True).assign(xi=np.linspace(-2e-3, 2e-3, 6), case_id=range(6))
    listed = solve_cases(many, "table", table)
    xi = many["xi"].to_numpy().reshape(2, 3)
    found = creep_force("table", 5e-3, 5e-3, 8e4, xi, -5e-4, 0.2, 0.3, 82e9, 0.28, table, psi=0.2)
    for name, force in zip(("Fx_N", "Fy_N", "Mz_Nm"), found, strict=True):
        assert force.shape == (2, 3)
        np.testing.assert_allclose(np.ravel(force), listed[name], rtol=1e-12)


@pytest.mark.parametrize("name", [*NUMBERS, "case_id"])
def test_missing_column(name):
    with pytest.raises(InputError, match=rf"in\.csv: {name}: expected columns"):
        solve_cases(frame().drop(columns=name), "linear", source="in.csv")


@pytest.mark.parametrize("value", [np.nan, np.inf, "many", None, ""])
@pytest.mark.parametrize("name", NUMBERS)
def test_not_a_number(name, value):
    two = pd.concat([frame(), frame(**{name: value})], ignore_index=True)
    with pytest.raises(InputError, match=rf"in\.csv: {name}, row 2: expected a finite number"):
        solve_cases(two, "linear", source="in.csv")


@pytest.mark.parametrize("value", [0.0, -1e-3])
@pytest.mark.parametrize("name", ["a_m", "b_neg_m", "b_pos_m", "N_N", "mu", "G_Pa"])
def test_not_positive(name, value):
    with pytest.raises(InputError, match=rf"{name}, row 1: expected a number above 0"):
        solve_cases(frame(**{name: value}), "linear")


def test_impossible_material_and_model(table):
    with pytest.raises(InputError, match="nu, row 1: expected 0 to 0.5, got 0.7"):
        solve_cases(frame(nu=0.7), "linear")
    with pytest.raises(InputError, match="model: expected one of table, linear"):
        solve_cases(frame(), "kalker")
    with pytest.raises(InputError, match="nu, row 1: expected the table's 0.28, got 0.3"):
        solve_cases(frame(nu=0.3), "table", table)


@pytest.mark.parametrize("psi", [-1.0, 1.0, [0.0, 2.0]])
def test_a_shape_number_beyond_the_patch_is_named(psi):
    with pytest.raises(InputError, match="creep_force: psi: expected"):
        creep_force("exact", 6e-3, 4e-3, 5e4, 1e-3, 0.0, 0.0, psi=psi)


@pytest.mark.parametrize("model", ["linear", "polach", "exact"])
@pytest.mark.parametrize("change", [{"xi": 1e300}, {"phi_per_m": -1e300}, {"N_N": 1e-300}, {"a_m": 1e200}])
def test_what_overflows_is_refused(model, change):
    with pytest.raises(InputError, match="xi, eta, phi_per_m, row 1: expected creepages times"):
        solve_cases(frame(**change), model)


def test_no_rows():
    assert len(solve_cases(frame().iloc[:0], "exact")) == 0 and len(solve_cases(frame().iloc[:0], "table")) == 0


def test_file_is_named_in_messages(tmp_path):
    path = tmp_path / "in.csv"
    frame(mu=-0.3).to_csv(path, index=False)
    with pytest.raises(InputError, match=r"in\.csv: mu, row 1: expected a number above 0, got -0.3"):
        solve_cases(read_cases(path), "linear")


def test_names_of_cases_stay_text(tmp_path):
    frame(case_id="007").to_csv(tmp_path / "in.csv", index=False)
    assert list(solve_cases(read_cases(tmp_path / "in.csv"), "linear").case_id) == ["007"]


@pytest.mark.parametrize("content", [None, "", 'case_id,"a_m\n1,2'])
def test_unreadable_files(tmp_path, content):
    path = tmp_path / "in.csv"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match="expected a CSV file with a header line|line 1: expected quotes that end"):
        read_cases(path)
