"""Where second-order work comes from, in words and rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rendulic.micro.clustering import verdict_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["anatomy_text"]


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
