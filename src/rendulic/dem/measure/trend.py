"""Whether a positive quantity grows or decays in time, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Trend", "trend"]

BLOCKS = 8  # neighbouring values are alike: only means of blocks count as independent
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Trend:
    """Growth of the logarithm of a quantity.

    Parameters
    ----------
    growth : float
        In 1/s; negative where it decays.
    error : float
        Half width of its 95 % interval in 1/s; infinite where too few values were seen.
    """

    growth: float
    error: float

    @property
    def surely_decays(self) -> bool:
        """Whether the whole interval is negative."""
        return self.growth + self.error < 0.0


def trend(time, value) -> Trend:
    """The trend of positive values (n,) at increasing times (n,) in s.

    A line is fitted to the means of the logarithms in eight blocks of equal duration. Blocks without a value are left out.

    >>> time = np.linspace(0.0, 1.0, 101)
    >>> round(trend(time, np.exp(-3.0 * time)).growth, 6)
    -3.0
    """
    from scipy.stats import linregress, t

    time, value = np.asarray(time, dtype=float), np.asarray(value, dtype=float)
    seen = value > 0.0
    time, value = time[seen], value[seen]
    if len(time) == 0 or not time[-1] > time[0]:
        return Trend(np.nan, np.inf)
    place = np.minimum((BLOCKS * (time - time[0]) / (time[-1] - time[0])).astype(int), BLOCKS - 1)
    count = np.bincount(place, minlength=BLOCKS)
    filled = count > 0
    if filled.sum() < 4:
        return Trend(np.nan, np.inf)
    middle = np.bincount(place, time, BLOCKS)[filled] / count[filled]
    # the mean of the logarithms: exact for an exponential
    mean = np.bincount(place, np.log(value), BLOCKS)[filled] / count[filled]
    fit = linregress(middle, mean)
    quantile = float(t.ppf(0.5 + 0.5 * CONFIDENCE, filled.sum() - 2))
    return Trend(float(fit.slope), quantile * float(fit.stderr))
