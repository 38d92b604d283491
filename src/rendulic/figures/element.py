"""Figure 7 of the paper: element tests, stress-strain, stress path and second-order work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.style import INK, NEGATIVE, RC, categories, new_figure
from rendulic.views.paths import TestsAlongPaths, tests_along_paths

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["element_tests", "label_panels"]


def element_tests(curves: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """q against eps_1, q against p', normalised W2 along the path, and eps_v where it changes.

    Parameters
    ----------
    curves : mapping of label to xarray.Dataset
        From `load`.
    title : str
        Above all.

    Notes
    -----
    Dots mark where the second-order work of the assembly vanishes.
    """
    return _tests(tests_along_paths(curves, title))


@draw.register(TestsAlongPaths)
def _tests(view: TestsAlongPaths) -> Figure:
    curves, swells = view.curves, view.swells
    figure = new_figure(7.2, 5.2) if swells else new_figure(9.6, 3.2)
    with mpl.rc_context(RC):
        panels = list(figure.subplots(*((2, 2) if swells else (1, 3))).flat)
        for colour, (label, curve) in zip(categories(len(curves)), curves.items(), strict=True):
            strain = 100 * curve.eps_1
            lost = curve.event_kind == "w2_lost" if "event_kind" in curve else slice(0)
            events: list[Any] = [
                curve[name].values[lost] if name in curve else [] for name in ("event_eps_1", "event_q", "event_p")
            ]
            at = [scale * np.asarray(values) for scale, values in zip((100, 1e-3, 1e-3), events, strict=True)]
            panels[0].plot(strain, 1e-3 * curve.q, color=colour, label=label)
            panels[1].plot(1e-3 * curve.p, 1e-3 * curve.q, color=colour)
            if "w2_normalised" in curve:
                panels[2].plot(strain, curve.w2_normalised, color=colour)
            for axes, x, y in (
                (panels[0], at[0], at[1]), (panels[1], at[2], at[1]), (panels[2], at[0], np.zeros(len(at[0]))),
            ):  # fmt: skip
                axes.plot(x, y, "o", ms=5, color=colour, mec=INK, mew=0.6, zorder=5)
            if swells:
                panels[3].plot(strain, 100 * curve.eps_v, color=colour)
        panels[0].plot([], [], "o", ms=5, mfc="white", mec=INK, label=r"$W_2 = 0$")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
        panels[2].axhline(0.0, color=NEGATIVE, lw=0.8, ls="--")
        label_panels(panels)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def label_panels(panels: Sequence[Axes]) -> None:
    """Name the axes of the panels of a test: q, stress path, W2n and, if there is a fourth, volume."""
    labels = (
        (r"axial strain $\varepsilon_1$  [%]", r"$q$  [kPa]"),
        (r"mean stress $p'$  [kPa]", r"$q$  [kPa]"),
        (r"axial strain $\varepsilon_1$  [%]", r"$W_{2n}$ along the path"),
        (r"axial strain $\varepsilon_1$  [%]", r"$\varepsilon_v$  [%] (contraction positive)"),
    )
    for axes, (x_label, y_label) in zip(panels, labels, strict=False):
        axes.set(xlabel=x_label, ylabel=y_label)
        axes.grid(visible=True)
    panels[1].set_xlim(left=0.0)
