"""Clustering of negative second-order work beside its controls, with matplotlib."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, INK, NEGATIVE, RC, new_figure
from rendulic.probing.anatomy_controls import CONTROLS, ClusterControls
from rendulic.views.anatomy_controls import COMPARED, ControlsView, controls_view

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["cluster_controls"]

MARKS = ("o", "s", "D", "^")
APART = 0.14  # of the way from one state to the next


def cluster_controls(controls: Mapping[str, ClusterControls], title: str = "") -> Figure:
    """Moran's I in the direction studied and in three controls, and what each control leaves.

    Parameters
    ----------
    controls : mapping of label to ClusterControls
        From `rd.cluster_controls`, by state.
    title : str
        Above.
    """
    return _controls(controls_view(controls, title))


@draw.register(ControlsView)
def _controls(view: ControlsView) -> Figure:
    places = np.arange(len(view.controls))
    colours = (NEGATIVE, *COLOURS[:3])
    figure = new_figure(9.0, 3.6)
    with mpl.rc_context(RC):
        index, left = figure.subplots(1, 2)
        for k, (name, mark, colour) in enumerate(zip(COMPARED, MARKS, colours, strict=True)):
            index.plot(places + APART * (k - 1.5), view.index_of(name), mark, color=colour, ms=5, label=name)
        for k, (name, mark, colour) in enumerate(zip(CONTROLS, MARKS[1:], colours[1:], strict=True)):
            value, low, high = view.left_by(name).T
            left.errorbar(
                places + APART * (k - 1),
                value,
                [value - low, high - value],
                fmt=mark,
                color=colour,
                ms=5,
                lw=1.0,
                capsize=3,
            )
        for axes in (index, left):
            axes.axhline(0.0, color=INK, lw=0.6)
            axes.set_xticks(places, list(view.controls))
            axes.set_xlim(-0.5, len(places) - 0.5)
        index.set_ylabel("Moran's I beyond a grain")
        left.set_ylabel("I in the direction studied less control")
        figure.legend(*index.get_legend_handles_labels(), loc="outside lower center", ncols=len(COMPARED))
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure
