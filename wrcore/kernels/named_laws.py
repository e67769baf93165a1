"""Functions that a scene names: found and read when the scene is loaded, run when it is simulated.

A scene names a function as ``file.py:function``, in a file beside it or below its folder, or by the name of an
installed entry point. A Python program may give the function itself. No other module is imported: a scene is data that
somebody may have sent. The text of a file is that of the moment at which the scene was loaded.
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
"""Entry points of laws that installed packages offer; creep laws have a group of their own."""

_KNOWN: dict[tuple[int, ...], Any] = {}
_TEXTS: dict[ModuleType, str] = {}
_MODULES: dict[tuple[str, bytes], ModuleType] = {}
_PRESENT: ContextVar["Laws | None"] = ContextVar("present", default=None)


class LawFile(NamedTuple):
    """A function in a file, which is read and not run."""

    path: str
    content: bytes
    name: str


class UserFunction(NamedTuple):
    """A function of the user."""

    name: str
    digest: tuple[int, ...]
    """Of its name and its text, as four numbers: models hold them in its place."""

    @property
    def function(self) -> Callable:
        """The function itself; the file that holds it is run when it is first asked for."""
        known = _KNOWN[self.digest]
        if isinstance(known, LawFile):
            known = _KNOWN[self.digest] = _function_in(known)
        return known

    @property
    def sha256(self) -> str:
        """The digest in 64 hex digits."""
        return np.array(self.digest, np.int64).tobytes().hex()


class Laws:
    """The laws that a scene names, by the text that names them.

    Parameters
    ----------
    *folders : Path
        Files lie in one of them, or below it.
    asked : iterable of str
        Laws that a person named in this very call: their files also count from the working directory, and may lie
        anywhere.
    before : mapping, optional
        Sources that were read before, by text: they are not read anew.
    trusted : bool
        False for a scene that a file of results holds: its laws are not run.
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
        """The law that a text names; an InputError without a source says what was expected."""
        key = law if ":" in law else f"{law} of {group}"
        if key not in self.known:
            self.known[key] = self._before.get(key) or self._source_of(law, group)
        return _user_function(self.known[key])

    def beside(self, law: str, folder: Path) -> str:
        """The text that names a law of a file in ``folder`` (a vehicle file say) with the absolute path of the law's
        file; the text as it is if the law is in no file there."""
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
        """SHA-256 of the files that hold laws, by path."""
        files = [source for source in self.known.values() if isinstance(source, LawFile)]
        return {file.path: hashlib.sha256(file.content).hexdigest() for file in files}

    @property
    def digests(self) -> dict[str, str]:
        """SHA-256 of each law, by the text that names it, without the folder of its file."""
        found: dict[str, set[str]] = {}
        for text, source in self.known.items():
            found.setdefault(text.replace("\\", "/").rpartition("/")[2], set()).add(_user_function(source).sha256)
        return {name: "+".join(sorted(each)) for name, each in found.items()}

    def allow(self) -> None:
        """Refuse to run laws of a scene that is not trusted; the error has no source."""
        if self.known and not self.trusted:
            named = ", ".join(sorted(self.digests))
            expected = f"expected trust=True (--trust) to run what this file names, code that may be anybody's: {named}"
            raise InputError("", "trust", expected)

    @contextmanager
    def present(self):
        """Let `present_law` find these laws meanwhile."""
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
        """The function that an installed entry point names."""
        entry = entry_named(group, law, self.trusted)
        if entry is None:
            raise InputError("", "", f"{_EXPECTED.format(group=group)}, got {law!r}")
        return loaded(entry, group)


_EXPECTED = (
    "expected file.py:function of a file beside the one that names it, an installed entry point of {group}, or in"
    " Python the function itself"
)


def present_laws() -> Laws:
    """The laws of the scene that is being read; else those of the working directory."""
    return _PRESENT.get() or Laws(Path())


