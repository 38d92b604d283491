"""How sure a mean response is: the studentised bootstrap over specimens, and shares with their intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Bounds", "bounds_of_mean", "interval_of_mean", "students_t", "wilson"]

CHUNK = 64  # directions at a time: bounds the memory
ROUNDING = 1e-12  # of a variance, relative: beneath it all specimens of a resample are alike


@dataclass(frozen=True, eq=False)
class Bounds:
    """Two-sided intervals of the mean response, and what resamples make of its sign.

    Parameters
    ----------
    work, work_normalised : (2, n) arrays
        Lower and upper bounds of W2 (J/m3) and of W2n; NaN for fewer than two specimens. W2n without bounds is -1 to 1, W2
        without is infinite.
    negative : (b, n) array of bool
        In which of the b resamples W2 of the mean response is negative.
    """

    work: np.ndarray
    work_normalised: np.ndarray
    negative: np.ndarray


def bounds_of_mean(
    imposed: np.ndarray, response: np.ndarray, within: np.ndarray, confidence: float, n_resamples: int, seed: int
) -> Bounds:
    """Intervals of W2 and W2n of the mean response of specimens.

    1. Specimens are drawn with replacement, whole: all directions of a resample are of the same specimens.
    2. W2 is the product of the imposed increment and the mean response; W2n is a cosine, and its cotangent
       `w / |s|`, the response along the imposed increment over that across it, has no bounds and the same sign.
    3. Both are studentised: `t = (value of resample - value) / standard error of resample`, with the standard error of the
       cotangent by the delta method. The interval is `value - t se`, t from the quantiles of the resamples.
    4. Both are widened by the error that the mean has from within the specimens.
    5. Where only one of both intervals has zero outside, it is widened to zero: one sign for both.

    Parameters
    ----------
    imposed : (n, 3) array
        Principal increments imposed, of n directions.
    response : (m, n, 3) array
        Principal increments that m specimens answer with; NaN where a specimen has no probe.
    within : (n,) array
        Error of the mean W2, J/m3, from within the specimens.
    confidence : float
        E.g. 0.95.
    n_resamples, seed : int
        Of the bootstrap.

    Notes
    -----
    Quantiles of resampled means ("percentile") are too narrow for few specimens and for skewed responses; studentised ones
    are too wide rather than too narrow where one specimen rules the mean, as they should be. What no specimen has shown
    cannot be in any interval. A cosine is underestimated where the response across is within the noise, which has a length
    but no sign: there the interval of W2n, not its sign, misses more often. Measured coverage: docs/theory/ensembles.md.

    References
    ----------
    Hall (1988), Ann. Statist. 16, 927-953. Hesterberg (2015), Am. Stat. 69, 371-386.
    """
    m, n = response.shape[:2]
    draws = np.random.default_rng(seed).multinomial(m, np.full(m, 1.0 / m), size=n_resamples).astype(float)
    parts = [
        _bounds(imposed[part], response[:, part], within[part], draws, confidence)
        for part in (slice(first, first + CHUNK) for first in range(0, n, CHUNK))
    ]
    return Bounds(*(np.concatenate(each, axis=1) for each in zip(*parts, strict=True)))


def interval_of_mean(
    values: np.ndarray, confidence: float = 0.95, n_resamples: int = 2000, seed: int = 0
) -> np.ndarray:
    """(2, n) studentised bounds of the mean of m specimens' values (m, n); infinite, or NaN, for too few.

    >>> low, high = interval_of_mean(np.random.default_rng(0).normal(size=(40, 1)))
    >>> bool(-0.6 < low[0] < high[0] < 0.6)
    True
    """
    m = len(values)
    draws = np.random.default_rng(seed).multinomial(m, np.full(m, 1.0 / m), size=n_resamples).astype(float)

    def at(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mean, squares = weights @ values / m, weights @ values**2 / m
        return mean, np.sqrt(_positive(squares - mean**2, squares) / (m - 1 if m > 1 else np.nan))

    (mean, error), (means, errors) = (np.squeeze(each, 0) for each in at(np.ones((1, m)))), at(draws)
    return _studentised(mean, error, means, errors, confidence)


def _bounds(
    imposed: np.ndarray, response: np.ndarray, within: np.ndarray, draws: np.ndarray, confidence: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    unit, *across = _axes(imposed)
    size = np.linalg.norm(imposed, axis=-1)
    there = np.isfinite(response).all(axis=-1)
    parts = np.where(there[..., None], response, 0.0)
    w, u, v = ((parts * axis).sum(axis=-1) for axis in (unit, *across))

    def at(weights: np.ndarray) -> tuple[np.ndarray, ...]:
        """Of every row of weights: mean response along with its standard error, and the cotangent with its."""
        count = weights @ there
        count = np.where(count > 0.0, count, np.nan)
        mean_w, mean_u, mean_v, ww, uu, vv, uv, wu, wv = (
            weights @ each / count for each in (w, u, v, w * w, u * u, v * v, u * v, w * u, w * v)
        )
        lateral = np.hypot(mean_u, mean_v)
        with np.errstate(divide="ignore", invalid="ignore"):
            cotangent = mean_w / lateral
            a, b = mean_u / lateral, mean_v / lateral
            # of the part w - cot (a u + b v), whose mean is zero
            spread = (
                ww - 2.0 * cotangent * (a * wu + b * wv) + cotangent**2 * (a * a * uu + 2 * a * b * uv + b * b * vv)
            )
            scale = ww + cotangent**2 * (uu + vv)
            less = np.where(count > 1.0, count - 1.0, np.nan)
            error = np.sqrt(_positive(ww - mean_w**2, ww) / less)
            cotangent_error = np.sqrt(_positive(spread, scale) / less) / lateral
        return mean_w, error, cotangent, cotangent_error

    mean, error, cotangent, cotangent_error = (each[0] for each in at(np.ones((1, len(response)))))
    means, errors, cotangents, cotangent_errors = at(draws)
    along = _studentised(mean, error, means, errors, confidence)
    turned = _studentised(cotangent, cotangent_error, cotangents, cotangent_errors, confidence)
    with np.errstate(invalid="ignore"):
        normalised = np.where(np.isinf(turned), np.sign(turned), turned / np.sqrt(1.0 + turned**2))
    work = along * size
    # a response that has nothing across the increment has no finite cotangent
    normalised = np.where(np.isnan(normalised), np.sign(work), normalised)
    with np.errstate(divide="ignore", invalid="ignore"):
        length = np.linalg.norm([each.sum(axis=0) / there.sum(axis=0) for each in (w, u, v)], axis=0)
    either_way = np.array([[-1.0], [1.0]])
    work = work + either_way * within
    normalised = np.clip(normalised + either_way * within / (length * size), -1.0, 1.0)
    for one, other in ((work, normalised), (normalised, work)):
        one[0] = np.where(other[0] <= 0.0, np.minimum(one[0], 0.0), one[0])
        one[1] = np.where(other[1] >= 0.0, np.maximum(one[1], 0.0), one[1])
    return work, normalised, means < 0.0


def _axes(imposed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The direction imposed, and two across it."""
    unit = imposed / np.linalg.norm(imposed, axis=-1, keepdims=True)
    other = np.eye(3)[np.abs(unit).argmin(axis=-1)]
    first = np.cross(unit, other)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return unit, first, np.cross(unit, first)


