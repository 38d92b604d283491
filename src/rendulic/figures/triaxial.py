"""Deviatoric stress and volume change against axial strain (Figs. 1 and 2 of the paper), with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl

from rendulic.figures.draw import draw
from rendulic.figures.style import INK, RC, categories, new_figure
from rendulic.views.loading import LoadingCurves, StateMark, loading_curves

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["deviatoric_stress", "volume_change"]

GREY = "#777777"


def deviatoric_stress(curve: xr.Dataset, states: xr.Dataset | None = None) -> Figure:
    """q against eps_1 (Fig. 1).

    Parameters
    ----------
    curve : xarray.Dataset
        From `load`, with `eps_1` and `q`.
    states : xarray.Dataset, optional
        States to mark, dimension `record`, with `eta`, `eps_1`, `q`, `eps_v`.
    """
    return _loading(loading_curves({"": curve}, {"": _marks(states)}, "q"))


def volume_change(curve: xr.Dataset, states: xr.Dataset | None = None) -> Figure:
    """Volume change `dV/V = -eps_v` against eps_1 (Fig. 2); contraction is negative, as in the paper."""
    return _loading(loading_curves({"": curve}, {"": _marks(states)}, "eps_v"))


def _marks(states: xr.Dataset | None) -> list[StateMark]:
    if states is None:
        return []
    rows = [states.isel(record=k) for k in range(states.sizes["record"])]
    return [StateMark(float(row.eta), float(row.eps_1), float(row.q), float(row.eps_v)) for row in rows]


@draw.register(LoadingCurves)
def _loading(view: LoadingCurves) -> Figure:
    of_q = view.quantity == "q"
    scale = 1e-3 if of_q else -100.0
    figure = new_figure()
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        marked = False
        faint = [one for one in view.curves if one.is_faint]
        for one in faint:
            own = scale * (one.q if of_q else one.eps_v)
            axes.plot(
                100 * one.eps_1,
                own,
                color=GREY,
                lw=0.5,
                alpha=0.5,
                label="single packings" if one is faint[0] else None,
            )
        full = [one for one in view.curves if not one.is_faint]
        for colour, one in zip(categories(len(full)), full, strict=True):
            if one.bands is not None:
                low, high = one.bands[0 if of_q else 1]
                axes.fill_between(100 * one.eps_1, scale * low, scale * high, color=colour, alpha=0.3, lw=0)
            axes.plot(100 * one.eps_1, scale * (one.q if of_q else one.eps_v), color=colour, label=one.label or None)
            for mark in one.marks:
                at = (100 * mark.eps_1, scale * (mark.q if of_q else mark.eps_v))
                axes.plot(*at, "o", ms=4.5, mfc="white", mec=INK, mew=1.0, label=None if marked else "states at rest")
                marked = True
                if len(full) == 1:
                    axes.annotate(
                        rf"$\eta$ = {mark.eta:.2f}", at, xytext=(6, -9 if of_q else 5), textcoords="offset points",
                        fontsize=7, color=INK,
                    )  # fmt: skip
        if marked or len(view.curves) > 1:
            axes.legend(loc="lower right" if of_q else "upper right")
        axes.set_xlabel(r"axial strain $\varepsilon_1$  [%]")
        axes.set_ylabel(r"$q$  [kPa]" if of_q else r"$\Delta V/V = -\varepsilon_v$  [%]")
        axes.set_title(view.title, loc="left")
        axes.grid(visible=True)
        axes.margins(x=0.02)
    return figure
