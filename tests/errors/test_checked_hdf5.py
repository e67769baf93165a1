"""HDF5 files that hold what was written to them, or are refused before anything is read."""

import os
import re

import h5py
import numpy as np
import pytest

from tests.conftest import ROOT
from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import checked_hdf5, new_hdf5, sign


@pytest.fixture
def path(tmp_path):
    os.mkfifo(tmp_path / "fifo")
    with new_hdf5(tmp_path / "file.h5") as file:
        file["group/x"] = np.arange(1000.0)
        file["group"].attrs["name"] = "text"
    return tmp_path / "file.h5"


def read(path):
    with checked_hdf5(path, "a file") as file:
        return file["group/x"][()], file["group"].attrs["name"]


def test_what_was_written_is_read(path):
    x, name = read(path)
    assert np.array_equal(x, np.arange(1000.0)) and name == "text"
    assert sorted(item.name for item in path.parent.iterdir()) == ["fifo", "file.h5"]
    assert path.stat().st_mode & 0o111 == 0


def test_any_bit_that_differs_is_noticed(path):
    """Every byte of a small file, one bit each."""
    data = path.read_bytes()
    for at in range(0, len(data), 13):
        spoiled = bytearray(data)
        spoiled[at] ^= 1 << at % 8
        path.write_bytes(spoiled)
        with pytest.raises(InputError, match="file.h5: expected a file, got: "):
            read(path)


LAYOUT = h5py.VirtualLayout((4,), float)
LAYOUT[:] = h5py.VirtualSource("fifo", "x", (4,))
EDITS = {
    "a link": (lambda file: file.__setitem__("y", h5py.ExternalLink("fifo", "/x")), "a link that leads elsewhere: y"),
    "nowhere": (lambda file: file.__setitem__("y", h5py.SoftLink("/z")), "a link that leads elsewhere: y"),
    "virtual": (lambda file: file.create_virtual_dataset("y", LAYOUT), "a dataset stored elsewhere: y"),
    "external": (
        lambda file: file.create_dataset("y", (4,), float, external=[("fifo", 0, 32)]), "a dataset stored elsewhere: y",
    ),
    "fill": (lambda file: file.create_dataset("y", (2**29,), float, chunks=(2**20,)), "larger than what is stored: y"),
    "chunks": (lambda file: file.create_dataset("y", (2**29,), float, chunks=(2**28,)), "in huge chunks: y"),
    "filter": (lambda file: file.create_dataset("y", data=np.zeros(99), compression="lzf"), "an unknown filter: y"),
    "kind": (lambda file: file.__setitem__("y", np.zeros(3, complex)), "neither numbers nor text: y"),
    "nothing": (lambda file: file.__setitem__("y", h5py.Empty(float)), "neither numbers nor text: y"),
    "type": (lambda file: file.__setitem__("y", np.dtype(float)), "neither group nor dataset: y"),
}  # fmt: skip


@pytest.mark.parametrize("edit, said", EDITS.values(), ids=EDITS)
def test_what_would_leave_the_file_or_fill_memory_is_refused(path, edit, said):
    with h5py.File(path, "a") as file:
        edit(file)
    sign(path)
    with pytest.raises(InputError, match=said):
        read(path)


def test_what_is_no_file_is_refused_at_once(path):
    for name, said in (("fifo", "no regular file"), (".", "no regular file"), ("absent", "no such file")):
        with pytest.raises(InputError, match=said):
            read(path.parent / name)


def test_remains_of_a_killed_writer_go_and_links_are_not_followed(path):
    folder = path.parent
    (folder / "victim").write_text("mine")
    (folder / ".file.h5.0123abcd.part").write_bytes(b"left")
    (folder / ".file.h5.parts.0123abcd.part").mkdir()
    (folder / ".file.h5.1234abcd.part").symlink_to("victim")
    (folder / ".file.h5.notes.part").write_text("mine")
    with new_hdf5(path) as file:
        held = [name for name in os.listdir(folder) if name.endswith(".part")]
        with new_hdf5(path):  # another writer leaves the first one's alone
            pass
        file["x"] = 1.0
    assert len(held) == 3
    assert sorted(os.listdir(folder)) == [".file.h5.1234abcd.part", ".file.h5.notes.part", "fifo", "file.h5", "victim"]
    assert (folder / "victim").read_text() == "mine"
    with h5py.File(path) as file:
        assert list(file) == ["x"]


def test_there_is_one_door():
    """HDF5's library crashes, or never ends, on damaged bytes: only `checked_hdf5` hands it a file of wrcore, and
    `hdf5_file`, in a process of its own with a time limit, one of other programs."""
    calls = re.compile(r"\bh5py\.(File|h5f)\b\s*\(?|import\s+File\b|read_hdf\b|HDFStore\b")
    doors = {
        (path.relative_to(ROOT).as_posix(), line.strip())
        for path in (ROOT / "wrcore").rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if (found := calls.search(line)) and (found[0].endswith("(") or "h5f" in found[0] or "h5py" not in found[0])
    }
    assert {path for path, _ in doors} == {"wrcore/errors/checked_hdf5.py", "wrcore/signals/hdf5_file.py"}
    assert sorted(line for _, line in doors) == [
        'with h5py.File(path, "r") as file, np.errstate(over="ignore"):',
        'with h5py.File(path, "r") as file:',
        'with h5py.File(patient, "w", userblock_size=BLOCK, **options) as file:',
    ]
