"""A view as a matplotlib figure, whatever view it is."""

from __future__ import annotations

from functools import singledispatch

from matplotlib.figure import Figure

from rendulic.foundation.errors import InvalidInput
from rendulic.views.view import View

__all__ = ["draw"]


@singledispatch
def draw(view: View) -> Figure:
    """The figure of a view; each file of this folder registers the views that it draws.

    Raises
    ------
    InvalidInput
        If no file of this folder draws it.
    """
    raise InvalidInput(
        f"nothing in rendulic.figures draws a {type(view).__name__}: register a function with @draw.register"
    )
