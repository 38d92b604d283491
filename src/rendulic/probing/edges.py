"""Edges of sectors of negative second-order work: where to probe next, and how sure an edge is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = [
    "NEAR_EDGE",
    "UNKNOWN",
    "Edge",
    "between",
    "find_edges",
    "give_or_take",
    "is_unknown",
    "largest_gap",
    "probes_wanted",
    "sectors_of",
    "share_of_drift",
    "wrap",
]

# degrees: uncertainty of an edge that the drift alone could make. 180 either way is the whole circle: nothing is known
UNKNOWN = 180.0
# degrees: what lies nearer to an edge is on neither side of it for sure, and an edge less sure than this is not sharp
NEAR_EDGE = 5.0


@dataclass(frozen=True)
class Edge:
    """A change of sign of the second-order work between neighbouring directions; angles in degrees.

    Parameters
    ----------
    opens : bool
        Whether W2 is negative counter-clockwise of it.
    before : int
        Index of the probe on its clockwise side; the next one is on the other side.
    alpha : float
        Middle of the bracket, and
    uncertainty : float
        half the bracket plus the shift that the drift can cause.
    response, response_uncertainty : float
        The same edge in directions of the response; see `find_edges`.
    """

    opens: bool
    before: int
    alpha: float
    uncertainty: float
    response: float
    response_uncertainty: float


def is_unknown(uncertainty):
    """Whether the drift alone could make an edge of this uncertainty; not where there is no edge (NaN).

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


def probes_wanted(alpha: np.ndarray, w2n: np.ndarray, tolerance: float, seek_smallest: bool = False) -> np.ndarray:
    """Directions that bring every edge, and if asked the smallest value, closer to its bracket.

    Parameters
    ----------
    alpha : (n,) array
        Sorted directions in degrees.
    w2n : (m, n) array
        Normalised second-order work, of m norms; the directions wanted are those of all of them.
    tolerance : float
        Degrees beneath which a bracket is left as it is.
    seek_smallest : bool
        Whether also the neighbours of the smallest value are brought within the tolerance.
    """
    gaps = (np.roll(alpha, -1) - alpha) % 360.0
    wanted = np.zeros(len(alpha), dtype=bool)  # whether to halve the gap after each direction
    for row in w2n:
        negative = row < 0.0
        wanted |= negative != np.roll(negative, -1)
        if seek_smallest and np.isfinite(row).any():
            least = int(np.nanargmin(row))
            wanted[[least - 1, least]] = True
    wanted &= gaps > tolerance
    return (alpha[wanted] + 0.5 * gaps[wanted]) % 360.0


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


def find_edges(
    alpha: np.ndarray, w2n: np.ndarray, level: np.ndarray, response: np.ndarray, turned: np.ndarray
) -> list[Edge]:
    """Edges of the sectors in which W2n is negative, each with its uncertainty.

    1. An edge lies between two neighbours of different sign: its middle is the edge, half of it its first uncertainty.
    2. From the zero of W2n (linear between the two) one goes either way until |W2n| exceeds `level`. Within
       this band the drift can make the sign, so the edge can be anywhere in it; the farther end is the
       second uncertainty. A W2n that is nearly flat makes the band wide, no slope is fitted.
    3. If W2n changes its sign again before it exceeds the level, the drift could remove this edge: it is UNKNOWN.

    Parameters
    ----------
    alpha : (n,) array
        Sorted directions in degrees, all around.
    w2n, level : (n,) arrays
        Normalised second-order work, and the value below which its sign can be the drift's.
    response : (n,) array
        Directions of the responses in degrees. Each edge is given in these, too: where the response is when W2n is zero,
        linear between the two probes, which near a limit state are far apart. Its uncertainty is the angle to the
        farther of their responses, plus that of the band, plus
    turned : (n,) array
        the angle in degrees by which the drift can turn a response.
    """
    negative = w2n < 0.0
    found = []
    for k in np.flatnonzero(negative != np.roll(negative, -1)):
        ahead = np.roll(np.arange(len(alpha)), -int(k) - 1)  # from the probe after the edge, once around
        behind = ahead[::-1]
        gap = float((alpha[ahead[0]] - alpha[k]) % 360.0)
        turn = float(wrap(response[ahead[0]] - response[k]))
        at_k, after = np.nan_to_num(w2n[[k, ahead[0]]])
        zero = float(at_k / (at_k - after)) if at_k != after else 0.5
        ways = [_reach(*way, alpha, w2n, level, response) for way in ((ahead, zero), (behind, 1.0 - zero))]
        reach, response_reach = np.max(ways, axis=0).tolist()
        farther = max(zero, 1.0 - zero) * abs(turn)
        found.append(
            Edge(
                opens=bool(negative[ahead[0]]),
                before=int(k),
                alpha=float(alpha[k] + 0.5 * gap),
                uncertainty=min(0.5 * gap + reach, UNKNOWN),
                response=float((response[k] + zero * turn) % 360.0),
                response_uncertainty=min(farther + response_reach + max(turned[k], turned[ahead[0]]), UNKNOWN),
            )
        )
    return found


def _reach(
    order: np.ndarray, start: float, alpha: np.ndarray, w2n: np.ndarray, level: np.ndarray, response: np.ndarray
) -> tuple[float, float]:
    """How far from the zero of W2n the drift can move it, one way around: in direction, and in that of the response.

    The probes come in `order`; the last of them is the one on the other side of the edge, and the zero is at the share
    `start` of the way from it to the first.
    """
    sign = -1.0 if w2n[order[0]] < 0.0 else 1.0
    excess = np.nan_to_num(sign * w2n - level, nan=-2.0)  # by how much the sign is sure
    way = response_way = 0.0
    last, share = order[-1], start
    for now in order[:-1]:
        if (w2n[now] < 0.0) != (sign < 0.0):
            break
        gap, turn = float(abs(wrap(alpha[now] - alpha[last]))), float(abs(wrap(response[now] - response[last])))
        if excess[now] > 0.0 or level[now] == 0.0:
            end = max(excess[last] / (excess[last] - excess[now]), share) if excess[last] < excess[now] else share
            return float(way + (end - share) * gap), float(response_way + (end - share) * turn)
        way, response_way = way + (1.0 - share) * gap, response_way + (1.0 - share) * turn
        last, share = now, 0.0
    return UNKNOWN, UNKNOWN


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
