"""Two runs beside each other: differences put into a run come out of its comparison, at the times that both have."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from tests.synthetic import hunting_run
from wrcore.analysis.legible import findings
from wrcore.cli import main


def rows(found):
    return found.table.set_index(["group", "channel"])


def changed(**options):
    """The hunting run with 0.1 mm, and a bump of another 1 mm at 2 s, more of y, and 1 % more of the left wheel's N."""
    run = hunting_run(**options)
    run.groups["wheelset"]["y_m"] = run["wheelset"].y_m + 1e-4 + 1e-3 * (np.abs(run.t - 2.0) < 1e-9)
    run.groups["wheelset/left"]["N_N"] = 1.01 * run["wheelset/left"].N_N
    return run


def test_differences_that_were_put_in_come_out():
    one, other = hunting_run(), changed()
    table = rows(wr.compare(one, other))
    y, count = table.loc["wheelset", "y_m"], len(one.t)
    assert y["max"] == pytest.approx(1.1e-3) and y["t_max_s"] == 2.0 and y["compared"] == 1.0
    assert y["rms"] == pytest.approx(np.sqrt((1.1e-3**2 + (count - 1) * 1e-4**2) / count))
    assert y["mean"] == pytest.approx(1e-4 + 1e-3 / count)
    assert y["scale"] == pytest.approx(max(np.std(run["wheelset"].y_m) for run in (one, other)))
    force = table.loc["wheelset/left", "N_N"]
    assert force["scale"] == pytest.approx(1.01 * 8.9e3) and force["relative"] == pytest.approx(0.01 / 1.01)
    assert table.loc["wheelset/right", "N_N"]["rms"] == 0.0 and table.loc["wheelset/left", "Q_N"]["rms"] > 80.0
    assert table["error"].isna().all() and np.isfinite(table["relative"]).all()
    back = rows(wr.compare(other, one)).loc["wheelset", "y_m"]
    assert back["mean"] == -y["mean"] and back["rms"] == y["rms"] and back["relative"] == y["relative"]


def test_what_hardly_moves_is_no_scale():
    """Noise of one body is measured by the motion of another one."""
    one, other = hunting_run(), hunting_run()
    for run, noise in ((one, 1e-18), (other, -1e-18)):
        run.groups["car_body"] = {"y_m": np.full_like(run.t, noise)}
    found = rows(wr.compare(one, other))
    assert 0.0 < found.loc["car_body", "y_m"]["relative"] < 1e-12


def test_rounding_is_no_scale():
    one, other = hunting_run(), hunting_run()
    for run, size in ((one, 1e-14), (other, -1e-14)):
        run.groups["wheelset"]["roll_rad"] = size * np.sin(run.t)
    assert rows(wr.compare(one, other)).loc["wheelset", "roll_rad"]["relative"] < 1e-4


def test_a_steady_difference_is_its_own_scale():
    """Speeds that differ by 20 m/s and waver by micrometres a second differ wholly, not ten million times."""
    one, other = hunting_run(), hunting_run()
    for run, speed in ((one, 20.0), (other, 40.0)):
        run.groups["wheelset"]["vx_m_per_s"] = speed + 1e-6 * np.sin(run.t)
    row = rows(wr.compare(one, other)).loc["wheelset", "vx_m_per_s"]
    assert row["scale"] == pytest.approx(20.0) and row["relative"] == pytest.approx(1.0)


def test_only_times_that_both_have_count():
    one, other = hunting_run(), changed(duration=2.5)
    other.t, end = other.t[::5], None
    for group in other.groups.values():
        group.update({name: values[::5] for name, values in group.items()})
    found = wr.compare(one, other)
    np.testing.assert_allclose(found.t, other.t[:end], atol=1e-12)
    assert rows(found).loc["wheelset", "y_m"]["max"] == pytest.approx(1.1e-3)
    other.t = other.t + 1e-3
    with pytest.raises(wr.InputError, match="compare: t: expected two runs with at least two output times in common"):
        wr.compare(one, other)


def test_patches_are_compared_where_both_wheels_have_equally_many():
    """A flange patch is no tread patch: with the times of two against one patch the angle would differ by 1.2 rad."""
    one, other = hunting_run(flange_at=1.0), hunting_run(flange_at=3.0)
    row = rows(wr.compare(one, other)).loc["wheelset/left", "contact_angle_rad"]
    alike = (one.t < 1.0) | (one.t >= 3.0)
    assert row["compared"] == pytest.approx(alike.mean()) and row["max"] == 0.0


