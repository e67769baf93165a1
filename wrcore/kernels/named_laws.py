"""Functions that a scene names; their files are read when the scene is loaded and run when it is simulated.

A scene names a function as ``file.py:function``, in a file in the folder of the scene or below, or by the name of an
installed entry point. A Python program may pass the function itself. No other module is imported, because a scene may
come from another person. The text of a file is the text at the time at which the scene was loaded.
"""

import hashlib
import inspect
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.checked_yaml import GIVEN
from wrcore.errors.input_files import check_regular

GROUP = "wrcore.laws"
"""Group of the entry points of laws in installed packages; creep laws have another group."""

_KNOWN: dict[tuple[int, ...], Any] = {}
_TEXTS: dict[ModuleType, str] = {}
_MODULES: dict[tuple[str, bytes], ModuleType] = {}
_PRESENT: ContextVar["Laws | None"] = ContextVar("present", default=None)


class LawFile(NamedTuple):
    """Function in a file that has been read but not run."""

    path: str
    content: bytes
    name: str


class UserFunction(NamedTuple):
    """Name and digest of a function of the user."""

    name: str
    digest: tuple[int, ...]
    """Digest of name and text as four numbers, which models hold instead of the function."""

    @property
    def function(self) -> Callable:
        """The function itself; its file is run at the first access."""
        known = _KNOWN[self.digest]
        if isinstance(known, LawFile):
            known = _KNOWN[self.digest] = _function_in(known)
        return known

    @property
    def sha256(self) -> str:
        """Digest as 64 hex digits."""
        return np.array(self.digest, np.int64).tobytes().hex()


class Laws:
    """Laws of a scene, by the texts that name them.

    Parameters
    ----------
    *folders : Path
        Folders that contain the files of laws, also in subfolders.
    asked : iterable of str
        Laws that the user named in the present call: their paths may also be relative to the working directory, and
        their files may be in any folder.
    before : mapping, optional
        Sources that have already been read, by text; they are not read again.
    trusted : bool
        False for a scene from a file of results: its laws are not run.
    """

    def __init__(
        self,
        *folders: Path,
        asked: Iterable[str] = (),
        before: Mapping[str, Any] | None = None,
        trusted: bool = True,
    ) -> None:
        self.folders, self.asked, self.trusted = tuple(map(Path, folders)), frozenset(asked), trusted
        self.known: dict[str, Any] = {}
        self._before = dict(before or {})

    def find(self, law: str, group: str = GROUP) -> UserFunction:
        """Return the law that a text names; an InputError without a source states the expectation."""
        key = law if ":" in law else f"{law} of {group}"
        if key not in self.known:
            self.known[key] = self._before.get(key) or self._source_of(law, group)
        return _user_function(self.known[key])

    def beside(self, law: str, folder: Path) -> str:
        """Return the name of a law with the absolute path of its file in ``folder``, the folder of a vehicle file say.

        The name is returned unchanged if there is no such file."""
        place, _, name = law.rpartition(":")
        path = _file_below(place, folder) if place.endswith(".py") else None
        if path is None:
            return law
        whole = f"{path}:{name}"
        if whole not in self._before:
            self._before[whole] = _read(path, name)
        return whole

    @property
    def files(self) -> dict[str, str]:
        """SHA-256 of the files with laws, by path."""
        files = [source for source in self.known.values() if isinstance(source, LawFile)]
        return {file.path: hashlib.sha256(file.content).hexdigest() for file in files}

    @property
    def digests(self) -> dict[str, str]:
        """SHA-256 of each law, by its name without the folder of the file."""
        found: dict[str, set[str]] = {}
        for text, source in self.known.items():
            found.setdefault(text.replace("\\", "/").rpartition("/")[2], set()).add(_user_function(source).sha256)
        return {name: "+".join(sorted(each)) for name, each in found.items()}

    def allow(self) -> None:
        """Raise an InputError without a source if the scene has laws and is not trusted."""
        if self.known and not self.trusted:
            named = ", ".join(sorted(self.digests))
            expected = f"expected trust=True (--trust) to run what this file names, code that may be anybody's: {named}"
            raise InputError("", "trust", expected)

    @contextmanager
    def present(self):
        """Make `present_laws` return these laws during a block."""
        token = _PRESENT.set(self)
        try:
            yield self
        finally:
            _PRESENT.reset(token)

    def _source_of(self, law, group):
        place, colon, name = law.rpartition(":")
        if law in GIVEN:
            return GIVEN[law]
        if not colon:
            return self._installed(law, group)
        if not place.endswith(".py") or not name.isidentifier():
            raise InputError("", "", f"{_EXPECTED.format(group=group)}, got {law!r}")
        path = next(filter(None, (_file_below(place, folder) for folder in self.folders)), None)
        there = next((base / place for base in (*self.folders, Path()) if _is_file(base / place)), None)
        if path is None and law in self.asked:
            path = there
        if path is None:
            what = "a file beside the one that names it, or below its folder" if there else "an existing file"
            raise InputError("", "", f"expected {what}, got {place!r}")
        return _read(path.resolve(), name)

    def _installed(self, law, group):
        """Return the function of an installed entry point."""
        entry = entry_named(group, law, self.trusted)
        if entry is None:
            raise InputError("", "", f"{_EXPECTED.format(group=group)}, got {law!r}")
        return loaded(entry, group)


