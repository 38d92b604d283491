"""Parabolas through the readings about each reading, at many widths, and how far noise moves them at each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import CubicSpline

__all__ = ["FEWEST", "LocalFits", "PathNoise", "local_fits", "noise_of", "widths_of"]

FEWEST = 5  # readings in a window: a parabola, and what tells how well it fits
GROWTH = 2**0.5  # of the number of readings, from width to width
NODES = 8  # of a window, at which it is fitted; between them the fits are interpolated
NOISE_LIKE = 1.7  # changes of sign of a detail per width: white noise has 2.8, a smooth curve less than 1
COUNTED = 8  # changes of sign that tell noise from curve: that of a curve has few
OF_MEDIAN = 1.4826  # standard deviations of normal noise in its median absolute value
ROUNDING = 1e-9  # of the largest value: no reading is known better


@dataclass(frozen=True)
class LocalFits:
    """Parabolas through `count` readings about each of n readings.

    Parameters
    ----------
    count : int
        Readings in a window.
    value, slope : (n, c) array
        Of the parabola at the reading, for each of c columns; slopes per strain.
    slope_gain : (n,) array
        Standard deviation of a slope where each reading scatters by 1, independently.
    value_gain : (n,) array
        The same of a value.
    reach : (n,) array
        Strain from a reading to where the window ends.
    """

    count: int
    value: np.ndarray
    slope: np.ndarray
    value_gain: np.ndarray
    slope_gain: np.ndarray
    reach: np.ndarray

    @property
    def w2(self) -> np.ndarray:
        """(n,) `sum_i (d sigma_i / ds) (d eps_i / ds)` in Pa, of columns that are stresses, then strains."""
        half = self.slope.shape[1] // 2
        return (self.slope[:, :half] * self.slope[:, half:]).sum(axis=1)


class PathNoise(NamedTuple):
    """What noise does to the fits of each width.

    Attributes
    ----------
    value : (m, n) array
        Standard deviation of the conjugate stress, whose slope W2 is, in Pa, for m widths and n readings: no less than this.
    value_seen : (m, n) array
        The same without the growth of step 3: what was seen as noise.
    w2 : (m, n) array
        That of W2, in Pa.
    w2_detail : (m, n) array
        The part of it that a window of twice the width takes away.
    """

    value: np.ndarray
    value_seen: np.ndarray
    w2: np.ndarray
    w2_detail: np.ndarray


def widths_of(n: int) -> list[int]:
    """Numbers of readings in windows, from five to half of `n`, each 1.4 times the one before."""
    widths = [FEWEST]
    while (wider := max(widths[-1] + 1, round(widths[-1] * GROWTH))) <= max(n // 2, min(n, FEWEST + 2)):
        widths.append(wider)
    return widths


def local_fits(s: np.ndarray, y: np.ndarray, count: int) -> LocalFits:
    """Weighted parabolas through the `count` readings about each reading; at the ends those nearest to them.

    Parameters
    ----------
    s : (n,) array
        Where the readings are, increasing.
    y : (n, c) array
        Readings.
    count : int
        Readings in a window, at most n.
    """
    n = len(s)
    step = max(1, count // NODES)
    nodes = np.unique(np.append(np.arange(0, n, step), n - 1))
    first = np.clip(nodes - count // 2, 0, n - count)
    t = sliding_window_view(s, count)[first] - s[nodes][:, None]
    reach = np.abs(t).max(axis=1) * (count + 1) / (count - 1)
    of_value, of_slope = _filters(t / reach[:, None])
    windows = sliding_window_view(y, count, axis=0)[first]
    value, slope = (np.einsum("nk,nck->nc", weights, windows) for weights in (of_value, of_slope / reach[:, None]))
    gains = (np.sqrt(np.einsum("nk,nk->n", weights, weights)) for weights in (of_value, of_slope / reach[:, None]))
    found = (value, slope, *gains, reach)
    if step > 1:
        found = tuple(CubicSpline(nodes, part)(np.arange(n)) for part in found)
    return LocalFits(count, *found)


def _filters(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, k) weights whose products with readings at t (n, k), within -1 to 1, are the value and the slope at 0."""
    size = np.abs(t)
    falls = 1.0 - size * size * size
    weight = falls * falls * falls
    first = weight * t
    second = first * t
    moments = [weight.sum(axis=1), first.sum(axis=1), second.sum(axis=1)]
    moments += [np.einsum("nk,nk->n", second, t), np.einsum("nk,nk,nk->n", second, t, t)]
    normal = np.stack([np.stack(moments[k : k + 3], axis=-1) for k in range(3)], axis=-2)
    # readings far apart from a dense group leave the curvature open: a trace keeps the matrix regular
    normal += 1e-16 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    inverse = np.linalg.inv(normal)[:, :2, :, None]
    value, slope = (row[:, 0] * weight + row[:, 1] * first + row[:, 2] * second for row in np.moveaxis(inverse, 1, 0))
    return value, slope


