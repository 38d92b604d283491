"""Where a curve turns for good, beyond its noise, and how well it is known where."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

__all__ = ["CERTAIN", "adaptive", "located", "rise", "turning_points"]

CERTAIN = (
    4.5  # standard deviations of a difference by which a curve turns: one of many places, and a noise known roughly
)
ALIKE = 2.5  # standard deviations of W2 within which a wider window still says the same
NEIGHBOURS = 9  # readings whose median width is taken, so that chance at one reading does not change it
SAME = 1.5  # standard deviations of a fall within which the place of an edge cannot be told
BLURRED = 0.4  # of half a window, by which an edge with unlike slopes on both sides may be shifted


def rise(s: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """(n,) integral of a slope from the first reading on."""
    return np.concatenate(([0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(s))))


def adaptive(w2: np.ndarray, error: np.ndarray) -> np.ndarray:
    """(n,) which of m widths to take at each reading: the widest that agrees with all narrower ones, as most about it do.

    Parameters
    ----------
    w2, error : (m, n) array
        From narrow to wide, and standard deviations, of what a wider window takes away.

    References
    ----------
    Goldenshluger, Nemirovski (1997), Math. Methods Statist. 6, 135-170 (intersection of confidence intervals).
    """
    low = np.maximum.accumulate(w2 - ALIKE * error, axis=0)
    high = np.minimum.accumulate(w2 + ALIKE * error, axis=0)
    agrees = np.logical_and.accumulate(low <= high, axis=0)
    return median_filter(agrees.sum(axis=0) - 1, size=NEIGHBOURS, mode="nearest")


def turning_points(value: np.ndarray, noise: np.ndarray) -> tuple[list[tuple[int, int]], int]:
    """Peaks and valleys between which a curve moves by more than its noise can.

    Parameters
    ----------
    value, noise : (n,) array
        The curve, and its standard deviation.

    Returns
    -------
    turns : list of (int, int)
        Index, and 1 for a peak or -1 for a valley, in turn. The first reading counts as a peak if the curve falls from it.
    sense : int
        Where the curve goes after the last: 1 up, -1 down, 0 if it never moves beyond noise.
    """
    enough = CERTAIN * np.sqrt(2.0) * noise
    turns: list[tuple[int, int]] = []
    top = bottom = sense = 0
    for k in range(len(value)):
        if value[k] > value[top]:
            top = k
        if value[k] < value[bottom]:
            bottom = k
        if sense >= 0 and value[top] - value[k] > max(enough[top], enough[k]):
            turns.append((top, 1))
            sense, bottom = -1, k
        elif sense <= 0 and value[k] - value[bottom] > max(enough[bottom], enough[k]):
            if sense < 0:
                turns.append((bottom, -1))
            sense, top = 1, k
    return turns, sense


def located(
    s: np.ndarray, w2: np.ndarray, error: np.ndarray, noise: np.ndarray, reach: np.ndarray, sign: int
) -> tuple[float, float, int]:
    """Where W2 changes its sign within a stretch, how far off that may be (nine times of ten), and the width that says so.

    1. At each width it is where the integral of W2, the conjugate stress, is largest (smallest). It may be anywhere where
       that is smaller by no more than 1.5 standard deviations of the difference, plus a part of the window.
    2. Wider windows are taken as long as they agree with all narrower ones. Of these the surest is the answer.

    Parameters
    ----------
    s : (n,) array
        Of the readings of the stretch.
    w2, error, noise, reach : (m, n) array
        From narrow to wide windows: W2, its standard deviation, that of the conjugate stress, half the window.
    sign : {1, -1}
        1 where W2 turns negative, -1 where it turns positive.
    """
    found: list[tuple[float, float]] = []
    sure: list[float] = []
    low, high = -np.inf, np.inf
    for slope, deviation, scatter, half in zip(sign * w2, error, noise, reach, strict=True):
        at, off = _largest(s, slope, deviation, scatter)
        blurred = BLURRED * float(np.interp(at, s, half))
        low, high = max(low, at - 0.25 * off - blurred), min(high, at + 0.25 * off + blurred)
        if found and low > high:
            break
        found.append((at, off + blurred))
        sure.append(0.5 * off + blurred)
    width = int(np.argmin(sure))
    return *found[width], width


def _largest(s: np.ndarray, slope: np.ndarray, error: np.ndarray, noise: np.ndarray) -> tuple[float, float]:
    """Where the integral of a slope is largest, and how far from there it is as large within its error."""
    value = rise(s, slope)
    top = int(np.argmax(value))
    at = float(s[top])
    before = top if slope[top] > 0.0 else top - 1
    if 0 <= before < len(s) - 1 and slope[before] > 0.0 >= slope[before + 1]:
        share = slope[before] / (slope[before] - slope[before + 1])
        at = float(s[before] + share * (s[before + 1] - s[before]))
    apart = np.minimum(np.sqrt(2.0) * noise, error * np.abs(s - at))
    same = np.flatnonzero(value[top] - value <= SAME * apart)
    return at, float(max(at - s[same[0]], s[same[-1]] - at, 0.0))
