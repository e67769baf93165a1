"""Functional mock-up units of scenes: a session behind the interface of FMI 2 or FMI 3 for co-simulation.

The file contains the scene with all files that it names, a short Python script and the binary of PythonFMU. The binary
implements FMI and runs the script in the Python of the machine. There, ``import wrcore`` must work.
"""

from __future__ import annotations

import copy
import json
import re
import shutil
import sys
import tempfile
from collections.abc import Iterable
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import yaml

import wrcore
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.errors.input_files import digest_of_file
from wrcore.errors.messages import say
from wrcore.errors.new_files import appearing
from wrcore.geometry.changing_rails.files import profiles_in, with_profiles
from wrcore.kernels.named_laws import LawFile
from wrcore.run.output.channels import DESCRIPTIONS
from wrcore.run.session import Session
from wrcore.run.start import start
from wrcore.run.state import State
from wrcore.scene.description import Scene
from wrcore.scene.reader import existing_file, find_file

LIBRARIES = {2: ("pythonfmu", "Fmi2Slave", "Real", "Fmi2"), 3: ("pythonfmu3", "Fmi3Slave", "Float64", "Fmi3")}
"""Library of each FMI version: its name, its class of a slave, its class of a number, and the prefix of its names."""

SCENE, INTERFACE = "scene.yaml", "interface.json"

JUMP = 1e-9
"""Largest relative difference between a communication point and the end of the last step: the master rounds."""

SCRIPT = '''"""A scene of wrcore {version} as a functional mock-up unit; it needs wrcore where it runs."""

from {library} import {number}, {prefix}Causality, {prefix}Variability, {slave}
from wrcore.run.fmu import SteppedScene


class {name}({bases}):
    held = [globals()]
    number, causality, variability = {number}, {prefix}Causality, {prefix}Variability
'''


class SteppedScene:
    """Behaviour of a unit: mixin for a class that also inherits from a slave class of PythonFMU."""

    number: Any
    causality: Any
    variability: Any
    held: list[Any]
    """References to the globals of the unit's script, one per instance, so that they are not freed while in use.
    PythonFMU's binary for FMI 2 (0.7.0) releases a borrowed reference to them at each instance."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.held.append(self.held[0])
        self._folder = Path(given["resources"])
        told = json.loads((self._folder / INTERFACE).read_text("utf-8"))
        self.description, self._session, self._read = told["description"], None, (float("nan"), {})  # type: ignore
        self._begin, self._digests = 0.0, told["sha256"]
        self._inputs, self._outputs = {name: value for name, (value, _) in told["inputs"].items()}, [*told["outputs"]]
        if told["fmi"] == 3:
            self._register("time", "independent", "continuous", "time, s", lambda: self._present().time)
        for name, (_, text) in told["inputs"].items():
            value, put = (lambda name=name: self._inputs[name] or 0.0), self._setter(name)
            self._register(name, "input", "continuous", text, value, put)
        for name, text in told["outputs"].items():
            self._register(name, "output", "continuous", text, lambda name=name: self._output(name))

    def _register(self, name, causality, variability, text, getter, setter=None):
        causality, variability = self.causality[causality], self.variability[variability]
        more = {"description": text, "getter": getter, "setter": setter}
        variable = self.number(name, causality=causality, variability=variability, **more)
        self.register_variable(variable, nested=False)

    def _setter(self, name):
        def put(value):
            self._inputs[name] = value

        return put

    def setup_experiment(self, start_time: float, *_: Any) -> None:
        """Store the start time of the master, s."""
        self._begin = float(start_time)

    def _present(self) -> Session:
        """Return the session; the first call starts it at the master's start time, at which tables over time begin."""
        if self._session is None:
            for name, digest in self._digests.items():
                if digest_of_file(self._folder / name) != digest:
                    raise InputError(name, "", "expected the file with which the unit was written, but it was changed")
            self._session = start(self._folder / SCENE, record=False)
            if self._begin != 0.0:
                first = self._session.state
                begun = State(first, self._begin, first.frame, first.vehicle)
                self._session = start(self._session.scene, start=begun, record=False)
        return self._session

    def _output(self, name):
        """Return the value of an output channel; all outputs of one time are computed together."""
        session = self._present()
        if self._read[0] != session.time:
            self._read = session.time, session.channels(*self._outputs)
        return self._read[1][name]

    def exit_initialization_mode(self) -> None:
        self._present()

    def do_step(self, current_time: float, step_size: float) -> Any:
        """Step with the present inputs; return False, which discards the step, if the step is invalid or fails.

        Then one line on standard error says why. The unit can still be used: a master may read its outputs or restore
        a state.
        """
        session = self._present()
        try:
            if abs(current_time - session.time) > JUMP * max(1.0, abs(session.time), abs(step_size)):
                expected = (
                    f"expected a step from {session.time:g} s on, the end of the last one, got {current_time:g} s"
                )
                raise InputError("unit", "communication point", expected)
            session.step(step_size, {name: value for name, value in self._inputs.items() if value is not None})
        except InputError as error:
            say(f"unit: {error}")
            return False
        if session.status != "running":
            say(f"unit: {session.status}: {session.reason}")
        return session.status == "running"

    def to_xml(self, *options: Any) -> Any:
        root = super().to_xml(*options)  # type: ignore[misc]
        root.set("variableNamingConvention", "flat")
        structure = root.find("ModelStructure")
        if (outputs := structure.find("Outputs")) is not None:  # FMI 2: PythonFMU omits InitialUnknowns
            outputs = copy.deepcopy(outputs)
            outputs.tag = "InitialUnknowns"
            structure.append(outputs)
        return root

    def _get_fmu_state(self) -> Any:
        return self._present().save(), dict(self._inputs)

    def _set_fmu_state(self, state: Any) -> None:
        self._present().restore(state[0])
        self._inputs.update(state[1])
        self._read = float("nan"), {}