@cache
def _gains(count: int, wider: int) -> tuple[float, float]:
    """How much of white noise the difference of two widths shows: of values and slopes, over `sqrt(a^2 - b^2)` of both."""
    both = []
    for k in (count, wider):
        t = np.arange(k) - k // 2
        reach = np.abs(t).max() * (k + 1) / (k - 1)
        of_value, of_slope = _filters(t[None] / reach)
        weights = np.concatenate((of_value, of_slope / reach))
        both.append(np.pad(weights, ((0, 0), (wider // 2 - k // 2, wider - wider // 2 - k + k // 2))))
    narrow, wide, apart = ((part**2).sum(axis=1) for part in (*both, both[0] - both[1]))
    value, slope = np.sqrt((narrow - wide) / apart)
    return float(value), float(slope)


def noise_of(y: np.ndarray, fits: Sequence[LocalFits]) -> PathNoise:
    """Standard deviations of the conjugate stress and of W2, width by width, for noise of any correlation.

    1. The detail of a width is what its fit has and that of twice the width has not. The median of its size, over all
       readings, is that of the noise there: curves bend in few places, noise is everywhere (level-dependent thresholds of
       Johnstone and Silverman).
    2. The noise of a fit is that of its own detail and of all wider ones. For white noise the sum is exact.
    3. A detail that changes its sign less often than noise of this width would is one of the curve. There the noise
       is taken to grow from narrower widths as that of a random walk does, which is the fastest growth of
       autoregressive noise and of moving averages; less if the detail itself is smaller.

    Parameters
    ----------
    y : (n, 6) array
        Principal stresses in Pa, then strains.
    fits : sequence of LocalFits
        From narrow to wide.

    References
    ----------
    Johnstone, Silverman (1997), J. R. Statist. Soc. B 59, 319-351, doi 10.1111/1467-9868.00071.
    """
    n, m = len(y), len(fits)
    counts = np.array([fit.count for fit in fits])
    value, slope, is_noise = (np.full(m, np.nan) for _ in range(3))
    for j in range(m - 1):
        narrow, wide = fits[j], fits[min(j + 2, m - 1)]
        of_value, of_slope = _gains(narrow.count, wide.count)
        detail = _conjugate(narrow.value - wide.value, wide)
        value[j] = of_value * _size(detail)
        slope[j] = of_slope * _size((narrow.w2 - wide.w2) / narrow.slope_gain)
        changes = np.count_nonzero(np.diff(np.sign(detail[detail != 0.0])))
        is_noise[j] = changes >= COUNTED and changes * narrow.count >= NOISE_LIKE * n
    # what single readings scatter about the fits, where there are too few for details
    scatter = _size(_conjugate(y - fits[-1].value, fits[-1])) / np.sqrt(max(1.0 - 3.0 / counts[-1], 0.2))
    if m == 1:
        value[:], slope[:], is_noise[:] = scatter * np.median(fits[0].value_gain), scatter, 1.0
    else:
        value[-1], slope[-1] = GROWTH**0.5 * value[-2], slope[-2]
    seen, slope = (_bounded(size, is_noise, counts, 0.0) for size in (value, slope))
    value = _bounded(value, is_noise, counts, 0.5)
    floor = ROUNDING * max(float(np.abs(_conjugate(y, fits[-1])).max()), 1e-300)
    square_value, square_seen, square_w2 = (np.zeros((m, n)) for _ in range(3))
    for j in reversed(range(m)):
        edge = np.maximum(fits[j].value_gain / np.median(fits[j].value_gain), 1.0)
        square_value[j] = (value[j] * edge) ** 2 + (square_value[j + 2] if j + 2 < m else floor**2)
        square_seen[j] = (seen[j] * edge) ** 2 + (square_seen[j + 2] if j + 2 < m else floor**2)
        square_w2[j] = (slope[j] * fits[j].slope_gain) ** 2
        square_w2[j] += square_w2[j + 2] if j + 2 < m else (floor * fits[j].slope_gain) ** 2
    details = np.stack([np.maximum(slope[j], floor) * fits[j].slope_gain for j in range(m)])
    return PathNoise(np.sqrt(square_value), np.sqrt(square_seen), np.sqrt(square_w2), details)


def _conjugate(y: np.ndarray, along: LocalFits) -> np.ndarray:
    """Small stresses and strains y (n, 6) as the conjugate stress feels them: each times the other's slope."""
    half = y.shape[1] // 2
    return (y[:, :half] * along.slope[:, half:] + y[:, half:] * along.slope[:, :half]).sum(axis=1)


def _size(detail: np.ndarray) -> float:
    return OF_MEDIAN * float(np.median(np.abs(detail)))


def _bounded(size: np.ndarray, is_noise: np.ndarray, counts: np.ndarray, power: float) -> np.ndarray:
    """Sizes of details, those of the curve no larger than noise that grows as `count**power` from narrower widths."""
    bounded, bound, seen = size.copy(), np.inf, False
    for j in range(len(size)):
        bound *= (counts[j] / counts[j - 1]) ** power if j else 1.0
        if is_noise[j] == 1.0 or j == 0:
            bound = max(bound, size[j]) if seen else size[j]
            seen = seen or is_noise[j] == 1.0
        else:
            bounded[j] = np.fmin(size[j], bound)
    return bounded
