"""Do carriers of negative second-order work cluster more than controls do: stable directions, positive work, chance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.notebooks import Shown
from rendulic.micro.clustering import CHANCE

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["CONTROLS", "ClusterControls", "cluster_controls"]

CONTROLS = ("stable directions", "positive carriers", "displacements kept")
COMPARABLE = 0.5  # carriers of a stable direction, over those of the direction studied, at least


@dataclass(frozen=True)
class ClusterControls(Shown):
    """What is left of the clustering of negative carriers beyond three controls, in Moran's I beyond a shared grain.

    Parameters
    ----------
    alpha : (n_packings,) array
        Direction studied in each packing in degrees; NaN on a sphere of directions.
    is_unstable : bool
        Whether W2 is negative there.
    n_stable : (n_packings,) int array
        Stable directions that each was compared with.
    index : float
        Moran's I of the negative carriers in the direction studied, mean of the packings.
    difference, low, high : (3,) arrays
        Of `index` less that of each of `CONTROLS`; the lower end is exceeded by chance in 5 % of cases. NaN where a control
        is missing.
    """

    alpha: np.ndarray
    is_unstable: bool
    n_stable: np.ndarray
    index: float
    difference: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def least(self) -> int | None:
        """The control that leaves the least, as index into `CONTROLS`; None if one is missing."""
        return None if np.isnan(self.low).any() else int(np.argmin(self.low))

    @property
    def left(self) -> tuple[float, float, float]:
        """What is left after all three controls, with its lower and upper end; NaN if one is missing."""
        if (k := self.least) is None:
            return (float("nan"),) * 3
        return float(self.difference[k]), float(self.low[k]), float(self.high[k])

    @property
    def is_clustered(self) -> bool:
        """Whether all lower ends are positive: by chance in at most 5 % of cases, since each control alone allows no more."""
        return self.least is not None and bool((self.low > 0.0).all())

    @property
    def verdict(self) -> str:
        """The answer in one sentence."""
        of = f"{len(self.alpha)} packings" if len(self.alpha) > 1 else "one packing"
        if self.least is None:
            missing = ", ".join(name for name, low in zip(CONTROLS, self.low, strict=True) if np.isnan(low))
            return f"Whether carriers of negative work cluster is undetermined: no control by {missing}."
        left, low, high = self.left
        what = (
            "Carriers of negative work cluster more than all three controls" if self.is_clustered
            else f"No clustering of negative work is shown beyond the control by {CONTROLS[self.least]}"
        )  # fmt: skip
        where = "" if self.is_unstable else "; no direction is unstable"
        return (
            f"{what}: what is left of Moran's I = {self.index:.3f} is {left:+.3f} [{low:+.3f}, {high:+.3f}] ({of}{where}); by chance "
            f"it would be called clustered in at most {100 * CHANCE:.0f} % of cases."
        )

    def _facts(self) -> dict[str, object]:
        each = {
            f"less {name}": f"{self.difference[k]:+.3f} [{self.low[k]:+.3f}, {self.high[k]:+.3f}]"
            for k, name in enumerate(CONTROLS)
        }
        return {"index": f"{self.index:.3f}", **each, "verdict": self.verdict}


def cluster_controls(probes: xr.Dataset | Sequence[xr.Dataset], alpha: float | None = None) -> ClusterControls:
    """Clustering of negative carriers in the direction studied beside stable directions, positive carriers and chance.

    1. *Stable directions*: the index in the direction studied less its mean over the directions of the same state where W2 is
       significantly positive, that came to rest, and where there are at least half as many carriers (rarer ones cluster less by arithmetic).
    2. *Positive carriers*: less that of as many contacts of positive work of like size, in the same probe.
    3. *Displacements kept*: less its mean where contacts of like displacement exchange labels (`micro.beyond_a_grain`).

    One packing: the interval of 1 is Student's for one more direction like the stable ones, those of 2 and 3 are the ends of
    their nulls about the difference. Several packings: Student's interval of the mean difference, all three. Ends are at 5 % each.

    Parameters
    ----------
    probes : xarray.Dataset or sequence of these
        From `rd.probe(..., anatomy=True)` at one norm; several are packings of one recipe in like states.
    alpha : float, optional
        Direction studied in degrees; by default the one with the smallest W2n in each packing. Packings where it is not
        unstable are then left out, unless none is.

    Raises
    ------
    InvalidInput
        If there are no probes, they have no anatomy or several norms, or the direction was not probed.

    Examples
    --------
    >>> import rendulic as rd
    >>> sample = rd.dem.pack(n_grains=60, radius=(8e-3, 12e-3), pressure=200e3, seed=1)
    >>> probes = rd.probe(sample, rd.directions.rendulic(60), 1e-5, rate=1e-7, anatomy=True)
    >>> rd.cluster_controls(probes).is_clustered
    False
    """
    several = [probes] if not isinstance(probes, Sequence) else list(probes)
    if not several:
        raise InvalidInput("there are no probes: give those of one packing at least")
    found = [_of_one(one, alpha) for one in several]
    if alpha is None and any(one["w2n"] < 0.0 for one in found):
        found = [one for one in found if one["w2n"] < 0.0]
    difference = np.array([one["difference"] for one in found])
    if len(found) == 1:
        low, high = found[0]["low"], found[0]["high"]
        mean = difference[0]
    else:
        mean, low, high = np.array([_student(column) for column in difference.T]).T
    return ClusterControls(
        alpha=np.array([one["alpha"] for one in found]),
        is_unstable=all(one["w2n"] < 0.0 for one in found),
        n_stable=np.array([one["n_stable"] for one in found]),
        index=float(np.mean([one["index"] for one in found])),
        difference=mean, low=low, high=high,
    )  # fmt: skip


def _of_one(probes: xr.Dataset, alpha: float | None) -> dict:
    if "beyond_index" not in probes or "norm" in probes.dims:
        raise InvalidInput(
            "probes must have an anatomy at one norm: probe with anatomy=True and choose one with .sel(norm=...)"
        )
    axis = "alpha" if "alpha" in probes.dims else "direction"
    w2n, index = probes.w2_normalised.values, probes.beyond_index.transpose(axis, "sign").values
    if alpha is not None:
        asked = probes.alpha.values if axis == "alpha" else np.zeros(0)
        at = np.flatnonzero(np.isclose(asked, alpha % 360.0))
        if not len(at):
            raise InvalidInput(f"alpha = {alpha:g} was not probed: choose one of the probes' directions")
        studied = int(at[0])
    else:
        studied = int(np.nanargmin(w2n))
    stable = (w2n > 0.0) & probes.is_significant.values & np.isfinite(index[:, 0])
    stable &= probes.carriers.values >= COMPARABLE * probes.carriers.values[studied]
    if "is_settled" in probes:
        stable &= probes.is_settled.values
    stable[studied] = False
    one = probes.isel({axis: studied})
    own, kept, signs = index[studied], one.beyond_kept.values, one.beyond_signs.values
    others = index[stable, 0]
    spread = (
        _quantile(len(others)) * np.std(others, ddof=1) * np.sqrt(1.0 + 1.0 / len(others))
        if len(others) > 1
        else np.nan
    )
    difference = np.array([own[0] - others.mean() if len(others) else np.nan, own[0] - own[1], own[0] - kept[1]])
    # what chance adds above its mean may be in the difference, and is taken off; below likewise
    above = np.array([spread, signs[2] - signs[1], kept[2] - kept[1]])
    below = np.array([spread, signs[1] - signs[0], kept[1] - kept[0]])
    return {
        "alpha": float(probes.alpha.values[studied]) if axis == "alpha" else float("nan"), "w2n": float(w2n[studied]),
        "n_stable": len(others), "index": float(own[0]), "difference": difference, "low": difference - above,
        "high": difference + below,
    }  # fmt: skip


def _student(values: np.ndarray) -> tuple[float, float, float]:
    """Mean of a few values and the ends of its interval; NaN for fewer than two."""
    values = values[np.isfinite(values)]
    if len(values) < 2:
        return (float("nan"),) * 3
    error = _quantile(len(values)) * np.std(values, ddof=1) / np.sqrt(len(values))
    return float(values.mean()), float(values.mean() - error), float(values.mean() + error)


def _quantile(count: int) -> float:
    from scipy.stats import t

    return float(t.ppf(1.0 - CHANCE, count - 1))
