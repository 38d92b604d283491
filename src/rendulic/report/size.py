"""The size of the page: figures and tables of large studies are thinned out, and say so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from rendulic.report.figure import Figure, PageSection, Trace, embedded
from rendulic.views.view import Table

__all__ = ["LARGEST", "MOST_ROWS", "fitted"]

LARGEST = 8_500_000  # bytes of all figures' data; plotly.js takes 4.8 MB, and the page stays below 15 MB
MOST_ROWS = 4000  # of all tables together, none of which loses its first
AIM = 0.95  # of its room that a figure is thinned to: not all points take the same
LEAST_POINTS, LEAST_ROWS = 60, 50  # of a curve, of a table

Kept = TypeVar("Kept")


def fitted(sections: Sequence[PageSection], largest: int = LARGEST, most_rows: int = MOST_ROWS) -> list[PageSection]:
    """Sections whose figures together take no more than `largest` bytes, and whose tables have no more than `most_rows`.

    Small figures stay as they are; large ones get equal shares of the room. They lose points of their curves first, evenly,
    then families or frames that the reader chooses from. What was left out is said in the caption.
    """
    figures = [part for section in sections for part in section.parts if isinstance(part, Figure)]
    sizes = [len(embedded(figure.data())) for figure in figures]
    room = _share(sizes, largest)
    smaller = {
        figure.name: _thinned(figure, size, room / size) if size else figure
        for figure, size in zip(figures, sizes, strict=True)
    }
    rows = _share([len(part.rows) for each in sections for part in each.parts if isinstance(part, Table)], most_rows)
    return [
        replace(section, parts=[
            smaller[part.name] if isinstance(part, Figure) else _shortened(part, max(int(rows), LEAST_ROWS))
            for part in section.parts
        ])
        for section in sections
    ]  # fmt: skip


def _share(sizes: Sequence[int], room: int) -> float:
    """The largest size with which all, cut to it, find room.

    >>> _share([1, 2, 9, 9], 13)
    5.0
    """
    left = float(room)
    for k, size in enumerate(sorted(sizes)):
        each = left / (len(sizes) - k)
        if size > each:
            return each
        left -= size
    return float(max(sizes, default=0))


def _thinned(figure: Figure, size: int, share: float) -> Figure:
    """The figure in a share of its size."""
    if share >= 1.0:
        return figure
    share *= AIM
    least = LEAST_POINTS
    families = {label: {at: [_fewer(trace, share, least) for trace in traces] for at, traces in frames.items()}
                for label, frames in figure.families.items()}  # fmt: skip
    fewer = replace(figure, families=families)
    now = len(embedded(fewer.data()))
    said = [f"curves with every {_nth(1 / share)} point, but at least {least}"] if now < size else []
    if now > share * size:
        kept, words = _chosen(families, share * size / now)
        fewer = replace(fewer, families=kept, start=0 if figure.start >= 0 else -1)
        said += words
    told = f" To keep the page small it shows {', and '.join(said)}; the study's folder has all." if said else ""
    return replace(fewer, caption=fewer.caption + told)


def _nth(step: float) -> str:
    whole = int(np.ceil(step))
    return f"{whole}{ {1: 'st', 2: 'nd', 3: 'rd'}.get(whole % 10 if whole % 100 not in (11, 12, 13) else 0, 'th') }"


def _fewer(trace: Trace, share: float, least: int) -> Trace:
    """A trace with that share of its points, first and last ones among them; all of it if it is no plain row of points."""
    along: list = next((trace[name] for name in ("x", "r", "lon") if isinstance(trace.get(name), list)), [])
    count = len(along)
    if count <= least or None in along or any(name in trace for name in ("i", "j", "k", "z0", "surfacecolor")):
        return trace
    places = np.unique(np.linspace(0, count - 1, max(least, int(share * count))).round().astype(int)).tolist()

    def picked(value: Any) -> Any:
        if isinstance(value, list) and len(value) == count:
            return [value[place] for place in places]
        return {name: picked(own) for name, own in value.items()} if isinstance(value, dict) else value

    return {name: picked(value) for name, value in trace.items()}


def _chosen(
    families: Mapping[str, Mapping[str, Sequence[Trace]]], share: float
) -> tuple[dict[str, Mapping[str, Sequence[Trace]]], list[str]]:
    """Some of the families, evenly; where there are too few, some of the frames; where there are, some of the traces."""
    counts = len(families), max(len(frames) for frames in families.values())
    kept = _evenly(list(families.items()), share)
    said = [f"{len(kept)} of {counts[0]} sets"] if len(kept) < counts[0] else []
    share *= counts[0] / len(kept)
    if share >= 1.0:
        return dict(kept), said
    fewer = {label: dict(_evenly(list(frames.items()), share)) for label, frames in kept}
    most = max(len(frames) for frames in fewer.values())
    said += [f"{most} of {counts[1]} frames"] if most < counts[1] else []
    share *= counts[1] / most
    if share < 1.0:
        traces = max(len(own) for frames in fewer.values() for own in frames.values())
        few = {label: {at: _evenly(list(own), share) for at, own in frames.items()} for label, frames in fewer.items()}
        left = max(len(own) for frames in few.values() for own in frames.values())
        return dict(few), [*said, f"{left} of {traces} curves"]
    return dict(fewer), said


def _evenly(values: list[Kept], share: float) -> list[Kept]:
    """That share of a list, at least one, first and last ones among them if there are two."""
    count = min(max(int(share * len(values)), 1), len(values))
    return [values[place] for place in np.unique(np.linspace(0, len(values) - 1, count).round().astype(int))]


def _shortened(table: Table, most: int) -> Table:
    """The first rows of a table."""
    if len(table.rows) <= most:
        return table
    return replace(
        table, caption=f"{table.caption} (the first {most} of {len(table.rows)} rows; the study's folder has all)".strip(),
        rows=table.rows[:most], goes_to=table.goes_to[:most], marks=table.marks[:most],
    )  # fmt: skip