_EXPECTED = (
    "expected file.py:function of a file beside the one that names it, an installed entry point of {group}, or in"
    " Python the function itself"
)


def present_laws() -> Laws:
    """Return the laws of the scene that is being read; else those of the working directory."""
    return _PRESENT.get() or Laws(Path())


def entry_named(group: str, name: str, trusted: bool = True) -> Any:
    """Return an installed entry point, or None; an InputError without a source is raised if it may not be run."""
    from importlib.metadata import entry_points  # reads the list of installed packages, about ten milliseconds

    entry = next((entry for entry in entry_points(group=group) if entry.name == name), None)
    if entry is not None and not trusted:
        expected = f"expected trust=True (--trust) to run {entry.value} of an installed package, which this file names"
        raise InputError("", "trust", expected)
    return entry


def loaded(entry: Any, group: str) -> Any:
    """Import and return the object of an entry point; any error becomes an InputError without a source."""
    return guarded(f"the entry point {entry.name} of {group}", entry.load)


def _user_function(source):
    """Return the `UserFunction` of a source (a `LawFile` or a function) and register the source."""
    if isinstance(source, LawFile):
        name, content = source.name, source.content
    else:
        name = getattr(source, "__name__", "")
        module = sys.modules.get(getattr(source, "__module__", ""))
        content = f"{_text(module, source)}\0{_content(source, set())}".encode("utf-8", "surrogatepass")
    sha = hashlib.sha256(name.encode() + b"\0" + content).digest()
    digest = tuple(int(part) for part in np.frombuffer(sha, np.int64))
    if not (isinstance(source, LawFile) and digest in _KNOWN):  # equal digests may belong to different objects
        _KNOWN[digest] = source
    return UserFunction(name, digest)


def _file_below(place, folder):
    """Return the resolved path of a file in a folder or below it; None if there is no such file."""
    if not _is_file(folder / place):
        return None
    path = (folder / place).resolve()
    return path if path.is_relative_to(folder.resolve()) else None


def _is_file(path):
    return os.path.isfile(path)  # Path.is_file raises for names that are too long and closed folders


def _read(path, name):
    try:
        check_regular(path)
        return LawFile(str(path), path.read_bytes(), name)
    except OSError as error:
        raise InputError("", "", f"expected a readable file: {path.name}: {error.strerror}") from None


def _function_in(file):
    """Return the function of a file; the file is run once in a process."""
    key = file.path, file.content
    if key not in _MODULES:
        stem = Path(file.path).stem
        name = f"{stem}_{hashlib.sha256(file.path.encode() + file.content).hexdigest()[:12]}"
        module = ModuleType(name)
        module.__file__ = file.path
        sys.modules[name] = module
        try:
            guarded(Path(file.path).name, lambda: exec(compile(file.content, file.path, "exec"), vars(module)))
        except BaseException:
            del sys.modules[name]
            raise
        _TEXTS[module] = file.content.decode("utf-8", "replace")
        for value in vars(module).values():
            _without_cache(value)
        _MODULES[key] = module
    function = getattr(_MODULES[key], file.name, None)
    if not callable(function):
        raise InputError("", "", f"expected a function {file.name!r} in {Path(file.path).name}, found none")
    return function


