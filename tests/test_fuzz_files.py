"""Bad files, fuzzed: profiles, irregularity, tables, runs, and what cannot be read or written; see test_fuzz.py."""

import contextlib
import io
import os
import tempfile
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml
from fuzzing import (
    SHORT,
    base_scene,
    check_command,
    check_run,
    examples,
    numbers,
    run_command,
    simulate_text,
    spoiled_text,
    texts,
)
from hypothesis import given
from hypothesis import strategies as st

from tests.conftest import ELLIPTIC
from wrcore.creep.axes import CreepTableData, TableAxes
from wrcore.creep.build import Resolution
from wrcore.creep.kalker import kalker_data
from wrcore.creep.table import CreepTable, write_table
from wrcore.errors import InputError
from wrcore.run.output.files import load_run
from wrcore.run.streaming import simulate_to
from wrcore.scene.description import load_scene

pytestmark = pytest.mark.usefixtures("no_new_tables")


def points(kind, unit=1.0, count=41):
    """A plausible profile: a coned wheel with a flange, or a round rail head."""
    u = np.linspace(-0.05, 0.05, count) if kind == "wheel" else np.linspace(-0.03, 0.03, count)
    f = 0.05 * u + 0.02 * np.exp(-(((u + 0.045) / 0.01) ** 2)) if kind == "wheel" else -(u**2) / 0.6
    return u * unit, f * unit


@cache
def profile_text(kind, form):
    u, f = points(kind, 1000.0)
    if form in ("prw", "prr"):
        rows = "\n".join(f"{a:.6f} {-b:.6f}" for a, b in zip(u, f, strict=True))
        kind_number = 1 if form == "prw" else 0
        return (
            f"header.begin\n  version  = 1\n  type     = {kind_number}\nheader.end\nspline.begin\n  units.len = 'mm'\n"
            "  units.len.f = 1000\n  units.ang.f = 1\n  mirror.y = 0\n  mirror.z = 0\n  inversion = 0\n  shift.y = 0\n"
            f"  bound.y.min = 1\n  bound.y.max = 0\n  point.begin\n{rows}\n  point.end\nspline.end\n"
        )
    if form == "whl":
        u, head = u + 70.0, "MINIPROF 1\nStock:\n\n"
        return head + "\n".join(f"{a:.6f} {-b:.6f} 0.0" for a, b in zip(u, f, strict=True)) + "\n"
    if form == "ban":
        head = "Xoffset=0.0\nColumnDef=X,Y\nXYPoints=41\n\n"
        return head + "\n".join(f"{-a:.6f} {b:.6f}" for a, b in zip(u, f, strict=True)) + "\n"
    if form == "whe":
        head, y = "WHEELPROFILE\nt\nTREADDATUM EUROPEAN\nFLANGEBACK 1360\n", u + 750.0
        return head + "\n".join(f"{-a:.6f} {-b:.6f} {a:.6f} {-b:.6f}" for a, b in zip(y, f, strict=True)) + "\n"
    head = "u_mm,f_mm\n" if form == "csv" else "# two columns, mm\n"
    return head + "\n".join(f"{a:.6f}{',' if form == 'csv' else ' '}{b:.6f}" for a, b in zip(u, f, strict=True)) + "\n"


number_text = st.characters(codec="ascii", categories=["Nd", "Po", "Zs"], include_characters="-+eE.,;\n\t nan")
forms = st.sampled_from(
    [
        ("wheel", "csv"), ("rail", "csv"), ("wheel", "dat"), ("wheel", "prw"), ("rail", "prr"), ("wheel", "whl"),
        ("rail", "ban"), ("wheel", "whe"),
    ]
)  # fmt: skip


@st.composite
def profile_files(draw):
    """Kind, ending and content of a profile file that went wrong."""
    kind, form = draw(forms)
    text = profile_text(kind, form)
    fault = draw(st.sampled_from(["text", "lines", "numbers", "binary"]))
    if fault == "text":
        return kind, form, draw(spoiled_text(text, number_text)).encode("utf-8", "surrogatepass")
    if fault == "binary":
        return kind, form, draw(st.binary(max_size=200)) + text.encode()[: draw(st.integers(0, len(text)))]
    lines = text.splitlines()
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(lines) - 1))
        if fault == "lines":
            other = draw(st.integers(0, len(lines) - 1))
            lines[at], lines[other] = draw(
                st.sampled_from([(lines[other], lines[at]), (lines[at], ""), (lines[other],) * 2])
            )
        else:
            lines[at] = f"{draw(numbers)},{draw(numbers)}"
    return kind, form, "\n".join(lines).encode()


@examples(100)
@given(file=profile_files(), unit=st.sampled_from([None, "m", "mm"]), smoothing=st.sampled_from([0.0, 1e-5]))
def test_profiles(folder, file, unit, smoothing):
    kind, form, content = file
    (folder / f"profile.{form}").write_bytes(content)
    spec = (
        {"points": f"profile.{form}"}
        | ({"unit": unit} if unit else {})
        | ({"smoothing": smoothing} if smoothing else {})
    )
    data = base_scene() | {kind: (base_scene()[kind] | {"profile": spec})}
    simulate_text(folder, yaml.dump(data))


