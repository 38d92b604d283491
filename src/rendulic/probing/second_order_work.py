"""Second-order work between two snapshots, macroscopic and at the contacts, and their identity."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rendulic.foundation.notebooks import Shown
from rendulic.micro.contact_work import CLASSES, ContactWork, contact_work
from rendulic.probing.audits import Audit, Audits, audits
from rendulic.specimen.snapshot import Snapshot, as_snapshot

__all__ = ["SecondOrderWork", "normalised", "second_order_work"]

SUMS = 1e-9  # of the largest term: sums of many terms in rounded numbers


@dataclass(frozen=True)
class SecondOrderWork(Shown):
    """Second-order work of one increment; densities in J/m3 (per initial volume).

    Parameters
    ----------
    boundary : float
        `sum_walls dF_w . du_w / V0`: the exact macroscopic value.
    lagrangian : float
        `dPi : dF` with the mean forces of opposite walls over initial areas (paper, Eq. 2).
    eulerian : float
        `d_sigma : d_eps` with Cauchy stress (paper, Eq. 3).
    contacts : float
        `sum_c df . dl / V0` over contacts before or after (first term of Eq. 17).
    grains : float
        `sum_p df_p . dx_p / V0`, the inertial term (second term of Eq. 17).
    paper : float
        Eq. 17 as the paper evaluates it: contacts present both before and after.
    by_class : dict of str to float
        `contacts` split by contact class.
    identity_residual : float
        `|boundary - contacts - grains|` over the largest of the summed absolute terms: rounding. All three are sums over
        the same list of contacts, so that this tests the code's sums, and nothing about the data: see `audits`.
    d_eps, d_sigma : (3,) arrays
        Principal increments; `d_eps` logarithmic, `d_sigma` in Pa.
    per_contact : ContactWork
        Work of every pair in J.
    before, after : Snapshot
        The two states.
    """

    boundary: float
    lagrangian: float
    eulerian: float
    contacts: float
    grains: float
    paper: float
    by_class: dict[str, float]
    identity_residual: float
    d_eps: np.ndarray
    d_sigma: np.ndarray
    per_contact: ContactWork = field(repr=False)
    before: Snapshot = field(repr=False)
    after: Snapshot = field(repr=False)

    @cached_property
    def audits(self) -> Audits:
        """Independent numbers of the two states held against each other, by name; see `rd.audits`.

        `sums_of_the_code` is the exception: it compares what must be equal whatever the data are.
        """
        found = audits(self.before, self.after)
        # where no force has changed, all that is summed is rounding
        force = np.abs(self.after.force).sum() + np.abs(self.before.force).sum()
        moved = np.abs(self.after.following(self.before).body_position - self.before.body_position).max(initial=0.0)
        smallest = 1e-6 * force * moved / self.before.volume
        apart = abs(self.boundary - self.contacts - self.grains)
        sums = Audit(
            "W2 of contacts and grains with W2 of the boundary: algebra on one list of contacts",
            "a fault in the code; nothing about the data",
            min(self.identity_residual, apart / smallest) if smallest > 0.0 else self.identity_residual, SUMS, "increment",
            "the code's sums do not add up: please report it",
        )  # fmt: skip
        return Audits({**found, "sums_of_the_code": sums}, found.not_possible)

    @property
    def normalised(self) -> float:
        """`d_sigma : d_eps / (|d_sigma| |d_eps|)`, in [-1, 1]."""
        return float(normalised(self.d_sigma, self.d_eps))

    def _facts(self) -> dict[str, object]:
        each = {f"contacts, {name}": f"{value:+.6g} J/m3" for name, value in self.by_class.items()}
        return {
            "walls": f"{self.boundary:+.6g} J/m3", "contacts": f"{self.contacts:+.6g} J/m3", **each,
            "inertial term": f"{self.grains:+.6g} J/m3", "normalised": f"{self.normalised:+.4f}",
            "audits": f"{len(self.audits.failed)} of {len(self.audits)} failed: {' '.join(self.audits.warnings)}"
            if self.audits.failed else f"all {len(self.audits)} passed",
        }  # fmt: skip


def normalised(d_sigma: np.ndarray, d_eps: np.ndarray) -> np.ndarray:
    """Normalised second-order work of principal increments (..., 3); NaN where either vanishes.

    >>> float(normalised(np.array([2.0, 0, 0]), np.array([-1e-5, 0, 0])))
    -1.0
    """
    d_sigma, d_eps = np.asarray(d_sigma, dtype=float), np.asarray(d_eps, dtype=float)
    size = np.linalg.norm(d_sigma, axis=-1) * np.linalg.norm(d_eps, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(size > 0.0, (d_sigma * d_eps).sum(axis=-1) / size, np.nan)


def second_order_work(before: Snapshot, after: Snapshot) -> SecondOrderWork:
    """Second-order work of the increment from `before` to `after`, any engine's snapshots, or specimens of grains.

    1. Every pair that touches before or after contributes `df . dl`.
    2. Every grain contributes `df_p . dx_p` with its resultant contact force.
    3. Every wall contributes `dF_w . du_w` with the external force that balances the grains on it.

    The first two sums equal the third to rounding, for any increment (theory, section 3), and for any data, right or
    wrong: whether these can be believed is in `audits`.

    Raises
    ------
    InvalidInput
        If the two snapshots are not of the same grains.
    """
    before, after = as_snapshot(before), as_snapshot(after)
    pairs = contact_work(before, after)
    after = after.following(before)
    n, volume = before.n_grains, before.volume
    moved = after.body_position - before.body_position
    terms = (after.resultant - before.resultant) * moved
    per_grain, per_wall = (
        terms[:n].sum(axis=1),
        -terms[n:].sum(axis=1),
    )  # the outside pushes back on the walls
    # what goes through periodic faces: d(sum of f times cells across) . d(lengths), also of opened contacts
    across = [(snapshot.force * snapshot.across).sum(axis=0) for snapshot in (before, after)]
    per_cell = -(across[1] - across[0]) * (after.lengths - before.lengths)
    contacts, grains, boundary = float(pairs.work.sum()), float(per_grain.sum()), float(per_wall.sum() + per_cell.sum())
    scale = max(np.abs(pairs.work).sum(), np.abs(per_grain).sum(), np.abs(per_wall).sum() + np.abs(per_cell).sum())
    kept = pairs.persists
    sigma_0, sigma_1 = np.diag(before.wall_stress), np.diag(after.wall_stress)
    d_eps = np.log(before.lengths / after.lengths)
    # Lagrangian: mean forces on the initial areas against the elongations
    areas_0, areas_1 = volume / before.lengths, after.volume / after.lengths
    d_pi = sigma_1 * areas_1 / areas_0 - sigma_0
    return SecondOrderWork(
        boundary=boundary / volume,
        lagrangian=float(d_pi @ (1.0 - after.lengths / before.lengths)),
        eulerian=float((sigma_1 - sigma_0) @ d_eps),
        contacts=contacts / volume,
        grains=grains / volume,
        paper=float(pairs.work[kept].sum() + grains) / volume,
        by_class={name: pairs.sum_of(name) / volume for name in CLASSES},
        identity_residual=abs(boundary - contacts - grains) / scale if scale > 0.0 else 0.0,
        d_eps=d_eps,
        d_sigma=sigma_1 - sigma_0,
        per_contact=pairs,
        before=before,
        after=after,
    )
