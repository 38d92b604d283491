"""Failure in words and rows: predicted against observed, and where second-order work comes from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rendulic.micro.clustering import verdict_of
from rendulic.probing.burst import VERDICTS, agreement

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["anatomy_text", "burst_rows", "burst_text"]

MARGIN = 5.0  # degrees from an edge within which a direction is not counted


def burst_rows(tables: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """All tables of `rd.bursts` as one, dimensions `state` and `alpha`, verdicts in words."""
    import pandas as pd
    import xarray as xr

    words = np.array(VERDICTS)
    named = [table.assign(verdict=("alpha", words[table.verdict.values])) for table in tables.values()]
    return xr.concat(named, pd.Index(list(tables), name="state"), join="outer", combine_attrs="drop")


def burst_text(tables: Mapping[str, xr.Dataset]) -> str:
    """Predicted against observed failure in Markdown: how many agree, the disagreements, every direction.

    Parameters
    ----------
    tables : mapping of state to xarray.Dataset
        From `rd.bursts`; the directions may differ.
    """
    heads = ("state", "predicted", "failed", "counted", "agree", "largest error of the books")
    lines = [f"Directions within {MARGIN:g} degrees of an edge are not counted.", "", *_head(heads)]
    total = np.zeros(2, dtype=int)
    for state, table in tables.items():
        agreeing, counted = agreement(table, MARGIN)
        total += agreeing, counted
        error = f"{float(table.balance_error.max()):.0e}" if "balance_error" in table else ""
        failed, predicted = int(table.observed.sum()), int(table.predicted.sum())
        lines.append(_row((state, predicted, failed, counted, agreeing, error)))
    lines += [_row(("all", "", "", total[1], total[0], "")), "", *_disagreements(tables), "", *_every_direction(tables)]
    return "\n".join(lines) + "\n"


def _disagreements(tables: Mapping[str, xr.Dataset]) -> list[str]:
    lines = _head(("state", "alpha", "R", "W2n", "observed", "energy grew by", "strain, in pushes", "to an edge"))
    count = len(lines)
    for state, table in tables.items():
        undecided = table.verdict.values == VERDICTS.index("undecided")
        for k in np.flatnonzero((table.predicted.values != table.observed.values) | undecided):
            one = table.isel(alpha=int(k))
            grew = f"{float(one.kinetic_growth):.1e}" if "kinetic_growth" in one else ""
            way = f"{float(one.travelled):.1f}" if "travelled" in one else ""
            lines.append(
                _row((
                    state, f"{float(one.alpha):g}", f"{float(one.ratio):.2f}", f"{float(one.w2_normalised):+.3f}",
                    VERDICTS[int(one.verdict)], grew, way, f"{float(one.to_edge):.0f}",
                ))
            )  # fmt: skip
    return ["Against the prediction, near edges or not:", "", *lines] if len(lines) > count else ["None disagrees."]


def _every_direction(tables: Mapping[str, xr.Dataset]) -> list[str]:
    """One row for each direction, one column for each state."""
    numbers = {state: str(k + 1) for k, state in enumerate(tables)}
    lines = ["Every direction: W2n of the probe, and what was observed. The states are", ""]
    lines += [f"{number}. {state}" for state, number in numbers.items()]
    lines += ["", *_head(("alpha", "R", *numbers.values()))]
    rows: dict[float, dict[str, xr.Dataset]] = {}
    for state, table in tables.items():
        for k, alpha in enumerate(table.alpha.values.tolist()):
            rows.setdefault(alpha, {})[state] = table.isel(alpha=k)
    for alpha, here in sorted(rows.items()):
        cells = [f"{alpha:.4g}", f"{float(next(iter(here.values())).ratio):.2f}"]
        for state in tables:
            cells.append(_outcome(here[state]) if state in here else "")
        lines.append(_row(cells))
    return lines


def _outcome(one: xr.Dataset) -> str:
    word = VERDICTS[int(one.verdict)]
    return f"{float(one.w2_normalised):+.2f} {f'**{word}**' if word == 'fails' else word}"


def anatomy_text(probes: Mapping[str, xr.Dataset]) -> str:
    """Where the second-order work of each state's most unstable direction comes from, in Markdown.

    Parameters
    ----------
    probes : mapping of state to xarray.Dataset
        From `rd.probe(..., anatomy=True)` at one norm.
    """
    heads = (
        "state", "alpha", "W2n", "negative contacts", "negative / positive work", "carriers of half",
        "of it sliding", "I of carriers", "z", "carriers are", "I of all negative", "all negative are",
        "coordination", "without rattlers", "fabric",
    )  # fmt: skip
    lines = _head(heads)
    for state, data in probes.items():
        one = data.isel(alpha=int(np.nanargmin(data.w2_normalised.values)))
        carry, every = one.sel(which="carriers"), one.sel(which="negative")
        before = one.sel(instant="before")
        lines.append(
            _row((
                state, f"{float(one.alpha):g}", f"{float(one.w2_normalised):+.3f}",
                f"{100 * float(one.negative_contacts):.0f} %", f"{float(one.negative_over_positive):.2f}",
                f"{100 * float(one.carriers):.1f} %",
                f"{100 * float(one.w2_negative_sliding / one.w2_negative):.0f} %",
                f"{float(carry.cluster_index):.3f}", f"{float(carry.cluster_score):.1f}",
                verdict_of(float(carry.cluster_score)), f"{float(every.cluster_index):.3f}",
                verdict_of(float(every.cluster_score)), f"{float(before.coordination):.2f}",
                f"{float(before.mechanical_coordination):.2f}", f"{float(before.fabric_anisotropy):+.2f}",
            ))
        )  # fmt: skip
    return "\n".join(lines) + "\n"


def _head(names) -> list[str]:
    return [_row(names), _row(["---"] * len(names))]


def _row(cells) -> str:
    return f"| {' | '.join(str(cell) for cell in cells)} |"
