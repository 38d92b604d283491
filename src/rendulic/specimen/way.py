"""How a probe of grains went on its way, and how it came to rest."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

__all__ = ["Way"]


@dataclass(frozen=True)
class Way:
    """What one can know of a probe but its end.

    Parameters
    ----------
    smooth : float
        Unbalanced force on the smooth parts of the way, while the walls moved: the tenth percentile of what was seen. It is in
        proportion to the rate; where grains break loose, it is larger for a while.
    largest : float
        Largest unbalanced force on the way.
    work : (k, 2) array
        At each look, the share of the way done, and W2n since its beginning, with the stresses of the walls.
    settling_steps : int
        Steps for which the walls were held before the reading.
    is_settled : bool
        Whether the grains were at rest when they were read.
    """

    smooth: float
    largest: float
    work: np.ndarray = field(repr=False, compare=False)
    settling_steps: int
    is_settled: bool

    def change_of_work(self, share: float) -> float:
        """How much W2n changed over the last `share` of the way that was done; NaN where it is not known."""
        done, work = self.work.T
        last = work[done >= (1.0 - share) * done[-1]]
        return float(np.ptp(last)) if np.isfinite(last).all() else float("nan")
