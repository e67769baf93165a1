"""The cache folder: ours alone or not used, and nothing in it that is not ours is touched."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from wrcore.creep import table as table_module
from wrcore.creep.table import ensure_table, table_path
from wrcore.errors.messages import _say_once, warn, warnings_suppressed
from wrcore.kernels import cache as cache_module
from wrcore.kernels.cache import cache_root, source_digest


@pytest.fixture
def wanted(tmp_path, monkeypatch):
    """A folder to be the cache; the answers of this process are forgotten before and after."""
    monkeypatch.setenv("WRCORE_CACHE", str(tmp_path / "cache"))
    cache_module._prepared.cache_clear()
    _say_once.cache_clear()
    return tmp_path / "cache"


def test_a_new_cache_is_closed_to_others(wanted, capsys):
    before = os.umask(0)
    try:
        assert cache_root() == wanted
    finally:
        os.umask(before)
    for folder in (wanted, wanted / "tables", wanted / "kernels", wanted / "kernels" / source_digest()):
        assert folder.stat().st_mode & 0o777 == 0o700
    assert capsys.readouterr().err == ""


def test_the_empty_string_is_no_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("WRCORE_CACHE", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_root() == tmp_path / "wrcore"


OLD = time.time() - 30 * 86400


def planted(folder, name="notes.txt"):
    """A folder with a file of somebody's, as old as can be."""
    folder.mkdir(parents=True)
    (folder / name).write_text("mine")
    os.utime(folder, (OLD, OLD))
    return folder / name


def test_only_kernels_of_ours_are_dropped(wanted, tmp_path):
    kernels = wanted / "kernels"
    kept = [planted(kernels / name) for name in ("thesis", "0123456789abcdeg", "0123456789abcdef")]
    kept.append(planted(tmp_path / "elsewhere", "kernel.nbc"))
    (kernels / "aaaaaaaaaaaaaaaa").symlink_to(tmp_path / "elsewhere")
    gone = planted(kernels / "bbbbbbbbbbbbbbbb" / "geometry_1", "kernel.1.nbc")
    os.utime(gone.parents[1], (OLD, OLD))
    cache_root()
    assert all(path.read_text() == "mine" for path in kept) and not gone.parents[1].exists()
    assert (kernels / "aaaaaaaaaaaaaaaa").is_symlink()


def writable(folder):
    folder.mkdir(parents=True)
    folder.chmod(0o775)


