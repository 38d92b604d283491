"""The cone in three dimensions: second-order work over the sphere of principal increments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap

from rendulic.figures.draw import draw
from rendulic.figures.style import FAINT, INK, NEGATIVE, RC, new_figure
from rendulic.tensors.increment_sphere import DEVIATORIC_AXES, equal_area
from rendulic.tensors.rendulic_plane import AXIAL_COMPRESSION, ISOCHORIC_COMPRESSION, increment_along
from rendulic.views.sphere import OnSphere, on_sphere

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["stereogram"]

LEVELS = np.linspace(-1.0, 1.0, 21)
# negative red as everywhere, positive light enough to read words on
COLOUR_MAP = ListedColormap(np.vstack((
    mpl.colormaps["Reds_r"](np.linspace(0.1, 0.9, 10)), mpl.colormaps["Blues"](np.linspace(0.05, 0.6, 10))
)))  # fmt: skip


def stereogram(probes: xr.Dataset, title: str = "") -> Figure:
    """Equal-area maps of the normalised second-order work: contractant increments left, dilatant ones right.

    Parameters
    ----------
    probes : xarray.Dataset
        From `rd.probe` with `rd.directions.sphere`, at one norm.
    title : str
        Above the maps; the share of the sphere that is unstable is added.

    Raises
    ------
    InvalidInput
        If the probes do not cover the sphere.

    Notes
    -----
    The rim of both maps is the same circle of isochoric increments. The red line is W2 = 0, as far as the
    directions resolve it; dots are the directions probed.
    """
    return _on_sphere(on_sphere(probes, title))


@draw.register(OnSphere)
def _on_sphere(view: OnSphere) -> Figure:
    unit, work, title = view.unit, view.w2_normalised, view.title
    figure = new_figure(7.4, 4.0)
    with mpl.rc_context(RC):
        panels = figure.subplots(1, 2)
        for axes, expansion in zip(panels, (False, True), strict=True):
            filled = _map(axes, unit, work, expansion)
        bar = figure.colorbar(filled, ax=list(panels), shrink=0.75, ticks=[-1.0, -0.5, 0.0, 0.5, 1.0])
        bar.set_label(r"$W_{2n}$")
        figure.suptitle(
            f"{title}{': ' if title else ''}{view.negative_share:.1%} of all directions unstable", x=0.02, ha="left"
        )
    return figure


def _map(axes: Axes, unit: np.ndarray, work: np.ndarray, expansion: bool):
    up = unit @ np.array(DEVIATORIC_AXES[2]) * (-1.0 if expansion else 1.0)
    near = up > -0.35  # a strip beyond the rim, so that the map reaches it
    x, y = equal_area(unit[near], expansion=expansion).T
    rim = mpl.patches.Circle((0.0, 0.0), 1.0, transform=axes.transData)
    filled = axes.tricontourf(x, y, work[near], LEVELS, cmap=COLOUR_MAP)
    filled.set_clip_path(rim)
    if (work[near] < 0.0).any() and (work[near] > 0.0).any():
        axes.tricontour(x, y, work[near], [0.0], colors=NEGATIVE, linewidths=1.6).set_clip_path(rim)
    inside = up >= 0.0
    dots = equal_area(unit[inside], expansion=expansion)
    axes.plot(dots[:, 0], dots[:, 1], ".", color=INK, ms=1.2, alpha=0.5)
    circle = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(np.cos(circle), np.sin(circle), color=INK, lw=0.8)
    axes.plot([0.0, 0.0], [-1.0, 1.0], color=FAINT, lw=0.8)
    for name, alpha, offset in (
        ("undrained\ncompression", ISOCHORIC_COMPRESSION, (0, 5)),
        ("undrained\nextension", ISOCHORIC_COMPRESSION + 180.0, (0, -5)),
        ("isotropic", None, (7, 0)),
        ("axial compression", AXIAL_COMPRESSION, (7, 0)),
        ("axial extension", AXIAL_COMPRESSION + 180.0, (7, 0)),
    ):
        pole = np.array(DEVIATORIC_AXES[2]) * (-1.0 if expansion else 1.0)
        where = pole if alpha is None else increment_along(alpha)
        if where @ pole < -1e-9:
            continue
        spot = equal_area(where, expansion=expansion)
        axes.plot(*spot, "o", color=INK, ms=3.5, mfc="white", zorder=3)
        vertical = "bottom" if offset[1] > 0 else "top" if offset[1] < 0 else "center"
        axes.annotate(
            name, (float(spot[0]), float(spot[1])), xytext=offset, textcoords="offset points", fontsize=7, va=vertical,
            ha="left" if offset[0] else "center",
        )  # fmt: skip
    axes.set_title("dilatant" if expansion else "contractant", loc="left")
    axes.set_aspect("equal")
    axes.set_xlim(-1.08, 1.08)
    axes.set_ylim(-1.25, 1.25)
    axes.axis("off")
    return filled
