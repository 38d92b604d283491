"""Other engines' files in, rendulic's results out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rendulic.foundation.lazy import lazy_names

_PUBLIC: dict[str, str | tuple[str, str]] = {
    "lammps": "rendulic.io.lammps",
    "yade": "rendulic.io.yade",
    "read": ("rendulic.io.reading", "read"),
    "read_about": ("rendulic.io.snapshot", "read_about"),
    "read_assembly": ("rendulic.io.reading", "read_assembly"),
    "read_dataset": ("rendulic.io.tables", "read_dataset"),
    "read_plain_text": ("rendulic.io.plain_text", "read_plain_text"),
    "read_snapshot": ("rendulic.io.snapshot", "read_snapshot"),
    "read_triaxial": ("rendulic.io.lab", "read_triaxial"),
    "write_csv": ("rendulic.io.tables", "write_csv"),
    "write_dataset": ("rendulic.io.tables", "write_dataset"),
    "write_plain_text": ("rendulic.io.plain_text", "write_plain_text"),
    "write_snapshot": ("rendulic.io.snapshot", "write_snapshot"),
    "write_vtkhdf": ("rendulic.io.vtkhdf", "write_vtkhdf"),
}

__all__ = [*_PUBLIC]

if TYPE_CHECKING:
    from rendulic.io import lammps, yade
    from rendulic.io.lab import read_triaxial
    from rendulic.io.plain_text import read_plain_text, write_plain_text
    from rendulic.io.reading import read, read_assembly
    from rendulic.io.snapshot import read_about, read_snapshot, write_snapshot
    from rendulic.io.tables import read_dataset, write_csv, write_dataset
    from rendulic.io.vtkhdf import write_vtkhdf

__getattr__, __dir__ = lazy_names(__name__, _PUBLIC)