def library_of(fmi: int) -> ModuleType:
    """Import the library that builds units of an FMI version; an InputError says how to install it."""
    try:
        return import_module(LIBRARIES[fmi][0])
    except ImportError:
        text = f"expected {LIBRARIES[fmi][0]} to be installed: pip install pythonfmu pythonfmu3"
        raise InputError("wrcore fmu", "", text) from None


def write_fmu(scene: Scene, path: Path, fmi: int = 2, outputs: Iterable[str] = ()) -> tuple[list[str], list[str]]:
    """Write a scene as a unit for co-simulation and return the names of its inputs and of its outputs.

    ``outputs`` are names of :meth:`Session.channels`, by default all channels of bodies and of the drive. InputError if
    a name does not exist.
    """
    library, session = library_of(fmi), start(scene)
    numbers = [name for name in session.channels() if "/" not in name or name.startswith("drive/")]
    chosen = list(outputs) or numbers
    session.channels(*chosen)
    told = {
        "fmi": fmi, "description": f"{scene!r}, by wrcore {wrcore.__version__}",
        "inputs": {name: _start_of(value, session.meanings[name]) for name, value in session.inputs.items()},
        "outputs": {name: DESCRIPTIONS.get(name.split(".")[1], "") for name in chosen},
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="wrcore_fmu_") as place, _import_state():
        folder = Path(place, "files")
        folder.mkdir()
        _pack_scene(scene, folder)
        told["sha256"] = {path.name: digest_of_file(path) for path in sorted(folder.iterdir())}
        (folder / INTERFACE).write_text(json.dumps(told), "utf-8")
        name, (package, slave, number, prefix) = re.sub(r"\W", "_", f"wrcore_{path.stem}"), LIBRARIES[fmi]
        words = {"version": wrcore.__version__, "library": package, "number": number, "slave": slave, "prefix": prefix}
        script = Path(place, f"{name}.py")
        script.write_text(SCRIPT.format(name=name, bases=f"SteppedScene, {slave}", **words), "utf-8")
        built = library.FmuBuilder.build_FMU(script, Path(place), list(folder.iterdir()), **_options(fmi))
        with appearing(path) as file, open(built, "rb") as unit:
            shutil.copyfileobj(unit, file)
    return list(told["inputs"]), chosen


