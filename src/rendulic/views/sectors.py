"""Sectors of directions in which second-order work is negative, or its sign unknown, and how they go on from state to state."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rendulic.probing.edges import give_or_take
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION
from rendulic.views.view import Mark

__all__ = ["MARKS", "Sector", "Track", "Verdict", "direction_range", "give_work", "verdict_of"]

MARGIN = 10.0  # degrees about the directions that are shown
TURNS = (-360.0, 0.0, 360.0)


@dataclass(frozen=True)
class Sector:
    """From one end to the other, in degrees of the strain increment, counter-clockwise.

    Parameters
    ----------
    first, last : float
        `last` beyond `first`; a whole turn if there are no edges.
    first_uncertainty, last_uncertainty : float
        Either way; see `rendulic.probing.edges.is_unknown`. NaN if there are no edges: all around, or of a sector whose sign is
        unknown.
    """

    first: float
    last: float
    first_uncertainty: float
    last_uncertainty: float

    @property
    def edges(self) -> tuple[tuple[float, float], ...]:
        """Direction and uncertainty of each."""
        pairs = ((self.first, self.first_uncertainty), (self.last, self.last_uncertainty))
        return tuple(pair for pair in pairs if np.isfinite(pair[1]))

    @property
    def middle(self) -> float:
        """Between the edges."""
        return 0.5 * (self.first + self.last)

    def turned(self, by: float) -> Sector:
        """The same sector, some degrees farther."""
        return Sector(self.first + by, self.last + by, self.first_uncertainty, self.last_uncertainty)

    def within(self, low: float, high: float) -> list[Sector]:
        """The sector at all turns at which it can be seen between two directions.

        >>> [(one.first, one.last) for one in Sector(350.0, 385.0, 1.0, 1.0).within(0.0, 360.0)]
        [(-10.0, 25.0), (350.0, 385.0)]
        """
        return [self.turned(by) for by in TURNS if self.last + by > low and self.first + by < high]

    def __str__(self) -> str:
        if self.last - self.first >= 360.0:
            return "all directions"
        if not self.edges:
            return f"{self.first % 360.0:.4g} to {self.last % 360.0:.4g}°"
        return " to ".join(f"{edge % 360.0:.4g} ± {give_or_take(width)}" for edge, width in self.edges) + "°"


Verdict = Literal["unstable", "unknown", "stable", ""]
MARKS: dict[Verdict, Mark] = {"unstable": "bad", "unknown": "doubtful", "stable": "", "": ""}


def verdict_of(is_unstable: bool, is_unknown: bool, is_there: bool = True) -> Verdict:
    """What is said of a state with unstable sectors, or with unknown ones: unknown is not stable."""
    return "unstable" if is_unstable else "unknown" if is_unknown else "stable" if is_there else ""


def give_work(smallest: float, error: float) -> str:
    """A smallest W2n with its error as it is said.

    >>> give_work(-0.2512, 0.0123), give_work(float("nan"), float("nan"))
    ('-0.251 ± 0.01', 'none')
    """
    return f"{smallest:+.3f} ± {error:.1g}" if np.isfinite(smallest) else "none"


@dataclass(frozen=True, eq=False)
class Track:
    """How the sectors and the smallest W2n of one sample go on along an abscissa, its stress ratio or the size of probes.

    Parameters
    ----------
    label : str
        What it is of.
    at : (n,) array
        Abscissas, increasing.
    sectors, unknown : sequences of n tuples of Sector
        Unstable ones, and those whose sign is unknown; empty where there are none, or no state.
    smallest : (n,) array
        Smallest W2n, NaN where there is none.
    is_significant : (n,) array of bool
        Whether its sign is sure.
    error : (n,) array
        Its error.
    """

    label: str
    at: np.ndarray
    sectors: tuple[tuple[Sector, ...], ...]
    unknown: tuple[tuple[Sector, ...], ...]
    smallest: np.ndarray
    is_significant: np.ndarray
    error: np.ndarray

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Of each state; empty where there is none."""
        return tuple(
            verdict_of(bool(here), bool(unknown), bool(np.isfinite(smallest)))
            for here, unknown, smallest in zip(self.sectors, self.unknown, self.smallest, strict=True)
        )

    @property
    def every(self) -> list[Sector]:
        """All sectors, unstable and unknown."""
        return [one for states in (self.sectors, self.unknown) for here in states for one in here]

    def bands(self) -> list[tuple[float, Sector, float, Sector]]:
        """Neighbouring abscissas, each with its sector, where one sector goes on in the other: where they overlap."""
        found = []
        for k in range(len(self.at) - 1):
            for one in self.sectors[k]:
                for other in self.sectors[k + 1]:
                    for next_one in (other.turned(by) for by in TURNS):
                        if min(one.last, next_one.last) > max(one.first, next_one.first):
                            found.append((float(self.at[k]), one, float(self.at[k + 1]), next_one))
        return found


def direction_range(sectors: Iterable[Sector]) -> tuple[float, float]:
    """Directions in degrees to show sectors in: about all of them, or all around if they lie apart.

    Examples
    --------
    >>> direction_range([Sector(116.0, 145.0, 0.5, 0.5)])
    (105.0, 165.0)
    >>> direction_range([Sector(350.0, 370.0, 0.5, 0.5)])
    (0.0, 360.0)
    """
    ends = np.array([(one.first, one.last) for one in sectors])
    if not len(ends) or ends.max() > 360.0 or np.ptp(ends) > 180.0:
        return 0.0, 360.0
    # the landmark that the cone is compared with stays in sight
    low = min(ends.min(), ISOCHORIC_COMPRESSION) - MARGIN
    high = max(ends.max(), ISOCHORIC_COMPRESSION) + MARGIN
    return float(max(15.0 * np.floor(low / 15.0), 0.0)), float(min(15.0 * np.ceil(high / 15.0), 360.0))
