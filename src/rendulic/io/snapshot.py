"""The neutral snapshot file: grains, contacts with forces, and the box, of any engine.

An HDF5 file with SI units, not compressed, written by `write_snapshot` or by a user's own script:

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

What the engine says besides, each only if it is known. Nothing is computed with it: audits hold the contacts against it.

| what | shape | meaning |
|---|---|---|
| `recorded/wall_force` | (6,) | force by the grains on each wall in N, outward positive, in the order of the faces |
| `recorded/grain_force` | (n, 3) | sum of the contact forces on each grain in N |
| `recorded/grain_moment` | (n, 3) | their moment about the centre of each grain in N m |
| `recorded/stress` | (3, 3) | Cauchy stress in Pa, compression positive; NaN where unknown |
| `recorded/slack` | (n,) | m that each grain moved between the instants of the forces and of the positions |
| attribute `recorded` | | JSON object: `step`; `are_spheres`; `springs` with `modulus` (Pa), `rule` and `wall_modulus`; `stress_of_pairs`; `n_merged`; `derived` (see `rendulic.specimen.recorded`) |
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.hdf5 import plain_file
from rendulic.foundation.json_text import read_json_text
from rendulic.foundation.whole_file import whole_file
from rendulic.io.recorded import ARRAYS, recorded_from, said_of
from rendulic.specimen.snapshot import Snapshot

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
        arrays = {place: getattr(snapshot, name) for name, (place, _) in FIELDS.items()}
        if snapshot.recorded is not None:
            file.attrs["recorded"] = json.dumps(said_of(snapshot.recorded))
            arrays |= {f"recorded/{name}": getattr(snapshot.recorded, name) for name in ARRAYS}
        for place, value in arrays.items():
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
    path = Path(path)
    if not path.is_file():
        raise InvalidInput(f"no snapshot at {path}: check the path")
    values: dict[str, Any] = {}
    with plain_file(path, "snapshot") as file:
        said = file.attributes()
        for name, expected in (("format", FORMAT), ("schema", SCHEMA), ("forces", CONVENTION)):
            if not isinstance(said.get(name), str | int) or said[name] != expected:
                raise CorruptFile(f"{path}: attribute '{name}' must be {expected!r}, found {said.get(name)!r}")
        about = read_json_text(str(said.get("about", "{}")))
        if not isinstance(about, dict):
            raise CorruptFile(f"{path}: attribute 'about' must be a JSON object, found {about!r}")
        if with_fields:
            for name, (place, shape) in FIELDS.items():
                found = file.array(place)
                if found is None and name != "image":
                    raise CorruptFile(f"{path} lacks the field {place}")
                values[name] = found if found is None else _field(path, found, place, shape, name in WHOLE)
            if "friction" in said:
                values["friction"] = float(said["friction"])
            if "recorded" in said:
                engine = {name: file.array(f"recorded/{name}") for name in ARRAYS}
                arrays = {
                    name: _field(path, array, f"recorded/{name}", ARRAYS[name], whole=False)
                    for name, array in engine.items() if array is not None
                }  # fmt: skip
                table = read_json_text(str(said["recorded"]))
                try:
                    values["recorded"] = recorded_from(table, arrays, f"{path}, attribute 'recorded'")
                except (ValueError, InvalidInput) as error:
                    raise CorruptFile(str(error)) from None
    return values, about


def _field(path: Path, found: np.ndarray, place: str, shape: tuple[int | None, ...], whole: bool) -> np.ndarray:
    """One field of the right shape and kind."""
    if len(found.shape) != len(shape) or any(b not in (None, a) for a, b in zip(found.shape, shape, strict=True)):
        wanted = tuple("any" if size is None else size for size in shape)
        raise CorruptFile(f"{path}: field {place} must have the shape {wanted}, found {found.shape}")
    if found.shape[0] > LARGEST:
        raise CorruptFile(f"{path}: field {place} has {found.shape[0]} rows, more than the {LARGEST} that are read")
    if found.dtype.kind not in ("iu" if whole else "iuf"):
        raise CorruptFile(f"{path}: field {place} must be of {'integers' if whole else 'numbers'}, found {found.dtype}")
    if whole and len(found) and found.max() > np.iinfo(np.int64).max:
        raise CorruptFile(
            f"{path}: field {place} must be of integers up to {np.iinfo(np.int64).max}, found {found.max()}"
        )
    return found.astype(np.int64 if whole else float)


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
    if (recorded := snapshot.recorded) is not None:
        for field in ("grain_force", "grain_moment", "slack"):
            values = getattr(recorded, field)
            if values is not None and len(values) != n:
                raise CorruptFile(f"{where}: recorded/{field} has {len(values)} rows, expected {n}")
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
