"""Whether contacts that stand out lie together, are spread at random, or avoid each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rendulic.foundation.checks import whole_number
from rendulic.foundation.errors import InvalidInput

__all__ = ["VERDICTS", "Clustering", "clustering", "moran", "verdict_of"]

VERDICTS = ("dispersed", "diffuse", "clustered")
SURE = 3.0  # standard deviations


@dataclass(frozen=True)
class Clustering:
    """How a set of contacts lies in the network of all contacts; two are neighbours if they share a grain.

    Parameters
    ----------
    index : float
        Moran's I of the set: 0 if neighbours are as alike as any two contacts, 1 if always alike, negative if they
        differ. NaN if the set is empty or has all contacts.
    score : float
        Distance of the index from its mean over all labellings with as many contacts, in their standard deviations.
    chance : float
        This standard deviation.
    largest : float
        Share of the set that its largest connected cluster holds.
    largest_at_random : float
        The same, median of random sets of as many contacts.
    """

    index: float
    score: float
    chance: float
    largest: float
    largest_at_random: float

    @property
    def verdict(self) -> str:
        """Clustered or dispersed beyond three standard deviations of chance, else diffuse."""
        return verdict_of(self.score)


def verdict_of(score: float) -> str:
    """What a standard score says; see `Clustering.verdict`.

    >>> verdict_of(-4.0), verdict_of(float("nan"))
    ('dispersed', 'undetermined')
    """
    if np.isnan(score):
        return "undetermined"
    return VERDICTS[1 + (score > SURE) - (score < -SURE)]


def clustering(first, second, n_grains: int, chosen, n_shuffles: int = 49, seed: int = 0) -> Clustering:
    """Whether chosen contacts, e.g. those of negative second-order work, lie in clusters.

    Parameters
    ----------
    first, second : (n,) int arrays
        Bodies of each contact; from `n_grains` on they are walls, which make no neighbours.
    n_grains : int
        Number of grains.
    chosen : (n,) bool array
        The set.
    n_shuffles : int
        Random sets for `largest_at_random`; none: NaN.
    seed : int
        Of the random sets.

    Raises
    ------
    InvalidInput
        If the arrays differ in length.

    Examples
    --------
    A chain of contacts, the first half of them chosen:

    >>> import numpy as np
    >>> grain = np.arange(100)
    >>> found = clustering(grain, grain + 1, 101, grain < 50)
    >>> found.verdict, round(found.index, 2), found.largest
    ('clustered', 0.98, 1.0)
    """
    first, second, chosen = np.asarray(first), np.asarray(second), np.asarray(chosen, dtype=bool)
    if not len(first) == len(second) == len(chosen):
        raise InvalidInput(
            f"first, second and chosen must name the same contacts, got {len(first)}, {len(second)} and {len(chosen)}"
        )
    whole_number("n_shuffles", n_shuffles, 0)
    if chosen.all() or not chosen.any():
        return Clustering(*(float("nan"),) * 3, float(chosen.any()), float("nan"))
    index, score, chance = moran(first, second, n_grains, chosen.astype(float))
    random = np.random.default_rng(seed)
    shuffled = [_largest(first, second, n_grains, random.permutation(chosen)) for _ in range(n_shuffles)]
    at_random = float(np.median(shuffled)) if shuffled else float("nan")
    return Clustering(index, score, chance, _largest(first, second, n_grains, chosen), at_random)


def moran(first: np.ndarray, second: np.ndarray, n_grains: int, values: np.ndarray) -> tuple[float, float, float]:
    """Moran's I of a value per contact over contacts that share a grain, its standard score, and the chance in it.

    1. `I = (n / S_0) sum_ij w_ij z_i z_j / sum_i z_i^2`, z the values less their mean, w_ij = 1 for neighbours. The sum
       over the neighbours at a grain is `(sum z)^2 - sum z^2`, so that no matrix is needed.
    2. Mean and variance are those over all permutations of the values, in closed form (Cliff and
       Ord, Spatial Processes, 1981).

    Returns
    -------
    index, score, deviation : float
        The last is the standard deviation over permutations. NaN if the values are all equal, there are fewer than four contacts, or no two share a grain.
    """
    n = len(values)
    centred = values - values.mean() if n else values
    square = float((centred**2).sum())
    ends, is_grain = np.concatenate((first, second)), np.concatenate((first, second)) < n_grains
    at, which = ends[is_grain], np.tile(np.arange(n), 2)[is_grain]
    here = np.bincount(at, minlength=n_grains)
    neighbours = np.bincount(which, here[at] - 1, n)
    s_0 = float(neighbours.sum())
    if n < 4 or s_0 == 0.0 or square == 0.0:
        return (float("nan"),) * 3
    summed = np.bincount(at, centred[which], n_grains)
    index = n / s_0 * float((summed**2).sum() - (centred[which] ** 2).sum()) / square
    s_1, s_2 = 2.0 * s_0, 4.0 * float((neighbours**2).sum())
    kurtosis = n * float((centred**4).sum()) / square**2
    mean = -1.0 / (n - 1)
    second_moment = (
        n * ((n**2 - 3 * n + 3) * s_1 - n * s_2 + 3 * s_0**2)
        - kurtosis * ((n**2 - n) * s_1 - 2 * n * s_2 + 6 * s_0**2)
    ) / ((n - 1) * (n - 2) * (n - 3) * s_0**2)  # fmt: skip
    variance = second_moment - mean**2
    deviation = float(np.sqrt(max(variance, 0.0)))
    return index, (index - mean) / deviation if deviation > 0.0 else float("nan"), deviation


def _largest(first: np.ndarray, second: np.ndarray, n_grains: int, chosen: np.ndarray) -> float:
    """Share of the chosen contacts in their largest connected cluster."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    one, other = first[chosen], second[chosen]
    other = np.where(other < n_grains, other, one)  # a wall connects nothing
    graph = coo_array((np.ones(len(one), dtype=np.int8), (one, other)), shape=(n_grains, n_grains))
    _, cluster = connected_components(graph, directed=False)
    return float(np.bincount(cluster[one]).max() / len(one))