def _without_cache(function):
    """Disable the cache of a compiled function, because cached machine code may be that of another text of the file."""
    if hasattr(function, "py_func") and hasattr(function, "_cache"):
        from numba.core.caching import NullCache

        function._cache = NullCache()


def guarded(what: str, load: Callable[[], Any]) -> Any:
    """Return the result of a call that imports or runs a module; any error becomes an InputError without a source."""
    try:
        return load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # any error in the code of the module
        raise InputError("", "", f"expected a module that can be imported: {what}: {said(error)}") from None


def said(error: BaseException) -> str:
    """Return type and message of an error in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split()).rstrip(": ")


def text_digest(function: Any) -> tuple[int, ...]:
    """Return the digest, as four numbers, of a kernel of an installed package and of the text of its module."""
    return _user_function(getattr(sys.modules[function.__module__], function.__name__)).digest


def function_of(digest: Iterable[int]) -> Callable:
    """Return the function with a digest."""
    return UserFunction("", tuple(map(int, digest))).function


def name_of(digest: Iterable[int]) -> str:
    """Return file and name of the function with a digest."""
    plain = getattr(function_of(digest), "py_func", function_of(digest))
    code = getattr(plain, "__code__", None)
    return f"{Path(code.co_filename).name}:{plain.__name__}" if code else str(plain)


def _text(module, function):
    """Return the text of a function's module as it was first read; in a notebook the source of the function."""
    if module not in _TEXTS:
        try:
            _TEXTS[module] = Path(module.__file__).read_text("utf-8")
        except (AttributeError, TypeError, OSError, UnicodeDecodeError):
            try:
                return inspect.getsource(getattr(function, "py_func", function))
            except (OSError, TypeError):
                return ""  # the digest still contains the code
    return _TEXTS[module]


def _content(thing, seen):
    """Return a text that represents a value or the code of a function, equal in all processes.

    A function that is defined again with other code or other globals has another text. Functions of libraries are
    represented by their names."""
    plain = getattr(thing, "py_func", thing)
    if isinstance(plain, FunctionType):
        name = f"{plain.__module__}.{plain.__qualname__}"
        foreign = seen and plain.__module__ not in {one.__module__ for one in seen} and plain is thing
        if foreign or plain in seen or name.startswith("wrcore."):
            return name
        seen.add(plain)
        cells = [cell.cell_contents for cell in plain.__closure__ or ()]
        around = [plain.__globals__[one] for one in _names(plain.__code__) if one in plain.__globals__]
        return _content((plain.__code__, plain.__defaults__, plain.__kwdefaults__, cells, around), seen)
    if isinstance(thing, CodeType):
        return f"{thing.co_code.hex()}{thing.co_names}{_content(thing.co_consts, seen)}"
    if isinstance(thing, np.ndarray | np.generic):
        return f"{thing.dtype}{np.shape(thing)}{hashlib.sha256(thing.tobytes()).hexdigest()}"
    if isinstance(thing, tuple | list):
        return str([_content(one, seen) for one in thing])
    if isinstance(thing, dict):
        return str([(str(key), _content(value, seen)) for key, value in thing.items()])
    if isinstance(thing, set | frozenset):
        return str(sorted(_content(one, seen) for one in thing))
    known = thing is None or isinstance(thing, bool | int | float | complex | str | bytes)
    return repr(thing) if known else f"{type(thing).__name__} {getattr(thing, '__name__', '')}"


def _names(code):
    """Return the names that code, with nested code, may take from its globals."""
    inner = [one for one in code.co_consts if isinstance(one, CodeType)]
    return sorted({*code.co_names, *(name for one in inner for name in _names(one))})
