"""Where to probe next: closer to every edge, and wherever second-order work may change its sign between two directions."""

from __future__ import annotations

import numpy as np

from rendulic.probing.edges import known_pairs, smallest_of

__all__ = ["may_dip", "probes_wanted"]

# of the bracket of an edge that unknown probes make wide: the ends of it are not sought closer than that
PART_OF_BRACKET = 0.125


def probes_wanted(
    alpha: np.ndarray,
    w2n: np.ndarray,
    size: np.ndarray,
    error: np.ndarray,
    sign: np.ndarray,
    tolerance: float,
    seek_smallest: bool = False,
) -> np.ndarray:
    """Directions that bring every edge closer to its bracket and look into every minimum that may be negative.

    1. Between two probes of opposite sure signs the gap is halved until it is within the tolerance. Where probes of
       unknown sign lie between the two, the gaps beside these two are, to half the tolerance or to an eighth of the
       bracket: more is not to be known.
    2. The gaps beside every local minimum that is not surely negative are halved as long as W2n, or W2 itself, may be negative
       within them, see `may_dip`; and beside every maximum that is not surely positive, as long as it may be positive.
    3. If asked, so are those beside the smallest value.

    Parameters
    ----------
    alpha : (n,) array
        Sorted directions in degrees.
    w2n, size, error : (m, n) arrays
        Normalised second-order work, `|d_sigma| |d_eps|`, and the error of W2n, of m norms; the directions wanted are those of
        all of them.
    sign : (m, n) array of int
        Sign of W2n, 0 where it is unknown.
    tolerance : float
        Degrees beneath which a bracket is left as it is.
    seek_smallest : bool
        Whether also the neighbours of the smallest value are brought within the tolerance.
    """
    gaps = (np.roll(alpha, -1) - alpha) % 360.0
    wanted = np.zeros(len(alpha), dtype=bool)  # whether to halve the gap after each direction
    for row, own_size, own_error, own_sign in zip(w2n, size, error, sign, strict=True):
        for i, j in known_pairs(own_sign):
            if own_sign[i] == own_sign[j]:
                continue
            bracket = (alpha[j] - alpha[i]) % 360.0
            if (j - i) % len(alpha) == 1:
                wanted[i] |= bracket > tolerance
            elif bracket > tolerance:
                ends = np.array([i, j - 1])
                wanted[ends] |= gaps[ends] > max(0.5 * tolerance, PART_OF_BRACKET * bracket)
        for scale in (1.0, own_size):
            for side in (1.0, -1.0):
                turns = may_dip(gaps, side * scale * row, scale * own_error, (side * own_sign).astype(int))
                wanted |= turns & (gaps > tolerance)
        if seek_smallest and np.isfinite(row).any():
            least = smallest_of(row, own_sign)
            wanted[[least - 1, least]] |= gaps[[least - 1, least]] > tolerance
    return (alpha[wanted] + 0.5 * gaps[wanted]) % 360.0


def may_dip(gaps: np.ndarray, values: np.ndarray, error: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Whether values around a circle may be surely negative in the gap after each, beside a minimum that is not.

    A convex function lies above the lines through two of its points, continued beyond them. From the two lines
    through the neighbours on either side follows the least value that it can have within a gap; a parabola through three
    of the points lies above that. Near a minimum second-order work is convex: for a tangent it is `a + b cos(2 (alpha - c))`. A line
    that the next value does not lie above is left out. Slopes that the errors could make are taken as zero, so
    that noise is not searched for minima.

    Parameters
    ----------
    gaps : (n,) array
        Degrees from each direction to the next, around the circle.
    values, error : (n,) arrays
        Of a multiple of the second-order work.
    sign : (n,) array of int
        -1 or 1 where it is sure, 0 where it is unknown.

    Returns
    -------
    (n,) array of bool

    Examples
    --------
    Values of `cos(4) - cos(alpha - 135)`, negative between 131 and 139 degrees, where none of 36 directions lies:

    >>> alpha = np.arange(0.0, 360.0, 10.0)
    >>> work = np.cos(np.radians(4.0)) - np.cos(np.radians(alpha - 135.0))
    >>> alpha[may_dip(np.full(36, 10.0), work, np.zeros(36), np.ones(36, dtype=int))].tolist()
    [130.0]
    """
    change, noise = np.roll(values, -1) - values, np.roll(error, -1) + error
    slope = np.sign(change) * np.maximum(np.abs(change) - noise, 0.0) / gaps
    before, after = np.roll(values, 1), np.roll(values, -1)
    # a value that is unknown for another reason than its size tells nothing of its neighbours
    open_to_doubt = (sign > 0) | ((sign == 0) & (np.abs(values) <= error))
    least = open_to_doubt & ~(before < values) & ~(after < values)
    beside = least | np.roll(least, -1)
    found = np.zeros(len(values), dtype=bool)
    for k in np.flatnonzero(beside):
        following = (k + 1) % len(values)
        found[k] = _lowest(
            float(values[k]), float(values[following]), float(gaps[k]), slope[k - 1], slope[k], slope[following]
        ) < -max(error[k], error[following])
    return found


def _lowest(first: float, last: float, gap: float, before: float, across: float, after: float) -> float:
    """Least value in a gap between two values, from the slopes before, across and after it; NaN if it is not known."""
    falls, rises = before <= across, across <= after  # whether the line from either side can be gone on with
    if falls and rises and before < 0.0 < after:
        return first + before * (last - first - after * gap) / (before - after)
    if falls and not rises and before < 0.0:
        return first + before * gap
    if rises and not falls and after > 0.0:
        return last - after * gap
    return min(first, last)
