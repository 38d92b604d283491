"""The cone of a mean response: its sectors, how sure their edges are, and where it is sure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["MeanCone", "MeanSector", "mean_cone", "negative_sectors"]

Span = tuple[float, float]


@dataclass(frozen=True)
class MeanSector:
    """A sector in which W2 of the mean response is negative; directions in degrees, counter-clockwise.

    Parameters
    ----------
    first, last : float
        Its edges, `first` in [0, 360), `last` beyond it.
    first_interval, last_interval : (float, float)
        Of each edge, the outer end first for `first` and last for `last`. NaN as inner end: there may be no such edge, as
        no direction of the sector is sure. NaN as outer end: nowhere outside is W2 surely positive.
    share : float
        Share of the resamples that have a negative direction in this sector.
    """

    first: float
    last: float
    first_interval: Span
    last_interval: Span
    share: float


@dataclass(frozen=True)
class MeanCone:
    """Sectors of the mean, those that are sure (upper bound negative), and those that may be (lower bound negative)."""

    sectors: tuple[MeanSector, ...]
    sure: tuple[Span, ...]
    possible: tuple[Span, ...]

    @property
    def openings(self) -> tuple[float, float, float]:
        """Degrees in all: of the mean, of what is sure, of what may be."""
        own = [(one.first, one.last) for one in self.sectors]
        return tuple(sum(last - first for first, last in spans) for spans in (own, self.sure, self.possible))  # type: ignore[return-value]


def negative_sectors(alpha: np.ndarray, value: np.ndarray) -> tuple[Span, ...]:
    """Sectors in which a quantity is negative, linear between neighbouring directions all around.

    >>> negative_sectors(np.array([0.0, 90.0, 180.0, 270.0]), np.array([1.0, 1.0, -1.0, 1.0]))
    ((135.0, 225.0),)
    """
    negative = value < 0.0
    if negative.all():
        return ((0.0, 360.0),)
    count = len(alpha)
    gaps = (np.roll(alpha, -1) - alpha) % 360.0
    found = []
    for before in np.flatnonzero(~negative & np.roll(negative, -1)):
        run = 1
        while negative[(before + run + 1) % count]:
            run += 1
        end, after = (before + run) % count, (before + run + 1) % count
        first = alpha[before] + gaps[before] * _zero(value[before], value[(before + 1) % count])
        # from the direction before the sector to the last within it
        way = sum(gaps[(before + k) % count] for k in range(run))
        last = alpha[before] + way + gaps[end] * (1.0 - _zero(value[after], value[end]))
        start = first % 360.0
        found.append((float(start), float(start + last - first)))
    return tuple(sorted(found))


def _zero(positive: float, negative: float) -> float:
    """Share of the way from the one to the other at which zero lies; all of it from what is not known."""
    return float(positive / (positive - negative)) if np.isfinite(positive) else 1.0


def mean_cone(
    alpha: np.ndarray, value: np.ndarray, lower: np.ndarray, upper: np.ndarray, negative: np.ndarray
) -> MeanCone:
    """The cone of the mean with intervals of its edges.

    An edge is where W2 is zero. So its interval is where zero is within the interval of W2: from the last direction
    that is surely positive to the first that is surely negative. It covers the edge as often as the interval of W2
    covers zero there; no distribution of edges is needed, and edges that exist in some resamples only are no case apart.

    Parameters
    ----------
    alpha : (n,) array
        Sorted directions in degrees, all around.
    value, lower, upper : (n,) arrays
        W2 of the mean and its bounds; NaN where nothing is known. Not W2n: a cosine is less straight between directions.
    negative : (b, n) array of bool
        In which resamples W2 of the mean is negative.
    """
    known = np.isfinite(value)
    sure = negative_sectors(alpha, np.where(known & np.isfinite(upper), upper, np.inf))
    possible = negative_sectors(alpha, np.where(known & np.isfinite(lower), lower, -np.inf))
    sectors = []
    for first, last in negative_sectors(alpha, value):
        own = known & (value < 0.0) & ((alpha - first) % 360.0 <= last - first)
        share = float(negative[:, own].any(axis=1).mean()) if len(negative) else float("nan")
        middle = 0.5 * (first + last)
        within = sorted(_turned(span, middle) for span in sure if _meet(span, (first, last)))
        around = [_turned(span, middle) for span in possible if _meet(span, (first, last))]
        inner = (within[0][0], within[-1][1]) if within else (np.nan, np.nan)
        outer = around[0] if around and around[0][1] - around[0][0] < 360.0 else (np.nan, np.nan)
        sectors.append(MeanSector(first, last, (outer[0], inner[0]), (inner[1], outer[1]), share))
    return MeanCone(tuple(sectors), sure, possible)


def _turned(span: Span, about: float) -> Span:
    """The span at that turn at which its middle is nearest to a direction."""
    by = 360.0 * round((about - 0.5 * (span[0] + span[1])) / 360.0)
    return span[0] + by, span[1] + by


def _meet(one: Span, other: Span) -> bool:
    return any(one[0] + by < other[1] and other[0] < one[1] + by for by in (-360.0, 0.0, 360.0))
