"""Figure 3 of the paper: circular diagrams of the normalised second-order work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.style import INK, NEGATIVE, RC, new_figure, sequence
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["circular_diagram"]

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
    figure = new_figure(5.2, 4.9)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        turn = np.linspace(0.0, 2.0 * np.pi, 361)
        axes.fill(SHIFT * np.cos(turn), SHIFT * np.sin(turn), color=NEGATIVE, alpha=0.07, lw=0)
        axes.plot(SHIFT * np.cos(turn), SHIFT * np.sin(turn), "--", color=NEGATIVE, lw=1.0, label=r"$W_{2n} = 0$")
        full = 1.0 + SHIFT
        axes.plot(full * np.cos(turn), full * np.sin(turn), color="#d8d8d8", lw=0.6)
        for angle, label in ((ISOTROPIC_COMPRESSION, "isotropic"), (90.0, "axial"), (ISOCHORIC_COMPRESSION, "isochoric")):
            away = np.radians(angle)
            axes.plot([0, full * np.cos(away)], [0, full * np.sin(away)], color="#d8d8d8", lw=0.6)
            axes.annotate(
                label, (1.04 * full * np.cos(away), 1.04 * full * np.sin(away)), fontsize=7, color="#777777",
                ha="left" if np.cos(away) > 0.1 else "right" if np.cos(away) < -0.1 else "center",
            )  # fmt: skip
        for colour, (label, data) in zip(sequence(len(probes)), probes.items(), strict=True):
            order = np.argsort(data.alpha.values)
            alpha = np.radians(data.alpha.values[order])
            w2n = data.w2_normalised.values[order]
            radius = np.maximum(w2n + SHIFT, 0.0)
            x, y = radius * np.cos(alpha), radius * np.sin(alpha)
            axes.plot(np.append(x, x[0]), np.append(y, y[0]), color=colour, label=label)
            sure = data.is_significant.values[order]
            axes.plot(x[sure], y[sure], ".", color=colour, ms=4)
            axes.plot(x[~sure], y[~sure], "o", mfc="white", mec=colour, ms=4)
        axes.axhline(0.0, color=INK, lw=0.5)
        axes.axvline(0.0, color=INK, lw=0.5)
        axes.set_aspect("equal")
        axes.set_xlim(-1.75, 1.75)
        axes.set_ylim(-1.65, 1.7)
        axes.set_xlabel(r"$\sqrt{2}\,d\varepsilon_3$ direction,  polar radius $W_{2n} + 0.5$")
        axes.set_ylabel(r"$d\varepsilon_1$ direction")
        axes.set_title(title)
        figure.legend(loc="outside right upper")
    return figure