def entry_named(group: str, name: str, trusted: bool = True) -> Any:
    """The installed entry point of a group and name, or None; an InputError without a source if it may not be run."""
    from importlib.metadata import entry_points  # reads what is installed: some ten milliseconds

    entry = next((entry for entry in entry_points(group=group) if entry.name == name), None)
    if entry is not None and not trusted:
        expected = f"expected trust=True (--trust) to run {entry.value} of an installed package, which this file names"
        raise InputError("", "trust", expected)
    return entry


def loaded(entry: Any, group: str) -> Any:
    """What an entry point names; an InputError without a source if it cannot be imported."""
    return guarded(f"the entry point {entry.name} of {group}", entry.load)


def _user_function(source):
    """`UserFunction` of a source."""
    if isinstance(source, LawFile):
        name, content = source.name, source.content
    else:
        name = getattr(source, "__name__", "")
        module = sys.modules.get(getattr(source, "__module__", ""))
        content = f"{_text(module, source)}\0{_content(source, set())}".encode("utf-8", "surrogatepass")
    sha = hashlib.sha256(name.encode() + b"\0" + content).digest()
    digest = tuple(int(part) for part in np.frombuffer(sha, np.int64))
    if not (isinstance(source, LawFile) and digest in _KNOWN):  # a function may hold objects that only look alike
        _KNOWN[digest] = source
    return UserFunction(name, digest)


def _file_below(place, folder):
    """Path of a file in a folder or below it, with all links followed; None if there is none."""
    if not _is_file(folder / place):
        return None
    path = (folder / place).resolve()
    return path if path.is_relative_to(folder.resolve()) else None


def _is_file(path):
    return os.path.isfile(path)  # Path.is_file raises where a name is too long or a folder is closed


def _read(path, name):
    try:
        check_regular(path)
        return LawFile(str(path), path.read_bytes(), name)
    except OSError as error:
        raise InputError("", "", f"expected a readable file: {path.name}: {error.strerror}") from None


def _function_in(file):
    """The function of a file, whose text is run once in a process."""
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
    """Have numba compile a function from this text: files of machine code beside it may be of another one."""
    if hasattr(function, "py_func") and hasattr(function, "_cache"):
        from numba.core.caching import NullCache

        function._cache = NullCache()


def guarded(what: str, load: Callable[[], Any]) -> Any:
    """The result of a call that imports or runs a module; an InputError without a source for any error in it."""
    try:
        return load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever the module's code does
        raise InputError("", "", f"expected a module that can be imported: {what}: {said(error)}") from None


def said(error: BaseException) -> str:
    """An error in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split()).rstrip(": ")


def text_digest(function: Any) -> tuple[int, ...]:
    """Four numbers for a kernel of an installed package and the text of its module."""
    return _user_function(getattr(sys.modules[function.__module__], function.__name__)).digest


def function_of(digest: Iterable[int]) -> Callable:
    """The function with a digest."""
    return UserFunction("", tuple(map(int, digest))).function


def name_of(digest: Iterable[int]) -> str:
    """File and name of the function with a digest."""
    plain = getattr(function_of(digest), "py_func", function_of(digest))
    code = getattr(plain, "__code__", None)
    return f"{Path(code.co_filename).name}:{plain.__name__}" if code else str(plain)


def _text(module, function):
    """What decides on a function: the text of its module as it was first read; in a notebook its own."""
    if module not in _TEXTS:
        try:
            _TEXTS[module] = Path(module.__file__).read_text("utf-8")
        except (AttributeError, TypeError, OSError, UnicodeDecodeError):
            try:
                return inspect.getsource(getattr(function, "py_func", function))
            except (OSError, TypeError):
                return ""  # its code still counts
    return _TEXTS[module]


def _content(thing, seen):
    """What a value is, or a function does, as text that another process finds, too: a function that is defined anew,
    with another text or other globals, has another one. Functions of libraries stand by their names."""
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
    """Names that code, and the code in it, takes from its globals."""
    inner = [one for one in code.co_consts if isinstance(one, CodeType)]
    return sorted({*code.co_names, *(name for one in inner for name in _names(one))})