IRREGULARITY = (
    "s_m,left_lateral_m,right_lateral_m\n" + "\n".join(f"{k},{0.001 * (k % 3)},0.0" for k in range(30)) + "\n"
)


@examples(30)
@given(text=st.one_of(spoiled_text(IRREGULARITY, number_text), spoiled_text(IRREGULARITY)))
def test_irregularity(folder, text):
    (folder / "irregularity.csv").write_bytes(text.encode("utf-8", "surrogatepass"))
    track = {"irregularity": {"points": "irregularity.csv", "fade_in": 2.0, "fade_out": 2.0}}
    simulate_text(folder, yaml.dump(base_scene() | {"track": track}))


CASES = (
    "case_id,a_m,b_neg_m,b_pos_m,N_N,mu,G_Pa,nu,ux,uy,phi_per_m\n"
    "1,0.005,0.004,0.004,50000,0.3,8.2e10,0.28,0.001,0.0005,0.1\n"
    "2,0.006,0.003,0.003,60000,0.4,8.2e10,0.28,0.0,0.0005,-0.2\n"
)
POSES = "pose_id,y_m,yaw_rad,roll_rad,z_m\n1,0.001,0.002,,\n2,-0.003,0.0,0.0001,\n3,0.002,0.001,0,0.4599\n"


@examples(50)
@given(
    text=st.one_of(spoiled_text(CASES, number_text), spoiled_text(CASES), st.binary(max_size=80)),
    model=st.sampled_from(["she", "linear", "polach", "fastsim", "none"]),
)
def test_creep_cases(folder, text, model):
    path, out = folder / "cases.csv", folder / "out" / "forces.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    check_command(["creep", "--cases", path, "--model", model, "--out", out], folder / "out", out)


@examples(50)
@given(text=st.one_of(spoiled_text(POSES, number_text), spoiled_text(POSES), st.binary(max_size=80)))
def test_poses(folder, text):
    path, out = folder / "poses.csv", folder / "out" / "patches.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    pair = ["--wheel", "S1002", "--rail", "UIC60-MBench", "--inclination", "1/40", "--wheel-load", "1e4"]
    check_command(["contact", "--poses", path, *pair, "--out", out], folder / "out", out)


@st.composite
def spoiled_file(draw, content):
    """The bytes of an HDF5 file cut short, or the file with a dataset or an attribute gone or replaced."""
    if draw(st.integers(0, 4)) == 0:
        return content[: draw(st.integers(0, len(content) - 1))]
    buffer = io.BytesIO(content)
    with h5py.File(buffer, "a") as file, np.errstate(over="ignore"):
        for _ in range(draw(st.integers(1, 2))):
            names = [""]
            file.visit(names.append)
            owner = file[draw(st.sampled_from(names)) or "/"]
            attributes = sorted(name for name in owner.attrs if name not in ("DIMENSION_LIST", "REFERENCE_LIST"))
            value = draw(
                st.one_of(
                    st.floats(), st.integers(-5, 2**62), texts, st.just([]), st.just([[1.0], [2.0]]), st.just(b"x")
                )
            )
            with contextlib.suppress(ValueError, TypeError, OverflowError):  # HDF5 does not hold all of them
                if attributes and draw(st.booleans()):
                    name = draw(st.sampled_from(attributes))
                    del owner.attrs[name]
                    if draw(st.booleans()):
                        owner.attrs[name] = value
                elif owner.name != "/":
                    name = owner.name
                    if isinstance(owner, h5py.Dataset) and owner.size and draw(st.booleans()):
                        owner[draw(st.integers(0, len(owner) - 1)) if owner.ndim else ()] = draw(st.floats())
                    else:
                        del file[name]
                        if draw(st.booleans()):
                            file[name] = value
    return buffer.getvalue()


@examples(50)
@given(data=st.data())
def test_run_files(folder, data):
    path = folder / "run.h5"
    if not path.exists():
        simulate_to(load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"integration.duration": SHORT}), path)
    content = path.read_bytes()
    spoiled_path = folder / "spoiled.h5"
    spoiled_path.write_bytes(data.draw(spoiled_file(content)))
    try:
        check_run(load_run(spoiled_path))
    except InputError as error:
        assert "\n" not in str(error) and "spoiled.h5" in str(error)
    except AssertionError:  # a number in it is another one, which no reader can know
        pass


@cache
def table_bytes():
    """A creep table as small as tables get; what it holds does not matter."""
    axes = TableAxes(-3.0, 3.0, 0.0, 3, 1, 3, 4, 3)
    data = CreepTableData(axes, kalker_data(0.28), np.zeros(5 * 1 * 5 * 5 * 5 * 4, np.float32))
    table = CreepTable(data, "ellipse", 0.01, Resolution(3, 1, 3, 4, 3, 2), 1, (0.0,) * 4, (0.0,) * 4)
    with tempfile.TemporaryDirectory() as folder:
        write_table(f"{folder}/table.h5", table)
        return Path(f"{folder}/table.h5").read_bytes()


