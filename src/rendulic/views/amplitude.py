"""Cones against the size of the probes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.probing.amplitude import amplitude_table
from rendulic.views.catalogue import StudyFigure
from rendulic.views.sectors import MARKS, Sector, Track, direction_range, give_work
from rendulic.views.view import Mark, Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.ids import SampleId
    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "Amplitude", "Sizes", "amplitude", "sectors_in", "sweeps", "unknown_in"]

CAPTION = (
    "Smallest normalised second-order work W2n (above) and edges of the unstable sectors of strain (below) against the "
    "size of the probes. Grey, above: the error of W2n; the sign of an open dot is not sure, and an edge without a bar of "
    "uncertainty could be made by the error alone. Grey and dotted, below: directions whose sign is unknown. Blue: the plateau, "
    "the sizes at which the smallest W2n hardly depends on the size."
)


@dataclass(frozen=True, eq=False)
class Sizes:
    """One state at all sizes.

    Parameters
    ----------
    track : Track
        Along the norm of the probes.
    plateau : (float, float) or None
        Its first and last norm.
    found : str
        The plateau in words, or why there is none.
    """

    track: Track
    plateau: tuple[float, float] | None
    found: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Amplitude(View):
    """States side by side; directions in sight from `low` to `high` degrees.

    Parameters
    ----------
    quantity : str
        What the norm is of, with its unit.
    """

    columns: tuple[Sizes, ...]
    quantity: str
    low: float
    high: float


def amplitude(tables: Mapping[str, xr.Dataset], title: str = "") -> Amplitude:
    """Smallest W2n and edges against the size of the probes, state by state.

    Parameters
    ----------
    tables : mapping of label to xarray.Dataset
        From `rd.cones_by_amplitude`, all of one kind of probes.
    title : str
        Above.

    Raises
    ------
    InvalidInput
        If a table has no norms, or some are of strain and some of stress probes.
    """
    for label, table in tables.items():
        if "norm" not in table.dims or "is_plateau" not in table:
            raise InvalidInput(f"a figure of amplitudes needs tables of rd.cones_by_amplitude, {label!r} is none")
    kinds = sorted({str(table.attrs["kind"]) for table in tables.values()})
    if len(kinds) != 1:
        raise InvalidInput(
            f"a figure of amplitudes needs tables of one kind of probes, got {' and '.join(kinds) or 'none'}"
        )
    columns = tuple(_column(label, table) for label, table in tables.items())
    low, high = direction_range(sector for one in columns for sector in one.track.every)
    even = [one.track.label for one in columns if one.plateau]
    return Amplitude(
        title=title,
        caption=CAPTION,
        verdict=f"A plateau of sizes: {', '.join(even) or 'in no state'}.",
        tables=(_plateaus(columns), _table(columns)),
        columns=columns,
        quantity=f"norm of the {kinds[0]} increment{' [Pa]' if kinds[0] == 'stress' else ''}",
        low=low,
        high=high,
    )


def sectors_in(table: xr.Dataset) -> tuple[Sector, ...]:
    """The sectors of one state of a table of cones, the widest first."""
    names = ("edge_from", "edge_to", "edge_from_uncertainty", "edge_to_uncertainty")
    rows = np.column_stack([np.atleast_1d(table[name].values) for name in names])
    return tuple(Sector(*row) for row in rows.tolist() if np.isfinite(row[0]))


def unknown_in(table: xr.Dataset) -> tuple[Sector, ...]:
    """The sectors of unknown sign of one state of a table of cones, the widest first."""
    rows = np.column_stack([np.atleast_1d(table[name].values) for name in ("unknown_from", "unknown_to")])
    return tuple(Sector(first, last, np.nan, np.nan) for first, last in rows.tolist() if np.isfinite(first))


def _column(label: str, table: xr.Dataset) -> Sizes:
    norm = table.norm.values
    track = Track(
        label,
        norm,
        tuple(sectors_in(table.isel(norm=k)) for k in range(len(norm))),
        tuple(unknown_in(table.isel(norm=k)) for k in range(len(norm))),
        table.smallest_w2n.values,
        table.is_significant.values,
        table.smallest_error.values,
    )
    there = bool(table.is_plateau.any())
    plateau = (float(table.plateau_from), float(table.plateau_to)) if there else None
    return Sizes(track, plateau, str(table.attrs["plateau_verdict"]))


def _plateaus(columns: tuple[Sizes, ...]) -> Table:
    rows = [(one.track.label, one.found) for one in columns]
    return Table("Sizes at which the smallest W2n hardly depends on the size", ("state", "plateau"), rows)


def _table(columns: tuple[Sizes, ...]) -> Table:
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    for track in (one.track for one in columns):
        for k, (norm, verdict) in enumerate(zip(track.at, track.verdicts, strict=True)):
            spans, open_ones = ("; ".join(map(str, which[k])) or "none" for which in (track.sectors, track.unknown))
            work = give_work(track.smallest[k], track.error[k])
            rows.append((track.label, f"{norm:g}", verdict, work, spans, open_ones))
            marks.append(MARKS[verdict])
    heads = ("state", "norm", "answer", "smallest W2n", "unstable from … to", "unknown from … to")
    return Table("Cones by the size of the probes", heads, rows, marks=marks, marked=2)


def sweeps(results: Results) -> dict[str, View]:
    """Cones against the size of the probes, of every sample that has cones of several sizes."""
    sets = results.sets("cones")
    tables: dict[SampleId, dict[str, xr.Dataset]] = {}
    for (name, state), probed in results.of("cones").items():
        if state is not None and len(sets[name].sizes) > 1:
            tables.setdefault(state.sample, {}).setdefault(str(state), amplitude_table(probed))
    return {
        f"amplitude_{sample.folder}": amplitude(own, f"{sample}, {results.about(sample)}")
        for sample, own in tables.items()
    }


def _needs(plan: Plan) -> list[Unit]:
    sets = plan.study.sets("cones")
    return [unit for (name, _), units in plan.of("cones").items() if len(sets[name].sizes) > 1 for unit in units]


STUDY_FIGURES = (
    StudyFigure(
        "amplitude", "cones against the size of the probes", "a [[cones]] set with several norms", _needs, sweeps
    ),
)
