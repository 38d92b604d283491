"""Snapshots and tables in formats that other programs open."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from rendulic.foundation.errors import InvalidInput, RendulicError, one_of
from rendulic.foundation.whole_file import writable_folder
from rendulic.io.lammps import write_deck
from rendulic.io.plain_text import write_plain_text
from rendulic.io.reading import read, read_assembly
from rendulic.io.tables import read_dataset, write_dataset, write_tables
from rendulic.io.vtkhdf import write_vtkhdf
from rendulic.probing.anatomy import anatomy
from rendulic.specimen.snapshot import Snapshot

__all__ = ["FORMATS", "export", "export_all"]


def _vtkhdf(source: Path, before: Snapshot | None, folder: Path) -> list[Path]:
    return write_vtkhdf(read(source), writable_folder(folder), before)


def _csv(source: Path, before: Snapshot | None, folder: Path) -> list[Path]:
    snapshot = read(source)
    written = [] if before is None else write_tables(anatomy(before, snapshot), writable_folder(folder) / "anatomy.csv")
    write_plain_text(snapshot, folder)
    return [*(folder / name for name in ("box.toml", "grains.csv", "contacts.csv")), *written]


def _netcdf(source: Path, before: Snapshot | None, folder: Path) -> list[Path]:
    if before is None:
        raise InvalidInput("NetCDF holds the second-order work between two states: give the state before, too")
    return [write_dataset(anatomy(before, read(source)), writable_folder(folder) / "anatomy.nc")]


def _lammps(source: Path, before: Snapshot | None, folder: Path) -> list[Path]:
    if before is not None:
        raise InvalidInput("a deck for LAMMPS starts from one state: leave the state before out")
    write_deck(read_assembly(source), folder)
    return [folder / "state.data", folder / "continue.in"]


# how grains are written in each format; the first is the usual one
OF_GRAINS: dict[str, Callable[[Path, Snapshot | None, Path], list[Path]]] = {
    "vtkhdf": _vtkhdf,
    "csv": _csv,
    "netcdf": _netcdf,
    "lammps": _lammps,
}
FORMATS = tuple(OF_GRAINS)


def export(
    source: str | os.PathLike,
    folder: str | os.PathLike,
    to: str | None = None,
    before: Snapshot | None = None,
) -> list[Path]:
    """Write one snapshot or table in a format that other programs open; return the paths.

    Parameters
    ----------
    source : path
        Whatever `rd.io.read` reads, or a table of curves or probes (`.nc`).
    folder : path
        Made if it is not there; the names in it are those of the format.
    to : {"vtkhdf", "csv", "netcdf", "lammps"}, optional
        Grains: for ParaView (`write_vtkhdf`), as plain text (`write_plain_text`), their anatomy (`rd.anatomy`) as
        NetCDF, or, of a state that steps on, a deck for LAMMPS (`rd.io.lammps.write_deck`). A table: "csv". By default the
        first of these.
    before : Snapshot, optional
        The same grains earlier: what is written then has second-order work, too.

    Raises
    ------
    InvalidInput
        If there is nothing at the path, the format is not one of its kind, or a file cannot be written.
    CorruptFile
        If the source is truncated, foreign or inconsistent.
    """
    source, folder = Path(source), Path(folder)
    if to is not None:
        one_of(to, FORMATS, "format")
    if not _is_table(source):
        return OF_GRAINS[to or FORMATS[0]](source, before, folder)
    if to not in (None, "csv"):
        raise InvalidInput(f"{source} is a table, which goes to csv, not to {to}; {to} is for grains")
    if before is not None:
        raise InvalidInput(f"{source} is a table: a state before is for grains only")
    return write_tables(read_dataset(source), writable_folder(folder) / f"{source.stem}.csv")


def export_all(
    source: str | os.PathLike,
    folder: str | os.PathLike,
    to: str | None = None,
    before: Snapshot | None = None,
) -> tuple[list[Path], list[str]]:
    """Export every state and table (`.h5`, `.npz`, `.nc`) in a folder of results, at the same places in the new one.

    Parameters are those of `export`. Returns the paths, and why each file was passed over that could not be written.

    Raises
    ------
    InvalidInput
        If nothing in the folder could be written.
    """
    source, folder = Path(source), Path(folder)
    written: list[Path] = []
    passed_over: list[str] = []
    if to is not None:
        one_of(to, FORMATS, "format")
    endings = (".h5", ".npz", ".nc") if to in (None, "csv") else (".h5", ".npz")
    found = sorted(path for path in source.rglob("*") if path.suffix in endings)
    for path in (path for path in found if not path.is_relative_to(folder)):
        place = folder / path.parent.relative_to(source)
        try:
            if _is_table(path):
                written += export(path, place, to)
            else:
                written += export(path, place / path.stem, to, before)
        except RendulicError as error:
            passed_over.append(str(error))
    if not written:
        why = passed_over[0] if passed_over else f"it has no {', '.join(endings)} file"
        raise InvalidInput(f"nothing in the folder {source} could be exported: {why}")
    return written, passed_over


def _is_table(path: Path) -> bool:
    return path.suffix == ".nc"
