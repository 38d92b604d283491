"""The grains of a snapshot and the forces between them, with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, FAINT, RC, new_figure
from rendulic.views import forces as view_of
from rendulic.views.forces import ForcesView

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
    return _forces(view_of.forces(snapshot, title))


@draw.register(ForcesView)
def _forces(view: ForcesView) -> Figure:
    figure = new_figure(5.0, 5.0)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        circles = [mpl.patches.Circle(tuple(at), radius) for at, radius in zip(view.centre, view.radius, strict=True)]
        axes.add_collection(mpl.collections.PatchCollection(circles, facecolor=FAINT, alpha=0.25, lw=0))
        width = WIDEST * view.force / (float(view.force.max(initial=0.0)) or 1.0)
        axes.add_collection(
            mpl.collections.LineCollection(list(view.lines), linewidths=width, colors=COLOURS[0], alpha=0.7)
        )
        axes.set_xlim(view.low[0], view.high[0])
        axes.set_ylim(view.low[1], view.high[1])
        axes.set_aspect("equal")
        axes.set_xlabel("axis 2 [m]")
        axes.set_ylabel("axis 1 [m]")
        axes.set_title(view.title, loc="left")
    return figure
