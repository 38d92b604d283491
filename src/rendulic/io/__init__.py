"""Other engines' files and laboratory data in, rendulic's results out."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rendulic.io.read import read

# public name -> module that has it; loaded on first use, so that computing loads neither tables nor validation
_PUBLIC = {
    "read_about": "rendulic.io.snapshot",
    "read_dataset": "rendulic.io.tables",
    "read_plain_text": "rendulic.io.plain_text",
    "read_snapshot": "rendulic.io.snapshot",
    "read_triaxial": "rendulic.io.lab",
    "write_csv": "rendulic.io.tables",
    "write_dataset": "rendulic.io.tables",
    "write_plain_text": "rendulic.io.plain_text",
    "write_snapshot": "rendulic.io.snapshot",
    "write_vtkhdf": "rendulic.io.vtkhdf",
}

__all__ = [*_PUBLIC, "read", "yade"]

if TYPE_CHECKING:
    from rendulic.io import yade
    from rendulic.io.lab import read_triaxial
    from rendulic.io.plain_text import read_plain_text, write_plain_text
    from rendulic.io.snapshot import read_about, read_snapshot, write_snapshot
    from rendulic.io.tables import read_dataset, write_csv, write_dataset
    from rendulic.io.vtkhdf import write_vtkhdf


def __getattr__(name: str) -> Any:
    if name == "yade":
        return import_module("rendulic.io.yade")
    if name not in _PUBLIC:
        raise AttributeError(f"module 'rendulic.io' has no attribute '{name}'; public names: {', '.join(__all__)}")
    value = getattr(import_module(_PUBLIC[name]), name)
    globals()[name] = value
    return value
