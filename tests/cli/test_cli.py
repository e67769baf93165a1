"""The command line explains itself: every option, every column, the word that was perhaps meant; ``wrcore init``."""

import errno
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

import wrcore as wr
from tests.conftest import ROOT, SCENES
from wrcore.cli import main, parser

SCENE = str(SCENES / "wheelset.yaml")
PAIR = ["--wheel", "S1002", "--rail", "60E1", "--inclination", "1/40"]


def commands(of=None, path=()):
    """All parsers by their words."""
    of = parser() if of is None else of
    yield path, of
    for action in of._actions:
        for name, inner in (action.choices or {}).items() if hasattr(action, "add_parser") else ():
            yield from commands(inner, (*path, name))


ALL = dict(commands())


def help_of(*words):
    return ALL[words].format_help()


@pytest.mark.parametrize("words", [words for words in ALL if words], ids=" ".join)
def test_every_option_says_what_it_is_and_its_default(words):
    assert ALL[words].description.strip()
    for action in ALL[words]._actions:
        assert action.help, action.dest
        if action.option_strings and isinstance(action.default, str | float) and action.default != "==SUPPRESS==":
            shown = action.default if isinstance(action.default, str) else f"{action.default:g}"
            assert f"(default: {shown})" in " ".join(help_of(*words).split()), action.dest


def test_columns_of_tables_are_those_that_the_help_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "poses.csv").write_text("pose_id,y_m,yaw_rad\n1,0.001,0\n")
    (tmp_path / "cases.csv").write_text("case_id,a_m,b_neg_m,b_pos_m,N_N,mu,G_Pa,nu,xi,eta,phi_per_m\na,5e-3,4e-3,4e-3,"
                                        "8e4,0.3,82e9,0.28,1e-3,0,0\n")  # fmt: skip
    assert main(["contact", "--poses", "poses.csv", *PAIR, "--wheel-load", "5e4", "--out", "contact.csv"]) == 0
    assert main(["conicity", *PAIR, "--to", "0.003", "--out", "conicity.csv", "--table", "table.csv"]) == 0
    assert main(["creep", "--cases", "cases.csv", "--model", "linear", "--out", "creep.csv"]) == 0
    for command, *names in (
        ("contact", "poses", "contact"),
        ("conicity", "conicity", "table"),
        ("creep", "cases", "creep"),
    ):
        explained = {
            line.split()[0] for line in help_of(command).splitlines() if line.startswith("  ") and line.split()
        }
        written = {column.replace("_right_", "_left_") for name in names for column in pd.read_csv(f"{name}.csv")}
        assert written - explained == set()


@pytest.mark.parametrize("words, says", [
    (["simulat", SCENE], "did you mean 'simulate'?"),
    (["simulate", SCENE, "--acuracy", "1"], "wrcore simulate: unknown option --acuracy; did you mean '--accuracy'?"),
    (["simulate", SCENE, "--accuracy", "1", "--accuracy-of", "Z"], "--accuracy-of: expected one of y, Y, Q, wear"),
    (["simulate", SCENE, "--set", "sped=30"], "--set: sped: unknown key"),
    (["simulate", SCENE, "--set", "contact.crep.model=table"], "--set: contact.crep: unknown key"),
    (["simulate", SCENE, "--set", "contact.crep.model=table"], "did you mean 'creep'?"),
    (["simulate", SCENE, "--set", "initial.bodies.wheelset.vx_m_per_s=20"], "did you mean 'vx'?"),
    (["simulate", SCENE, "--set", "speed_m_per_s=20"], "did you mean 'speed'?"),
    (["simulate", SCENE, "--set", "contact.creep.model=polak"], "did you mean 'polach'?"),
    (["simulate", SCENE, "--set", "integration.method=rk5"], "did you mean 'rk4"),
    (["simulate", SCENE, "--set", "wheel.profile=s1003"], "--set: wheel.profile"),
    (["simulate", SCENE, "--set", "wheel.profile=s1003"], "did you mean 'S1002'?"),
    (["simulate", SCENE, "--set", "track.path=[{curve: 100, radius: 3}]"], "--set: track.path.0.radius"),
    (["creep", "--model", "tabel"], "did you mean 'table'?"),
    (["keys", "scene", "contact.crep"], "did you mean 'contact.creep'?"),
])  # fmt: skip
def test_what_is_wrong_is_named_and_what_was_meant_is_guessed(capsys, words, says):
    assert main(words) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1 and (words[0] != "simulate" or "wheelset.yaml" not in said)


def test_a_fault_of_the_file_stays_one_of_the_file(tmp_path, capsys):
    scene = tmp_path / "bad.yaml"
    scene.write_text((SCENES / "wheelset.yaml").read_text() + "sped: 3\n")
    assert main(["simulate", str(scene), "--set", "contact.friction=0.2"]) == 2
    assert "bad.yaml: sped: unknown key" in capsys.readouterr().err


def test_unknown_names_in_python_are_guessed_too():
    with pytest.raises(wr.InputError, match="changes: integration.methd: unknown key.*did you mean 'method'"):
        wr.load_scene(SCENE, integration__methd="rk4")
    with pytest.raises(wr.InputError, match="did you mean 'trailer_vehicle'"):
        wr.example("trailer")
    run = wr.Run({}, "completed", "", [], {"wheelset": {"y_m": []}})
    with pytest.raises(KeyError, match="did you mean 'wheelset'"):
        run["wheelsets"]
    with pytest.raises(AttributeError, match="did you mean 'y_m'"):
        _ = run["wheelset"].ym
    with pytest.raises(wr.InputError, match="did you mean 'wheelset.y_m'"):
        run.plot("wheelset.ym")


