"""Which directions are unstable, and which unknown: edges between probes whose signs are sure, and how sure an edge is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "NEAR_EDGE",
    "ROUNDING",
    "UNKNOWN",
    "Edge",
    "Sectors",
    "between",
    "error_of",
    "find_edges",
    "give_or_take",
    "is_unknown",
    "known_pairs",
    "largest_gap",
    "sectors_of",
    "share_of_drift",
    "signs_of",
    "size_of",
    "smallest_of",
    "unknown_between",
    "wrap",
]

# degrees: uncertainty of an edge that the error alone could make. 180 either way is the whole circle: nothing is known
UNKNOWN = 180.0
# degrees: what lies nearer to an edge is on neither side of it for sure, and an edge less sure than this is not sharp
NEAR_EDGE = 5.0
# of |d_sigma| |d_eps|: below it no sign is sure. Increments are differences of states: at 300 kPa a response of 0.1 Pa is
# rounded to 7e-10 of itself
ROUNDING = 1e-9

Sectors = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Edge:
    """A change of sign of the second-order work between directions whose signs are sure; angles in degrees.

    Parameters
    ----------
    opens : bool
        Whether W2 is negative counter-clockwise of it.
    before, after : int
        Indices of the last probe on its clockwise side and the first on its other side whose signs are sure; of an
        edge that is unknown, of the negative one and its neighbour.
    alpha : float
        Middle between the two, and
    uncertainty : float
        half their distance plus what the error can shift it; see `find_edges`. `UNKNOWN` if the error alone could make the
        edge.
    response, response_uncertainty : float
        The same edge in directions of the response; see `find_edges`.
    """

    opens: bool
    before: int
    after: int
    alpha: float
    uncertainty: float
    response: float
    response_uncertainty: float


def is_unknown(uncertainty):
    """Whether the error alone could make an edge of this uncertainty; not where there is no edge (NaN).

    >>> is_unknown([0.5, 120.0, 180.0, float("nan")]).tolist()
    [False, False, True, False]
    """
    return np.asarray(uncertainty, dtype=float) >= UNKNOWN


def give_or_take(uncertainty: float) -> str:
    """An uncertainty in degrees as it is said, a question mark if it is unknown.

    >>> give_or_take(0.25), give_or_take(114.0), give_or_take(180.0)
    ('0.25', '114', '?')
    """
    if is_unknown(uncertainty):
        return "?"
    return f"{uncertainty:.0f}" if uncertainty >= 10.0 else f"{uncertainty:.2g}"


def wrap(angle):
    """Angles in degrees between -180 and 180.

    >>> float(wrap(350.0))
    -10.0
    """
    return (np.asarray(angle, dtype=float) + 180.0) % 360.0 - 180.0


def largest_gap(alpha: np.ndarray) -> float:
    """Widest distance between neighbours of sorted directions, in degrees; 360 if there are fewer than two.

    >>> largest_gap(np.array([0.0, 90.0, 300.0]))
    210.0
    """
    return float(((np.roll(alpha, -1) - alpha) % 360.0).max()) if len(alpha) > 1 else 360.0


def error_of(probes: xr.Dataset) -> xr.Variable:
    """Error of the normalised second-order work of each probe; NaN where W2n is.

    Parameters
    ----------
    probes : xarray.Dataset
        From `rd.probe`. Its `w2_normalised_error`, or where there is none the share of the null probe's drift.
    """
    if "w2_normalised_error" in probes:
        error = probes["w2_normalised_error"].variable
    else:
        error = abs(probes["w2_drift"].variable) / size_of(probes)
    return error.where(np.isfinite(probes["w2_normalised"].variable))


def size_of(probes: xr.Dataset) -> xr.Variable:
    """`|d_sigma| |d_eps|` of each probe, NaN where there is no response."""
    squares = ((probes[name].variable ** 2).sum("component") for name in ("d_sigma", "d_eps"))
    size = (next(squares) * next(squares)) ** 0.5
    return size.where(size > 0.0)


def signs_of(probes: xr.Dataset) -> xr.Variable:
    """Sign of the second-order work of each probe: -1 or 1 where it is sure, and 0 where it is unknown.

    It is unknown where W2n is no number, is not significant or does not exceed its error and `ROUNDING`, and where a stress
    was asked for that was not reached: what is known then is the sign in another direction.

    Parameters
    ----------
    probes : xarray.Dataset
        From `rd.probe`.
    """
    w2n = probes["w2_normalised"].variable
    sure = probes["is_significant"].variable & (abs(w2n) > error_of(probes)) & (abs(w2n) > ROUNDING)
    if probes.attrs["kind"] == "stress":
        sure = sure & probes["is_reached"].variable
    return sure * ((w2n > 0.0).astype(int) - (w2n < 0.0).astype(int))


def smallest_of(w2n: np.ndarray, sign: np.ndarray) -> int:
    """Index of the smallest W2n: of those that are surely negative if there are any, else of all numbers.

    >>> smallest_of(np.array([0.5, -0.2, -0.9, np.nan]), np.array([1, -1, 0, 0]))
    1
    """
    among = sign < 0 if (sign < 0).any() else np.isfinite(w2n)
    return int(np.argmin(np.where(among, w2n, np.inf)))


def share_of_drift(increments: np.ndarray, drift: np.ndarray) -> np.ndarray:
    """Size of a drift over that of each increment, at most 1: the sine of the angle by which it can turn them.

    Parameters
    ----------
    increments : (n, 3) array
        Principal increments of stress or of strain, and
    drift : (3,) array
        the same of the null probe.

    Returns
    -------
    (n,) array
        1 also where a probe has no response.

    Examples
    --------
    >>> share_of_drift(np.array([[3.0, 0.0, 4.0], [0.0, 0.0, 0.0]]), np.array([0.0, 1.0, 0.0])).tolist()
    [0.2, 1.0]
    """
    size, drifted = np.linalg.norm(increments, axis=-1), np.linalg.norm(drift)
    share = np.divide(drifted, size, out=np.ones(len(size)), where=size > 0.0)
    return np.fmin(share, 1.0)


def known_pairs(sign: np.ndarray) -> list[tuple[int, int]]:
    """Indices of probes whose signs are sure, each with the next one around the circle; none if no sign is.

    >>> known_pairs(np.array([1, 0, -1, -1]))
    [(0, 2), (2, 3), (3, 0)]
    """
    known = np.flatnonzero(sign).tolist()
    return list(zip(known, [*known[1:], *known[:1]], strict=True))


def unknown_between(
    alpha: np.ndarray, sign: np.ndarray, tolerance: float = 0.0
) -> list[tuple[tuple[int, int], tuple[float, float]]]:
    """Sectors in which the sign is unknown, each with the indices of the probes on both sides whose signs are sure.

    A sector goes from one probe with a sure sign to the next. Probes of unknown sign that lie between two of opposite signs not
    farther apart than the tolerance are left out: they are within the bracket of an edge.

    Parameters
    ----------
    alpha : (n,) array
        Sorted directions in degrees, all around.
    sign : (n,) array of int
        -1 or 1 where it is sure, 0 where it is unknown.
    tolerance : float
        Degrees.

    Returns
    -------
    list of ((before, after), (from, to))
        Indices (0, 0) and the whole circle if no sign is sure.

    Examples
    --------
    >>> unknown_between(np.array([0.0, 100.0, 200.0, 300.0]), np.array([0, 1, 1, 1]))
    [((3, 1), (300.0, 460.0))]
    """
    pairs = known_pairs(sign)
    if not pairs:
        return [((0, 0), (0.0, 360.0))]
    found = []
    for i, j in pairs:
        if (j - i) % len(sign) != 1 and len(sign) > 1:
            first, last = between(float(alpha[i]), float(alpha[j])) if i != j else (float(alpha[i]), alpha[i] + 360.0)
            if sign[i] == sign[j] or last - first > tolerance:
                found.append(((i, j), (first, float(last))))
    return sorted(found, key=lambda one: one[1])


def find_edges(
    alpha: np.ndarray, w2n: np.ndarray, error: np.ndarray, sign: np.ndarray, response: np.ndarray, turned: np.ndarray
) -> list[Edge]:
    """Edges of the sectors in which W2n is surely negative, each with its uncertainty.

    1. Between two neighbours of opposite sure signs lies an edge: in their middle, give or take half of their distance and the
       larger of their errors over the slope between them.
    2. If unknown probes lie between the two, the edge is in the middle, too, give or take half of their distance: that is as
       far as the error reaches, for beyond it the signs are sure.
    3. Unknown probes between two that are surely negative belong to the sector if W2n is negative in all of them, too: the value
       speaks for it, though not surely. If not, the sector ends beside the last sure one, at an edge that is `UNKNOWN`.

    Parameters
    ----------
    alpha : (n,) array
        Sorted directions in degrees, all around.
    w2n, error : (n,) arrays
        Normalised second-order work and its error.
    sign : (n,) array of int
        Its sign where it is sure, 0 where it is unknown.
    response : (n,) array
        Directions of the responses in degrees. Each edge is given in these, too: where the response is when W2n is zero,
        linear between the two probes, which near a limit state are far apart. Its uncertainty is the angle to the
        farthest of their responses and of those between, plus
    turned : (n,) array
        the angle in degrees by which the drift can turn a response.
    """
    count, found = len(alpha), []
    for i, j in known_pairs(sign):
        way = np.arange(i, i + ((j - i) % count or count) + 1) % count
        if sign[i] != sign[j]:
            gap = float((alpha[j] - alpha[i]) % 360.0)
            at, farthest = _response_of_zero(way, alpha, w2n, response)
            # what the error adds to half the bracket, over that half
            shift = 2.0 * float(max(error[i], error[j]) / abs(w2n[j] - w2n[i])) if len(way) == 2 else 0.0
            found.append(
                Edge(
                    opens=bool(sign[j] < 0),
                    before=i,
                    after=j,
                    alpha=float(alpha[i] + 0.5 * gap) % 360.0,
                    uncertainty=0.5 * gap * (1.0 + shift),
                    response=at,
                    response_uncertainty=min(farthest * (1.0 + shift) + float(np.nanmax(turned[way])), UNKNOWN),
                )
            )
        elif sign[i] < 0 and not (w2n[way] < 0.0).all():
            found += [_end_of_the_known(False, i, way[1], alpha, response)]
            found += [_end_of_the_known(True, way[-2], j, alpha, response)]
    return found


def _response_of_zero(way: np.ndarray, alpha: np.ndarray, w2n: np.ndarray, response: np.ndarray) -> tuple[float, float]:
    """Direction of the response where W2n is zero, linear from the first to the last probe, and the angle to the farthest."""
    way = way[np.isfinite(response[way])]
    first, last = w2n[way[0]], w2n[way[-1]]
    turns = np.concatenate(([0.0], np.cumsum(wrap(np.diff(response[way])))))
    places = (alpha[way] - alpha[way[0]]) % 360.0
    zero = float(np.interp(first / (first - last) * places[-1], places, turns))
    return float((response[way[0]] + zero) % 360.0), float(np.abs(turns - zero).max())


def _end_of_the_known(opens: bool, before: int, after: int, alpha: np.ndarray, response: np.ndarray) -> Edge:
    """The end of a sector beside a probe of unknown sign: half-way between it and the negative one."""
    negative, other = (after, before) if opens else (before, after)
    turn = float(np.nan_to_num(wrap(response[other] - response[negative])))
    return Edge(
        opens=opens,
        before=int(before),
        after=int(after),
        alpha=float(alpha[before] + 0.5 * ((alpha[after] - alpha[before]) % 360.0)) % 360.0,
        uncertainty=UNKNOWN,
        response=float(response[negative] + 0.5 * turn) % 360.0,
        response_uncertainty=UNKNOWN,
    )


def between(first: float, last: float) -> tuple[float, float]:
    """The sector from `first` counter-clockwise to `last`: `from` in [0, 360), `to` beyond it.

    >>> between(350.0, 10.0)
    (350.0, 370.0)
    """
    return first % 360.0, first % 360.0 + (last - first) % 360.0


def sectors_of(edges: list[Edge]) -> list[tuple[Edge, Edge]]:
    """Edges in pairs: each that opens with the one that closes it, sorted by direction."""
    closing = [edge for edge in edges if not edge.opens]
    pairs = [(edge, min(closing, key=lambda other: (other.alpha - edge.alpha) % 360.0)) for edge in edges if edge.opens]
    return sorted(pairs, key=lambda pair: pair[0].alpha % 360.0)
