"""Failure in words and rows: predicted against observed, and where second-order work comes from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rendulic.micro.clustering import verdict_of
from rendulic.probing.burst import VERDICTS, judged
from rendulic.probing.edges import NEAR_EDGE

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["anatomy_text", "burst_rows", "burst_text"]


def burst_rows(tables: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """All tables of `rd.bursts` as one, dimensions `state` and `alpha`, verdicts in words."""
    import xarray as xr

    words = np.array(VERDICTS)
    named = [table.assign(verdict=("alpha", words[table.verdict.values])) for table in tables.values()]
    states = xr.DataArray(np.array(list(tables), dtype=object), dims="state", name="state")
    return xr.concat(named, states, join="outer", combine_attrs="drop")


def burst_text(tables: Mapping[str, xr.Dataset]) -> str:
    """Predicted against observed failure in Markdown: how many agree, the disagreements, every direction.

    Parameters
    ----------
    tables : mapping of state to xarray.Dataset
        From `rd.bursts`; the directions may differ.
    """
    heads = (
        "state", "W2 < 0, lasting", "of them fail", "W2 < 0 at first", "of them do not", "W2 > 0", "of them do not",
        "agree", "energy balance error",
    )  # fmt: skip
    lines = [
        "How many directions fail, and do not, for W2 negative from the size of the push to ten times it, for W2 negative "
        "at the size of the push only, and for W2 positive. Not counted are directions closer than "
        f"{NEAR_EDGE:g} degrees to an edge of a cone, and stable ones whose opposite is unstable: a burst moves either way "
        "along its line.",
        "",
        *_head(heads),
    ]
    total = np.zeros(6, dtype=int)
    for state, table in tables.items():
        agrees, counted = judged(table)
        lasting, negative = table.predicted.values, table.w2_normalised.values < 0.0
        of_each = [
            int((counted & which & right).sum())
            for which in (lasting, negative & ~lasting, ~negative)
            for right in (np.ones(len(agrees), dtype=bool), agrees)
        ]
        total += of_each
        error = f"{float(table.balance_error.max()):.0e}" if "balance_error" in table else ""
        lines.append(_row((state, *of_each, _share(of_each), error)))
    lines += [_row(("all", *total, _share(total), "")), "", *_disagreements(tables), "", *_every_direction(tables)]
    return "\n".join(lines) + "\n"


def _share(counts) -> str:
    return f"{sum(counts[1::2])} of {sum(counts[::2])}"


def _disagreements(tables: Mapping[str, xr.Dataset]) -> list[str]:
    lines = _head(
        (
            "state",
            "alpha",
            "R",
            "W2n",
            "lasting",
            "of the opposite",
            "observed",
            "energy grew by",
            "ran, in pushes",
            "not counted",
        )
    )
    count = len(lines)
    for state, table in tables.items():
        agrees, counted = judged(table)
        for k in np.flatnonzero(~agrees):
            one = table.isel(alpha=int(k))
            grew = f"{float(one.kinetic_growth):.0e}" if "kinetic_growth" in one else ""
            way = f"{float(one.travelled):.1f}" if "travelled" in one else ""
            reason = "" if counted[k] else "edge" if float(one.to_edge) <= NEAR_EDGE else "opposite is unstable"
            lines.append(
                _row((
                    state, f"{float(one.alpha):.4g}", f"{float(one.ratio):.2f}", f"{float(one.w2_normalised):+.2f}",
                    f"{float(one.w2_normalised_lasting):+.2f}", f"{float(one.w2_normalised_opposite):+.2f}", VERDICTS[int(one.verdict)], grew, way, reason,
                ))
            )  # fmt: skip
    return ["Against the prediction, counted or not:", "", *lines] if len(lines) > count else ["None disagrees."]


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
