"""CSV files of any editor: read as they are meant, or one clear line."""

import pytest

from wrcore.errors import InputError
from wrcore.errors.column_files import read_column_file, read_table, split_unit

PLAIN = "pose_id,y_m,yaw_rad\n007,0.001,0\nb,0.002,0.5\n"
TAIL = PLAIN[:22] + PLAIN[22:].replace("\n", ",\n")


@pytest.fixture
def read(tmp_path):
    def read(content):
        path = tmp_path / "file.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_table(path, "pose_id", ("y_m", "yaw_rad"))

    return read


@pytest.mark.parametrize("content", [
    PLAIN, PLAIN.replace("\n", "\r\n"), PLAIN.replace("\n", "\r"), "\ufeff" + PLAIN, "\ufeff# a comment\n" + PLAIN,
    PLAIN.replace(",", "\t"), PLAIN.replace(",", ";"), PLAIN.replace(",", " , "), PLAIN.replace(",", ",\t"),
    PLAIN.replace("\n", "\r\n\r\n"), PLAIN.replace("pose_id", '"pose_id"'), TAIL,
    PLAIN.encode("utf-16"), PLAIN.replace(",", ";").replace(".", ","), PLAIN.replace(",", "\t").replace(".", ","),
    PLAIN.replace(",", " ").replace(".", ","), '"' + PLAIN.replace(",", '","').replace("\n", '"\n"').rstrip('"'),
    "pose_id,y_mm,yaw_mrad\n007,1,0\nb,2,500\n", "pose_id;y [mm];yaw (mrad)\n007;1,0;0\nb;2,0;500,0\n",
    "pose_id,y,yaw\n-,mm,rad\n007,1,0\nb,2,0.5\n", PLAIN.replace("0.5", "0.5 # a remark"),
    PLAIN.replace("0.002", "2e-3").replace("0.001", "1.0D-03"), "! a comment\n" + PLAIN,
    "'" + PLAIN.replace(",", "','").replace("\n", "'\n'").rstrip("'"),
    "pose_id,y,yaw\n-,[mm],[rad]\n007,1,0\nb,2,0.5\n",
    "pose_id;y;yaw\n;(mm);(mrad)\n007;1,0;0\nb;2,0;500,0\n", PLAIN.replace("pose_id", "'pose_id'"),
])  # fmt: skip
def test_files_of_any_editor(read, content):
    frame = read(content)
    assert frame["pose_id"].tolist() == ["007", "b"] and list(frame.columns) == ["pose_id", "y_m", "yaw_rad"]
    assert frame["y_m"].tolist() == pytest.approx([0.001, 0.002], rel=1e-14)
    assert frame["yaw_rad"].tolist() == pytest.approx([0.0, 0.5], rel=1e-14)


@pytest.mark.parametrize("content, says", [
    ("pose_id,y_m\na,0.001,0.002\n", "2 cells in each row"),  # the first cell would become an index, all others shift
    ("pose_id,y_m,y_m\na,0,0\n", "y_m twice"), ("", "header line"),
    ("pose_id,y\na,0\n", "such as y_m or y_mm, got 'y' without"),
    ('pose_id,y_m\n"a,0\nb,0\n', "line 2: expected quotes that end"),
    ('pose_id,"y_m\na,0\n', "line 1: expected quotes"),
])  # fmt: skip
def test_other_files_are_one_clear_line(read, content, says):
    with pytest.raises(InputError, match=says):
        read(content)


def test_names_are_text_whatever_they_say(read):
    frame = read("y_m,pose_id\nNA,NA\n0,null\n,\n1\n")
    assert frame["pose_id"].tolist() == ["NA", "null", "", ""]
    assert frame["y_m"].isna().tolist() == [True, False, True, False]


@pytest.mark.parametrize(("name", "base", "unit"), [
    ("u_mm", "u", "mm"), ("U [mm]", "u", "mm"), ("left lateral (m)", "left_lateral", "m"), ("yaw/mrad", "yaw", "mrad"),
    ("f in inch", "f", "inch"), ("V_m_per_s", "v", "m_per_s"), ("V [km/h]", "v", "km/h"), ("phi_per_m", "phi", "per_m"),
    ("cross-level, [mm]", "cross_level", "mm"), ("left_lateral", "left_lateral", ""), ("mu", "mu", ""),
])  # fmt: skip
def test_header_name_and_unit_are_told_apart(name, base, unit):
    assert split_unit(name) == (base, unit)


def test_columns_beside_known_ones_keep_their_names_and_numbers(read):
    frame = read("pose_id,y_mm,a remark,Load_kN\na,1,good,5\n")
    assert frame.to_dict("list") == {"pose_id": ["a"], "y_m": [0.001], "a remark": ["good"], "Load_kN": [5.0]}


def test_columns_of_one_name_are_refused(tmp_path):
    """The first one would be taken without a word."""
    path = tmp_path / "file.csv"
    path.write_text("u_mm,f_mm,f_mm\n0,1,2\n")
    with pytest.raises(InputError, match="line 1: expected each column once, got f_mm twice"):
        read_column_file(path)


def test_station_with_decimal_commas_keeps_the_files_mark(tmp_path):
    """A cell that a reader has put in place of 12+450,25 has a point; the file has commas alone."""
    path = tmp_path / "file.csv"
    path.write_text("s_m;level_m\n12+450,25;0,001\n")
    file = read_column_file(path)
    file.cells[0][0] = "12450.25"
    assert file.numbers([0, 1]).tolist() == [[12450.25, 0.001]]
