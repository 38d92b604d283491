"""The page itself: sections of what is there, in one file that needs nothing else."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rendulic import __version__
from rendulic.foundation.whole_file import whole_file
from rendulic.report.draw import drawn
from rendulic.report.figure import Figure, PageSection, embedded
from rendulic.report.size import fitted
from rendulic.study.execution.campaign import results_in
from rendulic.study.results import Results
from rendulic.views.catalogue import catalogue
from rendulic.views.view import verdicts

__all__ = ["CURVES", "NAME", "SECTIONS", "render", "sections", "write_report"]

NAME = "report.html"


@dataclass(frozen=True)
class Chapter:
    """A section of the page: figures of the catalogue that it shows, in order."""

    name: str
    heading: str
    figures: tuple[str, ...]


# the answer first; every figure that is in none of these comes under "others"
SECTIONS = (
    Chapter("cones", "Unstable directions", ("ensemble", "sizes", "cones", "amplitude", "map")),
    Chapter(
        "directions", "Second-order work by direction", ("fig3", "side_by_side", "fig4", "sphere", "stress_probes")
    ),
    Chapter("bursts", "Bursts: predicted and observed failure", ("bursts",)),
    Chapter("trust", "How far to trust it", ("trust",)),
    Chapter("loading", "Loading", ("fig1",)),
    Chapter("tests", "Tests", ("elements", "fig9", "fig6")),
    Chapter("anatomy", "Where in the grains", ("anatomy", "specimen")),
    Chapter("run", "What was done", ("run",)),
    Chapter("missing", "What is missing", ("missing",)),
)
LEFT_OUT = ("fig2", "fig7", "fig10", "fig3_model")  # shown by others of the page already
MOST_VERDICTS = 8  # of one figure
CURVES = ("loading", "directions", "cones", "tests")  # sections of the page of a running study


def write_report(folder: str | os.PathLike, path: str | os.PathLike | None = None) -> Path:
    """Write the report of a study as one HTML file that needs no other and no network, and return its path.

    Parameters
    ----------
    folder : path
        Of a study, see `rendulic run`; what is not finished is left out, and said to be missing.
    path : path, optional
        `report.html` in the folder if not given.

    Raises
    ------
    InvalidInput
        If the folder holds no study that this version reads, or the file cannot be written.
    CorruptFile
        If a finished result is damaged.
    """
    path = Path(folder) / NAME if path is None else Path(path)
    text = render(results_in(folder))
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def sections(results: Results, names: tuple[str, ...] | None = None) -> list[PageSection]:
    """Sections that the finished results fill; those of these names only, if some are given."""
    return [section for chapter in _chapters() if names is None or chapter.name in names
            if (section := _section(chapter, results)) is not None]  # fmt: skip


def _chapters() -> Iterator[Chapter]:
    yield from SECTIONS
    placed = {name for chapter in SECTIONS for name in chapter.figures} | set(LEFT_OUT)
    if others := tuple(name for name in catalogue() if name not in placed):
        yield Chapter("others", "More", others)


def _section(chapter: Chapter, results: Results) -> PageSection | None:
    parts: list[Any] = []
    words: list[str] = []
    for name in chapter.figures:
        if name in catalogue() and (views := catalogue()[name].shown(results)):
            parts += drawn(name, views)
            said = verdicts(views.items())
            words += said[:MOST_VERDICTS]
            if len(said) > MOST_VERDICTS:
                words.append(f"And {len(said) - MOST_VERDICTS} more of this kind: see the table.")
    return PageSection(chapter.name, chapter.heading, list(dict.fromkeys(words)), parts) if parts or words else None


def render(results: Results) -> str:
    """The page as text."""
    from plotly.offline import get_plotlyjs

    shown = fitted(sections(results))
    return template("report.html").render(
        title=results.study.title or results.store.folder.resolve().name,
        version=__version__,
        sections=shown,
        figures={part.name: embedded(part.data()) for each in shown for part in each.parts if isinstance(part, Figure)},
        is_figure=lambda part: isinstance(part, Figure),
        done=len(results.done & set(results.wanted)),
        total=len(results.wanted),
        plotly=get_plotlyjs(),
    )


def template(name: str) -> Any:
    """One of the page's templates; what comes from a study is escaped in it."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("rendulic.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    ).get_template(name)
