"""Grains, walls and contacts at one instant: all that an analysis needs, from any engine."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.notebooks import Shown
from rendulic.specimen.recorded import Recorded
from rendulic.specimen.unbalanced import unbalanced_ratio

__all__ = ["Snapshot", "as_snapshot"]


@dataclass(frozen=True)
class Snapshot(Shown):
    """One instant of a packing in a box, each axis between two walls or periodic; for analysis only.

    Parameters
    ----------
    position : (n, 3) array
        Centres of the grains in m. Grains of any shape: the theory needs forces, branches and positions only.
    radius : (n,) array
        Radii in m (only for pictures; of a sphere as large as the grain if it is none).
    wall_position : (6,) array
        Coordinates of the walls, or of the faces of the periodic cell, in m, in the order 1-, 1+, 2-, 2+, 3-, 3+.
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
    image : (n_contacts, 3) int array or None
        For periodic axes: `second` is its image that many cells on. None: no axis is periodic.
    recorded : Recorded or None
        What the engine itself says of this state; only audits use it.
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
    image: np.ndarray | None = None
    recorded: Recorded | None = None

    def _facts(self) -> dict[str, object]:
        return {
            "grains": self.n_grains,
            "contacts": f"{len(self.first)}, {int(self.is_wall.sum())} of them with walls",
            "lengths": ", ".join(f"{length:.5g}" for length in self.lengths) + " m",
            "stress on the walls": ", ".join(f"{value / 1e3:.4g}" for value in np.diag(self.wall_stress)) + " kPa",
            "sliding": f"{int(self.is_sliding.sum())} contacts" if self.friction is not None else "unknown",
            "unbalanced force": f"{self.unbalanced_force:.1e}",
        }

    @property
    def is_periodic(self) -> bool:
        """Whether contacts can go across the faces of the box."""
        return self.image is not None

    @property
    def across(self) -> np.ndarray:
        """(n_contacts, 3) cells between `second` and its image; zeros if no axis is periodic."""
        return np.zeros((len(self.first), 3), dtype=np.int64) if self.image is None else self.image

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
        """(n_contacts, 3) from `first` to `second` or its image in m; for a wall from the centre to its plane."""
        vector = self.body_position[self.second] - self.position[self.first] + self.across * self.lengths
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
        """(3, 3) principal Cauchy stress from the forces on walls and across periodic faces, in Pa, compression positive.

        Walls that are pulled inward, by grains that stick to them, count as tension.
        """
        on_walls = self.resultant[self.n_grains :]
        axes = np.arange(6) // 2
        outward = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
        pressing = outward * on_walls[np.arange(6), axes]
        across = (self.force * self.across).sum(axis=0)
        areas = self.volume / self.lengths
        return np.diag((0.5 * (pressing[0::2] + pressing[1::2]) + across) / areas)

    def following(self, before: Snapshot) -> Snapshot:
        """This snapshot with every grain in the copy of the cell that is nearest to where it was before.

        Engines put grains that leave a periodic cell back on its other side; then positions jump by a cell. Branches,
        forces and stress are unchanged.

        Parameters
        ----------
        before : Snapshot
            Of the same grains, less than half a cell earlier.
        """
        if self.image is None:
            return self
        part = (self.position - self.wall_position[0::2]) / self.lengths
        part_before = (before.position - before.wall_position[0::2]) / before.lengths
        cells = np.round(part_before - part).astype(np.int64)
        shift = np.concatenate((cells, np.zeros((6, 3), dtype=np.int64)))
        return replace(
            self,
            position=self.position + cells * self.lengths,
            image=self.image - shift[self.second] + shift[self.first],
        )

    def with_axial(self, axis: int) -> Snapshot:
        """This snapshot with another of its axes, 0, 1 or 2, as axis 1 (axial); the others follow in cyclic order."""
        order = np.roll(np.arange(3), -axis)
        face = self.second - self.n_grains
        turned = self.n_grains + 2 * ((face // 2 - axis) % 3) + face % 2
        return replace(
            self,
            position=self.position[:, order],
            wall_position=self.wall_position.reshape(3, 2)[order].reshape(-1),
            second=np.where(self.is_wall, turned, self.second),
            normal=self.normal[:, order],
            force_t=self.force_t[:, order],
            image=None if self.image is None else self.image[:, order],
            recorded=None if self.recorded is None else self.recorded.with_axes(order),
        )

    def with_pairs_merged(self) -> Snapshot:
        """This snapshot with one contact per pair of bodies, and per image in periodic boxes.

        Clumps and other grains that are not convex touch at several points. Second-order work needs their summed force
        only, because it is conjugate to the displacements of the centres; the normal becomes that of the summed
        normal forces, weighted by their size. Order: by first, then second.
        """
        key = np.column_stack((self.first, self.second, self.across))
        pairs, of_pair = np.unique(key, axis=0, return_inverse=True)
        of_pair = of_pair.reshape(-1)  # a column in NumPy 2.0
        if len(pairs) == len(key):
            return self
        force, pressing = np.zeros((len(pairs), 3)), np.zeros((len(pairs), 3))
        np.add.at(force, of_pair, self.force)
        size = np.abs(self.force_n)
        weight = size + (1e-15 * size.max() or 1.0)  # where there is no normal force, the mean of the normals
        np.add.at(pressing, of_pair, weight[:, None] * self.normal)
        normal = pressing / np.linalg.norm(pressing, axis=1)[:, None]
        force_n = (force * normal).sum(axis=1)
        return replace(
            self,
            first=pairs[:, 0],
            second=pairs[:, 1],
            normal=normal,
            force_n=force_n,
            force_t=force - force_n[:, None] * normal,
            image=None if self.image is None else pairs[:, 2:],
            recorded=replace(self.recorded or Recorded(), n_merged=len(key) - len(pairs)),
        )

    @property
    def unbalanced_force(self) -> float:
        """Mean |resultant on a grain| over mean |contact force|; infinite without contacts."""
        size = np.linalg.norm(self.force, axis=1)
        return unbalanced_ratio(self.resultant[: self.n_grains], float(size.sum()), len(size))


def as_snapshot(state: object) -> Snapshot:
    """A snapshot as it is, or that of a specimen of grains as it is now.

    Raises
    ------
    InvalidInput
        If it is neither.
    """
    if isinstance(state, Snapshot):
        return state
    take = getattr(state, "snapshot", None)
    if callable(take) and isinstance(taken := take(), Snapshot):
        return taken
    raise InvalidInput(
        f"expected a Snapshot (of rd.io.read, or sample.snapshot()) or a specimen of grains, got {type(state).__name__}"
    )
