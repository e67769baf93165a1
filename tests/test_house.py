"""The house: a room of the core imports only from rooms before it, no circle of files, nothing from the study."""

import ast
from collections import Counter
from pathlib import Path

from tests.conftest import ROOT

ROOMS = (
    "errors", "kernels", "geometry", "bodies", "contact", "creep", "wheels", "track", "forces", "equations", "jacobian",
    "integrate", "vehicle", "balance", "scene", "reference", "run", "sweep", "signals", "analysis", "reporting", "cli",
)  # fmt: skip
"""In the order of the data; ``wrcore/__init__.py`` is the door to all of them."""

STUDY = ("study", "workflow", "snakemake", "tests")

COMMANDS = {"surrogate"}
"""Packages of the study whose commands a person runs, and that the workflow does not."""


def imports(tree):
    """Modules that a file imports, with lines; what only a type checker reads is left out."""
    checked = [n for n in ast.walk(tree) if isinstance(n, ast.If) and getattr(n.test, "id", "") == "TYPE_CHECKING"]
    skipped = {id(inner) for block in checked for inner in ast.walk(block)}
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)


def module_of(path, root):
    return ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")


def room_of(module):
    return module.split(".")[1] if module.count(".") else ""


def graph(root):
    """Files of the core under a root by module, each with the modules of the core that it imports."""
    trees = {module_of(p, root): ast.parse(p.read_text("utf-8")) for p in sorted((root / "wrcore").rglob("*.py"))}
    edges = {}
    for module, tree in trees.items():
        edges[module] = []
        for name, line in imports(tree):
            target = name if name in trees else name.rpartition(".")[0]
            edges[module].append((target if target in trees else name, line))
    return edges


def breaches(root):
    """One line per import that the house forbids."""
    edges, found = graph(root), []
    for module, targets in edges.items():
        for target, line in targets:
            top, mine, other = target.split(".")[0], room_of(module), room_of(target)
            if top in STUDY:
                found.append(f"{module}:{line}: the core imports {target}")
            if top == "wrcore" and mine in ROOMS and other in ROOMS and ROOMS.index(other) > ROOMS.index(mine):
                found.append(f"{module}:{line}: {mine} imports {target}, a room after it")
            if top == "wrcore" and other and other not in ROOMS:
                found.append(f"{module}:{line}: {target} is no room")
    return found + [f"circle: {' - '.join(circle)}" for circle in circles(edges)]


def circles(edges):
    """Circles of files, each once; the door ``wrcore`` itself holds no imports that run."""
    inner = {m: [t for t, _ in targets if t in edges and t not in ("wrcore", m)] for m, targets in edges.items()}
    found, done = [], set()

    def walk(module, path):
        if module in path:
            found.append(path[path.index(module) :] + [module])
        elif module not in done:
            for target in inner[module]:
                walk(target, [*path, module])
            done.add(module)

    for module in inner:
        walk(module, [])
    return found


def test_rooms_stand_in_the_order_of_the_data():
    assert breaches(ROOT) == []


def test_the_integrator_knows_no_contact():
    """The integrator uses a model by `wrcore.equations.interface` and imports neither profiles, contact nor creep."""
    paths = (ROOT / "wrcore/integrate").glob("*.py")
    names = {name for path in paths for name, _ in imports(ast.parse(path.read_text("utf-8")))}
    rooms = {room_of(name) for name in names if name.startswith("wrcore.")}
    assert not rooms & {"geometry", "contact", "creep"}


def test_the_core_shows_its_rooms_and_nothing_else():
    entries = {p.name for p in (ROOT / "wrcore").iterdir()} - {"__pycache__"}
    assert {name.removesuffix(".pyi").removesuffix(".py") for name in entries} == {
        *ROOMS, "__init__", "__main__", "py.typed"
    }  # fmt: skip


def test_files_and_folders_of_the_core_are_short():
    """At most 400 lines in a file, 16 modules in a folder."""
    paths = sorted((ROOT / "wrcore").rglob("*.py"))
    lengths = {path.relative_to(ROOT).as_posix(): len(path.read_text("utf-8").splitlines()) for path in paths}
    assert not {name: length for name, length in lengths.items() if length > 400}
    counts = Counter(path.parent.relative_to(ROOT).as_posix() for path in paths)
    assert not {name: count for name, count in counts.items() if count > 16}


def test_every_question_has_its_drawers():
    """Study package, rules, scripts and captions share the names; sections of the configuration too."""
    questions = {p.name for p in (ROOT / "workflow/study").iterdir() if p.is_dir()} - {"__pycache__"} - COMMANDS
    assert {p.stem for p in (ROOT / "workflow/rules").glob("*.smk")} == questions | {"common"}
    assert {p.name for p in (ROOT / "workflow/scripts").iterdir()} == questions
    assert {p.name for p in (ROOT / "workflow/report").iterdir() if p.is_dir()} == questions - {"report"}
    sections = {
        line.split(":")[0] for line in (ROOT / "config/study.yaml").read_text().splitlines() if line[:1].isalpha()
    }
    assert sections == questions - {"report"}


def test_tests_stand_in_the_room_that_they_test():
    tests = ROOT / "tests"
    of_all_rooms = {Path(), Path("contract"), Path("attacks")}
    folders = {path.parent.relative_to(tests) for path in tests.rglob("test_*.py")} - of_all_rooms
    assert {folder.parts[0] for folder in folders} == {*ROOMS, "study"}
    assert [f for f in folders if not any((ROOT / package / f).is_dir() for package in ("wrcore", "workflow"))] == []


PLANTED = [
    ("run/simulation.py", "from wrcore.analysis.assessment import wheels", "run imports wrcore.analysis"),
    (
        "geometry/path.py",
        "def f():\n    import wrcore.contact.search.scan",
        "geometry imports wrcore.contact.search.scan",
    ),
    ("creep/laws.py", "from study.creep import laws", "the core imports study.creep"),
    ("kernels/jit.py", "from wrcore.kernels.lanes import total", "circle: wrcore.kernels.jit - wrcore.kernels.lanes"),
    ("kernels/lanes.py", "from wrcore.kernels.jit import jit", "circle: wrcore.kernels.jit - wrcore.kernels.lanes"),
    ("hallway.py", "from wrcore.hallway import x", "wrcore.hallway is no room"),
]
"""File, line added to it, and the breach of the house's order that it is."""


def test_planted_breaches_are_found(tmp_path):
    for path in (ROOT / "wrcore").rglob("*.py"):
        copy = tmp_path / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(path.read_text("utf-8"))
    for file, line, _ in PLANTED:
        with Path(tmp_path / "wrcore" / file).open("a") as target:
            target.write("\n" + line + "\n")
    found = breaches(tmp_path)
    assert [expected for _, _, expected in PLANTED if not any(expected in breach for breach in found)] == [], found
