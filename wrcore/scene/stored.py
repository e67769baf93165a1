"""Scenes that files of results hold, and laws that changes of a scene name."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from wrcore.kernels.named_laws import Laws


class StoredScene(dict[str, Any]):
    """Content of a scene that a run file holds: it may be anybody's, and names no law that is run unasked. Copies, and
    what is joined with others by ``|``, are such content, too."""

    def copy(self) -> "StoredScene":
        return StoredScene(self)

    def __or__(self, other: Any) -> "StoredScene":  # type: ignore[override]
        return StoredScene({**self, **other}) if isinstance(other, dict) else NotImplemented

    def __ror__(self, other: Any) -> "StoredScene":  # type: ignore[override]
        return StoredScene({**other, **self}) if isinstance(other, dict) else NotImplemented


def laws_of_stored(scene: dict[str, Any], trust: bool) -> Laws:
    """What finds the laws of a run's scene in the working directory; ``trust`` lets those of a run file be run."""
    return Laws(Path(), trusted=trust or not isinstance(scene, StoredScene))


def texts_in(value: Any) -> Iterable[str]:
    """All texts in nested data."""
    if isinstance(value, dict | list | tuple):
        for item in value.values() if isinstance(value, dict) else value:
            yield from texts_in(item)
    elif isinstance(value, str):
        yield value