def test_errors_that_runs_state_are_handed_on():
    one, other = hunting_run(), changed()
    one.settings |= {"accuracy_of": "y", "accuracy_found": 3e-6}
    other.settings |= {"accuracy_of": "y", "accuracy_found": 4e-6}
    other.counters["look_up_normal_error"] = 0.02
    table = rows(wr.compare(one, other))
    assert table.loc["wheelset", "y_m"]["error"] == pytest.approx(5e-6)
    assert table.loc["wheelset/left", "N_N"]["error"] == pytest.approx(0.02 * 1.01 * 8.9e3)
    assert np.isnan(table.loc["wheelset/left", "y_m"]["error"]) and np.isnan(table.loc["wheelset", "yaw_rad"]["error"])


def test_a_run_to_an_accuracy_states_it():
    scene = wr.load_scene(wr.example("suspended_wheelset"), integration__duration=0.1)
    run, accuracy = wr.simulate_to_accuracy(scene, 1e-5)
    assert run.settings["accuracy_found"] == accuracy.found and run.settings["accuracy_of"] == "y"
    error = rows(wr.compare(run, run)).loc["wheelset", "y_m"]["error"]
    assert error == pytest.approx(np.sqrt(2.0) * accuracy.found)


def test_what_was_changed_and_where_it_shows_most(capsys):
    one = hunting_run()
    other = dataclasses.replace(changed(), scene={**one.scene, "speed": 21.0, "contact": {"detection": "spatial"}})
    found = wr.compare(one, other)
    assert found.changes == {"speed": (20.0, 21.0), "contact.detection": ("planar", "spatial")}
    said = repr(found)
    assert "contact.detection: 'planar', 'spatial'" in said and "801 times, 0 to 4 s" in said
    summary = found.summary
    assert summary["relative"].is_monotonic_decreasing and summary["group"].tolist().count("wheelset") == 14
    assert summary.set_index("channel").loc["N_N", "group"] == "wheelset/left"


def test_bodies_of_one_run_alone_are_named():
    one, other = hunting_run(), hunting_run()
    other.groups["car_body"] = {"y_m": np.zeros_like(other.t)}
    said = repr(wr.compare(one, other))
    assert "only the second run has car_body: not compared" in said and "first run" not in said
    one.groups |= {f"axle_box_{k}": {"y_m": np.zeros_like(one.t)} for k in range(8)}
    assert "axle_box_5 and 2 more: not compared" in repr(wr.compare(one, other))
    assert "only" not in repr(wr.compare(one, one))


def test_its_picture_shows_both_runs_their_difference_and_the_error():
    one, other = hunting_run(), changed()
    one.settings |= {"accuracy_of": "y", "accuracy_found": 5e-4}
    figure = wr.compare(one, other).plot()
    assert findings(figure) == []
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels[::2] == ["y / mm", "yaw / mrad", "Q / kN", "Y / kN"] and labels[1] == "difference / mm"
    apart = figure.axes[1].lines[0].get_ydata()
    assert apart.max() == pytest.approx(1.1) and len(figure.axes[1].patches) == 1 and not figure.axes[3].patches
    assert figure.axes[4].get_title(loc="left") == "wheelset/left"
    assert len(wr.compare(one, other).plot("wheelset/left.xi", "wheelset.sum_Y_N").axes) == 4
    with pytest.raises(wr.InputError, match=r"did you mean 'wheelset.y_m'\?"):
        wr.compare(one, other).plot("wheelset.ym")


def test_command(tmp_path, capsys):
    paths = [str(tmp_path / name) for name in ("a.h5", "b.h5")]
    for path, run in zip(paths, (hunting_run(), changed()), strict=True):
        run.save(path)
    out, picture = tmp_path / "table.csv", tmp_path / "both.png"
    assert main(["compare", *paths, "--out", str(out), "--plot", str(picture)]) == 0
    assert "wheelset/left" in capsys.readouterr().out and picture.read_bytes().startswith(b"\x89PNG")
    written, found = pd.read_csv(out), wr.compare(*paths).table
    np.testing.assert_allclose(written["rms"], found["rms"], rtol=1e-10)
    assert main(["compare", paths[0], str(tmp_path / "none.h5")]) == 2
    assert "none.h5: expected" in capsys.readouterr().err
    assert main(["compare", *paths, "--plot", str(tmp_path / "x.csv")]) == 2
    assert "--plot" in capsys.readouterr().err


def test_runs_without_a_channel_in_common_are_refused():
    other = hunting_run()
    other.groups = {"car": other.groups["wheelset"]}
    with pytest.raises(wr.InputError, match="compare: channels: expected two runs with a channel in common"):
        wr.compare(hunting_run(), other)