def file(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("mine")


def below(folder, mode=0o700, owner=-1):
    """A folder in which numba keeps pickles, in a cache that is closed otherwise."""
    nested = folder / "kernels" / source_digest() / "geometry_1" / "deeper"
    for part in reversed([nested, *list(nested.parents)[:5]]):
        part.mkdir(mode=0o700, exist_ok=True, parents=True)
    os.chown(nested, owner, -1)
    nested.chmod(mode)


UNSAFE = {
    "others may write where pickles are": lambda folder: below(folder, 0o777),
    "a link where pickles are": lambda folder: (
        below(folder),
        (folder / "kernels" / source_digest() / "contact_1").symlink_to(folder),
    ),
    "others may write": lambda folder: writable(folder),
    "others may write to its kernels": lambda folder: writable(folder / "kernels" / source_digest()),
    "a file": file,
    "a file as kernels": lambda folder: file(folder / "kernels"),
    "below a file": lambda folder: file(folder.parent),
    "a link as kernels": lambda folder: (folder.mkdir(parents=True), (folder / "kernels").symlink_to(folder.parent)),
}


@pytest.mark.parametrize("plant", UNSAFE.values(), ids=UNSAFE)
def test_an_unsafe_cache_is_worked_around_with_one_line(wanted, monkeypatch, capsys, plant):
    monkeypatch.setenv("WRCORE_CACHE", str(wanted / "below" / "it"))
    plant(wanted / "below" / "it")
    root = cache_root()
    said = capsys.readouterr().err
    assert root != wanted / "below" / "it" and root.stat().st_mode & 0o777 == 0o700 and cache_root() == root
    assert said.count("\n") == 1 and said.startswith(f"wrcore: cache {wanted}") and "temporary" in said
    assert "others may not write" in said or "no file or link" in said or "Not a directory" in said


def test_a_cache_of_another_user_is_not_used(wanted, monkeypatch, capsys):
    wanted.mkdir()
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    with pytest.raises(OSError, match="of one's own"):
        cache_module._with_parts(wanted)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give folders away")
def test_pickles_of_another_user_are_not_used(wanted, capsys):
    below(wanted, owner=12345)
    assert cache_root() != wanted and "expected a folder of one's own" in capsys.readouterr().err


@pytest.mark.parametrize("home", ["/dev/null/nobody", None])
def test_without_a_home_kernels_are_compiled_all_the_same(tmp_path, home):
    script = """
import os, pwd
pwd.getpwuid = lambda _: (_ for _ in ()).throw(KeyError())
from wrcore.creep.axes import _stretch
from wrcore.kernels.forms import _FOLDER
assert 0.0 <= _stretch(0.5) <= 1.0
print(_FOLDER)
"""
    environment = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_CACHE_HOME", "WRCORE_CACHE")}
    environment |= {"TMPDIR": str(tmp_path)} | ({"HOME": home} if home else {})
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr.count("\n") == 1 and "wrcore: cache" in done.stderr, done.stderr
    assert Path(done.stdout.strip()).is_relative_to(tmp_path) and not list(tmp_path.iterdir())  # gone at the end


KERNEL = """
import sys
sys.path.insert(0, sys.argv[1])
from kernel import double
print(double(4.0), sum(double.stats.cache_hits.values()))
"""


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_a_damaged_kernel_is_compiled_anew(tmp_path, ending):
    (tmp_path / "kernel.py").write_text("from wrcore.kernels.jit import jit\n@jit\ndef double(x): return 2.0 * x\n")
    environment = os.environ | {"WRCORE_CACHE": str(tmp_path / "cache")}

    def run():
        command = [sys.executable, "-c", KERNEL, str(tmp_path)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, umask=0o002)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip(), done.stderr

    assert run() == ("8.0 0", "")
    (path,) = [path for path in (tmp_path / "cache").rglob(f"kernel.double*.{ending}")]
    path.write_bytes(path.read_bytes()[:-100])
    printed, said = run()
    assert printed == "8.0 0" and said.count("\n") == 1 and "damaged" in said
    assert run() == ("8.0 1", "")


@pytest.mark.parametrize("damage", ["truncated", "another", "unwritable"])
def test_a_cached_table_is_what_its_name_says(wanted, monkeypatch, capsys, damage):
    built = []
    monkeypatch.setattr(table_module, "build_table", lambda *args: built.append(args) or original(*args))
    tiny = ((1e-9, table_module.Resolution(4, 4, 6, 8, 4, 6)),)
    monkeypatch.setattr(table_module, "RESOLUTIONS", dict.fromkeys(table_module.RESOLUTIONS, tiny))
    monkeypatch.setattr(table_module, "CHECK_LEVEL", 6)
    path = table_path(0.28, "ellipse", 0.5)
    if damage == "unwritable":
        path.mkdir()
    else:
        ensure_table(0.28, "ellipse", 0.5 if damage == "truncated" else 0.4)
        if damage == "truncated":
            path.write_bytes(path.read_bytes()[:-100])
        else:
            table_path(0.28, "ellipse", 0.4).rename(path)
    built.clear()
    assert ensure_table(0.28, "ellipse", 0.5).tolerance == 0.5 and len(built) == 1
    assert str(path) in capsys.readouterr().err
    assert ensure_table(0.28, "ellipse", 0.5).tolerance == 0.5 and len(built) == 1 + (damage == "unwritable")


original = table_module.build_table


def test_numba_without_compilation_is_one_clear_line():
    command = [sys.executable, "-c", "import wrcore.kernels.jit"]
    done = subprocess.run(command, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True)
    assert "NUMBA_DISABLE_JIT: expected it unset: kernels hand" in done.stderr.splitlines()[-1]


def test_what_is_untold_is_told_later(wanted, capsys):
    with warnings_suppressed():
        warn("a worn profile")
    assert capsys.readouterr().err == ""
    warn("a worn profile")
    warn("a worn profile")
    assert capsys.readouterr().err == "wrcore: a worn profile\n"
