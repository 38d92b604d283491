"""Grains and the forces between them, seen from the side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.views.view import View

if TYPE_CHECKING:
    from rendulic.specimen.snapshot import Snapshot

__all__ = ["ForcesView", "forces"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ForcesView(View):
    """One instant, seen along axis 3: first column axis 2, second axis 1, in m.

    Parameters
    ----------
    centre : (n, 2) array
        And
    radius : (n,) array
        of the grains.
    lines : (m, 2, 2) array
        Ends of the branches.
    force : (m,) array
        Normal forces in N.
    low, high : (2,) arrays
        Corners of what is shown.
    """

    centre: np.ndarray
    radius: np.ndarray
    lines: np.ndarray
    force: np.ndarray
    low: np.ndarray
    high: np.ndarray


def forces(snapshot: Snapshot, title: str = "") -> ForcesView:
    """The view of a snapshot of any engine."""
    start = snapshot.position[snapshot.first]
    lines = np.stack((start, start + snapshot.branch), axis=1)[:, :, [1, 0]]
    size = f"{snapshot.n_grains} grains, {len(snapshot.first)} contacts"
    return ForcesView(
        title=title or size, caption=f"{size}, seen along axis 3, axis 1 upward; lines are as wide as the normal forces are large.",
        centre=snapshot.position[:, [1, 0]], radius=snapshot.radius, lines=lines, force=snapshot.force_n,
        low=snapshot.wall_position[0::2][[1, 0]], high=snapshot.wall_position[1::2][[1, 0]],
    )  # fmt: skip
