"""Spheres and walls that overlap by their places and sizes, whatever the list of contacts says."""

from __future__ import annotations

import numpy as np

from rendulic.specimen.snapshot import Snapshot

__all__ = ["TooManyPairs", "overlaps", "unlisted_overlaps"]

MOST_PAIRS = 1000  # of a grain, that may touch by their sizes: in a packing there are some tens


class TooManyPairs(ValueError):
    """Radii are so large beside the distances of the grains that nearly all overlap."""


def overlaps(snapshot: Snapshot) -> np.ndarray:
    """(n_contacts,) by which the spheres, or sphere and wall, of each contact overlap in m; negative where they are apart."""
    wall, radius, rows = snapshot.is_wall, snapshot.radius, np.arange(len(snapshot.first))
    branch = snapshot.branch
    face = np.where(wall, snapshot.second - snapshot.n_grains, 0)
    outward = np.where(face % 2 == 0, -1.0, 1.0) * branch[rows, face // 2]
    other = radius[np.where(wall, 0, snapshot.second)]
    apart = np.linalg.norm(branch, axis=1)
    return radius[snapshot.first] + np.where(wall, -outward, other - apart)


def unlisted_overlaps(snapshot: Snapshot, has_walls: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs that overlap and are not among the contacts.

    Parameters
    ----------
    has_walls : (3,) bool array
        Axes between walls; the others have none, or are periodic.

    Returns
    -------
    first, second : int arrays
        Bodies, as in `Snapshot`.
    overlap : array
        In m, positive.

    Raises
    ------
    TooManyPairs
        If the radii do not belong to the positions.
    """
    n, lengths, low = snapshot.n_grains, snapshot.lengths, snapshot.wall_position[0::2]
    periodic = snapshot.across.any(axis=0)
    inside = np.where(periodic, low + (snapshot.position - low) % lengths, snapshot.position)
    shift = np.where(periodic, np.rint((snapshot.position - inside) / lengths), 0.0).astype(np.int64)
    first, second = _near(inside - low, snapshot.radius, np.where(periodic, lengths, 0.0))
    apart = inside[second] - inside[first]
    nearest = np.where(periodic, -np.rint(apart / lengths), 0.0)
    overlap = snapshot.radius[first] + snapshot.radius[second] - np.linalg.norm(apart + nearest * lengths, axis=1)
    image = nearest.astype(np.int64) + shift[first] - shift[second]
    # grains on walls
    outward = np.column_stack((snapshot.position - low, snapshot.wall_position[1::2] - snapshot.position))
    on_wall = snapshot.radius[:, None] - outward[:, [0, 3, 1, 4, 2, 5]]
    grain, face = np.nonzero((on_wall > 0.0) & np.repeat(has_walls, 2))
    first, second = np.concatenate((first, grain)), np.concatenate((second, n + face))
    image = np.concatenate((image, np.zeros((len(grain), 3), dtype=np.int64)))
    overlap = np.concatenate((overlap, on_wall[grain, face]))
    closed = overlap > 0.0
    first, second, image, overlap = first[closed], second[closed], image[closed], overlap[closed]
    found, listed = _rows(first, second, image), _rows(snapshot.first, snapshot.second, snapshot.across)
    _, of_row = np.unique(np.concatenate((listed, found)), axis=0, return_inverse=True)
    of_row = of_row.reshape(-1)  # a column in NumPy 2.0
    missing = ~np.isin(of_row[len(listed) :], of_row[: len(listed)])
    return first[missing], second[missing], overlap[missing]


def _near(position: np.ndarray, radius: np.ndarray, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of grains that may overlap, the lower one first; grains of one octave of size share a tree."""
    from scipy.spatial import cKDTree

    position = np.where(cell > 0.0, np.minimum(position, np.nextafter(cell, 0.0)), position)
    octave = np.floor(np.log2(radius))
    members = [np.flatnonzero(octave == each) for each in np.unique(octave)]
    trees = [cKDTree(position[each], boxsize=cell if cell.any() else None) for each in members]
    found, total = [np.zeros((0, 2), dtype=np.int64)], 0
    for a, (one, tree) in enumerate(zip(members, trees, strict=True)):
        for other, larger in zip(members[a:], trees[a:], strict=True):
            reach = float(radius[one].max() + radius[other].max())
            total += int(tree.count_neighbors(larger, reach))
            if total > MOST_PAIRS * (100 + len(radius)):
                raise TooManyPairs
            near = tree.sparse_distance_matrix(larger, reach, output_type="ndarray")
            pairs = np.column_stack((one[near["i"]], other[near["j"]]))
            found.append(pairs[pairs[:, 0] < pairs[:, 1]] if one is other else np.sort(pairs, axis=1))
    return tuple(np.concatenate(found).T)


def _rows(first: np.ndarray, second: np.ndarray, image: np.ndarray) -> np.ndarray:
    """One row per pair, the lower body first."""
    swap = (first > second)[:, None]
    pair = np.where(swap, np.column_stack((second, first)), np.column_stack((first, second)))
    return np.hstack((pair, np.where(swap, -image, image)))
