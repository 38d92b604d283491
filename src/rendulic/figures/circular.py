"""Figure 3 of the paper: circular diagrams of the normalised second-order work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.style import FAINT, INK, NEGATIVE, RC, new_figure, sequence
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["circular_diagram", "circular_diagrams", "circular_panels"]

SHIFT = 0.5  # K of the paper: the polar radius is W2n + K, the dashed circle r = K


def circular_diagram(probes: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """`W2n + K` around the Rendulic plane, one closed curve per state.

    Parameters
    ----------
    probes : mapping of label to xarray.Dataset
        From `rd.probe` at one norm, directions all around, in the order to be drawn.
    title : str
        Above the diagram.

    Notes
    -----
    Inside the dashed circle the second-order work is negative. Values whose sign does not exceed
    the drift of the null probe are drawn as open dots. Radii below zero (W2n < -K) are drawn at
    the centre.
    """
    figure = new_figure(5.4, 4.2)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        _draw(axes, probes)
        axes.set_title(title, loc="left")
        axes.legend(loc="upper left", bbox_to_anchor=(0.93, 1.0), title=r"polar radius $W_{2n}+0.5$", alignment="left")
    return figure


def circular_diagrams(probes: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """One circular diagram for every norm of a sweep, side by side.

    Parameters
    ----------
    probes : mapping of label to xarray.Dataset
        From `rd.probe` with a sequence of norms, the same for all.
    title : str
        Above the row.
    """
    norms = next(iter(probes.values())).norm.values
    panels = {
        rf"$\|d\varepsilon\|$ = {norm:g}": {label: data.sel(norm=norm) for label, data in probes.items()}
        for norm in norms
    }
    return circular_panels(panels, title, columns=len(norms))


def circular_panels(panels: Mapping[str, Mapping[str, xr.Dataset]], title: str = "", columns: int = 2) -> Figure:
    """Circular diagrams side by side, each with its heading and its own family of states.

    Parameters
    ----------
    panels : mapping of heading to mapping of label to xarray.Dataset
        As for `circular_diagram`.
    title : str
        Above all.
    columns : int
        Diagrams in a row.
    """
    rows = -(-len(panels) // columns)
    shared = len({tuple(probes) for probes in panels.values()}) == 1
    figure = new_figure((3.1 if shared else 4.1) * columns + 0.9 * shared, 3.1 * rows + 0.4)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes, (heading, probes) in zip(grid.flat, panels.items(), strict=False):
            _draw(axes, probes)
            axes.set_title(heading)
            if not shared:
                axes.legend(loc="upper left", bbox_to_anchor=(0.98, 1.0))
        for axes in list(grid.flat)[len(panels) :]:
            axes.set_axis_off()
        if shared:
            grid[0, -1].legend(loc="upper left", bbox_to_anchor=(1.08, 1.0))
        figure.suptitle(title, x=0.02, ha="left")
    return figure


def _draw(axes: Axes, probes: Mapping[str, xr.Dataset]) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    full = 1.0 + SHIFT
    axes.fill(SHIFT * np.cos(turn), SHIFT * np.sin(turn), color=NEGATIVE, alpha=0.07, lw=0)
    axes.plot(SHIFT * np.cos(turn), SHIFT * np.sin(turn), "--", color=NEGATIVE, lw=1.0, label=r"$W_{2n} = 0$")
    axes.plot(full * np.cos(turn), full * np.sin(turn), color=FAINT, lw=0.6)
    for angle, label in (
        (ISOTROPIC_COMPRESSION, "isotropic"),
        (90.0, r"$d\varepsilon_1$ (axial)"),
        (ISOCHORIC_COMPRESSION, "isochoric"),
    ):
        x, y = full * np.cos(np.radians(angle)), full * np.sin(np.radians(angle))
        axes.plot([0, x], [0, y], color=FAINT, lw=0.6)
        side = "left" if x > 0.1 else "right" if x < -0.1 else "center"
        axes.annotate(label, (1.03 * x, 1.03 * y), fontsize=7, color="#777777", ha=side)
    axes.plot([-full, full], [0, 0], color=INK, lw=0.5)
    axes.plot([0, 0], [-full, full], color=INK, lw=0.5)
    axes.annotate(r"$\sqrt{2}\,d\varepsilon_3$", (1.03 * full, -0.03), fontsize=7, color="#777777")
    for colour, (label, data) in zip(sequence(len(probes)), probes.items(), strict=True):
        order = np.argsort(data.alpha.values)
        alpha = np.radians(data.alpha.values[order])
        radius = np.maximum(data.w2_normalised.values[order] + SHIFT, 0.0)
        x, y = radius * np.cos(alpha), radius * np.sin(alpha)
        axes.plot(np.append(x, x[0]), np.append(y, y[0]), color=colour, lw=1.2, label=label)
        sure = data.is_significant.values[order]
        axes.plot(x[sure], y[sure], ".", color=colour, ms=4 if len(x) <= 72 else 1.5)
        axes.plot(x[~sure], y[~sure], "o", mfc="white", mec=colour, ms=4)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-1.7, 1.7)
    axes.set_ylim(-1.6, 1.7)
