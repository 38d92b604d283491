"""A view as a matplotlib figure, whatever view it is."""

from __future__ import annotations

from functools import cache, singledispatch
from importlib import import_module
from pkgutil import iter_modules

from matplotlib.figure import Figure

import rendulic.figures
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
    _load_all()
    if draw.dispatch(type(view)) is draw.dispatch(object):
        raise InvalidInput(
            f"nothing in rendulic.figures draws a {type(view).__name__}: register a function with @draw.register"
        )
    return draw(view)


@cache
def _load_all() -> None:
    for module in iter_modules(rendulic.figures.__path__):
        import_module(f"rendulic.figures.{module.name}")
