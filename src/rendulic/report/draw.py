"""Views as figures of the page: a file of this folder registers each kind of view that it draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, TypeVar

import rendulic.report
from rendulic.report.figure import Figure
from rendulic.views.view import Table, View

__all__ = ["caption_of", "drawn", "interactive"]

Family = Mapping[str, Any]  # views of one kind, by the words that the reader chooses from
Renderer = Callable[[str, Family], Figure]
Function = TypeVar("Function", bound=Renderer)
MOST_TABLES = 12  # of one figure; more are in the files beside the figures

_renderers: dict[type[View], Renderer] = {}


def interactive(kind: type[View]) -> Callable[[Function], Function]:
    """Register a function as the one that draws views of a kind.

    It takes the name of the figure on the page and the views, and returns the `Figure`.
    """

    def register(function: Function) -> Function:
        _renderers[kind] = function
        return function

    return register


@cache
def _all() -> dict[type[View], Renderer]:
    for module in iter_modules(rendulic.report.__path__):
        import_module(f"rendulic.report.{module.name}")
    return _renderers


def drawn(name: str, views: Mapping[str, View]) -> list[Figure | Table]:
    """The figures and tables of a study figure's views; views that nothing here draws have their tables only."""
    parts: list[Figure | Table] = []
    for kind in dict.fromkeys(type(view) for view in views.values()):
        family = {label: view for label, view in views.items() if type(view) is kind}
        differ_in = "set"
        if kind in _all():
            figure = _all()[kind](name if not parts else f"{name}-{kind.__name__.lower()}", family)
            parts.append(figure)
            differ_in = figure.choice.lower() or differ_in
        parts += _tables(family, differ_in)
    return parts


def caption_of(views: Mapping[str, View]) -> str:
    """What is shown; the title before it where there is one view, for then the reader has nothing to choose from."""
    first = next(iter(views.values()))
    return f"{first.title}. {first.caption}" if first.title and len(views) == 1 else first.caption


def _tables(family: Mapping[str, View], differ_in: str) -> list[Table]:
    """Tables of the same heads as one, with a column that says which view a row is of; `differ_in` is its head."""
    together: dict[tuple[str, ...], list[tuple[str, Table]]] = {}
    for label, view in family.items():
        for table in view.tables:
            together.setdefault((table.caption, *table.heads), []).append((label, table))
    made = []
    for tables in list(together.values())[:MOST_TABLES]:
        first = tables[0][1]
        if len(tables) == 1:
            made.append(first)
            continue
        made.append(Table(
            first.caption, (first.heads[0], differ_in, *first.heads[1:]),
            [(row[0], label, *row[1:]) for label, table in tables for row in table.rows],
            goes_to=[state for _, table in tables for state in table.goes_to],
            marks=[mark for _, table in tables for mark in table.marks],
            marked=first.marked + 1, filter_by=differ_in if len(tables) > 2 else first.filter_by,
        ))  # fmt: skip
    return made
