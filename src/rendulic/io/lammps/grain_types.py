"""Grain types: LAMMPS has one spring per pair of types, where a law has one per pair of radii."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rendulic.dem.laws import LinearFrictional
from rendulic.specimen.snapshot import Snapshot

__all__ = ["GrainTypes", "sorted_into_types"]


@dataclass(frozen=True)
class GrainTypes:
    """Grains sorted by radius, and the spring of each pair of types.

    Parameters
    ----------
    of_grain : (n,) int array
        Type of each grain, from 0.
    k_n : (n_types, n_types) array
        Normal stiffness of each pair of types in N/m, symmetric.
    error : (n_contacts,) array
        Relative error of the normal stiffness of every contact between grains, `k_n(types) / k_n(radii) - 1`.
    """

    of_grain: np.ndarray
    k_n: np.ndarray
    error: np.ndarray

    @property
    def n_types(self) -> int:
        """Number of types that have grains."""
        return len(self.k_n)


def sorted_into_types(snapshot: Snapshot, law: LinearFrictional, n_types: int) -> GrainTypes:
    """Sort grains into at most `n_types` types: one per radius if that is enough, else geometric classes of radius.

    A pair of types gets the one spring under which its present contacts carry the same sum of normal forces,
    `sum k_n u / sum u` with the overlaps u; without contacts, that of the mean radii of the two types.
    """
    radius = snapshot.radius
    edges = np.unique(radius)
    if len(edges) > n_types:
        edges = np.geomspace(edges[0], edges[-1] * (1.0 + 1e-12), n_types + 1)
    _, kind = np.unique(np.searchsorted(edges, radius, side="right"), return_inverse=True)
    kind = kind.reshape(-1)
    mean = np.bincount(kind, weights=radius) / np.bincount(kind)
    k_n = law.stiffness(mean[:, None], mean[None, :], law.parameters)[0]
    between = ~snapshot.is_wall
    first, second = snapshot.first[between], snapshot.second[between]
    exact = law.stiffness(radius[first], radius[second], law.parameters)[0]
    overlap = radius[first] + radius[second] - np.linalg.norm(snapshot.branch[between], axis=1)
    pair = np.minimum(kind[first], kind[second]), np.maximum(kind[first], kind[second])
    carried, closed = np.zeros_like(k_n), np.zeros_like(k_n)
    np.add.at(carried, pair, exact * overlap)
    np.add.at(closed, pair, overlap)
    k_n = np.triu(np.where(closed > 0.0, carried / np.where(closed > 0.0, closed, 1.0), k_n))
    k_n = k_n + np.triu(k_n, 1).T
    return GrainTypes(kind, k_n, k_n[kind[first], kind[second]] / exact - 1.0)
