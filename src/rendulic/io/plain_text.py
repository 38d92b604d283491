"""Snapshots as plain text, for engines that have no reader of their own (PFC, own codes).

A folder with three files:

`box.toml`
    ``faces = [x-, x+, y-, y+, z-, z+]`` in m; ``forces = "on second"`` or ``"on first"``, of the force columns; for walls
    ``walls = [id, ...]``, their six ids in the order of the faces; for periodic boxes ``periodic = true`` instead; and,
    if wanted, ``axes = "zxy"``: which of x, y, z are axes 1 (axial), 2, 3, and ``friction``, the Coulomb coefficient. For audits, if they are known: ``wall_forces = [six]``, the force by the grains
    on each wall in N, outward positive, in the order of the faces; ``step``; ``spheres = true``; and a table ``[springs]``
    of the linear law: ``modulus`` in Pa, ``rule = "mean_diameter"`` or ``"harmonic"``, ``wall_modulus``.
`grains.csv`
    Columns ``id, x, y, z, radius`` in m, in any order, others are passed over.
`contacts.csv`
    Columns ``id1, id2, fx, fy, fz`` (whole contact force in N), and if the grains are not spheres ``nx, ny, nz``, the
    unit normal from 1 to 2; such grains may touch at several points, and get one contact with the summed force. A
    periodic contact is that of the nearest images.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.validation import Section, Whole, read_toml, validated
from rendulic.foundation.whole_file import whole_file, writable_folder
from rendulic.io.recorded import SaidSprings
from rendulic.io.snapshot import LARGEST, checked, nearest_images
from rendulic.specimen.recorded import Recorded
from rendulic.specimen.snapshot import Snapshot

__all__ = ["read_plain_text", "write_plain_text"]

GRAINS = ("id", "x", "y", "z", "radius")
FORCES = ("fx", "fy", "fz")
NORMALS = ("nx", "ny", "nz")
DIGITS = "%.17g"


class Box(Section):
    """What `box.toml` says."""

    faces: tuple[float, float, float, float, float, float]
    forces: Literal["on second", "on first"]
    walls: tuple[int, int, int, int, int, int] | None = None
    periodic: bool = False
    axes: Literal["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"] = "xyz"
    friction: float | None = Field(None, ge=0)
    wall_forces: tuple[float, float, float, float, float, float] | None = None
    step: Whole | None = None
    spheres: bool | None = None
    springs: SaidSprings | None = None

    def model_post_init(self, _context: Any) -> None:
        if self.periodic == (self.walls is not None):
            raise ValueError("give either walls = [six ids] or periodic = true")


def read_plain_text(folder: str | os.PathLike) -> Snapshot:
    """Read a folder of plain text as a snapshot.

    Raises
    ------
    InvalidInput
        If a file is not there, or `box.toml` says something that cannot be.
    CorruptFile
        Naming file, column and row, and what was expected.
    """
    folder = Path(folder)
    for name in ("box.toml", "grains.csv", "contacts.csv"):
        if not (folder / name).is_file():
            raise InvalidInput(
                f"no {name} in {folder}: a snapshot in plain text has box.toml, grains.csv, contacts.csv"
            )
    try:
        table = read_toml(folder / "box.toml", f"no box.toml in {folder}")
    except InvalidInput as error:
        raise CorruptFile(str(error)) from None
    box = validated(Box, table, str(folder / "box.toml"))
    order = ["xyz".index(axis) for axis in box.axes]
    grains = _table(folder / "grains.csv", GRAINS)
    contacts = _table(folder / "contacts.csv", ("id1", "id2", *FORCES))
    if (again := contacts[["id1", "id2", *FORCES]].duplicated().to_numpy()).any():
        row = int(np.flatnonzero(again)[0])
        raise CorruptFile(f"{folder / 'contacts.csv'}, row {row + 2} repeats another; each contact must appear once")
    faces = np.array(box.faces).reshape(3, 2)[order].reshape(-1)
    position = grains[["x", "y", "z"]].to_numpy()[:, order]
    ids = _whole(folder / "grains.csv", grains, "id")
    if len(np.unique(ids)) != len(ids):
        raise CorruptFile(f"{folder / 'grains.csv'}: column id names a grain twice")
    by_id = np.argsort(ids)
    ids, position, radius = ids[by_id], position[by_id], grains["radius"].to_numpy()[by_id]
    walls = np.array([], dtype=np.int64)
    if box.walls is not None:
        walls = np.array(box.walls).reshape(3, 2)[order].reshape(-1)
        if len(np.unique(walls)) != 6 or np.isin(walls, ids).any():
            raise CorruptFile(f"{folder / 'box.toml'}: walls must be six ids that no grain has, found {box.walls}")
    first, second = (_bodies(folder / "contacts.csv", contacts, name, ids, walls) for name in ("id1", "id2"))
    force = contacts[list(FORCES)].to_numpy()[:, order] * (1.0 if box.forces == "on second" else -1.0)
    swap = first > second
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    force = np.where(swap, -1.0, 1.0)[:, None] * force
    bare = Snapshot(
        position, radius, faces, first, second, np.zeros_like(force), np.zeros(len(first)), np.zeros_like(force),
        box.friction, nearest_images(position, faces, first, second) if box.periodic else None,
    )  # fmt: skip
    if (first >= len(ids)).any():
        row = int(np.flatnonzero(first >= len(ids))[0])
        raise CorruptFile(
            f"{folder / 'contacts.csv'}, row {row + 2}: a contact needs a grain, this one is of two walls"
        )
    has_normals = set(NORMALS) <= set(contacts.columns)
    if has_normals:
        normal = np.where(swap, -1.0, 1.0)[:, None] * contacts[list(NORMALS)].to_numpy()[:, order]
    else:
        length = np.linalg.norm(bare.branch, axis=1)
        normal = bare.branch / np.where(length > 0.0, length, 1.0)[:, None]
    force_n = (force * normal).sum(axis=1)
    whole = Snapshot(
        position,
        radius,
        faces,
        first,
        second,
        normal,
        force_n,
        force - force_n[:, None] * normal,
        box.friction,
        bare.image,
        Recorded(
            wall_force=None if box.wall_forces is None else np.array(box.wall_forces).reshape(3, 2)[order].reshape(-1),
            springs=None if box.springs is None else box.springs.springs(),
            are_spheres=box.spheres if has_normals else True,
            step=box.step,
            derived=("force_t",) if has_normals else ("normal", "force_t"),
        ),
    )
    whole = checked(whole, str(folder))
    return checked(whole.with_pairs_merged(), str(folder)) if has_normals else whole


def write_plain_text(snapshot: Snapshot, folder: str | os.PathLike) -> Path:
    """Write a snapshot as `box.toml`, `grains.csv`, `contacts.csv`; grains are numbered from 1, walls after them."""
    folder = writable_folder(Path(folder))
    n = snapshot.n_grains
    faces = ", ".join(DIGITS % face for face in snapshot.wall_position)
    lines = [f"faces = [{faces}]", 'forces = "on second"']
    lines.append("periodic = true" if snapshot.is_periodic else f"walls = {[n + 1 + k for k in range(6)]}")
    if snapshot.friction is not None:
        lines.append(f"friction = {snapshot.friction!r}")
    if (recorded := snapshot.recorded) is not None:
        lines += _lines_of(recorded)
    with whole_file(folder / "box.toml") as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    grains = pd.DataFrame({"id": np.arange(1, n + 1), **dict(zip("xyz", snapshot.position.T, strict=True)),
                           "radius": snapshot.radius})  # fmt: skip
    contacts = pd.DataFrame({"id1": snapshot.first + 1, "id2": snapshot.second + 1,
                             **dict(zip(FORCES, snapshot.force.T, strict=True)),
                             **dict(zip(NORMALS, snapshot.normal.T, strict=True))})  # fmt: skip
    for name, frame in (("grains", grains), ("contacts", contacts)):
        with whole_file(folder / f"{name}.csv") as temporary:
            frame.to_csv(temporary, index=False, float_format=DIGITS)
    return folder


def _lines_of(recorded: Recorded) -> list[str]:
    """Lines of `box.toml` for audits."""
    lines = []
    if recorded.wall_force is not None:
        lines.append(f"wall_forces = [{', '.join(DIGITS % force for force in recorded.wall_force)}]")
    if recorded.step is not None:
        lines.append(f"step = {recorded.step}")
    if recorded.are_spheres is not None:
        lines.append(f"spheres = {str(recorded.are_spheres).lower()}")
    if recorded.springs is not None:
        springs = recorded.springs
        lines += ["", "[springs]", f"modulus = {springs.modulus!r}", f'rule = "{springs.rule}"']
        if springs.wall_modulus is not None:
            lines.append(f"wall_modulus = {springs.wall_modulus!r}")
    return lines


def _table(path: Path, wanted: tuple[str, ...]) -> pd.DataFrame:
    """The columns wanted, and normals if there are any, all of finite numbers."""
    try:
        frame = pd.read_csv(path, skipinitialspace=True, nrows=LARGEST + 1, float_precision="round_trip")
    except (ValueError, UnicodeDecodeError, OSError) as error:
        raise CorruptFile(f"{path} is not a table in CSV: {error}") from None
    frame.columns = [str(name).strip() for name in frame.columns]
    missing = [name for name in wanted if name not in frame.columns]
    if missing:
        raise CorruptFile(f"{path} lacks the column(s) {', '.join(missing)}; it has {', '.join(frame.columns)}")
    if len(frame) > LARGEST:
        raise CorruptFile(f"{path} has more than the {LARGEST} rows that are read")
    for name in [*wanted, *(name for name in NORMALS if name in frame.columns)]:
        values = pd.to_numeric(frame[name], errors="coerce").to_numpy(dtype=float)
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise CorruptFile(
                f"{path}, row {row + 2}, column {name}: expected a number, found {frame[name].iloc[row]!r}"
            )
        frame[name] = values
    return frame


def _whole(path: Path, frame: pd.DataFrame, name: str) -> np.ndarray:
    values = frame[name].to_numpy()
    wrong = (values != np.round(values)) | (np.abs(values) > 2.0**53)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise CorruptFile(f"{path}, row {row + 2}, column {name}: expected a whole number, found {values[row]!r}")
    return values.astype(np.int64)


def _bodies(path: Path, contacts: pd.DataFrame, name: str, ids: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """Rows of the grains, and n + face of the walls, that a column of ids names."""
    found = _whole(path, contacts, name)
    row = np.searchsorted(ids, found)
    is_grain = ids[np.minimum(row, len(ids) - 1)] == found if len(ids) else np.zeros(len(found), dtype=bool)
    face = np.argmax(found[:, None] == walls, axis=1) if len(walls) else np.zeros(len(found), dtype=np.int64)
    is_wall = np.isin(found, walls)
    if not (is_grain | is_wall).all():
        row_of = int(np.flatnonzero(~(is_grain | is_wall))[0])
        raise CorruptFile(
            f"{path}, row {row_of + 2}, column {name}: {found[row_of]} is neither a grain of grains.csv nor a wall of box.toml"
        )
    return np.where(is_wall, len(ids) + face, row)