@examples(40)
@given(content=st.deferred(lambda: spoiled_file(table_bytes())))
def test_creep_tables(folder, content):
    (folder / "table.h5").write_bytes(content)
    (folder / "cases.csv").write_text(CASES)
    status, _, err = run_command(["table", "info", folder / "table.h5"])
    assert status in (0, 2) and (status == 0 or err.count("\n") == 1), err
    out = folder / "out" / "forces.csv"
    cases = ["creep", "--cases", folder / "cases.csv", "--table", folder / "table.h5"]
    assert check_command([*cases, "--out", out], folder / "out", out) == status
    scene = base_scene() | {"contact": base_scene()["contact"] | {"creep": {"model": "table", "table": "table.h5"}}}
    simulate_text(folder, yaml.dump(scene))


PAIR = ["--wheel", "S1002", "--rail", "UIC60-MBench", "--inclination", "1/40"]
FILES = {
    "scene": ["simulate", "FILE"],
    "poses": ["contact", "--poses", "FILE", *PAIR, "--wheel-load", "1e4", "--out", "OUT"],
    "cases": ["creep", "--cases", "FILE", "--model", "she", "--out", "OUT"],
    "table": ["table", "info", "FILE"],
    "wheel": ["conicity", "--wheel", "FILE", "--rail", "UIC60-MBench", "--inclination", "1/40", "--out", "OUT"],
    "creep_table": ["creep", "--cases", "CASES", "--table", "FILE", "--out", "OUT"],
}  # fmt: skip


@pytest.mark.parametrize("arguments", FILES.values(), ids=FILES)
@pytest.mark.parametrize("kind", ["absent", "folder", "below_a_file", "too_long", "closed", "empty", "binary", "pipe"])
def test_files_that_cannot_be_read(tmp_path, arguments, kind):
    (tmp_path / "out").mkdir()
    (tmp_path / "cases.csv").write_text(CASES)
    (tmp_path / "file.csv").write_bytes(bytes(range(256)) if kind == "binary" else b"")
    os.mkfifo(tmp_path / "pipe.csv")
    closed = tmp_path / "closed.csv"
    closed.write_text("x")
    closed.chmod(0)
    path = {
        "absent": tmp_path / "absent.csv", "folder": tmp_path, "below_a_file": tmp_path / "cases.csv" / "x.csv",
        "too_long": tmp_path / f"{'x' * 300}.csv", "closed": closed,
        "pipe": tmp_path / "pipe.csv",
    }.get(kind, tmp_path / "file.csv")  # fmt: skip
    out = tmp_path / "out" / "result.csv"
    names = {"FILE": path, "OUT": out, "CASES": tmp_path / "cases.csv"}
    assert check_command([names.get(word, word) for word in arguments], tmp_path / "out", out) == 2


@pytest.mark.parametrize("kind", ["folder", "absent_folder", "below_a_file", "too_long", "closed_system"])
@pytest.mark.parametrize("command", ["simulate", "creep", "contact", "conicity", "table"])
def test_results_that_cannot_be_written(tmp_path, command, kind):
    (tmp_path / "scene.yaml").write_text(yaml.dump(base_scene()))
    (tmp_path / "cases.csv").write_text(CASES)
    (tmp_path / "poses.csv").write_text(POSES)
    arguments = {
        "simulate": [ELLIPTIC / "suspended_wheelset.yaml"], "creep": ["--cases", tmp_path / "cases.csv"],
        "contact": ["--poses", tmp_path / "poses.csv", *PAIR, "--wheel-load", "1e4"], "conicity": PAIR,
        "table": ["build"],
    }  # fmt: skip
    out = {
        "folder": tmp_path / "folder", "absent_folder": tmp_path / "absent" / "x", "closed_system": "/proc/x",
        "below_a_file": tmp_path / "cases.csv" / "x", "too_long": tmp_path / ("x" * 300),
    }  # fmt: skip
    ending = ".h5" if command in ("simulate", "table") else ".csv"
    (tmp_path / f"folder{ending}").mkdir()
    before = sorted(tmp_path.iterdir())
    status, printed, err = run_command([command, *arguments[command], "--out", f"{out[kind]}{ending}"])
    assert (status, printed) == (2, "") and err.count("\n") == 1 and "--out" in err, err
    assert sorted(tmp_path.iterdir()) == before


def test_a_disk_that_fills_up_is_one_line(folder, monkeypatch):
    (folder / "scene.yaml").write_text(yaml.dump(base_scene()))
    out = folder / "out" / "run.h5"

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("wrcore.run.output.files.Datasets", full)
    status, _, err = run_command(["simulate", folder / "scene.yaml", "--out", out])
    assert status == 2 and err == f"wrcore: {out}: No space left on device\n"
    assert not list((folder / "out").iterdir())
