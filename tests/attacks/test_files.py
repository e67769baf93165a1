"""Damaged files: profiles, irregularity, cases, positions, tables, runs, parts of sweeps; files nobody can read."""

import os
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from tests.attacks.generator import damaged, edited, examples, numbers, spoiled_text
from tests.attacks.outcomes import (
    base_scene,
    check_command,
    fault_of,
    run_command,
    same_numbers,
    simulate_text,
)
from tests.attacks.test_documents import CASES, PAIR, POSES
from tests.conftest import ELLIPTIC
from wrcore.creep.axes import CreepTableData, TableAxes
from wrcore.creep.build import Resolution
from wrcore.creep.cases import creep_force
from wrcore.creep.kalker import kalker_data
from wrcore.creep.table import CreepTable, load_table, write_table
from wrcore.run.output.files import load_run
from wrcore.run.streaming import simulate_to
from wrcore.scene.description import load_scene
from wrcore.sweep.batch import load_table as load_rows
from wrcore.sweep.batch import write_table as write_rows
from wrcore.sweep.measures import COUNTERS
from wrcore.sweep.plan import load_sweep

pytestmark = pytest.mark.usefixtures("no_new_tables")

PAIR_OPTIONS = [word for option in PAIR.items() for word in option]
randoms = st.randoms(use_true_random=False)

# ------------------------------------------------------------------------------------------------------- text of files


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
FORMS = [
    ("wheel", "csv"), ("rail", "csv"), ("wheel", "dat"), ("wheel", "prw"), ("rail", "prr"), ("wheel", "whl"),
    ("rail", "ban"), ("wheel", "whe"),
]  # fmt: skip
IRREGULARITY = (
    "s_m,left_lateral_m,right_lateral_m\n" + "\n".join(f"{k},{0.001 * (k % 3)},0.0" for k in range(30)) + "\n"
)


@st.composite
def wrong_file(draw, text):
    """Bytes of a text file with a fault in its letters, its lines, its numbers or its encoding."""
    fault = draw(st.sampled_from(["text", "numbers of text", "lines", "numbers", "binary"]))
    if fault in ("text", "numbers of text"):
        alphabet = number_text if fault == "numbers of text" else None
        return draw(spoiled_text(text, alphabet)).encode("utf-8", "surrogatepass")
    if fault == "binary":
        return draw(st.binary(max_size=200)) + text.encode()[: draw(st.integers(0, len(text)))]
    lines = text.splitlines()
    for _ in range(draw(st.integers(1, 4))):
        at, other = draw(st.integers(0, len(lines) - 1)), draw(st.integers(0, len(lines) - 1))
        if fault == "numbers":
            lines[at] = f"{draw(numbers)},{draw(numbers)}"
        else:
            lines[at], lines[other] = draw(
                st.sampled_from([(lines[other], lines[at]), (lines[at], ""), (lines[other],) * 2])
            )
    return "\n".join(lines).encode()


@examples(50)
@given(data=st.data(), form=st.sampled_from(FORMS), unit=st.sampled_from([None, "m", "mm"]), smooth=st.booleans())
def test_wrong_profile_is_refused_or_run(folder, data, form, unit, smooth):
    kind, ending = form
    (folder / f"profile.{ending}").write_bytes(data.draw(wrong_file(profile_text(*form))))
    spec = {"points": f"profile.{ending}"} | ({"unit": unit} if unit else {}) | ({"smoothing": 1e-5} if smooth else {})
    simulate_text(folder, yaml.dump(base_scene() | {kind: (base_scene()[kind] | {"profile": spec})}))


@examples(15)
@given(content=wrong_file(IRREGULARITY))
def test_wrong_irregularity_is_refused_or_run(folder, content):
    (folder / "irregularity.csv").write_bytes(content)
    track = {"irregularity": {"points": "irregularity.csv", "fade_in": 2.0, "fade_out": 2.0}}
    simulate_text(folder, yaml.dump(base_scene() | {"track": track}))


@examples(20)
@given(content=wrong_file(CASES), model=st.sampled_from(["she", "linear", "polach", "fastsim", "none"]))
def test_wrong_creep_cases_are_refused_or_answered(folder, content, model):
    path, out = folder / "cases.csv", folder / "out" / "forces.csv"
    path.write_bytes(content)
    check_command(["creep", "--cases", path, "--model", model, "--out", out], folder / "out", out)


@examples(20)
@given(content=wrong_file(POSES))
def test_wrong_positions_are_refused_or_answered(folder, content):
    path, out = folder / "poses.csv", folder / "out" / "patches.csv"
    path.write_bytes(content)
    contact = ["contact", "--poses", path, *PAIR_OPTIONS, "--wheel-load", "1e4", "--out", out]
    check_command(contact, folder / "out", out)


# ---------------------------------------------------------------------------------------------------------- HDF5 files


def content(run):
    """What must be the same in two runs of a scene."""
    counters = {name: value for name, value in run.counters.items() if name not in ("wall_s", "compile_s")}
    return run.status, run.reason, run.t, run.groups, run.end_t, run.end_state, counters


def read_run(path):
    run = load_run(path)
    repr(run)
    return content(run), run.scene, run.settings


