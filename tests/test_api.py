"""The interface that a person types: three lines to a run, completion, tables, figures, progress and doctests."""

import doctest
import importlib
import inspect
import subprocess
import sys
import time
import tomllib

import matplotlib
import numpy as np
import pytest
from synthetic import hunting_run

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT, SCENES

PUBLIC = sorted(set(wr.__all__) - {"__version__"})
DOCUMENTED = sorted(
    {getattr(wr, name).__module__ for name in PUBLIC}
    | {"wrcore.run.output.channels", "wrcore.run.progress", "wrcore.reference"}
)


@pytest.mark.parametrize("name", DOCUMENTED)
def test_examples_in_docstrings_run_as_written(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    result = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.attempted > 0 and result.failed == 0


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_name_has_an_example_and_types(name):
    public = getattr(wr, name)
    assert ">>> " in public.__doc__.partition("Examples\n")[2]
    if inspect.isfunction(public):
        signature = inspect.signature(public)
        parts = {key: part.annotation for key, part in signature.parameters.items()}
        missing = [key for key, part in parts.items() if part is inspect.Parameter.empty]
        assert missing == [] and signature.return_annotation is not inspect.Signature.empty


def test_types_are_checked_where_public_names_are_defined():
    files = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["mypy"]["files"]
    modules = {getattr(wr, name).__module__.replace(".", "/") for name in PUBLIC}
    assert [m for m in modules if not {f"{m}.py", f"{m}/__init__.py", "/".join(m.split("/")[:2])} & {*files}] == []


def test_a_path_a_dict_and_a_scene_with_changes_give_the_same_run():
    path = ELLIPTIC / "suspended_wheelset.yaml"
    changes = {"speed": 30, "integration": {"duration": 0.05}}
    scene = wr.load_scene(path, ["speed=30", "integration.duration=0.05"])
    vehicle = str(ELLIPTIC.parent / "vehicles" / "suspended_wheelset.yaml")
    content = {**wr.load_scene(path).data, "vehicle": {"parameters": vehicle}}
    runs = [
        wr.simulate(scene),
        wr.simulate(path, **changes),
        wr.simulate(content, speed=np.int64(30), integration__duration=np.float64(0.05)),
        wr.simulate(wr.load_scene(path), overrides={"speed": 30, "integration.duration": 0.05}),
        *wr.simulate_many([scene, scene], threads=2),
    ]
    for run in runs:
        assert run.scene["speed"] == 30 and run.t[-1] == 0.05
        np.testing.assert_array_equal(run["wheelset"].y_m, runs[0]["wheelset"].y_m)


def test_a_wrong_change_is_one_line():
    with pytest.raises(wr.InputError, match="sped: unknown key") as caught:
        wr.simulate(SCENES / "wheelset.yaml", sped=30)
    assert "\n" not in str(caught.value)
    with pytest.raises(wr.InputError, match="expected a key below a mapping"):
        wr.load_scene(SCENES / "wheelset.yaml", speed__high=3)


def test_changes_of_a_mapping_keep_its_other_keys():
    scene = wr.load_scene(SCENES / "wheelset.yaml", contact={"friction": 0.4, "normal": {"damping": {"c_e": 0.7}}})
    assert scene.data["contact"]["patch"] == "maximum" and scene.data["contact"]["friction"] == 0.4
    assert scene.data["contact"]["normal"]["damping"] == {"c_e": 0.7, "v0": 0.05}


def test_groups_and_channels_are_listed_for_completion():
    run = hunting_run()
    assert run.keys() == list(run) == run._ipython_key_completions_() and "wheelset/left" in run
    assert {"y_m", "yaw_rad"} <= set(dir(run["wheelset"])) and "y_m" in run["wheelset"]
    assert run["wheelset"]["y_m"] is run["wheelset"].y_m
    assert "y_m" in repr(run["wheelset"]) and "lateral position" in repr(run["wheelset"])
    with pytest.raises(AttributeError, match="no channel 'y' in 'wheelset'; it has x_m, y_m"):
        _ = run["wheelset"].y
    with pytest.raises(KeyError, match="no group 'wheel'"):
        _ = run["wheel"]
    assert repr(run) == (
        "Run 'synthetic': completed, 4 s, 801 output times in 0.5 s; groups: wheelset, wheelset/left, wheelset/right"
    )


def test_table_of_a_run_wide_and_tidy():
    run = hunting_run(flange_at=1.0)
    wide, tidy = run.to_pandas(), run.to_pandas(tidy=True)
    assert wide.index.name == "t_s" and len(wide) == len(run.t)
    np.testing.assert_array_equal(wide["wheelset.y_m"], run["wheelset"].y_m)
    np.testing.assert_array_equal(wide["wheelset/left.u_rail_m.1"], run["wheelset/left"].u_rail_m[:, 1])
    assert "wheelset/left.u_rail_m.2" not in wide and "wheelset/right.u_rail_m.1" not in wide
    flange = tidy.query("group == 'wheelset/left' and channel == 'contact_angle_rad' and patch == 1")
    assert len(flange) == np.sum(run.t >= 1.0) and set(flange["unit"]) == {"rad"}
    assert not tidy["value"].isna().any()


def test_figures_of_a_run_have_units():
    figure = hunting_run(flange_at=1.0).plot()
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["y / mm", "yaw / mrad", "Q / kN", "Y / kN"] and figure.axes[-1].get_xlabel() == "time / s"
    figure = hunting_run().plot("wheelset.wy_rad_per_s", "wheelset/left.phi_per_m", "wheelset/left.xi", "wheelset.x_m")
    assert [axes.get_ylabel() for axes in figure.axes] == ["wy / rad/s", "phi / 1/m", "xi", "x / m"]
    np.testing.assert_allclose(hunting_run().plot("wheelset.y_m").axes[0].lines[0].get_ydata()[0], 2.0)  # mm
    assert hunting_run().plot("wheelset/left.Y_over_Q").axes[0].get_ylabel() == "Y over Q"
    assert isinstance(figure, matplotlib.figure.Figure)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("wheelset.y", "wheelset.y_m"), ("wheelset/left.Q", "wheelset/left.Q_N"), ("yaw_rad", "wheelset.yaw_rad"),
        ("wheelset1/right.Y_over_Q", "wheelset/right.Y_over_Q"), ("wheelset.sumY", "wheelset.sum_Y_N"),
    ],
)  # fmt: skip
def test_a_wrong_channel_is_answered_in_one_line_with_the_nearest(wrong, right):
    with pytest.raises(wr.InputError) as caught:
        hunting_run().plot(wrong)
    said = str(caught.value)
    assert said.startswith(f"plot: {wrong}: expected ") and said.endswith(f"did you mean {right!r}?"), said


