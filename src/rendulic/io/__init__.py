"""Other engines' files in, rendulic's results out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rendulic.lazy import lazy_names

_PUBLIC: dict[str, str | tuple[str, str]] = {
    "lammps": "rendulic.io.lammps",
    "yade": "rendulic.io.yade",
    "read": ("rendulic.io.reading", "read"),
    "read_about": ("rendulic.io.snapshot", "read_about"),
    "read_plain_text": ("rendulic.io.plain_text", "read_plain_text"),
    "read_snapshot": ("rendulic.io.snapshot", "read_snapshot"),
    "write_plain_text": ("rendulic.io.plain_text", "write_plain_text"),
    "write_snapshot": ("rendulic.io.snapshot", "write_snapshot"),
}

__all__ = [*_PUBLIC]

if TYPE_CHECKING:
    from rendulic.io import lammps, yade
    from rendulic.io.plain_text import read_plain_text, write_plain_text
    from rendulic.io.reading import read
    from rendulic.io.snapshot import read_about, read_snapshot, write_snapshot

__getattr__, __dir__ = lazy_names(__name__, _PUBLIC)
