"""Which contacts and grains a second-order work comes from: classes, directions, forces, clusters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.micro.clustering import beyond_a_grain, clustering, moved_alike, partners
from rendulic.micro.contact_work import CLASSES, ContactWork
from rendulic.micro.coordination import coordination
from rendulic.micro.fabric import fabric
from rendulic.micro.grain_work import grain_work
from rendulic.probing.second_order_work import SecondOrderWork, second_order_work
from rendulic.specimen.snapshot import Snapshot, as_snapshot

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["BOUNDS", "NETWORKS", "SIGNS", "anatomy", "carriers", "summary"]

NETWORKS = ("strong", "weak")
INSTANTS = ("before", "after")
SIGNS = ("negative", "positive")
BOUNDS = ("low", "mean", "high")  # of what chance gives: beyond each end in one of twenty
POLAR_BINS = 9  # of 10 degrees
CARRIED = 0.5  # share of the negative work that the carriers carry
DETAIL = ("pair", "grain")  # dimensions that a summary leaves out


def anatomy(before: Snapshot, after: Snapshot, *, n_shuffles: int = 99, seed: int = 0) -> xr.Dataset:
    """Where in the grains the second-order work between two snapshots is, any engine's.

    Parameters
    ----------
    before, after : Snapshot
        Of one specimen, e.g. before and after a probe.
    n_shuffles, seed : int
        Random sets that the clusters are compared with; see `micro.clustering`. Fewer than 19 give no ends of chance.

    Returns
    -------
    xarray.Dataset
        Per `pair` in contact before or after: the bodies `first` and `second`, `w2` in J, `class_of_pair` (index into
        `CLASSES`), `normal`, `position` of the contact, `relative_force` (normal force before over its mean; 0 for a
        contact created), `is_sliding` after. Per `grain`: `position`, `radius`, `w2` in J, whose sum is that of the
        walls exactly. Summed, in J/m3:

        - `w2_by_class` and `w2_inertial`; together they are `w2_boundary`,
        - `w2_by_network` and `contacts_by_network`, `negative_by_network` (numbers) by `network` (strong: normal force
          above its mean) and `slides`,
        - `w2_by_polar`, `contacts_by_polar`, `negative_by_polar` by the angle `polar` between normal and axis 1,
          walls left out.

        Of the pairs whose work is negative: `negative_contacts`, their share of all; `w2_negative` and
        `w2_positive`, `w2_negative_sliding`, and `negative_over_positive`, which exceeds 1 where the contacts' second-order work is
        negative; `carriers`, the least share of all contacts that carries half of the negative work. Of the negative
        pairs and of the carriers (dimension `which`): `cluster_index`, `cluster_score`, `cluster_chance`, `largest_cluster`,
        `largest_at_random`; see `micro.Clustering`. These compare with contacts dealt out freely, which is no control: contacts
        of one grain are alike in any set. What is left beyond that is in `beyond_index` of the carriers by `sign` (beside
        each of negative work stands one of positive work, of like size), with what chance gives by `bound`:
        `beyond_kept` where displacements are kept, `beyond_signs` of the difference of both signs where signs are dealt out
        anew; see `micro.beyond_a_grain`, and `rd.cluster_controls` for stable directions beside it. At each `instant`: `coordination`, `mechanical_coordination`,
        `rattlers`, `fabric_anisotropy`.

    Raises
    ------
    InvalidInput
        If the two snapshots are not of the same grains.
    """
    before, after = as_snapshot(before), as_snapshot(after)
    return anatomy_of(second_order_work(before, after), before, after, n_shuffles=n_shuffles, seed=seed)


def anatomy_of(work: SecondOrderWork, before: Snapshot, after: Snapshot, n_shuffles: int = 99, seed: int = 0):
    """The anatomy of a second-order work that is known already; see `anatomy`."""
    import xarray as xr

    pairs = work.per_contact
    detail = _pairs(pairs, before, after)
    negative, carry = pairs.work < 0.0, carriers(pairs.work)
    variables: dict[str, Any] = {
        **detail,
        "grain_position": (("grain", "component"), before.position, "centre before", "m"),
        "grain_radius": ("grain", before.radius, "radius", "m"),
        "grain_w2": ("grain", grain_work(before, after, pairs), "second-order work of the grain", "J"),
        "w2_boundary": ((), work.boundary, "second-order work of the walls", "J/m3"),
        "w2_inertial": ((), work.grains, "inertial term of the grains", "J/m3"),
        "w2_by_class": ("contact_class", [work.by_class[name] for name in CLASSES], "by class of contact", "J/m3"),
        "negative_contacts": ((), _share(negative), "share of contacts with negative work", "1"),
        "w2_negative": ((), pairs.work[negative].sum() / before.volume, "sum over these", "J/m3"),
        "w2_positive": ((), pairs.work[~negative].sum() / before.volume, "sum over the others", "J/m3"),
        "w2_negative_sliding": (
            (),
            _sliding(pairs, detail, negative) / before.volume,
            "of these, sliding ones",
            "J/m3",
        ),
        "carriers": ((), _share(carry), "share of contacts that carries half of the negative work", "1"),
    }
    positive = float(variables["w2_positive"][1])
    ratio = -float(variables["w2_negative"][1]) / positive if positive > 0.0 else float("nan")
    variables["negative_over_positive"] = ((), ratio, "negative work over positive work", "1")
    variables |= _networks(pairs, detail, before.volume) | _polar(pairs, detail, before.volume)
    found = [
        clustering(pairs.first, pairs.second, before.n_grains, chosen, n_shuffles, seed) for chosen in (negative, carry)
    ]
    for name, pick, label in (
        ("cluster_index", "index", "Moran's I over contacts that share a grain"),
        ("cluster_score", "score", "its distance from chance in standard deviations"),
        ("cluster_chance", "chance", "this standard deviation"),
        ("largest_cluster", "largest", "share of the set in its largest connected cluster"),
        ("largest_at_random", "largest_at_random", "the same of random sets, median"),
    ):
        variables[name] = ("which", [getattr(one, pick) for one in found], label, "1")
    variables |= _beyond(pairs, detail, before, carry, n_shuffles, seed) | _instants(before, after)
    coords = {
        "component": [1, 2, 3],
        "contact_class": list(CLASSES),
        "network": list(NETWORKS),
        "slides": [False, True],
        "which": ["negative", "carriers"],
        "sign": list(SIGNS),
        "bound": list(BOUNDS),
        "instant": list(INSTANTS),
        "polar": ("polar", (np.arange(POLAR_BINS) + 0.5) * 90.0 / POLAR_BINS, {"units": "degree"}),
    }
    data = {
        name: (dims, values, {"long_name": label, "units": unit})
        for name, (dims, values, label, unit) in variables.items()
    }
    return xr.Dataset(data, coords, {"volume": before.volume, "d_eps": work.d_eps, "d_sigma": work.d_sigma})


def summary(found: xr.Dataset) -> xr.Dataset:
    """An anatomy without its pairs and grains: what `rd.probe(..., anatomy=True)` keeps of every direction."""
    return found.drop_dims(DETAIL, errors="ignore")


def carriers(work: np.ndarray) -> np.ndarray:
    """The fewest contacts that carry half of the negative second-order work.

    Parameters
    ----------
    work : (n,) array
        Second-order work per contact.

    Returns
    -------
    (n,) bool array

    Examples
    --------
    >>> import numpy as np
    >>> carriers(np.array([5.0, -1.0, -4.0, -2.0])).tolist()
    [False, False, True, False]
    """
    order = np.argsort(work, kind="stable")
    so_far = np.cumsum(np.minimum(work[order], 0.0))
    chosen = np.zeros(len(work), dtype=bool)
    if len(work) and so_far[-1] < 0.0:
        chosen[order[: int(np.searchsorted(-so_far, -CARRIED * so_far[-1])) + 1]] = True
    return chosen


def _beyond(
    pairs: ContactWork, detail: dict[str, tuple], before: Snapshot, carry: np.ndarray, n_shuffles: int, seed: int
):
    """Carriers of both signs, compared where they share no grain."""
    negative = np.flatnonzero(carry)
    positive = partners(pairs.work, negative)
    negative = negative[: len(positive)]  # none if there are not as many positive ones
    radius = np.concatenate((before.radius, np.zeros(6)))
    groups = moved_alike(pairs.apart, detail["normal"][1], radius[pairs.first] + radius[pairs.second])
    found = beyond_a_grain(pairs.first, pairs.second, before.n_grains, negative, positive, groups, n_shuffles, seed)
    label = "Moran's I of the carriers over contacts joined by a third, no grain shared"
    return {
        "beyond_index": ("sign", [found.negative, found.positive], label, "1"),
        "beyond_kept": ("bound", found.kept, "the same of the negative ones by chance, displacements kept", "1"),
        "beyond_signs": (
            "bound",
            found.signs,
            "its difference, negative less positive, by chance, signs dealt anew",
            "1",
        ),
    }


def _sliding(pairs: ContactWork, detail: dict[str, tuple], negative: np.ndarray) -> float:
    return float(pairs.work[negative & detail["is_sliding"][1]].sum())


def _share(chosen: np.ndarray) -> float:
    return float(chosen.mean()) if len(chosen) else float("nan")


def _pairs(pairs: ContactWork, before: Snapshot, after: Snapshot) -> dict[str, tuple]:
    """What each pair is: from the state before, or from that after if it was created."""
    was, now = pairs.in_before >= 0, pairs.in_after >= 0
    normal, position = np.zeros((len(pairs.work), 3)), np.zeros((len(pairs.work), 3))
    force, slides = np.zeros(len(pairs.work)), np.zeros(len(pairs.work), dtype=bool)
    # the state before is written last: it decides where a pair is in both
    for snapshot, here, at in ((after, now, pairs.in_after[now]), (before, was, pairs.in_before[was])):
        turned = np.where(snapshot.first > snapshot.second, -1.0, 1.0)[:, None]
        normal[here] = (turned * snapshot.normal)[at]
        position[here] = _contact_points(snapshot)[at]
    force[was] = before.force_n[pairs.in_before[was]]
    slides[now] = after.is_sliding[pairs.in_after[now]]
    mean = float(before.force_n.mean()) if len(before.force_n) else float("nan")
    return {
        "first": ("pair", pairs.first, "grain", "1"),
        "second": ("pair", pairs.second, "grain, or wall from the number of grains on", "1"),
        "w2": ("pair", pairs.work, "second-order work df . dl", "J"),
        "class_of_pair": ("pair", pairs.contact_class, f"index into {', '.join(CLASSES)}", "1"),
        "normal": (("pair", "component"), normal, "unit vector from first to second", "1"),
        "position": (("pair", "component"), position, "point of contact", "m"),
        "relative_force": ("pair", force / mean, "normal force before over its mean", "1"),
        "is_sliding": ("pair", slides, "at the Coulomb limit after", "1"),
    }


def _contact_points(snapshot: Snapshot) -> np.ndarray:
    """Where each contact is: between two grains the distance is parted as their radii, at a wall on its plane."""
    radius = snapshot.radius
    own = radius[snapshot.first]
    other = np.where(snapshot.is_wall, 0.0, radius[np.minimum(snapshot.second, snapshot.n_grains - 1)])
    return snapshot.position[snapshot.first] + (own / (own + other))[:, None] * snapshot.branch


def _networks(pairs: ContactWork, detail: dict[str, tuple], volume: float) -> dict[str, tuple]:
    """Sums over strong and weak contacts, those that slide and those that do not."""
    at = 2 * (detail["relative_force"][1] <= 1.0) + detail["is_sliding"][1]
    return _sums(at, (2, 2), ("network", "slides"), "network", pairs.work, volume)


def _polar(pairs: ContactWork, detail: dict[str, tuple], volume: float) -> dict[str, tuple]:
    """Sums over contacts whose normals are at like angles to axis 1; walls point along the axes and are left out."""
    between = pairs.contact_class != CLASSES.index("wall")
    angle = np.degrees(np.arccos(np.clip(np.abs(detail["normal"][1][between, 0]), 0.0, 1.0)))
    at = np.minimum((angle * POLAR_BINS / 90.0).astype(int), POLAR_BINS - 1)
    return _sums(at, (POLAR_BINS,), ("polar",), "polar", pairs.work[between], volume)


def _sums(at: np.ndarray, shape: tuple[int, ...], dims: tuple[str, ...], name: str, work: np.ndarray, volume: float):
    count = int(np.prod(shape))
    return {
        f"w2_by_{name}": (dims, np.bincount(at, work, count).reshape(shape) / volume, "second-order work", "J/m3"),
        f"contacts_by_{name}": (dims, np.bincount(at, minlength=count).reshape(shape), "number of contacts", "1"),
        f"negative_by_{name}": (
            dims,
            np.bincount(at[work < 0.0], minlength=count).reshape(shape),
            "number with negative work",
            "1",
        ),
    }


def _instants(before: Snapshot, after: Snapshot) -> dict[str, tuple]:
    both = (before, after)
    found = [coordination(snapshot) for snapshot in both]
    return {
        "coordination": ("instant", [one.mean for one in found], "contacts with grains per grain", "1"),
        "mechanical_coordination": ("instant", [one.mechanical for one in found], "the same without rattlers", "1"),
        "rattlers": ("instant", [one.rattlers for one in found], "share of grains with fewer than two contacts", "1"),
        "fabric_anisotropy": (
            "instant",
            [fabric(snapshot.normal[~snapshot.is_wall]).anisotropy for snapshot in both],
            "anisotropy of the fabric, positive along axis 1",
            "1",
        ),
    }
