"""Scenes stored in run files; user-defined laws that they name are not run without consent."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from wrcore.kernels.named_laws import Laws


class StoredScene(dict[str, Any]):
    """Content of a scene from a run file, whose author may be unknown: laws that it names run only if trusted.

    Copies and unions with ``|`` are of this type, too.
    """

    def copy(self) -> "StoredScene":
        return StoredScene(self)

    def __or__(self, other: Any) -> "StoredScene":  # type: ignore[override]
        return StoredScene({**self, **other}) if isinstance(other, dict) else NotImplemented

    def __ror__(self, other: Any) -> "StoredScene":  # type: ignore[override]
        return StoredScene({**other, **self}) if isinstance(other, dict) else NotImplemented


def laws_of_stored(scene: dict[str, Any], trust: bool) -> Laws:
    """Return the `Laws` that find a run's laws in the working directory; ``trust`` allows laws of a run file."""
    return Laws(Path(), trusted=trust or not isinstance(scene, StoredScene))


def texts_in(value: Any) -> Iterable[str]:
    """Yield all strings in nested dicts, lists and tuples."""
    if isinstance(value, dict | list | tuple):
        for item in value.values() if isinstance(value, dict) else value:
            yield from texts_in(item)
    elif isinstance(value, str):
        yield value
