"""Fixtures that several test modules share: the benchmark pair and where data that is never committed may lie."""

import atexit
import os
import shutil
import signal
import tempfile
from pathlib import Path

import numpy as np
import pytest

from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import named_profile
from wrcore.scene.parts import creep

ROOT = Path(__file__).parent.parent
DATA = Path(__file__).parent / "data"


SCENES = ROOT / "config" / "scenes"
"""The examples as users run them."""


def _with_ellipses():
    """Return the folder of copies of the examples whose contact is `moment` in place of the surrogate."""
    folder = Path(tempfile.mkdtemp(prefix="wrcore-examples-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for part in ("scenes", "vehicles", "sweeps"):
        shutil.copytree(ROOT / "config" / part, folder / part)
    for path in (folder / "scenes").glob("*.yaml"):
        path.write_text(path.read_text("utf-8").replace("patch: surrogate", "patch: moment"), "utf-8")
    return folder / "scenes"


ELLIPTIC = _with_ellipses()
"""The examples with elliptic patches, for tests of something that ellipses alone have, or of many runs of another
matter than contact."""

CHECKS = (
    "study/", "test_workflow", "test_slurm", "attacks", "test_bring_your_own", "test_first_result",
    "test_arrays", "test_notebooks", "test_docs", "test_wheel",
)  # fmt: skip
"""How names of files begin that have the marker ``check``: no tests of the core, but of the study, pages, the package,
and attacks."""

FIRST = (
    "test_workflow", "equations/test_energy", "contact/patch", "contact/grid", "contact/normal", "contact/rolling",
    "analysis/contact", "creep", "bodies", "equations", "forces", "wheels", "track", "jacobian",
    "analysis/contact/test_out_of_round", "integrate", "track/test_corrugation",
    "run", "vehicle", "balance", "contract", "sweep", "analysis", "test_api", "study", "contact", "attacks",
)  # fmt: skip
"""The same in the order in which files are tested (``--no-loadscope-reorder``; a longer name counts for itself): of two
workers one compiles what vehicles run with, the other one what patches are solved with; files that need the same
kernels do not begin together; what is quick comes last, when one of them waits."""

# What a command says must not depend on whether its kernels are compiled already; tests of bars and announcements
# take the variable away for themselves.
os.environ["WRCORE_PROGRESS"] = "0"

# A shell starts what runs in the background with Ctrl-C ignored: tests of interrupts need it as in the foreground.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_ignore_collect(collection_path, config):
    """Leave out files without a test of the mark in ``-m check`` and ``-m "not check"``, and do not import them."""
    if not collection_path.name.startswith("test_") or config.option.markexpr not in ("check", "not check"):
        return None
    is_check = collection_path.relative_to(Path(__file__).parent).as_posix().startswith(CHECKS)
    if config.option.markexpr == "not check":
        return is_check or None
    return None if is_check or "mark.check" in collection_path.read_text("utf-8") else True


def pytest_collection_modifyitems(items):
    names = {item: item.path.relative_to(Path(__file__).parent).as_posix() for item in items}
    for item, name in names.items():
        if name.startswith(CHECKS):
            item.add_marker("check")
    places = {begin: k for k, begin in enumerate((*FIRST, ""))}  # "" begins any name
    items.sort(key=lambda item: places[max(filter(names[item].startswith, places), key=len)])


@pytest.fixture(scope="session")
def s1002():
    return named_profile("S1002", "wheel")


@pytest.fixture(scope="session")
def uic60():
    return named_profile("UIC60-MBench", "rail", 1 / 40)


@pytest.fixture(scope="session")
def benchmark_pair(s1002, uic60):
    """S1002 on UIC60 1:40, gauge 1435 mm, rolling radius 460 mm: the Manchester contact benchmark."""
    return WheelOnRail(s1002, uic60).geometry


@pytest.fixture
def shared_file():
    """Path of a file that belongs to others; skips where it is absent."""

    def find(*parts):
        path = Path(os.environ.get("WRCORE_SHARED", ROOT.parent / "shared")).joinpath(*parts)
        if not path.is_file():
            pytest.skip(f"{'/'.join(parts)} is not distributed with the project and not present here")
        return path

    return find


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with the vehicle files, and one for results."""
    path = tmp_path_factory.mktemp("scenes")
    shutil.copytree(ROOT / "config" / "vehicles", path / "vehicles")
    (path / "out").mkdir()
    return path


@pytest.fixture(scope="module")
def no_new_tables():
    """A spoiled material would have a creep table built, which takes its time: only the one at hand is given."""
    table = creep.ensure_table()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(creep, "ensure_table", lambda *_: table)
        yield table


def pair_with_waves(height, length):
    """S1002 with waves (µm high, mm long) on UIC60."""
    u = np.arange(-0.04, 0.0301, 2e-4)
    wheel, rail = named_profile("S1002", "wheel"), named_profile("UIC60-MBench", "rail", 1 / 40)
    waves = 1e-6 * height * np.cos(2e3 * np.pi * u / length) * (abs(u) < 0.025)
    return WheelOnRail(ProfileCurve.from_points(u, wheel(u) + waves, "wheel", "waves"), rail).geometry
