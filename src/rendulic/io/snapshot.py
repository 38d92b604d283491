"""The neutral snapshot file: grains, contacts with forces, and the box, of any engine.

An HDF5 file with SI units, written by `write_snapshot` or by a user's own script:

| what | shape | meaning |
|---|---|---|
| attribute `format` | | "rendulic snapshot" |
| attribute `schema` | | 1 |
| attribute `forces` | | "on second, compression positive": the convention must be stated |
| attribute `friction` | | Coulomb coefficient between grains, if known |
| attribute `about` | | JSON object with anything worth knowing: engine, time, step |
| `grains/position` | (n, 3) | centres in m |
| `grains/radius` | (n,) | in m |
| `box/faces` | (6,) | walls, or faces of the periodic cell, in m: 1-, 1+, 2-, 2+, 3-, 3+ |
| `contacts/first`, `contacts/second` | (n_contacts,) | bodies: a grain by its row, face k as n + k, always second |
| `contacts/normal` | (n_contacts, 3) | unit vector from first to second |
| `contacts/force_n` | (n_contacts,) | normal force in N |
| `contacts/force_t` | (n_contacts, 3) | tangential force on second in N |
| `contacts/image` | (n_contacts, 3) | periodic boxes only: second is its image that many cells on |
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.whole_file import whole_file
from rendulic.specimen.snapshot import Snapshot

if TYPE_CHECKING:
    import h5py

__all__ = ["checked", "nearest_images", "read_about", "read_snapshot", "write_snapshot"]

FORMAT, SCHEMA = "rendulic snapshot", 1
CONVENTION = "on second, compression positive"
LARGEST = 50_000_000  # rows that a file may ask for
FIELDS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "position": ("grains/position", (None, 3)),
    "radius": ("grains/radius", (None,)),
    "wall_position": ("box/faces", (6,)),
    "first": ("contacts/first", (None,)),
    "second": ("contacts/second", (None,)),
    "normal": ("contacts/normal", (None, 3)),
    "force_n": ("contacts/force_n", (None,)),
    "force_t": ("contacts/force_t", (None, 3)),
    "image": ("contacts/image", (None, 3)),
}
WHOLE = ("first", "second", "image")


def write_snapshot(snapshot: Snapshot, path: str | os.PathLike, about: Mapping[str, Any] | None = None) -> Path:
    """Write a snapshot as a neutral file, whole or not at all; return the path.

    Parameters
    ----------
    about : mapping, optional
        Anything that JSON can hold.
    """
    import h5py

    snapshot = checked(snapshot, "the snapshot to write")
    with whole_file(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update(format=FORMAT, schema=SCHEMA, forces=CONVENTION, about=json.dumps(dict(about or {})))
        if snapshot.friction is not None:
            file.attrs["friction"] = snapshot.friction
        for name, (place, _) in FIELDS.items():
            value = getattr(snapshot, name)
            if value is not None:
                file.create_dataset(place, data=value, fletcher32=True)
    return Path(path)


def read_snapshot(path: str | os.PathLike) -> Snapshot:
    """Read a neutral file; nothing in it is executed, and links out of it are refused.

    Raises
    ------
    InvalidInput
        If there is no such file.
    CorruptFile
        If it is truncated, altered, foreign, or inconsistent: the message names the field and what was expected.
    """
    values = _values(path)
    return checked(Snapshot(**values[0]), str(path))


def read_about(path: str | os.PathLike) -> dict[str, Any]:
    """What the writer of a neutral file said about it; errors as of `read_snapshot`."""
    return _values(path, with_fields=False)[1]


def _values(path: str | os.PathLike, with_fields: bool = True) -> tuple[dict[str, Any], dict[str, Any]]:
    import h5py

    path = Path(path)
    if not path.is_file():
        raise InvalidInput(f"no snapshot at {path}: check the path")
    values: dict[str, Any] = {}
    try:
        with h5py.File(path, "r") as file:
            _expect(path, file, "format", FORMAT)
            _expect(path, file, "schema", SCHEMA)
            _expect(path, file, "forces", CONVENTION)
            about = json.loads(file.attrs.get("about", "{}"))
            if not isinstance(about, dict):
                raise CorruptFile(f"{path}: attribute 'about' must be a JSON object, found {about!r}")
            if with_fields:
                for name, (place, shape) in FIELDS.items():
                    found = _array(path, file, place, shape, name in WHOLE)
                    if found is None and name != "image":
                        raise CorruptFile(f"{path} lacks the field {place}")
                    values[name] = found
                if "friction" in file.attrs:
                    values["friction"] = float(file.attrs["friction"])
    except CorruptFile:
        raise
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        raise CorruptFile(f"{path} is not a readable snapshot (truncated, altered or foreign): {error}") from None
    return values, about


def _expect(path: Path, file: h5py.File, name: str, value: Any) -> None:
    found = file.attrs.get(name)
    if isinstance(found, bytes):
        found = found.decode(errors="replace")
    if found is None or found != value:
        raise CorruptFile(f"{path}: attribute '{name}' must be {value!r}, found {found!r}")


def _array(path: Path, file: h5py.File, place: str, shape: tuple[int | None, ...], whole: bool) -> np.ndarray | None:
    """One field, if it is there, of the right shape and kind, and inside the file."""
    import h5py

    group: Any = file
    for part in place.split("/"):
        link = group.get(part, getlink=True) if isinstance(group, h5py.Group) else None
        if link is None:
            return None
        if not isinstance(link, h5py.HardLink):
            raise CorruptFile(f"{path}: field {place} is a link; a snapshot must hold its data itself")
        group = group[part]
    if not isinstance(group, h5py.Dataset) or group.external or group.is_virtual:
        raise CorruptFile(f"{path}: field {place} must be a dataset with its data in this file")
    if len(group.shape) != len(shape) or any(b not in (None, a) for a, b in zip(group.shape, shape, strict=True)):
        wanted = tuple("any" if size is None else size for size in shape)
        raise CorruptFile(f"{path}: field {place} must have the shape {wanted}, found {group.shape}")
    if group.shape[0] > LARGEST:
        raise CorruptFile(f"{path}: field {place} has {group.shape[0]} rows, more than the {LARGEST} that are read")
    if group.dtype.kind not in ("iu" if whole else "iuf"):
        raise CorruptFile(f"{path}: field {place} must be of {'integers' if whole else 'numbers'}, found {group.dtype}")
    return group[()].astype(np.int64 if whole else float)


def checked(snapshot: Snapshot, where: str) -> Snapshot:
    """The snapshot itself, if its fields agree with each other.

    Raises
    ------
    CorruptFile
        Naming `where`, the field and the row.
    """
    n, n_contacts = snapshot.n_grains, len(snapshot.first)

    def refuse(wrong: np.ndarray, field: str, expected: str) -> None:
        if np.any(wrong):
            row = int(np.flatnonzero(wrong.reshape(len(wrong), -1).any(axis=1))[0]) if np.ndim(wrong) else 0
            raise CorruptFile(f"{where}: {field}, row {row}: {expected}")

    for field, rows in (("position", n), ("radius", n), ("normal", n_contacts), ("force_n", n_contacts),
                        ("force_t", n_contacts), ("second", n_contacts), ("image", n_contacts)):  # fmt: skip
        values = getattr(snapshot, field)
        if values is None:
            continue
        if len(values) != rows:
            raise CorruptFile(f"{where}: {field} has {len(values)} rows, expected {rows}")
        refuse(~np.isfinite(values), field, "expected a finite number")
    faces = snapshot.wall_position
    refuse(~np.isfinite(faces), "faces of the box", "expected a finite number")
    if not (snapshot.lengths > 0.0).all():
        raise CorruptFile(f"{where}: faces of the box must be 1- < 1+, 2- < 2+, 3- < 3+, found {faces.tolist()}")
    refuse(snapshot.radius <= 0.0, "radius", "expected a positive length in m")
    inside = (snapshot.first >= 0) & (snapshot.first < n)
    refuse(~inside, "first", f"expected a grain, 0 to {n - 1}")
    refuse(
        (snapshot.second < 0) | (snapshot.second >= n + 6),
        "second",
        f"expected a grain below {n}, or a face below {n + 6}",
    )
    itself = (snapshot.first == snapshot.second) & ~snapshot.across.any(axis=1)
    refuse(itself, "second", "a grain cannot touch itself")
    refuse(abs(np.linalg.norm(snapshot.normal, axis=1) - 1.0) > 1e-6, "normal", "expected a unit vector")
    through = snapshot.is_wall & snapshot.across.any(axis=1)
    refuse(through, "image", "a contact with a face cannot go through a face")
    if snapshot.friction is not None and not 0.0 <= snapshot.friction < np.inf:
        raise CorruptFile(f"{where}: friction must be zero or positive, found {snapshot.friction}")
    away = (snapshot.normal * snapshot.branch).sum(axis=1) < 0.0  # some may, between grains that are not convex
    if 2 * int(away.sum()) > n_contacts:
        raise CorruptFile(
            f"{where}: normal must point from first to second, but {int(away.sum())} of {n_contacts} point the other way"
        )
    return snapshot


def nearest_images(position: np.ndarray, faces: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(n_contacts, 3) cells to the image of `second` that is nearest to `first`, in a box periodic along every axis."""
    lengths = faces[1::2] - faces[0::2]
    n = len(position)
    apart = position[np.minimum(second, n - 1)] - position[np.minimum(first, n - 1)]
    return -np.round(apart / lengths).astype(np.int64)
