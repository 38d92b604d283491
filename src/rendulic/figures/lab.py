"""A measured test, with matplotlib: stress-strain, stress path, and second-order work along it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.element import label_panels
from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure
from rendulic.views import path_work as view_of
from rendulic.views.path_work import PathWork

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["path_work"]


def path_work(measured: xr.Dataset, along: xr.Dataset, title: str = "") -> Figure:
    """q against eps_1, q against p', normalised W2 along the path, and eps_v where it changes.

    Parameters
    ----------
    measured : xarray.Dataset
        From `rd.io.read_triaxial`.
    along : xarray.Dataset
        From `rd.w2_along` of it.
    title : str
        Above all.

    Notes
    -----
    Grey dots are readings, lines what was fitted. A dot marks where W2 turns negative, its bar how sure that is; the band
    about W2 is two standard deviations of noise.
    """
    return _path_work(view_of.path_work(measured, along, title))


@draw.register(PathWork)
def _path_work(view: PathWork) -> Figure:
    measured, along, drained = view.measured, view.along, view.swells
    figure = new_figure(7.2, 5.2) if drained else new_figure(9.6, 3.2)
    with mpl.rc_context(RC):
        panels = list(figure.subplots(*((2, 2) if drained else (1, 3))).flat)
        strain, within = 100 * along.eps_1, 100 * float(along.instability_within)
        at = {name: float(along[f"instability_{name}"]) for name in ("eps_1", "p", "q")}
        shown = [("eps_1", 100, "q", 1e-3), ("p", 1e-3, "q", 1e-3), ("eps_1", 100, "eps_v", 100)]
        places = [panels[0], panels[1], *panels[3:]]
        for axes, (x, x_scale, y, y_scale) in zip(places, shown, strict=False):
            readings = axes.plot(x_scale * measured[x], y_scale * measured[y], ".", ms=3, color=FAINT)[0]
            fit = axes.plot(x_scale * along[x], y_scale * along[y], color=COLOURS[0])[0]
            readings.set_label("readings")
            fit.set_label("fitted")
        panels[2].fill_between(strain, *view.band, color=COLOURS[0], alpha=0.25, lw=0)
        panels[2].plot(strain, along.w2_normalised, color=COLOURS[0])
        panels[2].axhline(0.0, color=NEGATIVE, lw=0.8, ls="--")
        panels[2].set_ylim(-1.05, 1.05)
        if np.isfinite(at["eps_1"]):
            for axes, abscissa, ordinate, bar in (
                (panels[0], 100 * at["eps_1"], 1e-3 * at["q"], within),
                (panels[1], 1e-3 * at["p"], 1e-3 * at["q"], None),
                (panels[2], 100 * at["eps_1"], 0.0, within),
            ):
                axes.errorbar(
                    abscissa, ordinate, xerr=bar, fmt="o", ms=5, color=NEGATIVE, mec=INK, mew=0.6, capsize=2, zorder=5,
                    label=r"$W_2$ turns negative",
                )  # fmt: skip
        panels[0].legend(loc="best")
        label_panels(panels)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure
