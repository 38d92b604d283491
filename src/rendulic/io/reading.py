"""A snapshot from whatever file it is in."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from rendulic.foundation.errors import CorruptFile, InvalidInput, told_of
from rendulic.foundation.hdf5 import plain_file
from rendulic.foundation.sealed import SIGNATURE, is_sealed
from rendulic.specimen.snapshot import Snapshot

if TYPE_CHECKING:
    from rendulic.dem.assembly import Assembly

__all__ = ["read", "read_assembly"]

KINDS = (
    "a snapshot or state of rendulic (.h5), a Yade state (.npz), a dump of LAMMPS with its contacts beside it, or a folder "
    "with box.toml, grains.csv and contacts.csv"
)


def read(path: str | os.PathLike) -> Snapshot:
    """Read a snapshot for analysis; the kind of file is told by its content.

    Parameters
    ----------
    path : path
        A neutral snapshot or a state of an assembly (HDF5), a state of Yade (`.npz`), a dump of
        LAMMPS (`NAME.dump`, with `NAME.contacts` beside it), or a folder of plain text.

    Raises
    ------
    InvalidInput
        If there is nothing at the path, or nothing that is known.
    CorruptFile
        If a file is truncated, altered or inconsistent.
    """
    from rendulic.io import lammps, plain_text, snapshot, yade

    path = Path(path)
    if path.is_dir():
        return plain_text.read_plain_text(path)
    if not path.is_file():
        raise InvalidInput(f"no snapshot at {path}: expected {KINDS}")
    with path.open("rb") as file:
        begin = file.read(64)
    if begin.startswith(SIGNATURE) or is_sealed(begin):
        return _of_state(path) if _format(path) == "rendulic state" else snapshot.read_snapshot(path)
    if begin.startswith(b"PK"):
        return yade.read_snapshot(path)
    if begin.startswith(b"ITEM: "):
        return lammps.read_snapshot(path)
    raise CorruptFile(f"{path} is of no known kind: expected {KINDS}")


def read_assembly(path: str | os.PathLike) -> Assembly:
    """Read a packing that steps on: a state of an assembly (HDF5), one of Yade (`.npz`), or LAMMPS's data file.

    Raises
    ------
    InvalidInput, CorruptFile
        If it is none of these, or a snapshot for analysis only.
    """
    from rendulic.dem.assembly import Assembly
    from rendulic.io import lammps, yade
    from rendulic.specimen.state import State

    path = Path(path)
    if path.is_file() and path.suffix == ".npz":
        return yade.read(path)
    if path.is_file() and path.suffix == ".data":
        return lammps.read_data(path)
    if path.is_file() and path.suffix == ".h5" and _format(path) == "rendulic state":
        state = State.from_file(path)
        with told_of(path):
            return Assembly.from_state(state)
    raise InvalidInput(
        f"{path} is no packing that steps on: expected a state of rendulic (.h5), a Yade state (.npz) or a data file of "
        "LAMMPS (.data)"
    )


def _format(path: Path) -> str:
    """What an HDF5 file says that it is; nothing, if it says that in no words."""
    with plain_file(path, "HDF5 file") as file:
        said = file.attributes().get("format")
    return said if isinstance(said, str) else ""


def _of_state(path: Path) -> Snapshot:
    from rendulic.dem.assembly import Assembly
    from rendulic.specimen.state import State

    state = State.from_file(path)
    with told_of(path):
        return Assembly.from_state(state).snapshot()
