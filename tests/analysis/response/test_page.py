"""reports/response.md works as written."""

from tests.conftest import ELLIPTIC
from tests.pages import run_blocks


def test_every_block_runs(tmp_path, monkeypatch):
    (tmp_path / "config").symlink_to(ELLIPTIC.parent)
    monkeypatch.chdir(tmp_path)
    run_blocks("response.md")
    assert (tmp_path / "bode.png").stat().st_size > 10_000
