"""Numbers of the readings, which of them are dropped and why, and the legs of a test."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.io.lab.rows import SHOWN, Rows

__all__ = ["MOST_DROPPED", "Readings", "legs_of", "one_way", "readings_of"]

MOST_DROPPED = 0.05  # of the readings: with more, the description is wrong rather than the file
GLITCH = 0.01  # of the strain gone through: what a reading may go back by and be dropped
FEWEST = 5  # readings of a leg


@dataclass
class Readings:
    """Columns of numbers, the line of each reading, and what was dropped.

    Parameters
    ----------
    lines : (n,) array
        In the file.
    columns : dict of (n,) arrays
        As they stand in the file.
    dropped : list of (int, str)
        Line and reason of each row that was left out.
    """

    lines: np.ndarray
    columns: dict[str, np.ndarray]
    dropped: list[tuple[int, str]] = field(default_factory=list)

    def part(self, keep: np.ndarray) -> Readings:
        """Some of the readings; what was dropped before is not told again."""
        return Readings(self.lines[keep], {name: values[keep] for name, values in self.columns.items()})


def readings_of(rows: Rows, headings: Mapping[str, str | int], decimal: str) -> Readings:
    """The numbers of all rows that have them.

    Rows before the first reading (units) and after the last (remarks) are dropped whatever their number; between them, no more
    than a twentieth.

    Raises
    ------
    InvalidInput
        If fewer than two are left, or too many are dropped: the first is named.
    """
    values = np.full((len(rows.entries), len(rows.places)), np.nan)
    wrong: dict[int, str] = {}
    for k, row in enumerate(rows.entries):
        for c, (name, place) in enumerate(rows.places.items()):
            text = row[place] if place < len(row) else ""
            values[k, c] = _number(text, decimal)
            if k not in wrong and not isfinite(values[k, c]):
                wrong[k] = (
                    f"column '{headings[name]}': expected a finite number, got {text[:SHOWN]!r}{_hint(text, decimal)}"
                )
        if rows.headings and k not in wrong and len(row) > len(rows.headings) and any(row[len(rows.headings) :]):
            wrong[k] = (
                f"has {len(row)} entries under {len(rows.headings)} headings: with decimal commas, the columns must be parted by "
                "another sign, and decimal=',' given"
            )
    good = np.array([k not in wrong for k in range(len(rows.entries))], dtype=bool)
    at = np.flatnonzero(good)
    if len(at) < 2:
        first = next(iter(wrong), None)
        told = "" if first is None else f"; line {rows.lines[first]}, {wrong[first]}"
        raise InvalidInput(f"{rows.path} has {len(at)} readings; a test has at least 2{told}")
    inside = [k for k in wrong if at[0] < k < at[-1]]
    if len(inside) > max(1.0, MOST_DROPPED * len(good)) or at[0] > max(3, MOST_DROPPED * len(good)):
        first = inside[0] if inside else next(iter(wrong))
        raise InvalidInput(
            f"{rows.path}, line {rows.lines[first]}, {wrong[first]}; {len(wrong)} of {len(good)} rows are like that, of which no "
            f"more than {100 * MOST_DROPPED:g} % are dropped"
        )
    dropped = [(line, "an empty row") for line in rows.empty] + [(rows.lines[k], told) for k, told in wrong.items()]
    columns = {name: values[good, c] for c, name in enumerate(rows.places)}
    return Readings(np.array(rows.lines)[good], columns, sorted(dropped))


def _number(text: str, decimal: str) -> float:
    other = "," if decimal == "." else "."
    try:
        return float("nan" if other in text or "_" in text else text.replace(decimal, "."))
    except ValueError:
        return float("nan")


def _hint(text: str, decimal: str) -> str:
    other = "," if decimal == "." else "."
    return f"; a decimal {'comma' if other == ',' else 'point'} needs decimal='{other}'" if other in text else ""


def one_way(strain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The most readings whose strain only rises, and how far each of the others is from where it would have to be.

    Returns
    -------
    keep : (n,) bool array
        The longest rising subsequence (patience sorting).
    off : (n,) array
        For the others, the distance of the strain from those of the nearest kept before and after; zero where it repeats.
    """
    tops: list[float] = []
    ends: list[int] = []
    before = np.full(len(strain), -1)
    for k, value in enumerate(strain.tolist()):
        at = bisect_left(tops, value)
        before[k] = ends[at - 1] if at else -1
        if at == len(tops):
            tops.append(value)
            ends.append(k)
        elif value < tops[at]:
            tops[at], ends[at] = value, k
    keep = np.zeros(len(strain), dtype=bool)
    k = ends[-1]
    while k >= 0:
        keep[k] = True
        k = int(before[k])
    kept = np.flatnonzero(keep)
    after = np.clip(np.searchsorted(kept, np.arange(len(strain))), 0, len(kept) - 1)
    low = strain[kept[np.maximum(after - 1, 0)]]
    high = strain[kept[after]]
    low, high = np.minimum(low, high), np.maximum(low, high)
    off = np.where(keep, 0.0, np.maximum(np.maximum(low - strain, strain - high), 0.0))
    return keep, off


def legs_of(strain: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of each stretch on which the strain goes one way, beyond its noise.

    A turn counts where the strain has gone back by more than a hundredth of what it went through since the turn before, and by
    more than its own scatter from reading to reading.
    """
    n = len(strain)
    if n < 3:
        return [(0, n - 1)]
    scatter = 3.0 * float(np.median(np.abs(np.diff(strain, 2)))) if n > 4 else 0.0
    turns, sense, far = [0], 0, 0
    low = high = 0
    for k in range(1, n):
        if sense == 0:
            low = k if strain[k] < strain[low] else low
            high = k if strain[k] > strain[high] else high
            span = strain[high] - strain[low]
            if span > scatter and span > 0.0:
                sense, far = (1, high) if high > low else (-1, low)
            continue
        if (strain[k] - strain[far]) * sense >= 0.0:
            far = k
            continue
        back = (strain[far] - strain[k]) * sense
        gone = abs(strain[far] - strain[turns[-1]])
        if back > max(GLITCH * gone, scatter) and k - far >= 2:
            turns.append(far)
            sense, far = -sense, k
    turns.append(n - 1)
    return [(begin, end) for begin, end in pairwise(turns) if end > begin]
