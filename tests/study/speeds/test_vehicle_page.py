"""The page of vehicle values."""

from study.speeds.vehicle_page import vehicle_page
from tests.conftest import ROOT


def test_every_line_of_every_vehicle_file_is_there_and_marks_are_set_off(tmp_path):
    paths = sorted((ROOT / "config" / "vehicles").glob("*.yaml"))
    assert len(paths) >= 3
    page = vehicle_page(paths)
    text = page.replace("<mark>", "").replace("</mark>", "").replace("&lt;", "<").replace("&gt;", ">")
    for path in paths:
        assert f"<h2>{path.name}</h2>" in page
        for line in path.read_text(encoding="utf-8").splitlines():
            assert line.replace("&", "&amp;") in text
    own = tmp_path / "own.yaml"
    own.write_text("mass: 1.0  # CHOSEN, not unCHOSENed <b>", encoding="utf-8")
    assert "# <mark>CHOSEN</mark>, not unCHOSENed &lt;b&gt;" in vehicle_page([own])