@pytest.mark.parametrize("kind, key, says", [
    ("scene", "contact.friction", "default: 0.3"), ("track", "gauge", "in m"), ("vehicle", "bodies.*.mass", "in kg"),
    ("sweep", "sampling", "sampling.kind"), ("wear", "distance", "(needed)"),
    ("scene", "track.crossing", "crossing.at [m]"),
])  # fmt: skip
def test_keys_are_listed_with_what_is_expected(capsys, kind, key, says):
    assert main(["keys", kind, key]) == 0
    assert says in capsys.readouterr().out


def test_files_to_start_from_are_copied_and_never_written_over(tmp_path, capsys):
    assert main(["init", str(tmp_path / "mine")]) == 0 and "wrcore simulate" in capsys.readouterr().out
    for part in ("scenes", "vehicles", "sweeps", "wear"):
        copied = {path.name: path.read_text() for path in (tmp_path / "mine" / part).iterdir()}
        assert copied == {path.name: path.read_text() for path in (ROOT / "config" / part).iterdir()} != {}
    for path in (tmp_path / "mine" / "scenes").glob("*.yaml"):
        assert wr.load_scene(path).data == wr.load_scene(wr.example(path.stem)).data
    wr.load_sweep(tmp_path / "mine" / "sweeps" / "smoke.yaml")
    assert main(["init", str(tmp_path / "mine")]) == 2 and "not written over" in capsys.readouterr().err


@pytest.mark.parametrize("fault", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_init_that_fails_leaves_nothing_and_can_be_repeated(tmp_path, monkeypatch, capsys, fault):
    copy, left = shutil.copyfile, [12]

    def until_full(source, target):
        left[0] -= 1
        if not left[0]:
            Path(target).touch()
            raise fault
        return copy(source, target)

    monkeypatch.setattr(shutil, "copyfile", until_full)
    folder = tmp_path / "new" / "mine"
    assert main(["init", str(folder)]) in (2, 130)
    said = capsys.readouterr().err
    assert said in (f"wrcore: {folder}: No space left on device\n", "wrcore: interrupted\n")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    assert main(["init", str(folder)]) == 0 and not [
        p for p in folder.rglob("*") if p.is_file() and not p.stat().st_size
    ]


def test_a_profile_of_a_file_is_shown(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    u = [0.5 * k for k in range(-60, 61)]
    text = "header.begin\ntype = 1\nheader.end\nspline.begin\nunits.len.f = 1000\npoint.begin\n% 1 2\n"
    points = "".join(f"{k + 100} {-0.05 * k}\n" for k in u)
    (tmp_path / "cone.prw").write_text(f"{text}{points}point.end\nspline.end\n")
    assert main(["profiles", "{points: cone.prw, tape_circle: 0.1}", "--out", "cone.svg"]) == 0
    source, shape = capsys.readouterr().out.splitlines()
    assert source == "measured points, cone.prw: SIMPACK, tape circle 100 mm from the file's origin, 121 points"
    assert shape == (
        "wheel, u from -30.00 to 30.00 mm, 1201 nodes; flange 1.50 mm high, slope at the tape circle 0.0500"
    )
    assert "<svg" in (tmp_path / "cone.svg").read_text()
    assert main(["profiles", "cone.prw"]) == 2
    assert "tape_circle, flange_back or shift says where it is" in capsys.readouterr().err
    (tmp_path / "top.csv").write_text("u_mm,f_mm\n" + "".join(f"{k},{-k * k / 600}\n" for k in u))
    assert main(["profiles", "top.csv"]) == 2
    assert "wrcore profiles: --kind: expected wheel or rail" in capsys.readouterr().err
    assert main(["profiles", "top.csv", "--kind", "rail"]) == 0
    assert "rail, u from -30.00 to 30.00 mm, 1201 nodes; it ends above the 14 mm" in capsys.readouterr().out


def test_the_module_is_the_command():
    done = subprocess.run([sys.executable, "-m", "wrcore", "--version"], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.strip() == f"wrcore {wr.__version__}"


def test_no_garbage_is_looked_for_when_the_command_ends():
    code = "import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count() > 1000))"  # said last
    code += "; from wrcore.cli import main; main(['profiles'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.split()[-1] == "True"


def test_a_shell_that_completes_is_handed_the_parser(monkeypatch, capsys):
    asked = []
    monkeypatch.setitem(sys.modules, "argcomplete", SimpleNamespace(autocomplete=asked.append))
    assert main(["profiles"]) == 0 and asked == []
    monkeypatch.setenv("_ARGCOMPLETE", "1")
    assert main(["profiles"]) == 0 and [whole.prog for whole in asked] == ["wrcore"]


def test_a_reader_that_has_enough_ends_it_without_a_word():
    """As ``wrcore keys scene | head`` does."""
    command = [sys.executable, "-m", "wrcore", "keys", "scene"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT) as running:
        running.stdout.close()
        assert running.stderr.read() == b"" and running.wait() == 141
