"""Grains, contacts and walls of a snapshot as VTKHDF files, which ParaView opens.

Every file is one `PolyData` of VTKHDF 2.0, for ParaView 5.12 and later. Its field data `variables` has a line for each variable, with unit and
meaning; the datasets carry the same as attributes `units` and `long_name`. Lengths are in m, forces in N, stresses in
Pa, second-order work in J; compression is positive; x, y, z are the axes 1, 2, 3.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.whole_file import whole_file, writable_folder
from rendulic.micro.contact_work import CLASSES
from rendulic.probing.anatomy import anatomy as anatomy_of_pair
from rendulic.specimen.snapshot import Snapshot

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["write_contacts", "write_grains", "write_vtkhdf", "write_walls"]

VERSION = (2, 0)
SUFFIXES = (".vtkhdf", ".hdf")  # by which ParaView knows its reader
KINDS = ("Vertices", "Lines", "Polygons", "Strips")
Columns = Mapping[str, tuple[np.ndarray, str, str]]  # values, unit, meaning


def write_vtkhdf(snapshot: Snapshot, folder: str | os.PathLike, before: Snapshot | None = None) -> list[Path]:
    """Write `grains.vtkhdf`, `contacts.vtkhdf` and `walls.vtkhdf` into a folder; return their paths.

    Parameters
    ----------
    snapshot : Snapshot
        Any engine's.
    folder : path
        Made if it is not there.
    before : Snapshot, optional
        The same grains earlier: adds displacement and second-order work of grains, and second-order work and class of
        contacts, also of those that have opened since.

    Raises
    ------
    InvalidInput
        If `before` is of other grains, or a file cannot be written.
    """
    folder = writable_folder(folder)
    anatomy = None if before is None else anatomy_of_pair(before, snapshot)
    return [
        write_grains(snapshot, folder / "grains.vtkhdf", anatomy=anatomy, before=before),
        write_contacts(snapshot, folder / "contacts.vtkhdf", anatomy=anatomy),
        write_walls(snapshot, folder / "walls.vtkhdf"),
    ]


def write_grains(
    snapshot: Snapshot,
    path: str | os.PathLike,
    *,
    anatomy: xr.Dataset | None = None,
    before: Snapshot | None = None,
) -> Path:
    """Write the grains as points, whole or not at all; return the path.

    Per point: `id` (the row in the snapshot), `radius` in m, `coordination` and `wall_contacts` (numbers of contacts with
    grains and with walls), `resultant` (summed contact force, a vector in N); with `before` also `displacement` in m,
    with `anatomy` also `w2` in J.

    Parameters
    ----------
    snapshot : Snapshot
        Any engine's.
    path : path
        Ends with .vtkhdf (or .hdf).
    anatomy : xarray.Dataset, optional
        Of `rd.anatomy`, of the same grains.
    before : Snapshot, optional
        The same grains earlier: less than half a cell of displacement earlier in a periodic box.

    Raises
    ------
    InvalidInput
        If `anatomy` or `before` is of other grains, `anatomy` lacks its grains, or the file cannot be written.
    """
    n, between = snapshot.n_grains, ~snapshot.is_wall
    position = finite_array("position of the grains", snapshot.position, (None, 3))
    sides = np.concatenate((snapshot.first[between], snapshot.second[between]))
    columns = {
        "id": (np.arange(n), "1", "row of the grain in the snapshot"),
        "radius": (snapshot.radius, "m", "radius"),
        "coordination": (np.bincount(sides, minlength=n), "1", "contacts with grains"),
        "wall_contacts": (np.bincount(snapshot.first[~between], minlength=n), "1", "contacts with walls"),
        "resultant": (snapshot.resultant[:n], "N", "summed contact force"),
    }
    if before is not None:
        if before.n_grains != n:
            raise InvalidInput(f"before must hold the same {n} grains as the snapshot, got {before.n_grains}")
        moved = snapshot.following(before).position - before.position
        columns["displacement"] = (moved, "m", "displacement since the snapshot before")
    if anatomy is not None:
        _of_same_grains(anatomy, snapshot, ("grain_w2",))
        columns["w2"] = (anatomy.grain_w2.values, "J", "second-order work of the grain")
    return _write(path, position, "Vertices", np.arange(n)[:, None], point_data=columns)


def write_contacts(snapshot: Snapshot, path: str | os.PathLike, *, anatomy: xr.Dataset | None = None) -> Path:
    """Write the contacts as lines from centre to centre, or to the wall's plane; return the path.

    Per line: `first` and `second` (bodies, as in `Snapshot`), `force_n` in N, `force_t` (on `second`, a vector in N),
    `relative_force` (`force_n` over its mean over this snapshot), `is_sliding`. Through a periodic face a line goes on
    to the image. Lines share no points.

    Parameters
    ----------
    snapshot : Snapshot
        Any engine's.
    path : path
        Ends with .vtkhdf (or .hdf).
    anatomy : xarray.Dataset, optional
        Of `rd.anatomy`, with this snapshot as the one before or after. Then there is a line for each of its pairs,
        with `w2` in J, `class_of_pair` (0 elastic, 1 sliding, 2 opened, 3 created, 4 wall) and `is_closed`: pairs that
        touch only in the other snapshot have 0 there and no force.

    Raises
    ------
    InvalidInput
        If `anatomy` is of other grains or of other snapshots, lacks its pairs, or has a pair twice (a small periodic
        box, through two images), or the file cannot be written.
    """
    n_closed = len(snapshot.first)
    extra: dict[str, tuple[np.ndarray, str, str]] = {}
    if anatomy is not None:
        snapshot, pair = _with_all_pairs(snapshot, anatomy)
        names = ", ".join(f"{k} {name}" for k, name in enumerate(CLASSES))
        extra = {
            "is_closed": (np.arange(len(pair)) < n_closed, "1", "in contact in this snapshot"),
            "class_of_pair": (anatomy.class_of_pair.values[pair], "1", names),
            "w2": (anatomy.w2.values[pair], "J", "second-order work df . dl"),
        }
    closed = np.arange(len(snapshot.first)) < n_closed
    mean = float(snapshot.force_n[closed].mean()) if n_closed else 0.0
    columns = {
        "first": (snapshot.first, "1", "grain"),
        "second": (snapshot.second, "1", "grain, or wall from the number of grains on"),
        "force_n": (snapshot.force_n, "N", "normal force, compression positive"),
        "force_t": (snapshot.force_t, "N", "tangential force on second"),
        "relative_force": (snapshot.force_n / (mean or 1.0), "1", "normal force over its mean"),
        "is_sliding": (snapshot.is_sliding & closed, "1", "tangential force at the Coulomb limit"),
    }
    start = finite_array("position of the grains", snapshot.position, (None, 3))[snapshot.first]
    ends = np.stack((start, start + snapshot.branch), axis=1).reshape(-1, 3)
    return _write(path, ends, "Lines", np.arange(len(ends)).reshape(-1, 2), cell_data=columns | extra)


def write_walls(snapshot: Snapshot, path: str | os.PathLike) -> Path:
    """Write the six walls, or faces of the periodic cell, as quads in the order 1-, 1+, 2-, 2+, 3-, 3+; return the path.

    Per quad: `wall` (0 to 5), `normal` (out of the box), `force` (of the grains on the wall or through the face, a
    vector in N), `stress` (its normal part over the area in Pa, compression positive).

    Raises
    ------
    InvalidInput
        If the file cannot be written, or `path` ends with neither .vtkhdf nor .hdf.
    """
    faces = finite_array("wall_position", snapshot.wall_position, (6,))
    axis, side = np.arange(6) // 2, np.arange(6) % 2
    outward = 2.0 * side - 1.0
    normal, corners = np.zeros((6, 3)), np.empty((6, 4, 3))
    normal[np.arange(6), axis] = outward
    for wall in range(6):
        a, b = (axis[wall] + 1) % 3, (axis[wall] + 2) % 3
        around = np.array([0, 1, 3, 2])[:: int(outward[wall])]  # counterclockwise, seen from outside
        corners[wall, :, axis[wall]] = faces[wall]
        corners[wall, :, a] = faces[2 * a + around % 2]
        corners[wall, :, b] = faces[2 * b + around // 2]
    through = snapshot.across.T @ snapshot.force  # one row per axis that is crossed
    force = snapshot.resultant[snapshot.n_grains :] + outward[:, None] * through[axis]
    columns = {
        "wall": (np.arange(6), "1", "1-, 1+, 2-, 2+, 3-, 3+"),
        "normal": (normal, "1", "out of the box"),
        "force": (force, "N", "of the grains on the wall, or through the face of the periodic cell"),
        "stress": (
            (force * normal).sum(axis=1) * (snapshot.lengths / snapshot.volume)[axis],
            "Pa",
            "normal force over area, compression positive",
        ),
    }
    return _write(path, corners.reshape(-1, 3), "Polygons", np.arange(24).reshape(6, 4), cell_data=columns)


def _of_same_grains(anatomy: xr.Dataset, snapshot: Snapshot, needed: Iterable[str]) -> None:
    missing = [name for name in (*needed, "grain_radius") if name not in anatomy]
    if missing:
        raise InvalidInput(
            f"the anatomy lacks {', '.join(missing)}: give one of rd.anatomy(before, after), which keeps pairs and grains"
        )
    radius = anatomy.grain_radius.values
    if radius.shape != snapshot.radius.shape or not np.allclose(radius, snapshot.radius, rtol=1e-6):
        raise InvalidInput(
            f"the anatomy must be of the snapshot's {snapshot.n_grains} grains, in their order; its {len(radius)} grains "
            "have other radii"
        )


def _with_all_pairs(snapshot: Snapshot, anatomy: xr.Dataset) -> tuple[Snapshot, np.ndarray]:
    """The snapshot with, after its own contacts, the pairs that touch in the other one; and the pair of each."""
    _of_same_grains(anatomy, snapshot, ("w2", "class_of_pair", "first", "second"))
    n = snapshot.n_grains

    def key(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return np.minimum(first, second).astype(np.int64) * (n + 6) + np.maximum(first, second)

    of_pair, own = key(anatomy.first.values, anatomy.second.values), key(snapshot.first, snapshot.second)
    order = np.argsort(of_pair)
    if len(np.unique(of_pair)) < len(of_pair):
        raise InvalidInput("the anatomy has a pair of grains twice, through two images: its pairs cannot be told apart")
    unknown = ~np.isin(own, of_pair)
    if unknown.any():
        raise InvalidInput(
            f"the snapshot must be one of the two that the anatomy was made of, but {int(unknown.sum())} of its "
            f"{len(own)} contacts are not among the pairs of the anatomy"
        )
    other = np.flatnonzero(~np.isin(of_pair, own))
    first, second = anatomy.first.values[other], anatomy.second.values[other]
    image = snapshot.image
    if image is not None:
        apart = snapshot.body_position[second] - snapshot.position[first]
        between = (second < n)[:, None] & image.any(axis=0)
        image = np.concatenate((image, np.where(between, -np.round(apart / snapshot.lengths), 0).astype(image.dtype)))
    none = np.zeros((len(other), 3))
    joined = replace(
        snapshot,
        first=np.concatenate((snapshot.first, first)),
        second=np.concatenate((snapshot.second, second)),
        normal=np.concatenate((snapshot.normal, none)),
        force_n=np.concatenate((snapshot.force_n, none[:, 0])),
        force_t=np.concatenate((snapshot.force_t, none)),
        image=image,
    )
    return joined, np.concatenate((order[np.searchsorted(of_pair[order], own)], other))


def _write(
    path: str | os.PathLike,
    points: np.ndarray,
    kind: str,
    cells: np.ndarray,
    *,
    point_data: Columns | None = None,
    cell_data: Columns | None = None,
) -> Path:
    """One partition of `PolyData` whose cells, (n_cells, points per cell), are all of one kind."""
    import h5py

    path = Path(path)
    if path.suffix not in SUFFIXES:
        raise InvalidInput(
            f"a file for ParaView ends with {' or '.join(SUFFIXES)}, by which it is known; got {path.name}"
        )
    with whole_file(path) as temporary, h5py.File(temporary, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array(VERSION, dtype=np.int64)
        root.attrs["Type"] = np.bytes_(b"PolyData")  # of fixed length: vtk reads no other
        root["NumberOfPoints"] = np.array([len(points)], dtype=np.int64)
        root["Points"] = points
        for name in KINDS:
            own = cells if name == kind else np.empty((0, 1), dtype=np.int64)
            group = root.create_group(name)
            group["NumberOfCells"] = np.array([len(own)], dtype=np.int64)
            group["NumberOfConnectivityIds"] = np.array([own.size], dtype=np.int64)
            group["Offsets"] = np.arange(len(own) + 1, dtype=np.int64) * own.shape[1]
            group["Connectivity"] = own.reshape(-1).astype(np.int64)
        lines = []
        for place, columns in (("PointData", point_data or {}), ("CellData", cell_data or {})):
            group = root.create_group(place)
            for name, (values, unit, meaning) in columns.items():
                stored = values.astype(np.uint8) if values.dtype == bool else values
                group.create_dataset(name, data=stored).attrs.update(units=unit, long_name=meaning)
                lines.append(f"{name} [{unit}]: {meaning}")
        root.create_group("FieldData").create_dataset("variables", data=lines, dtype=h5py.string_dtype("ascii"))
    return path
