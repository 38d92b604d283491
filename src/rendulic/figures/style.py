"""One restrained style for every figure, and the saving of figures."""

from __future__ import annotations

import logging
import os
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

__all__ = ["COLOURS", "FAINT", "INK", "NEGATIVE", "categories", "new_figure", "save", "sequence"]

INK = "#222222"
FAINT = "#d8d8d8"
NEGATIVE = "#c1272d"
# Okabe and Ito's colours, told apart by colour-blind readers; dark ones first
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")

RC: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "xtick.color": INK,
    "ytick.color": INK,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "savefig.dpi": 200,
    "savefig.bbox": "tight",
    "figure.constrained_layout.use": True,
}


class HouseFigure(Figure):
    """A figure that notebooks show, whatever their backend."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        with mpl.rc_context(RC):
            self.savefig(picture, format="png", dpi=120)
        return picture.getvalue()


def new_figure(width: float = 4.6, height: float = 3.4) -> Figure:
    """An empty figure in the house style, sizes in inches; no display is needed."""
    with mpl.rc_context(RC):
        return HouseFigure(figsize=(width, height), layout="constrained")


def categories(count: int) -> list[str]:
    """`count` colours for an unordered family of curves, repeating after six."""
    return [COLOURS[k % len(COLOURS)] for k in range(count)]


def sequence(count: int) -> list:
    """`count` colours from light to dark, for an ordered family of curves; one alone is dark."""
    colour_map = mpl.colormaps["viridis_r"]
    return [colour_map(0.15 + 0.85 * k / max(count - 1, 1)) for k in (range(count) if count > 1 else (1,))]


def save(figure: Figure, folder: str | os.PathLike, name: str) -> list[Path]:
    """Write `name.png` and `name.pdf` into `folder`; return the paths."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    logging.getLogger("fontTools").setLevel(logging.ERROR)  # it remarks on the dates of fonts
    paths = [folder / f"{name}.{kind}" for kind in ("png", "pdf")]
    with mpl.rc_context(RC):
        for path in paths:
            figure.savefig(path)
    return paths
