"""The figures of a study by name: what each needs, and its views."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules
from typing import TYPE_CHECKING

import rendulic.views
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.views.view import View

if TYPE_CHECKING:
    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["StudyFigure", "catalogue", "check_figures", "units_for"]


@dataclass(frozen=True)
class StudyFigure:
    """A kind of figure that a study can ask for.

    A file of `rendulic.views` lists those that it makes in `STUDY_FIGURES`; so does a module that another package names as
    an entry point of the group `rendulic.views`.

    Parameters
    ----------
    name : str
        In `[figures] draw`, and of its file.
    shows : str
        In a few words, for the help.
    lacks : str
        What a study must have: "a [[cones]] set".
    needs : callable
        From a plan the units that it is drawn from; none where the study has not what it needs.
    views : callable
        From the finished results of a study its views by the name of their file.
    families : callable, optional
        The same for the report, which shows all that is finished: views by the words that the reader chooses from. `views`
        by their titles, if not given.
    in_report_only : bool
        Whether it is nothing that a picture shows: tables, or what is turned with the mouse.
    """

    name: str
    shows: str
    lacks: str
    needs: Callable[[Plan], list[Unit]]
    views: Callable[[Results], Mapping[str, View]]
    families: Callable[[Results], Mapping[str, View]] | None = None
    in_report_only: bool = False

    def shown(self, results: Results) -> Mapping[str, View]:
        """What the report shows, by the words that the reader chooses from."""
        if self.families is not None:
            return self.families(results)
        return {view.title or stem: view for stem, view in self.views(results).items()}


@cache
def catalogue() -> dict[str, StudyFigure]:
    """All figures that a study can ask for, by name."""
    modules = [import_module(f"rendulic.views.{found.name}") for found in iter_modules(rendulic.views.__path__)]
    modules += [point.load() for point in entry_points(group="rendulic.views")]
    found = {figure.name: figure for module in modules for figure in getattr(module, "STUDY_FIGURES", ())}
    return dict(sorted(found.items()))


def units_for(plan: Plan, names: Iterable[str]) -> list[Unit]:
    """The units that these figures are drawn from."""
    return [unit for name in names for unit in catalogue()[one_of(name, catalogue(), "figure")].needs(plan)]


def check_figures(plan: Plan, names: Iterable[str]) -> None:
    """Raise `InvalidInput` if a figure is unknown or of the report only, or the study has not what it needs."""
    for name in names:
        figure = catalogue()[one_of(name, catalogue(), "figure")]
        if figure.in_report_only:
            raise InvalidInput(f"figures: {name} is shown by rendulic report only: leave it out")
        if not figure.needs(plan):
            raise InvalidInput(f"figures: {name} needs {figure.lacks}, and the study has none")
