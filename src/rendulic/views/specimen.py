"""Grains and contacts in three dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.micro.contact_work import CLASSES
from rendulic.views.anatomy import most_negative
from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.specimen.snapshot import Snapshot
    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["MOST_CONTACTS", "MOST_GRAINS", "STUDY_FIGURES", "InSpace", "of_anatomy", "of_snapshot"]

MOST_GRAINS, MOST_CONTACTS = 4000, 8000  # that are shown; those of the largest work, or force


@dataclass(frozen=True, kw_only=True, eq=False)
class InSpace(View):
    """Grains and contacts, at most `MOST_GRAINS` and `MOST_CONTACTS`.

    Parameters
    ----------
    centre : (n, 3) array
        In m, and
    radius : (n,) array
        in m, and
    grain_w2 : (n,) array
        second-order work in J.
    begin, end : (m, 3) arrays
        Ends of contacts in m: centre to centre, or to the contact where the other body is a wall or across a periodic face.
    w2, force, kind : (m,) arrays
        Second-order work in J, normal force over its mean, and index into `classes`.
    has_work : bool
        Whether there is second-order work to show.
    """

    centre: np.ndarray
    radius: np.ndarray
    grain_w2: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    w2: np.ndarray
    force: np.ndarray
    kind: np.ndarray
    has_work: bool
    classes: tuple[str, ...] = tuple(CLASSES)


def of_anatomy(found: xr.Dataset, title: str = "") -> InSpace:
    """The view of a probe, from `rd.anatomy`."""
    return _reduced(
        found.grain_position.values, found.grain_radius.values, found.grain_w2.values, found.first.values, found.second.values,
        found.position.values, found.w2.values, found.relative_force.values, found.class_of_pair.values, title,
        "Each contact's share of the second-order work of one probe.",
    )  # fmt: skip


def of_snapshot(snapshot: Snapshot, title: str = "") -> InSpace:
    """The view of the forces of one instant."""
    n = snapshot.n_grains
    touching = snapshot.second >= n
    at = snapshot.position[snapshot.first] + snapshot.radius[snapshot.first][:, None] * snapshot.normal
    mean = float(np.abs(snapshot.force_n[~touching]).mean()) if (~touching).any() else 1.0
    nothing = np.zeros(len(snapshot.first))
    return _reduced(
        snapshot.position, snapshot.radius, np.zeros(n), snapshot.first, snapshot.second, at, nothing,
        snapshot.force_n / (mean or 1.0), nothing.astype(int), title,
        "Forces only: second-order work of single contacts needs [[probes]] with anatomy = true.",
    )  # fmt: skip


def _reduced(
    centre: np.ndarray, radius: np.ndarray, grain_w2: np.ndarray, first: np.ndarray, second: np.ndarray, position: np.ndarray,
    w2: np.ndarray, force: np.ndarray, kind: np.ndarray, title: str, heading: str,
) -> InSpace:  # fmt: skip
    """Those of the largest work, or force, first; and in words what they are."""
    has_work = bool((w2 != 0.0).any())
    end = position.copy()
    between = second < len(radius)
    # a pair across a periodic face is drawn to its contact only
    near = np.zeros(len(first), dtype=bool)
    apart = np.linalg.norm(centre[first[between]] - centre[second[between]], axis=1)
    near[between] = apart < 1.5 * (radius[first[between]] + radius[second[between]])
    end[near] = centre[second[near]]
    grains = np.argsort(-np.abs(grain_w2) if has_work else -radius, kind="stable")[:MOST_GRAINS]
    contacts = np.argsort(-np.abs(w2) if has_work else -force, kind="stable")[:MOST_CONTACTS]
    words = f"{len(radius)} grains and {len(w2)} contacts"
    if len(grains) < len(radius) or len(contacts) < len(w2):
        what = "work" if has_work else "size and force"
        words += f", of which the {len(grains)} and {len(contacts)} of the largest {what} are shown"
    if has_work:
        words += f"; {100.0 * float((w2 < 0.0).mean()):.0f} % of the contacts have negative second-order work"
    return InSpace(
        title=title, caption=f"Grains and contacts in three dimensions, axis 1 upward, lengths in metres. {heading} {words}.",
        centre=centre[grains], radius=radius[grains], grain_w2=grain_w2[grains], begin=centre[first[contacts]],
        end=end[contacts], w2=w2[contacts], force=force[contacts], kind=kind[contacts], has_work=has_work,
    )  # fmt: skip


def _needs(plan: Plan) -> list[Unit]:
    return [unit for state, unit in plan.states.items() if plan.has_grains(state)]


def _specimen(results: Results) -> dict[str, View]:
    """The state whose contacts are known, else the last state of grains with its forces."""
    if (worst := most_negative(results)) is not None:
        state, found = worst
        return {"specimen": of_anatomy(found, f"{state}, {found.attrs['alpha']:g} degrees")}
    states = [state for state in results.states if results.plan.has_grains(state)]
    if not states:
        return {}
    last: Any = results.state(states[-1])
    return {"specimen": of_snapshot(last.snapshot(), str(states[-1]))}


STUDY_FIGURES = (
    StudyFigure(
        "specimen",
        "grains and contacts in three dimensions",
        "states of grains",
        _needs,
        _specimen,
        in_report_only=True,
    ),
)