def _start_of(value, text):
    """Return start value (None if it is NaN: the scene's table applies) and description of an input."""
    return (value, text) if value == value else (None, f"{text}; until it is set the scene's table rules")


def _options(fmi):
    return {"canGetAndSetFMUstate" if fmi == 2 else "canGetAndSetFMUState": True}


@contextmanager
def _import_state():
    """Restore `sys.path` and remove imported modules of units after the import of a script."""
    path, modules = list(sys.path), set(sys.modules)
    try:
        yield
    finally:
        sys.path[:] = path
        for name in set(sys.modules) - modules:
            if name.startswith("wrcore_"):
                del sys.modules[name]


def _pack_scene(scene, folder):
    """Write a scene and all files that it names into one folder."""
    names = {}
    for number, path in enumerate(scene.files):
        names[path] = f"{number}_{Path(path).name}"
    laws = _pack_laws(scene, folder, names)
    for path in scene.files.keys() - scene.laws.files.keys():
        shutil.copy(path, folder / names[path])
        if any(str(listed) in names for listed in profiles_in(path)):  # slices, whose profiles were renamed
            text = with_profiles(path, lambda name, at=Path(path).parent: names.get(str(at / name), name))
            (folder / names[path]).write_text(text)
    content = _with_laws(_with_files(scene.data, Path(scene.source).parent, names), laws)
    vehicle = scene.data["vehicle"]["parameters"]
    if isinstance(vehicle, str) and any("law" in item for item in scene.vehicle.data["elements"]):
        path = find_file(vehicle, Path(scene.source).parent, scene.source, "vehicle.parameters")
        text = yaml.safe_dump(_vehicle_of(path, scene, laws), sort_keys=False)
        (folder / names[str(path)]).write_text(text, "utf-8")
    (folder / SCENE).write_text(yaml.safe_dump(content, sort_keys=False), "utf-8")


NAMED_BY = "parameters", "profile", "points", "slices", "table"
"""Keys of a scene whose values may name files."""


def _with_files(value, folder, names, key=""):
    """Return a scene's content, or a part of it, with renamed files; ``names`` maps their paths to new names."""
    if isinstance(value, dict):
        return {name: _with_files(item, folder, names, name) for name, item in value.items()}
    if isinstance(value, list):
        return [_with_files(item, folder, names, key) for item in value]
    found = existing_file(value, folder) if key in NAMED_BY and isinstance(value, str) else None
    return names.get(str(found), value)


def _pack_laws(scene, folder, names):
    """Write the files of a scene's laws as they were when the scene was read; return the new text of each law."""
    laws = {}
    for text, source in scene.laws.known.items():
        if isinstance(source, LawFile):
            (folder / names[source.path]).write_bytes(source.content)
            laws[text] = f"{names[source.path]}:{source.name}"
        elif ":" in text:  # an entry point has no colon: its package must be installed where the unit runs
            raise InputError("wrcore fmu", "law", f"expected file.py:function for a unit to take along, got {text!r}")
    return laws


def _with_laws(value, laws, key=""):
    """Return a scene's content, or a part of it, with the texts of its laws replaced."""
    if isinstance(value, dict):
        return {name: _with_laws(item, laws, name) for name, item in value.items()}
    if isinstance(value, list):
        return [_with_laws(item, laws, key) for item in value]
    return laws.get(value, value) if key in ("law", "model") else value


def _vehicle_of(path, scene, laws):
    """Return the content of a vehicle file with the texts of its elements' laws replaced."""
    data, folder = read_yaml(path), Path(path).parent
    for item in data["elements"]:
        if "law" in item:
            item["law"] = laws.get(scene.laws.beside(item["law"], folder), item["law"])
    return data
