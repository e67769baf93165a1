"""What the kernels of a run need to solve the real patch: settings and tables, and scratch arrays."""

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
"""Patch models by name: two reductions to an ellipse, exact strips, these looked up, and a trained network of them."""

STRIPS = "exact", "tabulated"
"""Those that solve patches on strips, in a run or before it."""

RESOLUTIONS = ("coarse", "middle", "fine")
SLIPS = ("surfaces", "creepages")


class PairTable(NamedTuple):
    """Exact contact of a wheel on its rail at the nodes of lattices, see `wrcore.wheels.table.lookup`; empty where it
    is not looked up."""

    keys: np.ndarray
    states: np.ndarray
    """(n,) int64 and int32: cells by their keys, each with its number or its state."""
    cells: np.ndarray
    """(n, NODES, NUMBERS) float32: what a cell is looked up from."""
    misses: np.ndarray
    """(n, 2) float32: errors in its middle, of N and of the creep force over mu N."""
    modes: np.ndarray
    """(2, n + 2, n + 2, 3 MODES) float32: coefficients of quadratic B-splines over the disk of the creepages, of both
    families."""
    fill: int
    """Address of what solves a cell's nodes."""


NO_TABLE = PairTable(
    np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros((0,) * 3, np.float32), np.zeros((0, 2), np.float32),
    np.zeros((0,) * 4, np.float32), 0,
)  # fmt: skip
NODES, NUMBERS, MODES = 48, 72, 24
"""Rows of a cell, numbers of a node, and modes of each family of the creep force that are among them."""

LOBE_COLUMNS, SHARES = 10 + 2 * MAX_PATCHES, (12, 15)
"""Of a lobe that is looked up, see `wrcore.wheels.table.coupled_lobes`, and of the cells that have a share in it, see
`wrcore.wheels.table.cells`."""


KERNEL, MODEL, ELLIPSES, LOBES, LOAD = range(5)
"""Addresses in `StripModel.late`."""


class StripModel(NamedTuple):
    """Settings and tables of patches on strips, for kernels; its arrays are empty without strips, and where patches are
    looked up until one is to be solved (`with_tables`)."""

    strips: int
    """Strips of a window; 0: patches are ellipses."""
    surfaces: int
    """1: rigid slip of the surfaces, strip by strip; 0: one set of creepages."""
    looked_up: float
    """Coefficient of friction of the pair's table in which patches are looked up; 0: they are solved."""
    values: np.ndarray
    """Of `influence_table`."""
    library: Library
    wider: Library
    widest: Library
    """Windows that are wide have 3/2 or 2 times the strips of others."""
    slender: Library
    """Resolution of slender patches."""
    fallback: int = 0
    """Address of the kernel that solves a patch on a grid."""
    table: PairTable = NO_TABLE
    group: int = 0
    """Address of the kernel that adds what acts on a patch: looked up in the table or solved."""
    late: np.ndarray = np.zeros(5, np.int64)
    """Addresses of the kernel that solves a patch where it is looked up, of the model that it takes, of the kernel with
    ellipses in its place, and of that of lobes that are apart, all 0 until they are needed, and of what then finds
    them."""


class StripWork(NamedTuple):
    """Scratch arrays of one patch at a time."""

    memory: np.ndarray
    """(wheelsets, 2, MAX_PATCHES, MEMORY): last solutions, from which the next ones may start; part of what a run
    knows."""
    spare: np.ndarray
    """(MEMORY,): a memory of nothing, once its first number is 0; solutions are written into it."""
    flags: np.ndarray
    """(3,): what is asked of patches, see `wrcore.wheels.exact_force`."""
    rows: np.ndarray
    out: np.ndarray
    strips: np.ndarray
    slip: np.ndarray
    friction: np.ndarray
    """(3, MAX_STRIPS): forces on the strips, see `gap.strip_wrenches`."""
    wrench: np.ndarray
    """(2, 6): of pressure and of friction."""
    sums: np.ndarray
    solved: np.ndarray
    """(3,) int: strips of the last solution, 1 if they are slender, and windows."""
    lobes: np.ndarray
    numbers: np.ndarray
    weights: np.ndarray
    shares: np.ndarray
    """(MAX_PATCHES, LOBE_COLUMNS), (MAX_PATCHES, NUMBERS), (NODES,) and `SHARES`: of a patch that is looked up."""
    spread: np.ndarray
    along: np.ndarray
    rest: np.ndarray
    lattice: np.ndarray
    """(5, NODES), (4, NUMBERS), (8, 3) and (10, 4): of its slopes, see `wrcore.jacobian.table_wheel`."""
    moments: np.ndarray
    """(3, 5): of overlaps, see `wrcore.contact.search.moved.slopes_of_square`."""
    normal: NormalWork
    rolling: RollingWork
    slender: RollingWork
    surrogate: SurrogateScratch


def _no_library(nu, level=Level(0, 0, 0, 0)):  # noqa: B008  a tuple
    return Library(level, make_panels(max(level.panels, 4)), nu, LOG_MIN, LOG_STEP, np.zeros((0, 0), np.float32))


def strip_model(patch, resolution="middle", slip="surfaces", nu=0.28, friction=0.3):
    """`StripModel` of a scene's ``patch`` (of `PATCHES`), resolution (8, 12 or 16 strips of a window) and ``slip`` (of
    the real surfaces, or of one set of creepages per patch); ``nu`` is Poisson's ratio, ``friction`` the coefficient
    of a table. InputError for an unknown name.
    """
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
    """A `StripModel` with all that a solution takes."""
    bare = model._asdict()
    names = "library", "wider", "widest", "slender"
    libraries = {name: make_library(bare[name].level, bare[name].nu) for name in names}
    return model._replace(values=influence_table(), **libraries)


def strip_work(model, wheelsets, slips=1, surrogate=None):
    """Scratch arrays for a `StripModel`, a number of wheelsets, and so many ``slips`` of a patch at once; next to
    nothing where patches are ellipses. ``surrogate``: the trained network, if the scene has one."""
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
