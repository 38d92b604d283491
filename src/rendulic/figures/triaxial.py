"""Figures 1 and 2 of the paper: deviatoric stress and volume change against axial strain."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl

from rendulic.figures.style import COLOURS, INK, RC, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["deviatoric_stress", "volume_change"]


def deviatoric_stress(curve: xr.Dataset, states: xr.Dataset | None = None) -> Figure:
    """q against eps_1 (Fig. 1).

    Parameters
    ----------
    curve : xarray.Dataset
        From `load`, with `eps_1` and `q`.
    states : xarray.Dataset, optional
        States to mark, with the same variables.
    """
    return _against_strain(curve, states, "q", 1e-3, r"$q$  [kPa]")


def volume_change(curve: xr.Dataset, states: xr.Dataset | None = None) -> Figure:
    """Volume change `dV/V = -eps_v` against eps_1 (Fig. 2); contraction is negative, as in the paper."""
    return _against_strain(curve, states, "eps_v", -100.0, r"$\Delta V/V = -\varepsilon_v$  [%]")


def _against_strain(curve: xr.Dataset, states: xr.Dataset | None, name: str, scale: float, label: str) -> Figure:
    figure = new_figure()
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        axes.plot(100 * curve.eps_1, scale * curve[name], color=COLOURS[0])
        if states is not None:
            axes.plot(
                100 * states.eps_1, scale * states[name], "o", ms=4.5, mfc="white", mec=INK, mew=1.0,
                label="probed states, at rest",
            )  # fmt: skip
            for k in range(states.sizes["record"]):
                row = states.isel(record=k)
                axes.annotate(
                    rf"$\eta$ = {float(row.eta):.2f}", (100 * float(row.eps_1), scale * float(row[name])),
                    xytext=(6, -9 if name == "q" else 5), textcoords="offset points", fontsize=7, color=INK,
                )  # fmt: skip
            axes.legend(loc="lower right" if name == "q" else "upper right")
        axes.set_xlabel(r"axial strain $\varepsilon_1$  [%]")
        axes.set_ylabel(label)
        axes.grid(visible=True)
        axes.margins(x=0.02)
    return figure
