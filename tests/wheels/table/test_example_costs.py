"""Examples with both patch models in turn."""

from tests.wheels.table.example_costs import PATCHES, costs
from wrcore.wheels.table import store as pair_store


def test_cells_are_put_together_anew_in_every_run(monkeypatch, tmp_path):
    put, keep = [], pair_store.Pair._keep
    monkeypatch.setattr(pair_store, "table_folder", lambda: tmp_path)  # no other process adds to these
    monkeypatch.setattr(pair_store.Pair, "_keep", lambda pair, *cell: put.append(cell[0]) or keep(pair, *cell))
    times = costs("suspended_wheelset", 2, integration__duration=0.05)
    assert tuple(times) == PATCHES and all(len(one) == 2 and one.min() > 0.0 for one in times.values())
    assert len(put) == 3 * len(set(put)) > 0
