"""Whether contacts that stand out lie together, and whether more than their grains' displacements make them.

Contacts of one grain share its displacement, its rotation and its size. So contacts that stand out in any way lie together,
and a comparison with contacts dealt out freely (`clustering`) says nothing about failure. `beyond_a_grain` asks the question
that does: it compares contacts that share *no* grain, with two nulls that keep what is shared.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.checks import whole_number
from rendulic.foundation.errors import InvalidInput

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = [
    "VERDICTS", "BeyondAGrain", "Clustering", "beyond_a_grain", "clustering", "joined_by_a_third", "moran", "moved_alike",
    "partners", "verdict_of",
]  # fmt: skip

VERDICTS = ("dispersed", "diffuse", "clustered")
SURE = 3.0  # standard deviations
CHANCE = 0.05  # how often something is called more than chance that is chance
ALIKE = 8  # contacts that one of like displacement is exchanged with, itself among them


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
        """Clustered or dispersed beyond three standard deviations of chance, else diffuse.

        Chance deals contacts out freely, which is no control: any set of contacts that grains have in common is clustered.
        """
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


@dataclass(frozen=True)
class BeyondAGrain:
    """Whether the carriers of negative second-order work lie together where they share no grain.

    Parameters
    ----------
    negative : float
        Moran's I of the carriers of negative work, over contacts that a third contact joins and that share no grain.
    positive : float
        The same of as many contacts of positive work, of like size.
    kept : (3,) array
        The index of the negative carriers where contacts of like displacement exchange their labels: lower end, mean and
        upper end; one of twenty draws is beyond each end.
    signs : (3,) array
        `negative - positive` where signs are dealt out anew: the same three numbers.
    """

    negative: float
    positive: float
    kept: np.ndarray
    signs: np.ndarray


def beyond_a_grain(
    first, second, n_grains: int, negative, positive, alike, n_shuffles: int = 99, seed: int = 0
) -> BeyondAGrain:
    """Whether carriers of negative work lie together beyond what grains share, against two nulls.

    1. Only contacts that share no grain, and that a third contact joins, are compared (`joined_by_a_third`). What the contacts
       of one grain have in common, its displacement, its rotation, its size, then makes no likeness, known or not.
    2. Null "displacements kept": the labels are permuted among contacts whose grains moved against each other alike
       (`moved_alike`). It keeps the displacements of all grains, and how often a contact that moves so is a carrier. It breaks
       everything else: rotations, forces, sliding, where the contact is. It is exact if whether a contact is a carrier depends
       on its own relative displacement and on nothing that its neighbours know (the conditional permutation test of Berrett,
       Wang, Barber and Samworth, J. R. Statist. Soc. B 82, 2020, with groups in place of a density).
    3. Null "signs": each negative carrier and the positive one of like size (`partners`) keep their places, and it is dealt out
       anew which of the two is negative. It is exact if carriers lie where much moves, whatever their sign.

    Parameters
    ----------
    first, second : (n,) int arrays
        Bodies of each contact; from `n_grains` on they are walls, which join nothing.
    n_grains : int
        Number of grains.
    negative, positive : (m,) int arrays
        Contacts that are carriers, each negative one beside its positive partner.
    alike : (n,) int array
        Group of each contact, from `moved_alike`.
    n_shuffles : int
        Draws from each null; with 99 the ends are at exactly 5 %.
    seed : int
        Of the draws.

    Returns
    -------
    BeyondAGrain
        All NaN where there are no carriers, or no two contacts are joined by a third.
    """
    negative, positive, alike = np.asarray(negative), np.asarray(positive), np.asarray(alike)
    whole_number("n_shuffles", n_shuffles, 0)
    weights = joined_by_a_third(first, second, n_grains)
    if weights.nnz == 0 or not len(negative):
        return BeyondAGrain(float("nan"), float("nan"), np.full(3, np.nan), np.full(3, np.nan))
    random = np.random.default_rng(seed)
    # only in groups with a carrier is there anything to permute
    place = np.flatnonzero(np.isin(alike, alike[negative]))
    place = place[np.argsort(alike[place], kind="stable")]
    labelled = np.isin(place, negative)
    kept = [place[labelled[np.argsort(alike[place] + random.random(len(place)))]] for _ in range(n_shuffles)]
    swap = random.random((n_shuffles, len(negative))) < 0.5
    of_dealt = _index_of(weights, [*np.where(swap, positive, negative), *np.where(swap, negative, positive)])
    own = _index_of(weights, [negative, positive])
    return BeyondAGrain(
        float(own[0]), float(own[1]), _bounds(_index_of(weights, kept)),
        _bounds(of_dealt[:n_shuffles] - of_dealt[n_shuffles:]),
    )  # fmt: skip


def partners(work, negative) -> np.ndarray:
    """For each contact of negative work one of positive work that is as large, each only once.

    Parameters
    ----------
    work : (n,) array
        Second-order work per contact.
    negative : (m,) int array
        Contacts of negative work.

    Returns
    -------
    (m,) int array
        The contacts of positive work; the largest negative one chooses first. Empty if there are fewer than m.

    Examples
    --------
    >>> partners([-3.0, 1.0, 2.9, 7.0, -1.5], [0, 4]).tolist()
    [2, 1]
    """
    work, negative = np.asarray(work, dtype=float), np.asarray(negative, dtype=np.int64)
    free = np.flatnonzero(work > 0.0)
    if len(free) < len(negative):
        return np.zeros(0, dtype=np.int64)
    free = free[np.argsort(work[free], kind="stable")].tolist()
    sizes = work[free].tolist()
    found = np.empty(len(negative), dtype=np.int64)
    for k in np.argsort(work[negative], kind="stable"):
        size = -work[negative[k]]
        at = bisect(sizes, size)
        if at == len(sizes) or (at > 0 and size - sizes[at - 1] <= sizes[at] - size):
            at -= 1
        sizes.pop(at)
        found[k] = free.pop(at)
    return found


def joined_by_a_third(first, second, n_grains: int) -> csr_array:
    """Which contacts have a third contact between them but no grain in common.

    Parameters
    ----------
    first, second, n_grains
        As for `clustering`.

    Returns
    -------
    (n, n) scipy.sparse.csr_array
        Symmetric, 1 for such pairs.

    Examples
    --------
    In a chain of four contacts only the first and third, and the second and fourth, are:

    >>> joined_by_a_third([0, 1, 2, 3], [1, 2, 3, 4], 5).toarray().astype(int).tolist()
    [[0, 0, 1, 0], [0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]]
    """
    from scipy.sparse import csr_array

    first, second = np.asarray(first), np.asarray(second)
    n = len(first)
    ends, contact = np.concatenate((first, second)), np.tile(np.arange(n), 2)
    is_grain = ends < n_grains
    ones = np.ones(int(is_grain.sum()), dtype=np.int64)
    at = csr_array((ones, (ends[is_grain], contact[is_grain])), shape=(n_grains, n))
    shares = (at.T @ at).tocsr()
    reached = (shares @ shares).tocsr()
    reached.data[:] = 1
    shares.data[:] = 1
    found = csr_array(reached - shares)  # a contact reaches all that it shares a grain with, itself too
    found.eliminate_zeros()
    return found.astype(float)


def moved_alike(apart, normal, extent, size: int = ALIKE) -> np.ndarray:
    """Groups of about `size` contacts whose grains moved against each other alike.

    Contacts are sorted by the angle between relative displacement and normal, so that those that close, shear and open are
    apart, and within a range of angles by `extent * |apart|^2`, on which a linear contact's work depends.

    Parameters
    ----------
    apart : (n, 3) array
        Relative displacement of the bodies of each contact in m.
    normal : (n, 3) array
        Unit vectors.
    extent : (n,) array
        Distance of the centres in m; stiffness grows with it.
    size : int
        Mean number of contacts of a group.

    Returns
    -------
    (n,) int array
        Number of each contact's group.
    """
    length2 = (np.asarray(apart) ** 2).sum(axis=1)
    along = (apart * normal).sum(axis=1) / np.sqrt(np.where(length2 > 0.0, length2, 1.0))
    count = max(round(np.sqrt(len(along) / size)), 1)
    angle = _ranks(along) * count // max(len(along), 1)
    group = np.empty(len(along), dtype=np.int64)
    for k in range(count):
        here = np.flatnonzero(angle == k)
        group[here] = k * count + _ranks((extent * length2)[here]) * count // max(len(here), 1)
    return group


def _ranks(values: np.ndarray) -> np.ndarray:
    return np.argsort(np.argsort(values, kind="stable"), kind="stable")


def _index_of(weights: csr_array, sets: Sequence[np.ndarray]) -> np.ndarray:
    """Moran's I of each set of contacts, labelled 1 among all others, 0."""
    from scipy.sparse import csr_array

    n, total, degree = weights.shape[0], weights.sum(), weights.sum(axis=1)
    if not len(sets):
        return np.zeros(0)
    size = np.array([len(chosen) for chosen in sets])
    rows = np.repeat(np.arange(len(sets)), size)
    labels = csr_array((np.ones(len(rows)), (rows, np.concatenate(sets))), shape=(len(sets), n))
    both = (labels @ weights).multiply(labels).sum(axis=1)
    mean = size / n
    with np.errstate(divide="ignore", invalid="ignore"):
        return n / total * (both - 2.0 * mean * (labels @ degree) + mean**2 * total) / (size * (1.0 - mean))


def _bounds(draws: np.ndarray) -> np.ndarray:
    """Lower end, mean and upper end: a further draw is beyond each end in 5 % of cases."""
    if len(draws) < 1.0 / CHANCE - 1.0:
        return np.full(3, np.nan)
    ordered, beyond = np.sort(draws), int(CHANCE * (len(draws) + 1))
    return np.array([ordered[beyond - 1], draws.mean(), ordered[-beyond]])


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
