"""The grains of a snapshot and the forces between them, seen from the side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.style import COLOURS, FAINT, RC, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rendulic.specimen.snapshot import Snapshot

__all__ = ["forces"]

WIDEST = 4.0  # points, of the largest force


def forces(snapshot: Snapshot, title: str = "") -> Figure:
    """Grains as circles, normal forces as lines as wide as they are large; seen along axis 3, axis 1 upward.

    Parameters
    ----------
    snapshot : Snapshot
        Of any engine.
    title : str
        Above.
    """
    figure = new_figure(5.0, 5.0)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        seen = snapshot.position[:, [1, 0]]
        circles = [mpl.patches.Circle(tuple(at), radius) for at, radius in zip(seen, snapshot.radius, strict=True)]
        axes.add_collection(mpl.collections.PatchCollection(circles, facecolor=FAINT, alpha=0.25, lw=0))
        start = snapshot.position[snapshot.first]
        lines = np.stack((start, start + snapshot.branch), axis=1)[:, :, [1, 0]]
        largest = float(snapshot.force_n.max(initial=0.0)) or 1.0
        width = WIDEST * snapshot.force_n / largest
        axes.add_collection(mpl.collections.LineCollection(list(lines), linewidths=width, colors=COLOURS[0], alpha=0.7))
        low, high = snapshot.wall_position[0::2], snapshot.wall_position[1::2]
        axes.set_xlim(low[1], high[1])
        axes.set_ylim(low[0], high[0])
        axes.set_aspect("equal")
        axes.set_xlabel("axis 2 [m]")
        axes.set_ylabel("axis 1 [m]")
        axes.set_title(title or f"{snapshot.n_grains} grains, {len(snapshot.first)} contacts", loc="left")
    return figure