def _positive(variance: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """The variance, zero where it is nothing but rounding."""
    return np.where(variance > ROUNDING * scale, variance, np.where(np.isnan(variance), np.nan, 0.0))


def _studentised(
    value: np.ndarray, error: np.ndarray, values: np.ndarray, errors: np.ndarray, confidence: float
) -> np.ndarray:
    """(2, n) bounds of values with their standard errors, from those of the resamples."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (values - value) / errors
    # resamples of one specimen again and again, or of none, have no standard error: as far as can be, on their side
    t = np.where(np.isfinite(errors), t, np.copysign(np.inf, values - value))
    t[np.isnan(t)] = 0.0
    t.sort(axis=0)
    tail = 0.5 * (1.0 - confidence)
    low, high = int(np.floor(tail * (len(t) - 1))), int(np.ceil((1.0 - tail) * (len(t) - 1)))
    with np.errstate(invalid="ignore"):
        bounds = value - t[[high, low]] * error
    # no spread at all is none, whatever t is
    return np.where(error == 0.0, value, bounds)


def wilson(count: np.ndarray, total: np.ndarray, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    """Wilson intervals of shares; NaN where there is nothing.

    >>> [bounds.round(3).tolist() for bounds in wilson(np.array([0, 8]), np.array([16, 16]), 0.95)]
    [[0.0, 0.28], [0.194, 0.72]]
    """
    from scipy.stats import binomtest

    count, total = np.asarray(count), np.asarray(total)
    pairs, where = np.unique(np.stack((count.ravel(), total.ravel())), axis=1, return_inverse=True)
    found = np.full((2, pairs.shape[1]), np.nan)
    for k, (own, all_of) in enumerate(pairs.T.astype(int)):
        if all_of:
            interval = binomtest(int(own), int(all_of)).proportion_ci(confidence, method="wilson")
            found[:, k] = interval.low, interval.high
    low, high = found[:, where.ravel()].reshape(2, *count.shape)
    return low, high


def students_t(degrees_of_freedom: int, confidence: float) -> float:
    """The factor of a two-sided interval of a mean.

    >>> round(students_t(7, 0.95), 3)
    2.365
    """
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * confidence, degrees_of_freedom))
