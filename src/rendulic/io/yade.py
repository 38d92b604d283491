"""States and probes computed by Yade, as its users save them with NumPy.

Fields (theory and units as in Yade): `pos, rad, mass, vel, angvel` per sphere; `ids` their body
ids; `wallids` and `wallpos` of the walls in the order x-, x+, y-, y+, z-, z+; `contacts`, one row
each: id1, id2, k_n, k_t, normal force (3), shear force (3), normal from 1 to 2 (3). Both forces act
on body 2 in Yade's own sign, so the normal force of a compressed contact points from 1 to 2.
"""

from __future__ import annotations

import os
import zipfile
import zlib
from pathlib import Path

import numpy as np

from rendulic.checks import finite_array
from rendulic.dem.assembly import Assembly
from rendulic.dem.laws import LinearFrictional
from rendulic.errors import CorruptFile, InvalidInput
from rendulic.snapshot import Snapshot

__all__ = ["read", "read_snapshot"]

AXES = (1, 0, 2)  # rendulic's axes 1, 2, 3 are Yade's y, x, z in a triaxial test about y
WALLS = (2, 3, 0, 1, 4, 5)
SHAPES: dict[str, tuple[int | None, ...]] = {
    "pos": (None, 3), "rad": (None,), "mass": (None,), "vel": (None, 3), "angvel": (None, 3),
    "ids": (None,), "wallids": (6,), "wallpos": (6, 3), "contacts": (None, None),
}  # fmt: skip


def _fields(path: str | os.PathLike, wanted: tuple[str, ...]) -> dict[str, np.ndarray]:
    path = Path(path)
    if not path.is_file():
        raise InvalidInput(f"no Yade state at {path}: check the path")
    found: dict[str, np.ndarray] = {}
    try:
        archive = np.load(path, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise CorruptFile(f"{path} is a bare array, not an .npz archive of a Yade state")
        with archive:
            missing = [name for name in wanted if name not in archive.files]
            if missing:
                raise CorruptFile(f"{path} lacks the field(s) {', '.join(missing)}; it has {', '.join(archive.files)}")
            for name in (*wanted, *(n for n in ("dt",) if n in archive.files)):
                found[name] = archive[name]
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error, KeyError) as error:
        raise CorruptFile(f"{path} is not a readable .npz archive: {error}") from None
    for name in wanted:
        try:
            found[name] = finite_array(name, found[name], SHAPES[name])
        except InvalidInput as error:
            raise CorruptFile(f"{path}, field {error}") from None
    count = len(found["ids"])
    for name in ("pos", "rad", "mass", "vel", "angvel"):
        if name in found and len(found[name]) != count:
            raise CorruptFile(f"{path}: field {name} has {len(found[name])} rows, ids has {count}")
    by_id = np.argsort(found["ids"], kind="stable")
    for name in ("ids", "pos", "rad", "mass", "vel", "angvel"):
        if name in found:
            found[name] = found[name][by_id]
    if found["contacts"].shape[1] < 13:
        raise CorruptFile(f"{path}: field contacts has {found['contacts'].shape[1]} columns, at least 13 are needed")
    return found


def _bodies(path, fields: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Bodies of each contact: grains by index, walls as `n + wall` in rendulic's order."""
    ids, wall_ids = fields["ids"].astype(np.int64), fields["wallids"].astype(np.int64)
    number = {int(body): index for index, body in enumerate(ids)}
    if len(number) != len(ids):
        raise CorruptFile(f"{path}: field ids names a sphere twice")
    number |= {int(wall_ids[yade]): len(ids) + ours for ours, yade in enumerate(WALLS)}
    try:
        bodies = [[number[int(body)] for body in row[:2]] for row in fields["contacts"]]
    except KeyError as error:
        raise CorruptFile(f"{path}: a contact names body {error}, which is neither in ids nor in wallids") from None
    pairs = np.array(bodies, dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def read_snapshot(path: str | os.PathLike, friction: float | None = 0.7) -> Snapshot:
    """Read a state for analysis only: forces are Yade's own, nothing is recomputed.

    Raises
    ------
    InvalidInput, CorruptFile
        Naming file, field and what was expected.
    """
    fields = _fields(path, ("ids", "pos", "rad", "wallids", "wallpos", "contacts"))
    first, second = _bodies(path, fields)
    rows = fields["contacts"]
    swap = first > second  # walls come second, as everywhere in rendulic
    sign = np.where(swap, -1.0, 1.0)[:, None]
    vector = np.array(AXES)
    normal = sign * rows[:, 10:13][:, vector]
    normal_force = sign * rows[:, 4:7][:, vector]
    return Snapshot(
        position=fields["pos"][:, vector],
        radius=fields["rad"],
        wall_position=_wall_coordinates(fields),
        first=np.where(swap, second, first),
        second=np.where(swap, first, second),
        normal=normal,
        force_n=(normal_force * normal).sum(axis=1),
        force_t=sign * rows[:, 7:10][:, vector],
        friction=friction,
    )


def _wall_coordinates(fields: dict[str, np.ndarray]) -> np.ndarray:
    return np.array([fields["wallpos"][yade, yade // 2] for yade in WALLS])


def read(path: str | os.PathLike, law: LinearFrictional | None = None, damping: float = 0.05) -> Assembly:
    """Read a state as an `Assembly` that steps on.

    Parameters
    ----------
    path : path
        An `.npz` with the fields above.
    law : LinearFrictional, optional
        By default Yade's frictional law with E = 712 MPa, k_t/k_n = 0.42, mu = 0.7: the `harmonic`
        stiffness rule.

    Notes
    -----
    Normal forces are recomputed from positions and radii; tangential forces are the file's. The
    time step is the file's `dt` where it has one.

    Raises
    ------
    InvalidInput, CorruptFile
        Naming file, field and what was expected.
    """
    fields = _fields(path, tuple(SHAPES))
    vector = np.array(AXES)
    volume = 4.0 / 3.0 * np.pi * fields["rad"] ** 3
    density = float(fields["mass"].sum() / volume.sum())
    if not np.allclose(fields["mass"], density * volume, rtol=1e-6):
        raise CorruptFile(f"{path}: the masses are not those of spheres of one density; fields mass and rad disagree")
    # Yade's axes 1, 2, 3 = y, x, z are an odd permutation: pseudovectors change sign
    assembly = Assembly(
        fields["pos"][:, vector],
        fields["rad"],
        _wall_coordinates(fields),
        density=density,
        law=law or LinearFrictional(stiffness_rule="harmonic"),
        damping=damping,
        velocity=fields["vel"][:, vector],
        angular_velocity=-fields["angvel"][:, vector],
    )
    first, second = _bodies(path, fields)
    n = len(assembly)
    between = (first < n) & (second < n)
    first, second = first[between], second[between]
    swap = first > second
    shear = np.where(swap, -1.0, 1.0)[:, None] * fields["contacts"][between, 7:10][:, vector]
    # Yade saves positions after a step and the forces from before it
    dt = float(finite_array("dt", fields["dt"], ())) if "dt" in fields else 0.0
    assembly.set_tangential_forces(np.where(swap, second, first), np.where(swap, first, second), shear, age=dt)
    if dt:
        assembly.set_time_step(dt)
    return assembly
