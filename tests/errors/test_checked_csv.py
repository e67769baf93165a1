"""CSV files of any editor: read as they are meant, or one clear line."""

import pytest

from wrcore.errors import InputError
from wrcore.errors.checked_csv import read_csv_table

PLAIN = "pose_id,y_m,yaw_rad\n007,0.001,0\nb,0.002,0.5\n"
TAIL = PLAIN[:22] + PLAIN[22:].replace("\n", ",\n")


@pytest.fixture
def read(tmp_path):
    def read(content):
        path = tmp_path / "file.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_csv_table(path, "pose_id")

    return read


@pytest.mark.parametrize("content", [
    PLAIN, PLAIN.replace("\n", "\r\n"), PLAIN.replace("\n", "\r"), "\ufeff" + PLAIN, "\ufeff# a comment\n" + PLAIN,
    PLAIN.replace(",", "\t"), PLAIN.replace(",", ";"), PLAIN.replace(",", " , "), PLAIN.replace(",", ",\t"),
    PLAIN.replace("\n", "\r\n\r\n"), PLAIN.replace("pose_id", '"pose_id"'), TAIL,
])  # fmt: skip
def test_files_of_any_editor(read, content):
    frame = read(content)
    assert frame.to_dict("list") == {"pose_id": ["007", "b"], "y_m": [0.001, 0.002], "yaw_rad": [0.0, 0.5]}


@pytest.mark.parametrize("content, says", [
    ("pose_id,y_m\na,0.001,0.002\n", "2 cells in each row"),  # the first cell would become an index, all others shift
    ("pose_id,y_m,y_m\na,0,0\n", "Duplicate"), ("", "header line"), (PLAIN.encode("utf-16"), "UTF-8"),
    ('pose_id,y_m\n"a,0\nb,0\n', "header line"),
])  # fmt: skip
def test_other_files_are_one_clear_line(read, content, says):
    with pytest.raises(InputError, match=says):
        read(content)


def test_names_are_text_whatever_they_say(read):
    frame = read("y_m,pose_id\nNA,NA\n0,null\n,\n1\n")
    assert frame["pose_id"].tolist() == ["NA", "null", "", ""]
    assert frame["y_m"].isna().tolist() == [True, False, True, False]