def test_the_public_function_is_not_hidden_by_the_file_of_its_name():
    code = "import wrcore as wr; from wrcore.run.simulate import simulate; assert wr.simulate is simulate"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


@pytest.mark.parametrize(
    ("command", "absent"),
    [
        ("simulate --help", "numpy numba h5py scipy pandas matplotlib jsonschema"),
        (
            "simulate {} --set integration.duration=0.01 --json",
            "scipy.interpolate scipy.fft scipy.linalg scipy.optimize scipy.special pandas matplotlib numpy.f2py",
        ),
    ],
    ids=["help", "run"],
)
def test_command_imports_no_package_that_it_does_not_use(command, absent):
    words = command.format(ROOT / "config" / "scenes" / "metro_car.yaml").split()  # a scene with random irregularity
    code = (
        f"import sys; from wrcore.cli import main\ntry: status = main({words})\nexcept SystemExit as end: "
        f"status = end.code\nassert status in (0, None); sys.exit(str(set({absent.split()}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stderr.split("\n")[-2:] == ["set()", ""], done.stderr


def test_import_is_cheap_and_names_are_complete():
    code = "import sys, wrcore; assert not {'numpy', 'numba', 'matplotlib', 'pandas'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
    assert all(getattr(wr, name) is not None for name in wr.__all__) and set(wr.__all__) == set(dir(wr))
    assert (ROOT / "wrcore" / "py.typed").is_file()


def test_no_bar_in_a_log_and_one_in_a_terminal(monkeypatch):
    from wrcore.run import progress

    monkeypatch.delenv("WRCORE_PROGRESS", raising=False)
    assert not progress.somebody_watches()  # pytest captures
    assert progress.counted([1, 2]) == [1, 2]
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(progress, "DELAY", 0.0)
    with progress.simulated_time(2.0, begin=1.0) as advance:
        advance(2.5)
    assert list(progress.counted(range(3))) == [0, 1, 2]
    monkeypatch.setenv("WRCORE_PROGRESS", "0")
    with progress.simulated_time(2.0) as advance:
        assert advance is None


def test_bar_reaches_the_simulated_time(capsys, monkeypatch):
    from wrcore.run import progress

    monkeypatch.setattr(progress, "somebody_watches", lambda: True)
    monkeypatch.setattr(progress, "DELAY", 0.0)
    with progress.simulated_time(2.0) as advance:
        advance(0.5)
        time.sleep(0.2)  # bars are drawn at most ten times a second
        advance(2.0)
    assert "2.00/2 s" in capsys.readouterr().err
