"""A measured test, with matplotlib: stress-strain, stress path, and second-order work along it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl

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
    Grey dots are readings, lines what was fitted. Dots mark where W2 turns negative (full) and positive again (open), their
    bars how sure that is; the band about W2 is two standard deviations of noise.
    """
    return _path_work(view_of.path_work(measured, along, title))


@draw.register(PathWork)
def _path_work(view: PathWork) -> Figure:
    measured, along, drained = view.measured, view.along, view.swells
    figure = new_figure(7.2, 5.2) if drained else new_figure(9.6, 3.2)
    with mpl.rc_context(RC):
        panels = list(figure.subplots(*((2, 2) if drained else (1, 3))).flat)
        strain = 100 * along.eps_1
        shown = [("eps_1", 100, "q", 1e-3), ("p", 1e-3, "q", 1e-3), ("eps_1", 100, "eps_v", 100)]
        places = [panels[0], panels[1], *panels[3:]]
        for axes, (x, x_scale, y, y_scale) in zip(places, shown, strict=False):
            if x == "p" and not view.is_effective:
                axes.text(
                    0.5, 0.5, "total stresses: no stress path", ha="center", va="center", transform=axes.transAxes
                )
                axes.set_axis_off()
                continue
            readings = axes.plot(x_scale * measured[x], y_scale * measured[y], ".", ms=3, color=FAINT)[0]
            fit = axes.plot(x_scale * along[x], y_scale * along[y], color=COLOURS[0])[0]
            readings.set_label("readings")
            fit.set_label("fitted")
        panels[2].fill_between(strain, *view.band, color=COLOURS[0], alpha=0.25, lw=0)
        panels[2].plot(strain, along.w2_normalised, color=COLOURS[0])
        panels[2].axhline(0.0, color=NEGATIVE, lw=0.8, ls="--")
        panels[2].set_ylim(-1.05, 1.05)
        for begin, end in view.stretches:
            for axes in (panels[0], *panels[2:]):
                axes.axvspan(100 * begin, 100 * end, color=NEGATIVE, alpha=0.08, lw=0)
        named: set[bool] = set()
        for edge in view.edges:
            label = r"$W_2$ turns negative" if edge.falls else r"$W_2$ turns positive"
            for axes, abscissa, ordinate, bar in (
                (panels[0], 100 * edge.eps_1, 1e-3 * edge.q, 100 * edge.error),
                (panels[1], 1e-3 * edge.p, 1e-3 * edge.q, None),
                (panels[2], 100 * edge.eps_1, 0.0, 100 * edge.error),
            ):
                if axes is panels[1] and not view.is_effective:
                    continue
                axes.errorbar(
                    abscissa, ordinate, xerr=bar, fmt="o", ms=5, color=NEGATIVE, mec=INK, mew=0.6, capsize=2, zorder=5,
                    mfc=NEGATIVE if edge.falls else "white", label="" if edge.falls in named else label,
                )  # fmt: skip
            named.add(edge.falls)
        panels[0].legend(loc="best")
        label_panels(panels)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure
