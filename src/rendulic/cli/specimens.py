"""Specimens of any kind from their state files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rendulic.chang_hicher.point import MaterialPoint
    from rendulic.dem.assembly import Assembly

__all__ = ["read_specimen"]


def read_specimen(path: Path) -> Assembly | MaterialPoint:
    """The grains or the material point that a state file holds; grains of Yade (.npz) and LAMMPS (.data), too.

    Raises
    ------
    InvalidInput
        If there is no such file, or its kind is unknown.
    CorruptFile
        If it is truncated, altered or foreign.
    """
    from rendulic.chang_hicher.point import KIND, MaterialPoint
    from rendulic.dem.assembly import Assembly
    from rendulic.foundation.errors import told_of
    from rendulic.io.reading import read_assembly
    from rendulic.specimen.state import State

    if path.suffix in (".npz", ".data"):
        return read_assembly(path)
    state = State.from_file(path)
    with told_of(path):
        return MaterialPoint.from_state(state) if state.kind == KIND else Assembly.from_state(state)
