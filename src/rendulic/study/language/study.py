"""What a study is: specimens with their states, what is measured there, figures; all of it checked."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from pydantic import Field, create_model, model_validator

from rendulic.foundation.validation import Positive, Section
from rendulic.study.specimens.union import AnySpecimen
from rendulic.study.tasks.measurement import Measurement, measurements
from rendulic.study.values import MOST, different

__all__ = ["Figures", "Study"]


class Figures(Section):
    """What is drawn when all that it needs is there, and written under names that people know."""

    draw: tuple[str, ...] = Field(
        (), max_length=100, description="names of figures; the reference of TOML files has all"
    )
    diagram_norm: Positive | None = Field(
        None, description="size of the probes in Figs. 3 and 4; the smallest of the set if not given"
    )
    tables: bool = Field(
        True, strict=True, description="whether to write states and tables of all units as files of their own"
    )

    @model_validator(mode="after")
    def _different_names(self) -> Figures:
        different(self.draw)
        return self


class _StudyBase(Section):
    """Specimens, their states, what is measured there, and figures."""

    title: str = Field("", max_length=200, description="for people")
    specimen: tuple[AnySpecimen, ...] = Field((), max_length=MOST, description="[[specimen]] tables")
    figures: Figures = Figures()

    def sets(self, table: str) -> dict[str, Any]:
        """The sets of a table by name, in their order."""
        return {each.name: each for each in getattr(self, table)}

    def measurements(self) -> Iterator[Measurement]:
        """All sets of all tables, those that need others after them."""
        for table in measurements():
            yield from getattr(self, table)

    @model_validator(mode="after")
    def _hangs_together(self) -> _StudyBase:
        if not self.specimen and not any(True for _ in self.measurements()):
            raise ValueError("there is nothing to do: give at least one [[specimen]]")
        for what in ("specimen", *measurements()):
            _own_names(what, (each.name for each in getattr(self, what)))
        for specimen in self.specimen:
            specimen.check()
        for each in self.measurements():
            each.check(self)
        norm, sets = self.figures.diagram_norm, self.sets("probes").values()
        if norm is not None and not any(norm in each.norms for each in sets):
            raise ValueError(f"figures: diagram_norm = {norm:g} must be one of the norms of the probes that are drawn")
        return self


if TYPE_CHECKING:

    class Study(_StudyBase):
        """Specimens, their states, what is measured there, and figures."""

        def __getattr__(self, table: str) -> Any: ...

else:
    Study = create_model(
        "Study",
        __base__=_StudyBase,
        __module__=__name__,
        __doc__=_StudyBase.__doc__,
        **{
            table: (tuple[kind, ...], Field((), max_length=MOST, description=f"[[{table}]] tables"))
            for table, kind in measurements().items()
        },
    )


def _own_names(what: str, names: Iterable[str]) -> None:
    names = [name.lower() for name in names]
    if len(set(names)) < len(names):
        raise ValueError(f"[[{what}]]: each needs a name of its own, got {', '.join(names)}")