def read_table(path):
    table = load_table(path)
    a, xi = np.geomspace(1e-3, 5e-3, 20), np.linspace(-0.01, 0.01, 20)
    forces = creep_force("table", a, 3e-3, 5e4, xi, 2e-3, 0.5, nu=table.nu, table=table)
    return forces, tuple(table.data), table.planes, table.tolerance, table.resolution, table.force_error


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """Files of creep tables and of runs, by the function that reads them, and what it reads from each."""
    folder, rng = tmp_path_factory.mktemp("stored"), np.random.default_rng(0)
    tables, runs = [folder / "ellipse.h5", folder / "sdec.h5"], [folder / "tsit5.h5", folder / "ros34pw2.h5"]
    for path, psi, nodes in zip(tables, (0.0, 0.9), ((3, 1, 3, 4, 3), (3, 3, 3, 4, 3)), strict=True):
        data = CreepTableData(TableAxes(-3.0, 3.0, psi, *nodes), kalker_data(0.28), np.empty(0))
        shape = (5, 1, 5, 5, 5, 4) if path.stem == "ellipse" else (5, 5, 5, 7, 5, 4)
        data = data._replace(coefficients=rng.uniform(-1.0, 1.0, shape).astype(np.float32).ravel())
        resolution = Resolution(3, nodes[1], 3, 4, 3, 2)
        write_table(path, CreepTable(data, path.stem, 0.01, resolution, 1, (0.0,) * 4, (0.0,) * 4))
    for path in runs:
        changes = {"integration.duration": 0.05, "contact.creep.model": "she", "integration.method": path.stem}
        simulate_to(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes), path)
    files = {read_table: tables, read_run: runs}
    return {read: {path: (path.read_bytes(), read(path)) for path in paths} for read, paths in files.items()}


@examples(80)
@given(rng=randoms, read=st.sampled_from([read_run, read_table]), by_bytes=st.sampled_from([True, True, False]))
def test_damaged_hdf5_file_is_refused_or_read_as_written(stored, rng, read, by_bytes):
    original = rng.choice(sorted(stored[read]))
    written, found = stored[read][original]
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "file.h5"
        path.write_bytes(damaged(written, rng) if by_bytes else written)
        if not by_bytes:
            edited(path, rng)
        same = "read as something else" if by_bytes else ""
        assert fault_of(lambda: "" if same_numbers(read(path), found) else same) == ""


@examples(15)
@given(rng=randoms, by_bytes=st.booleans())
def test_command_with_a_damaged_creep_table_is_refused_or_answered(folder, stored, rng, by_bytes):
    path = folder / "table.h5"
    ((_, (written, _)), *_) = stored[read_table].items()
    path.write_bytes(damaged(written, rng) if by_bytes else written)
    if not by_bytes:
        edited(path, rng)
    (folder / "cases.csv").write_text(CASES)

    def commands():
        status, _, err = run_command(["table", "info", path])
        assert status in (0, 2) and (status == 0 or err.count("\n") == 1), err
        out = folder / "out" / "forces.csv"
        cases = ["creep", "--cases", folder / "cases.csv", "--table", path]
        assert check_command([*cases, "--out", out], folder / "out", out) == status
        scene = base_scene() | {"contact": base_scene()["contact"] | {"creep": {"model": "table", "table": str(path)}}}
        simulate_text(folder, yaml.dump(scene))
        return ""

    assert fault_of(commands) == ""


# ------------------------------------------------------------------------------------------------------ parts of sweeps

SWEEP = {
    "name": "attack", "scene": str(ELLIPTIC / "suspended_wheelset.yaml"), "sampling": {"kind": "grid"},
    "keys": {"speed": {"from": 20.0, "to": 40.0, "steps": 6}, "contact.detection": {"values": ["planar", "spatial"]}},
    "measures": ["y_rms_m", "y_max_m", "frequency_Hz", "steps"], "begin": 0.0, "window": 0.5, "batch": 3,
}  # fmt: skip


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """Folder with the parts of two sweeps, as CSV and HDF5, with numbers that no run gave; and the first whole."""
    folder = tmp_path_factory.mktemp("parts")
    for number, speed in ((1, 40.0), (2, 41.0)):
        data = SWEEP | {"keys": SWEEP["keys"] | {"speed": {"from": 20.0, "to": speed, "steps": 6}}}
        (folder / f"{number}.yaml").write_text(yaml.safe_dump(data))
        sweep, draw = load_sweep(folder / f"{number}.yaml"), np.random.default_rng(number)
        for batch in range(sweep.batches):
            table = sweep.rows(batch).reset_index()
            table["status"], table["method"] = "completed", "tsit5"
            for name in data["measures"]:
                counts = name in COUNTERS
                table[name] = draw.integers(1, 999, len(table)) if counts else draw.normal(size=len(table))
            table.loc[0, "frequency_Hz"] = np.nan
            for ending in (".csv", ".h5"):
                write_rows(folder / f"{number}_{batch}{ending}", table, sweep)
    whole = pd.concat(load_rows(part) for part in sorted(folder.glob("1_*.csv")))
    write_rows(folder / "whole.csv", whole.sort_values("run", ignore_index=True))
    return folder


