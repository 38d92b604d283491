"""Grains, walls and contacts at one instant: all that an analysis needs, from any engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Snapshot"]


@dataclass(frozen=True)
class Snapshot:
    """One instant of a packing between six walls, for analysis only.

    Parameters
    ----------
    position : (n, 3) array
        Centres of the grains in m.
    radius : (n,) array
        Radii in m (only for pictures and volumes; the theory needs none).
    wall_position : (6,) array
        Wall coordinates in m, in the order 1-, 1+, 2-, 2+, 3-, 3+.
    first, second : (n_contacts,) int arrays
        Bodies of each contact. A grain is its index; wall w is `n + w`, and always `second`.
    normal : (n_contacts, 3) array
        Unit vector from `first` to `second` (for a wall: out of the box).
    force_n : (n_contacts,) array
        Normal force in N, compression positive.
    force_t : (n_contacts, 3) array
        Tangential force on `second` in N.
    friction : float or None
        Coulomb coefficient between grains, if known: sliding contacts are told by it.
    """

    position: np.ndarray
    radius: np.ndarray
    wall_position: np.ndarray
    first: np.ndarray
    second: np.ndarray
    normal: np.ndarray
    force_n: np.ndarray
    force_t: np.ndarray
    friction: float | None = None

    @property
    def n_grains(self) -> int:
        """Number of grains."""
        return len(self.position)

    @property
    def force(self) -> np.ndarray:
        """(n_contacts, 3) force on `second` by `first` in N."""
        return self.force_n[:, None] * self.normal + self.force_t

    @property
    def is_wall(self) -> np.ndarray:
        """(n_contacts,) bool: contacts of a grain with a wall."""
        return self.second >= self.n_grains

    @property
    def is_sliding(self) -> np.ndarray:
        """(n_contacts,) bool: tangential force at the Coulomb limit (walls never; all False if unknown)."""
        if self.friction is None:
            return np.zeros(len(self.first), dtype=bool)
        at_limit = np.linalg.norm(self.force_t, axis=1) >= self.friction * self.force_n * (1.0 - 1e-9)
        return at_limit & ~self.is_wall

    @property
    def lengths(self) -> np.ndarray:
        """(3,) distances between opposite walls in m."""
        return self.wall_position[1::2] - self.wall_position[0::2]

    @property
    def volume(self) -> float:
        """Volume between the walls in m3."""
        return float(np.prod(self.lengths))

    @property
    def body_position(self) -> np.ndarray:
        """(n + 6, 3) positions of grains, then of walls.

        A wall's point has its own coordinate along its normal and the origin's elsewhere; only
        differences of these over time are meaningful, except along the normal.
        """
        walls = np.zeros((6, 3))
        walls[np.arange(6), np.arange(6) // 2] = self.wall_position
        return np.concatenate((self.position, walls))

    @property
    def branch(self) -> np.ndarray:
        """(n_contacts, 3) from `first` to `second` in m; for a wall from the centre to its plane."""
        vector = self.body_position[self.second] - self.position[self.first]
        if (wall := self.is_wall).any():
            axis = (self.second[wall] - self.n_grains) // 2
            along = vector[wall, axis]
            vector[wall] = 0.0
            vector[np.flatnonzero(wall), axis] = along
        return vector

    @property
    def resultant(self) -> np.ndarray:
        """(n + 6, 3) summed contact force on each grain, then on each wall, in N."""
        total = np.zeros((self.n_grains + 6, 3))
        force = self.force
        np.add.at(total, self.second, force)
        np.add.at(total, self.first, -force)
        return total

    @property
    def wall_stress(self) -> np.ndarray:
        """(3, 3) Cauchy stress from the wall forces in Pa, compression positive."""
        on_walls = self.resultant[self.n_grains :]
        axes = np.arange(6) // 2
        pressing = np.abs(on_walls[np.arange(6), axes])
        areas = self.volume / self.lengths
        return np.diag(0.5 * (pressing[0::2] + pressing[1::2]) / areas)

    @property
    def unbalanced_force(self) -> float:
        """Mean |resultant on a grain| over mean |contact force|; infinite without contacts."""
        size = np.linalg.norm(self.force, axis=1)
        if not size.any():
            return float("inf")
        return float(np.linalg.norm(self.resultant[: self.n_grains], axis=1).mean() / size.mean())
