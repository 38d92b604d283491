"""Data files of LAMMPS: grains with radii (`atom_style sphere`) in a box."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.dem.laws import LinearFrictional
from rendulic.dem.state.assembly_state import DAMPING
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.whole_file import whole_file
from rendulic.io.lammps.text import numbers_of, table_of, text_of, whole_numbers_of

__all__ = ["NUMBER", "read_data", "write_data"]

NUMBER = "%.17g"
ATOMS = ("id", "type", "diameter", "density", "x", "y", "z")
IMAGES = ("ix", "iy", "iz")
VELOCITIES = ("id", "vx", "vy", "vz", "wx", "wy", "wz")
SECTION = re.compile(r"^ *([A-Z][A-Za-z ]*?) *(?:#(.*))?$", flags=re.MULTILINE)


def read_data(path: str | os.PathLike, law: LinearFrictional | None = None, damping: float = DAMPING) -> Assembly:
    """Read a data file with radii as an `Assembly` that steps on, between walls at the faces of the file's box.

    Parameters
    ----------
    path : path
        A data file of ``atom_style sphere`` in SI units, for instance by LAMMPS's ``write_data``. Grains are in the
        order of their ids; forces and history are not in such a file, so that tangential forces start from zero.
    law : LinearFrictional, optional
        The contact law, `LinearFrictional()` if not given.

    Raises
    ------
    InvalidInput
        If there is no file, or its grains are no packing: not in the box, deep in each other.
    CorruptFile
        If it is truncated, foreign or inconsistent: naming file, section, column and what was expected.
    """
    path = Path(path)
    title, _, text = text_of(path).partition("\n")
    units = re.search(r"units *= *(\w+)", title)
    if units and units[1] != "si":
        raise CorruptFile(f"{path} is in units {units[1]!r}, expected 'si'")
    marks = list(SECTION.finditer(text))
    ends = [mark.start() for mark in marks[1:]] + [len(text)]
    sections = {mark[1]: text[mark.end() : end] for mark, end in zip(marks, ends, strict=False)}
    style = next(((mark[2] or "sphere").strip() for mark in marks if mark[1] == "Atoms"), None)
    if style != "sphere":
        found = "there is no section Atoms" if style is None else f"its section Atoms is of style {style!r}"
        raise CorruptFile(f"{path} is no data file of atom_style sphere: {found}")
    header = text[: marks[0].start()]  # there are marks: one is of Atoms
    count = re.search(r"^\s*(\d+)\s+atoms\b", header, flags=re.MULTILINE)
    box = np.array([_bounds(path, header, axis) for axis in "xyz"]).reshape(6)
    images = IMAGES if len(sections["Atoms"].split("\n\n", 1)[-1].partition("\n")[0].split()) == 10 else ()
    atoms = table_of(path, [*ATOMS, *images], sections["Atoms"])
    if count is None or int(count[1]) != len(atoms.rows):
        said = "does not say how many" if count is None else f"says {count[1]}"
        raise CorruptFile(f"{path} has {len(atoms.rows)} rows in section Atoms, its header {said}: truncated?")
    ids = whole_numbers_of(path, atoms, "id")
    order = np.argsort(ids)
    if len(np.unique(ids)) != len(ids):
        raise CorruptFile(f"{path}: column id of section Atoms names a grain twice")
    diameter, density, *position = numbers_of(path, atoms, ATOMS[2:])[order].T
    if not np.allclose(density, density.mean(), rtol=1e-6):
        raise CorruptFile(f"{path}: column density of section Atoms must be one density for all grains")
    motion = np.zeros((len(ids), 6))
    if "Velocities" in sections:
        moving = table_of(path, list(VELOCITIES), sections["Velocities"])
        named = whole_numbers_of(path, moving, "id")
        if not np.array_equal(np.sort(named), ids[order]):
            raise CorruptFile(f"{path}: column id of section Velocities does not name the grains of section Atoms")
        motion = numbers_of(path, moving, VELOCITIES[1:])[np.argsort(named)]
    try:
        return Assembly(
            np.column_stack(position),
            0.5 * diameter,
            box,
            density=float(density.mean()),
            law=law,
            damping=damping,
            velocity=motion[:, :3],
            angular_velocity=motion[:, 3:],
        )
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from None


def write_data(
    assembly: Assembly, path: str | os.PathLike, of_type: np.ndarray, velocity: np.ndarray, spin: np.ndarray
) -> Path:
    """Write grains, of types from 1, and the velocities and spins given; return the path."""
    grains, faces = assembly.grains, assembly.walls.position
    density = grains.mass / (4.0 / 3.0 * np.pi * grains.radius**3)
    lines = ["LAMMPS data file of rendulic, units = si", ""]
    lines += [f"{len(assembly)} atoms", f"{of_type.max()} atom types", ""]
    lines += [f"{NUMBER % faces[2 * k]} {NUMBER % faces[2 * k + 1]} {axis}lo {axis}hi" for k, axis in enumerate("xyz")]
    lines += ["", "Atoms # sphere", ""]
    for i, numbers in enumerate(zip(2.0 * grains.radius, density, *grains.position.T, strict=True)):
        lines.append(f"{i + 1} {of_type[i]} " + " ".join(NUMBER % number for number in numbers))
    lines += ["", "Velocities", ""]
    for i, numbers in enumerate(np.hstack((velocity, spin))):
        lines.append(f"{i + 1} " + " ".join(NUMBER % number for number in numbers))
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="ascii")
    return Path(path)


def _bounds(path: Path, header: str, axis: str) -> tuple[float, float]:
    found = re.search(rf"^\s*(\S+)\s+(\S+)\s+{axis}lo\s+{axis}hi\b", header, flags=re.MULTILINE)
    try:
        if found is None:
            raise ValueError
        return float(found[1]), float(found[2])
    except ValueError:
        raise CorruptFile(f"{path}: its header must have a line 'low high {axis}lo {axis}hi' of two numbers") from None