FAULTS = ["missing", "doubled", "foreign", "nothing", "emptied", *4 * ["damaged"]]


@examples(50)
@given(rng=randoms, fault=st.sampled_from(FAULTS), ending=st.sampled_from([".csv", ".h5"]))
def test_wrong_parts_of_a_sweep_are_refused_or_give_the_same_table(parts, rng, fault, ending):
    chosen, others = (sorted(parts.glob(f"{n}_*{ending}")) for n in (1, 2))
    k, out = rng.randrange(len(chosen)), parts / "out.csv"
    if fault == "missing":
        del chosen[k]
    elif fault == "doubled":
        chosen.insert(rng.randrange(len(chosen)), chosen[k])
    elif fault == "foreign":
        chosen[k] = others[k]
    elif fault in ("emptied", "damaged"):
        written = b"" if fault == "emptied" else damaged(chosen[k].read_bytes(), rng)
        chosen[k] = parts / f"spoiled{ending}"
        chosen[k].write_bytes(written)

    def gathered():
        status, _, said = run_command(["sweep", parts / "1.yaml", "--out", out, "--gather", *chosen])
        if status == 2 and not out.exists() and said.count("\n") == 1:
            return "nothing wrong, but refused" if fault == "nothing" else ""
        if status == 0 and load_rows(out).equals(load_rows(parts / "whole.csv")):
            return "" if fault in ("damaged", "nothing") else f"{fault}, and done"
        return f"{fault}: exit status {status}, {said[:300]!r}"

    found = fault_of(gathered)
    out.unlink(missing_ok=True)
    assert found == ""


# ------------------------------------------------------------------------------ files nobody can read, or write, at all

FILES = {
    "scene": ["simulate", "FILE"],
    "poses": ["contact", "--poses", "FILE", *PAIR_OPTIONS, "--wheel-load", "1e4", "--out", "OUT"],
    "cases": ["creep", "--cases", "FILE", "--model", "she", "--out", "OUT"],
    "table": ["table", "info", "FILE"],
    "wheel": ["conicity", "--wheel", "FILE", "--rail", "UIC60-MBench", "--inclination", "1/40", "--out", "OUT"],
    "creep_table": ["creep", "--cases", "CASES", "--table", "FILE", "--out", "OUT"],
}  # fmt: skip


@pytest.mark.parametrize("kind", ["absent", "folder", "below_a_file", "too_long", "closed", "empty", "binary", "pipe"])
def test_files_that_cannot_be_read_are_refused(tmp_path, kind):
    (tmp_path / "out").mkdir()
    (tmp_path / "cases.csv").write_text(CASES)
    (tmp_path / "file.csv").write_bytes(bytes(range(256)) if kind == "binary" else b"")
    os.mkfifo(tmp_path / "pipe.csv")
    closed = tmp_path / "closed.csv"
    closed.write_text("x")
    closed.chmod(0)
    path = {
        "absent": tmp_path / "absent.csv", "folder": tmp_path, "below_a_file": tmp_path / "cases.csv" / "x.csv",
        "too_long": tmp_path / f"{'x' * 300}.csv", "closed": closed, "pipe": tmp_path / "pipe.csv",
    }.get(kind, tmp_path / "file.csv")  # fmt: skip
    out = tmp_path / "out" / "result.csv"
    names = {"FILE": path, "OUT": out, "CASES": tmp_path / "cases.csv"}
    for arguments in FILES.values():
        assert check_command([names.get(word, word) for word in arguments], tmp_path / "out", out) == 2, arguments


@pytest.mark.parametrize("kind", ["folder", "absent_folder", "below_a_file", "too_long", "closed_system"])
def test_results_that_cannot_be_written_are_refused(tmp_path, kind):
    (tmp_path / "scene.yaml").write_text(yaml.dump(base_scene()))
    (tmp_path / "cases.csv").write_text(CASES)
    (tmp_path / "poses.csv").write_text(POSES)
    arguments = {
        "simulate": [ELLIPTIC / "suspended_wheelset.yaml"], "creep": ["--cases", tmp_path / "cases.csv"],
        "contact": ["--poses", tmp_path / "poses.csv", *PAIR_OPTIONS, "--wheel-load", "1e4"], "conicity": PAIR_OPTIONS,
        "table": ["build"],
    }  # fmt: skip
    out = {
        "folder": tmp_path / "folder", "absent_folder": tmp_path / "absent" / "x", "closed_system": "/proc/x",
        "below_a_file": tmp_path / "cases.csv" / "x", "too_long": tmp_path / ("x" * 300),
    }  # fmt: skip
    for ending in (".csv", ".h5"):
        (tmp_path / f"folder{ending}").mkdir()
    before = sorted(tmp_path.iterdir())
    for command, words in arguments.items():
        ending = ".h5" if command in ("simulate", "table") else ".csv"
        status, printed, err = run_command([command, *words, "--out", f"{out[kind]}{ending}"])
        assert (status, printed) == (2, "") and err.count("\n") == 1 and "--out" in err, (command, err)
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
