"""Settings, tables and work arrays with which the kernels of a run solve patches on strips."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wrcore.contact.normal.influence import influence_table
from wrcore.contact.normal.solve import STRIP_ROWS, SUMS
from wrcore.contact.normal.strips import MAX_STRIPS, MEMORY, NormalWork, normal_work
from wrcore.contact.rolling.library import LOG_MIN, LOG_STEP, Library, make_library
from wrcore.contact.rolling.panels import make_panels
from wrcore.contact.rolling.rolling import LEVELS, Level, RollingWork, rolling_work
from wrcore.contact.search.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.contact.surrogate.network import no_surrogate
from wrcore.contact.surrogate.scratch import SurrogateScratch, surrogate_scratch
from wrcore.errors import InputError, one_of

PATCHES = ("maximum", "moment", "exact", "tabulated", "surrogate")
"""Names of patch models: two reductions to an ellipse, solution on strips, its lookup table, and a trained network."""

STRIPS = "exact", "tabulated"
"""Patch models that solve patches on strips, in a run or before it."""

RESOLUTIONS = ("coarse", "middle", "fine")
SLIPS = ("surfaces", "creepages")


class PairTable(NamedTuple):
    """Lookup table of contact on strips for a wheel on its rail, see `wrcore.wheels.table.lookup`; empty without a
    table."""

    keys: np.ndarray
    states: np.ndarray
    """(n,) int64 and int32: keys of the cells, and the number or the state of each cell."""
    cells: np.ndarray
    """(n, NODES, NUMBERS) float32: numbers at the nodes of each cell."""
    misses: np.ndarray
    """(n, 2) float32: errors of N and of the creep force over mu N in the middle of each cell."""
    modes: np.ndarray
    """(2, n + 2, n + 2, 3 MODES) float32: coefficients of quadratic B-splines over the disk of the creepages, for both
    families of modes."""
    fill: int
    """Address of the kernel that solves the nodes of a cell."""


NO_TABLE = PairTable(
    np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros((0,) * 3, np.float32), np.zeros((0, 2), np.float32),
    np.zeros((0,) * 4, np.float32), 0,
)  # fmt: skip
NODES, NUMBERS, MODES = 48, 72, 24
"""Number of nodes of a cell, of numbers at a node, and of modes of the creep force in each family."""

LOBE_COLUMNS, SHARES = 10 + 2 * MAX_PATCHES, (12, 15)
"""Number of columns of a sub-patch from the table, see `wrcore.wheels.table.coupled_lobes`; shape of the array of its
cells, see `wrcore.wheels.table.cells`."""


KERNEL, MODEL, ELLIPSES, LOBES, LOAD = range(5)
"""Indices of the addresses in `StripModel.late`."""


class StripModel(NamedTuple):
    """Settings and tables of patches on strips, for kernels.

    Arrays are empty without strips. With a lookup table they are empty until a patch must be solved (`with_tables`)."""

    strips: int
    """Number of strips of a window; 0: patches are ellipses."""
    surfaces: int
    """1: rigid slip of the surfaces in each strip; 0: one set of creepages per patch."""
    looked_up: float
    """Coefficient of friction of the lookup table; 0: patches are solved directly."""
    values: np.ndarray
    """Coefficients of `influence_table`."""
    library: Library
    wider: Library
    widest: Library
    """Libraries for 1, 3/2 and 2 times the usual number of strips, for windows of increasing width."""
    slender: Library
    """Library for slender patches."""
    grid_kernel: int = 0
    """Address of the kernel that solves a patch on a grid if strips do not converge."""
    table: PairTable = NO_TABLE
    patch_forces_kernel: int = 0
    """Address of the kernel that adds force and moment of a patch, from the table or from a solution."""
    late: np.ndarray = np.zeros(5, np.int64)
    """Addresses; the first four are 0 until they are needed. KERNEL: kernel that solves a patch outside the table;
    MODEL: its model; ELLIPSES: the kernel with ellipses in its place; LOBES: the kernel for separate sub-patches; LOAD:
    the kernel that finds these four."""


class StripWork(NamedTuple):
    """Work arrays for one patch at a time."""

    memory: np.ndarray
    """(wheelsets, 2, MAX_PATCHES, MEMORY): last solutions, from which the next ones may start; part of the state of a
    run."""
    spare: np.ndarray
    """(MEMORY,): memory for a solution without a start: its first number is set to 0 before use."""
    flags: np.ndarray
    """(3,): options of the evaluation of patches, see `wrcore.wheels.exact_force`."""
    rows: np.ndarray
    out: np.ndarray
    strips: np.ndarray
    slip: np.ndarray
    friction: np.ndarray
    """(3, MAX_STRIPS): forces on the strips, see `gap.strip_wrenches`."""
    wrench: np.ndarray
    """(2, 6): wrenches of pressure and of friction."""
    sums: np.ndarray
    solved: np.ndarray
    """(3,) int: number of strips of the last solution, 1 if the patch is slender, and number of windows."""
    lobes: np.ndarray
    numbers: np.ndarray
    weights: np.ndarray
    shares: np.ndarray
    """(MAX_PATCHES, LOBE_COLUMNS), (MAX_PATCHES, NUMBERS), (NODES,) and `SHARES`: for a patch from the table."""
    spread: np.ndarray
    along: np.ndarray
    rest: np.ndarray
    lattice: np.ndarray
    """(5, NODES), (4, NUMBERS), (8, 3) and (10, 4): for its derivatives, see `wrcore.jacobian.table_wheel`."""
    moments: np.ndarray
    """(3, 5): moments of overlaps, see `wrcore.contact.search.moved.slopes_of_square`."""
    normal: NormalWork
    rolling: RollingWork
    slender: RollingWork
    surrogate: SurrogateScratch


def _no_library(nu, level=Level(0, 0, 0, 0)):  # noqa: B008  a tuple
    return Library(level, make_panels(max(level.panels, 4)), nu, LOG_MIN, LOG_STEP, np.zeros((0, 0), np.float32))


def strip_model(patch, resolution="middle", slip="surfaces", nu=0.28, friction=0.3):
    """Return the `StripModel` for a scene's patch model, resolution and slip.

    ``patch`` is one of `PATCHES`; ``resolution`` stands for 8, 12 or 16 strips of a window; ``slip`` is that of the
    true surfaces or of one set of creepages per patch; ``nu`` is Poisson's ratio, ``friction`` the coefficient of a
    table. InputError for an unknown name."""
    named = {"patch": (patch, PATCHES), "resolution": (resolution, RESOLUTIONS), "slip": (slip, SLIPS)}
    for name, (value, known) in named.items():
        if value not in known:
            raise InputError("contact", name, one_of(known, value))
    return _strip_model(patch, resolution, slip, float(nu), float(friction) if patch == "tabulated" else 0.0)


@lru_cache(maxsize=8)
def _strip_model(patch, resolution, slip, nu, friction):
    if patch not in STRIPS:
        return StripModel(0, 0, 0.0, np.zeros((0, 0)), *(_no_library(nu) for _ in range(4)))
    level = LEVELS[resolution]
    levels = [level._replace(strips=level.strips * halves // 2) for halves in (2, 3, 4)]
    libraries = (_no_library(nu, each) for each in (*levels, LEVELS["slender"]))
    model = StripModel(level.strips, int(slip == "surfaces"), friction, np.zeros((0, 0)), *libraries)
    return model if friction else with_tables(model)


def with_tables(model):
    """Return the `StripModel` with all tables of a direct solution."""
    bare = model._asdict()
    names = "library", "wider", "widest", "slender"
    libraries = {name: make_library(bare[name].level, bare[name].nu) for name in names}
    return model._replace(values=influence_table(), **libraries)


def strip_work(model, wheelsets, slips=1, surrogate=None):
    """Return the work arrays for a `StripModel`, a number of wheelsets, and ``slips`` slips of a patch at once.

    Arrays are small if patches are ellipses. ``surrogate``: the trained network, if the scene has one."""
    count, wheels, normal = MAX_STRIPS, (wheelsets, 2, MAX_PATCHES), normal_work()
    if not model.strips:
        count, wheels = 1, (0, 0, 0)
        normal = NormalWork(*(np.zeros((0,) * part.ndim, part.dtype) for part in normal))
    return StripWork(
        np.zeros((*wheels, MEMORY)), np.zeros(MEMORY), np.zeros(3),
        np.zeros((MAX_PATCHES, PATCH_COLUMNS)), np.zeros(PATCH_COLUMNS),
        np.zeros((STRIP_ROWS, count)), np.zeros((4, count)), np.zeros((3, count)),
        np.zeros((2, 6)), np.zeros(SUMS), np.zeros(3, np.int64),
        np.zeros((MAX_PATCHES, LOBE_COLUMNS)), np.zeros((MAX_PATCHES, NUMBERS)), np.zeros(NODES),
        np.zeros(SHARES),
        *(np.zeros(shape if model.looked_up else (0, 0)) for shape in ((5, NODES), (4, NUMBERS), (8, 3), (10, 4))),
        np.zeros((3, 5)), normal,
        *(rolling_work(count, max(one.level.panels, 2), slips) for one in (model.library, model.slender)),
        surrogate_scratch(no_surrogate() if surrogate is None else surrogate),
    )  # fmt: skip
