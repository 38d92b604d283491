"""Interactive figures as plain data: what plotly.js draws, what the reader chooses, and what is said in words."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rendulic.views.view import Table

__all__ = ["Figure", "PageSection", "Trace", "categories", "embedded", "numbers", "sequence"]

Trace = dict[str, Any]
DIGITS = 5
# names of colours that the page's style sheet gives, one for light and one for dark
CATEGORIES = ("--c0", "--c1", "--c2", "--c3", "--c4", "--c5")
STEPS = 7
SYMBOLS = ("circle", "square", "diamond", "cross", "triangle-up", "x")


def categories(count: int) -> list[str]:
    """`count` colours for an unordered family, repeating after six."""
    return [CATEGORIES[k % len(CATEGORIES)] for k in range(count)]


def sequence(count: int) -> list[str]:
    """`count` colours for an ordered family; one alone has the last."""
    return [f"--s{round((STEPS - 1) * k / max(count - 1, 1))}" for k in (range(count) if count > 1 else (1,))]


def numbers(values: Any, digits: int = DIGITS) -> list:
    """Values as JSON has them, rounded to significant digits, None where they are not finite; of any shape.

    >>> numbers([1.23456789, float("nan")])
    [1.2346, None]
    """
    values = np.asarray(values)
    if values.ndim > 1:
        return [numbers(row, digits) for row in values]
    if values.dtype.kind in "iub":
        return values.tolist()
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values.tolist()]


def embedded(value: Any) -> str:
    """JSON that can stand within an HTML script element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@dataclass(frozen=True)
class Figure:
    """A figure, of which one family and one frame is shown at a time.

    Parameters
    ----------
    name : str
        Unique on the page.
    caption : str
        Below: what is shown, and the numbers that matter; the alternative for those who do not see it.
    families : dict of label to (dict of label to list of trace)
        Traces, as plotly.js takes them, of each frame of each family. Colours are names of the style sheet (`--c0`).
    layout : dict
        As plotly.js takes it, without colours.
    choice, slide : str
        What families and frames differ in; a list and a slider are shown where there are several.
    fixed : list of trace
        Behind all frames.
    start : int
        The frame that is shown first; from the end if negative.
    linked : str
        Figures with the same word, families and frames move together.
    """

    name: str
    caption: str
    families: Mapping[str, Mapping[str, Sequence[Trace]]]
    layout: Mapping[str, Any]
    choice: str = ""
    slide: str = ""
    fixed: Sequence[Trace] = ()
    start: int = 0
    linked: str = ""
    drawn_by: str = "plot"

    def data(self) -> dict[str, Any]:
        """What the page's script takes."""
        return {
            "families": [
                {"label": label, "frames": [{"label": at, "data": list(traces)} for at, traces in frames.items()]}
                for label, frames in self.families.items()
            ],
            "layout": dict(self.layout), "fixed": list(self.fixed), "start": self.start, "linked": self.linked,
            "choice": self.choice, "slide": self.slide, "drawn_by": self.drawn_by,
        }  # fmt: skip


@dataclass(frozen=True)
class PageSection:
    """A part of the page.

    Parameters
    ----------
    name, heading : str
        Its anchor and its title.
    text : list of str
        Paragraphs before its figures.
    parts : list of Figure or Table
        In order.
    """

    name: str
    heading: str
    text: Sequence[str] = ()
    parts: Sequence[Figure | Table] = field(default_factory=list)
