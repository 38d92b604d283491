"""Circular diagrams of the normalised second-order work (Fig. 3 of the paper), with matplotlib."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.style import FAINT, INK, NEGATIVE, RC, new_figure, sequence
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION
from rendulic.views import circular
from rendulic.views.circular import CENTRE, CircularDiagram, CircularPanels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["circular_diagram", "circular_diagrams", "circular_panels"]

PAPER = -0.5  # W2n at the centre of the paper's diagrams
GREY = "#777777"


def circular_diagram(probes: Mapping[str, xr.Dataset], title: str = "", paper: bool = False) -> Figure:
    """`W2n` around the Rendulic plane, one closed curve per state.

    Parameters
    ----------
    probes : mapping of label to xarray.Dataset
        From `rd.probe` or `rd.ensemble_response` at one norm, directions all around, in the order to be drawn.
    title : str
        Above the diagram.
    paper : bool
        Whether the centre is at W2n = -0.5, as in the paper, instead of -1. Smaller values are then drawn at the centre,
        and the figure says so.

    Notes
    -----
    Inside the dashed circle the second-order work is negative. Values whose sign is not sure are open dots.
    """
    return _diagram(circular.circular_diagram(probes, title), PAPER if paper else CENTRE)


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
    return _panels(circular.circular_panels(panels, title, columns))


@draw.register(CircularDiagram)
def _diagram(view: CircularDiagram, centre: float = CENTRE) -> Figure:
    figure = new_figure(5.4, 4.2)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        _draw(axes, view, centre)
        axes.set_title(view.title, loc="left")
        axes.legend(loc="upper left", bbox_to_anchor=(0.95, 1.0), title=r"$W_{2n}$ outwards", alignment="left")
    return figure


@draw.register(CircularPanels)
def _panels(view: CircularPanels) -> Figure:
    rows = -(-len(view.panels) // view.columns)
    shared = len({tuple(one.label for one in panel.curves) for panel in view.panels.values()}) == 1
    figure = new_figure((3.1 if shared else 4.1) * view.columns + 0.9 * shared, 3.1 * rows + 0.4)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, view.columns, squeeze=False)
        for axes, (heading, panel) in zip(grid.flat, view.panels.items(), strict=False):
            _draw(axes, panel, CENTRE)
            axes.set_title(heading)
            if not shared:
                axes.legend(loc="upper left", bbox_to_anchor=(0.98, 1.0))
        for axes in list(grid.flat)[len(view.panels) :]:
            axes.set_axis_off()
        if shared:
            grid[0, min(view.columns, len(view.panels)) - 1].legend(loc="upper left", bbox_to_anchor=(1.08, 1.0))
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _around(alpha: np.ndarray, work: np.ndarray, centre: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of a diagram; what is below the centre is drawn there."""
    radius, angle = np.maximum(work, centre) - centre, np.radians(alpha)
    return radius * np.cos(angle), radius * np.sin(angle)


def _closed(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.append(x, x[0]), np.append(y, y[0])


def _draw(axes: Axes, view: CircularDiagram, centre: float) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    zero, rim = -centre, 1.0 - centre
    axes.fill(zero * np.cos(turn), zero * np.sin(turn), color=NEGATIVE, alpha=0.07, lw=0)
    axes.plot(zero * np.cos(turn), zero * np.sin(turn), "--", color=NEGATIVE, lw=1.0, label=r"$W_{2n} = 0$")
    axes.plot(rim * np.cos(turn), rim * np.sin(turn), color=FAINT, lw=0.6)
    for angle, label in (
        (ISOTROPIC_COMPRESSION, "isotropic"),
        (90.0, r"$d\varepsilon_1$ (axial)"),
        (ISOCHORIC_COMPRESSION, "isochoric"),
    ):
        x, y = rim * np.cos(np.radians(angle)), rim * np.sin(np.radians(angle))
        axes.plot([0, x], [0, y], color=FAINT, lw=0.6)
        side = "left" if x > 0.1 else "right" if x < -0.1 else "center"
        axes.annotate(label, (1.03 * x, 1.03 * y), fontsize=7, color=GREY, ha=side)
    axes.plot([-rim, rim], [0, 0], color=INK, lw=0.5)
    axes.plot([0, 0], [-rim, rim], color=INK, lw=0.5)
    axes.annotate(r"$\sqrt{2}\,d\varepsilon_3$", (1.03 * rim, -0.03), fontsize=7, color=GREY)
    for value in (-0.5, 0.0, 0.5, 1.0):
        if value > centre:
            axes.annotate(
                f"{value:g}".replace("-", "\N{MINUS SIGN}"), (0.02, centre - value), fontsize=6, color=GREY, va="center"
            )
    clipped = 0
    for colour, one in zip(sequence(len(view.curves)), view.curves, strict=True):
        clipped += int((one.w2_normalised < centre).sum())
        x, y = _around(one.alpha, one.w2_normalised, centre)
        for k, single in enumerate(one.single if len(view.curves) == 1 else ()):
            axes.plot(
                *_closed(*_around(one.alpha, single, centre)),
                color=GREY,
                lw=0.5,
                alpha=0.45,
                label=None if k else "single packings",
            )
        if one.band is not None:
            low, high = (_closed(*_around(one.alpha, bound, centre)) for bound in one.band)
            ring = [np.append(outer, inner[::-1]) for outer, inner in zip(high, low, strict=True)]
            axes.fill(*ring, color=colour, alpha=0.3, lw=0)
        axes.plot(*_closed(x, y), color=colour, lw=1.2, label=one.label)
        sure = one.is_significant
        axes.plot(x[sure], y[sure], ".", color=colour, ms=4 if len(x) <= 72 else 1.5)
        axes.plot(x[~sure], y[~sure], "o", mfc="white", mec=colour, ms=4)
    if clipped:
        words = f"{clipped} {'value' if clipped == 1 else 'values'} below {centre:g} drawn at the centre"
        axes.annotate(
            words.replace("-", "\N{MINUS SIGN}"),
            (0.5, 0.0),
            xycoords="axes fraction",
            fontsize=7,
            color=NEGATIVE,
            ha="center",
        )
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-1.13 * rim, 1.13 * rim)
    axes.set_ylim(-1.07 * rim, 1.13 * rim)
