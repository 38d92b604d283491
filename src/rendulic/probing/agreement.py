"""How often bursts do what second-order work predicts, how sure that share is, and what it is worth."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.probing.burst import VERDICTS
from rendulic.probing.edges import NEAR_EDGE

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Agreement", "agreement", "interval_of", "judged"]


@dataclass(frozen=True)
class Agreement:
    """Counts of directions.

    Parameters
    ----------
    fails_as_predicted, fails_unpredicted : int
        Directions that failed, with and without a prediction of failure.
    stays_as_predicted, stays_unpredicted : int
        Directions that did not: without and with a prediction of failure. What moved and came to rest again did not fail.
    surely_stable, surely_stable_stays : int
        Directions whose W2 is surely positive at the size of the push, and those of them that did not fail. That is the control: a
        failure here refutes the prediction.
    undecided, too_fast : int
        Bursts that prove nothing.
    not_counted : int
        The other directions: those that the prediction does not speak of; see `judged`.
    """

    fails_as_predicted: int
    fails_unpredicted: int
    stays_as_predicted: int
    stays_unpredicted: int
    surely_stable: int
    surely_stable_stays: int
    undecided: int
    too_fast: int
    not_counted: int

    @property
    def agreeing(self) -> int:
        """Directions that did what was predicted."""
        return self.fails_as_predicted + self.stays_as_predicted

    @property
    def counted(self) -> int:
        """Directions with a prediction and a verdict."""
        return self.agreeing + self.fails_unpredicted + self.stays_unpredicted

    @property
    def share(self) -> float:
        """Of the counted directions, those that agree; NaN without any."""
        return self.agreeing / self.counted if self.counted else np.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the share.

        It takes directions as independent. Those of one state are not, so that the true interval is wider.
        """
        return interval_of(self.agreeing, self.counted)

    @property
    def expected(self) -> float:
        """Share that would agree if observation had nothing to do with prediction, at the same numbers of failures; NaN without any."""
        if not self.counted:
            return np.nan
        predicted = self.fails_as_predicted + self.stays_unpredicted
        observed = self.fails_as_predicted + self.fails_unpredicted
        fails = predicted * observed
        stays = (self.counted - predicted) * (self.counted - observed)
        return (fails + stays) / self.counted**2

    @property
    def kappa(self) -> float:
        """Cohen's kappa: 1 if all agree, 0 for what chance gives; NaN where all directions are predicted and observed alike."""
        return (self.share - self.expected) / (1.0 - self.expected) if self.expected < 1.0 else np.nan

    @property
    def p_value(self) -> float:
        """Fisher's exact test: how probable so many predicted failures are, if failures fell on directions by chance."""
        from scipy.stats import fisher_exact

        table = [
            [self.fails_as_predicted, self.stays_unpredicted],
            [self.fails_unpredicted, self.stays_as_predicted],
        ]
        return float(fisher_exact(table, alternative="greater").pvalue)


def agreement(tables: xr.Dataset | Iterable[xr.Dataset], margin: float = NEAR_EDGE) -> Agreement:
    """Count, over one or several tables, the directions that do what is predicted.

    Parameters
    ----------
    tables : xarray.Dataset, or several
        From `rd.bursts`. Tables of grains and of models do not belong together: the verdict of a model repeats the sign of its tangent.
    margin : float
        Directions closer to an edge of a cone, in degrees, are not counted.
    """
    import xarray as xr

    total = np.zeros(9, dtype=int)
    for table in [tables] if isinstance(tables, xr.Dataset) else tables:
        agrees, counted = judged(table, margin)
        predicted, verdict = table.predicted.values, table.verdict.values
        undecided, too_fast = (verdict == VERDICTS.index(word) for word in ("undecided", "too fast"))
        stable = counted & (table.w2_normalised.values > 0.0) & ~predicted
        total += [
            np.count_nonzero(which)
            for which in (
                counted & predicted & agrees, counted & ~predicted & ~agrees, counted & ~predicted & agrees,
                counted & predicted & ~agrees, stable, stable & agrees, undecided, too_fast, ~(counted | undecided | too_fast),
            )
        ]  # fmt: skip
    return Agreement(*total.tolist())


def judged(table: xr.Dataset, margin: float = NEAR_EDGE) -> tuple[np.ndarray, np.ndarray]:
    """Whether each direction agrees with its prediction, and whether it is counted, (n,) bool each.

    Only "fails" is failure; an avalanche that was arrested is none. Not counted are

    - directions of which the prediction does not speak: closer than `margin` degrees to an edge, with a sign within its error, and
      stable ones whose opposite is unstable, as a burst moves either way along its line, so that taking the push back can set
      off the failure of the opposite direction, or not;
    - directions whose burst proves nothing: undecided, or pushed too fast.
    """
    verdict = table.verdict.values
    proves = (verdict != VERDICTS.index("undecided")) & (verdict != VERDICTS.index("too fast"))
    return (table.predicted.values == table.observed.values) & proves, _spoken_of(table, margin) & proves


def _spoken_of(table: xr.Dataset, margin: float) -> np.ndarray:
    is_own = (table.w2_normalised.values < 0.0) | (table.w2_normalised_opposite.values >= 0.0)
    return (table.to_edge.values > margin) & is_own & table.is_sure.values.astype(bool)


def interval_of(count: int, of: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share; (0, 1) if nothing was counted.

    >>> [round(end, 3) for end in interval_of(9, 10)]
    [0.596, 0.982]
    """
    from scipy.stats import binomtest

    if not of:
        return 0.0, 1.0
    interval = binomtest(count, of).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)
