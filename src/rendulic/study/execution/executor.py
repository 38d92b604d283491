"""What runs units: any object that takes orders and tells what became of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

__all__ = ["Event", "Executor"]


@dataclass(frozen=True)
class Event:
    """Something that happened to a unit.

    Parameters
    ----------
    what : {"progress", "done", "failed", "stopped", "lost"}
        `stopped`: its result could not be kept, nor could those of others; `lost`: its worker died.
    key : str
        The unit's hash.
    about : object
        `[done, total, note]`, `{"error": ..., "is_final": ...}` or the reason.
    """

    what: str
    key: str
    about: Any = None


class Executor(Protocol):
    """Workers somewhere. `capacity` units run at once, `ahead` more may wait there."""

    capacity: int
    ahead: int

    def submit(self, order: Mapping[str, Any], threads: int) -> None: ...

    def events(self, seconds: float) -> list[Event]: ...

    def close(self) -> None: ...
