"""Tables of rails that change are kept, and made anew where what is kept is not whole."""

import numpy as np
import pytest

from tests.track.crossing_rails import write_rail
from wrcore.contact.changing_rails.out_of_round import SlicedWheel
from wrcore.contact.changing_rails.section_table import shape_table
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.geometry.changing_rails.files import read_slices
from wrcore.geometry.profiles.standards import named_profile
from wrcore.scene.parts import kept_tables
from wrcore.scene.parts.kept_tables import TABLE_FIELDS, kept_shape, kept_table


def numbers(table):
    return [np.asarray(part) for part in (*(getattr(table, name) for name in TABLE_FIELDS), *table.geometry)]


def test_a_kept_table_is_the_one_that_was_made(tmp_path, monkeypatch):
    folder = tmp_path / "tables"
    folder.mkdir()
    monkeypatch.setattr(kept_tables, "table_folder", lambda: folder)
    pair = WheelOnRail(named_profile("cone:1/20", "wheel"), named_profile("circle:0.3", "rail", 0.0))
    rails = [read_slices(write_rail(tmp_path, [0.0, 0.02, 0.04], lambda s, f=f: f * s)) for f in (0.01, 0.02)]
    rails = [rail.along(pair.rail) for rail in rails]
    made = kept_table(pair, rails[0], False)
    (path,) = folder.glob("seen_*.npz")
    whole = path.read_bytes()
    monkeypatch.setattr(kept_tables, "section_table", lambda *more: pytest.fail("made anew"))
    for one, other in zip(numbers(made), numbers(kept_table(pair, rails[0], False)), strict=True):
        np.testing.assert_array_equal(one, other)
    monkeypatch.undo()
    monkeypatch.setattr(kept_tables, "table_folder", lambda: folder)
    path.write_bytes(whole[: len(whole) // 2])
    np.testing.assert_array_equal(kept_table(pair, rails[0], False).sections, made.sections)
    assert path.read_bytes()[:4] == whole[:4] and path.stat().st_size == len(whole)
    assert not np.array_equal(kept_table(pair, rails[1], False).sections, made.sections)
    assert not np.array_equal(kept_table(pair, rails[0], True).sections, made.sections)
    assert len(list(folder.glob("seen_*.npz"))) == 3


def test_numbers_of_a_table_are_those_of_its_form(tmp_path, monkeypatch):
    """Where this fails, tables have other numbers than `FORM` says: count it up, and put the new numbers here."""
    monkeypatch.setattr(kept_tables, "table_folder", lambda: tmp_path)
    pair = WheelOnRail(named_profile("cone:1/20", "wheel"), named_profile("circle:0.3", "rail", 0.0))
    rail = read_slices(write_rail(tmp_path, [0.0, 0.02, 0.04], lambda s: 20.0 * s * s)).along(pair.rail)
    table = kept_table(pair, rail, False)
    assert kept_tables.FORM == 1 and (table.begin, table.step) == pytest.approx((-0.2, 0.002))
    section = 2.726300994839e-2, 0.1714213350854, -3.481424511812, 1.847898901318e-2, 183.5510713101
    np.testing.assert_allclose(table.sections[111, 0, :, 298], section, rtol=1e-7)
    np.testing.assert_allclose(table.strips[:, 298], [2.175657337727, -0.015605625169], rtol=1e-9)
    assert table.bounds.mean() == pytest.approx(-0.010229962580443312, rel=1e-7)


@pytest.mark.parametrize("fault", ["a byte", "all of another", "no seal", "objects", "empty"])
def test_kept_table_damaged_is_made_anew_without_a_word(tmp_path, monkeypatch, capsys, fault):
    monkeypatch.setattr(kept_tables, "table_folder", lambda: tmp_path)
    pair = WheelOnRail(named_profile("cone:1/20", "wheel"), named_profile("circle:0.3", "rail", 0.0))
    rail = read_slices(write_rail(tmp_path, [0.0, 0.02, 0.04], lambda s: 0.01 * s)).along(pair.rail)
    made = kept_table(pair, rail, False)
    (path,) = tmp_path.glob("seen_*.npz")
    whole = path.read_bytes()
    random = np.random.default_rng(3)
    for place in random.integers(0, len(whole), 30) if fault == "a byte" else [0]:
        if fault == "a byte":
            path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x11]) + whole[place + 1 :])
        elif fault == "all of another":
            with np.load(path) as found:
                parts = {name: found[name] for name in found.files}
            np.savez(path, **parts | {"sections": parts["sections"] + 1e-3})
        elif fault == "objects":
            np.savez(path, sections=np.array([{}], object))
        else:
            path.write_bytes(whole[: -kept_tables.SEAL] if fault == "no seal" else b"")
        np.testing.assert_array_equal(kept_table(pair, rail, False).sections, made.sections)
        assert path.read_bytes()[:4] == whole[:4] and path.stat().st_size == len(whole)
    assert capsys.readouterr().err == ""


def test_so_is_that_of_a_wheel_of_slices(tmp_path, monkeypatch):
    """Which hangs on its sections and their angles."""
    monkeypatch.setattr(kept_tables, "table_folder", lambda: tmp_path)
    wheel, rail = named_profile("cone:1/20", "wheel"), named_profile("circle:0.3", "rail", 0.0)
    pair, made = WheelOnRail(wheel, rail), []
    monkeypatch.setattr(kept_tables, "shape_table", lambda *given: made.append(given) or shape_table(*given))
    u = np.linspace(-0.003, 0.003, 30)
    for k, deep in enumerate((0.0, 1e-4, 2e-4)):
        points = np.column_stack([u, wheel(u) + deep])
        np.savetxt(tmp_path / f"{k}.csv", points, fmt="%.12g", delimiter=",", header="u_m,f_m", comments="")
    tables = []
    for last, end in ((1, 0.2), (1, 0.2), (2, 0.2), (1, 0.3)):
        rows = [f"{angle:g},{k}.csv" for angle, k in ((-0.2, 0), (0.0, last), (end, 0))]
        (tmp_path / "wheel.csv").write_text("\n".join(["angle_rad,profile", *rows]))
        shape = SlicedWheel(read_slices(tmp_path / "wheel.csv", "wheel"), pair.rolling_radius)
        tables.append(kept_shape(pair, shape).sections)
    assert len(made) == 3
    np.testing.assert_array_equal(tables[0], tables[1])
    assert not np.array_equal(tables[0], tables[2]) and not np.array_equal(tables[0], tables[3])
