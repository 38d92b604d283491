"""All audits that the data allow."""

from __future__ import annotations

from typing import Any

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.micro.overlapping import overlaps
from rendulic.probing.audits import increment, one_state
from rendulic.probing.audits.audit import Audit, Audits, NotPossible
from rendulic.probing.audits.one_state import Reading
from rendulic.specimen.snapshot import Snapshot

__all__ = ["audits"]

NOT_FINITE = "there are numbers that are not finite"
TOUCH = 0.1  # radii by which spheres in contact may be apart, or overlap, to be taken for spheres


def audits(before: Snapshot, after: Snapshot | None = None) -> Audits:
    """Hold the numbers of one state, or of two that an increment lies between, against each other.

    An audit compares two numbers that do not follow from each other: forces on walls that the engine wrote down with
    the contacts on them, overlaps with forces, the stress within with that on the boundary. What the data do not allow
    is in `not_possible`, with the reason, and never counts as passed.

    Parameters
    ----------
    before, after : Snapshot
        Of any engine. With one of them only, that state is audited.

    Returns
    -------
    Audits
        A dict of name to `Audit`, worst first: residual, limit, `passed`. Of two states it has the worse one.

    Examples
    --------
    >>> import rendulic as rd
    >>> sample = rd.dem.pack(n_grains=60, radius=(8e-3, 12e-3), pressure=200e3, seed=1)
    >>> found = rd.audits(sample.snapshot())
    >>> list(found.failed), "law" in found
    ([], True)

    Raises
    ------
    InvalidInput
        If the two states are not of the same number of grains, or in two kinds of box.
    """
    if after is not None and (before.n_grains, before.is_periodic) != (after.n_grains, after.is_periodic):
        raise InvalidInput(
            f"before and after must hold the same grains in the same kind of box: {before.n_grains} grains before, "
            f"{after.n_grains} after, periodic {before.is_periodic} and {after.is_periodic}"
        )
    states = {"before": before} if after is None else {"before": before, "after": after}
    first, *others = one_state.AUDITS  # nothing can be asked of numbers that are not finite
    finite = {where: first.ask(Reading(state, False)) for where, state in states.items()}
    if any(residual > limit for residual, limit in finite.values()):
        more = increment.AUDITS if after is not None else ()
        return Audits({first.name: _worst(first, finite)}, {one.name: NOT_FINITE for one in (*others, *more)})
    if after is not None:
        states["after"] = after.following(before)
    spheres = _are_spheres(list(states.values()))
    readings = {where: Reading(state, spheres) for where, state in states.items()}
    done: dict[str, Audit] = {first.name: _worst(first, finite)}
    not_possible: dict[str, str] = {}
    for each in others:
        found = {}
        for where, reading in readings.items():
            try:
                found[where] = each.ask(reading)
            except NotPossible as reason:
                not_possible[each.name if after is None else f"{each.name} ({where})"] = str(reason)
        if after is not None and not found:
            not_possible[each.name] = not_possible.pop(f"{each.name} (before)")
            del not_possible[f"{each.name} (after)"]
        if found:
            done[each.name] = _worst(each, found)
    if after is not None:
        pair = increment.Pair(readings["before"], readings["after"])
        for one in increment.AUDITS:
            try:
                done[one.name] = _worst(one, {"increment": one.ask(pair)})
            except NotPossible as reason:
                not_possible[one.name] = str(reason)
    return Audits(done, not_possible)


def _worst(about: Any, found: dict[str, tuple[float, float]]) -> Audit:
    """The audit of the state that is farther from its limit; both are named if both fail."""

    def excess(where: str) -> float:
        residual, limit = found[where]
        if np.isnan(residual):
            return np.inf
        return residual / limit if limit > 0.0 else residual * np.inf if residual > 0.0 else 0.0

    where = max(found, key=excess)
    failing = [name for name in found if not found[name][0] <= found[name][1]]
    residual, limit = found[where]
    return Audit(about.compares, about.catches, residual, limit, " and ".join(failing) or where, about.failure)


def _are_spheres(states: list[Snapshot]) -> bool:
    """Whether the grains are spheres: the engine says so, or in one of the states most contacts touch as spheres do."""
    said = [state.recorded.are_spheres for state in states if state.recorded is not None]
    if any(one is not None for one in said):
        return False not in said
    return any(_touch_as_spheres(state) for state in states)


def _touch_as_spheres(state: Snapshot) -> bool:
    between = ~state.is_wall
    if not between.any():
        return False
    smaller = np.minimum(state.radius[state.first], state.radius[np.where(between, state.second, 0)])
    near = np.abs(overlaps(state)) <= TOUCH * smaller
    along = np.abs((state.normal * state.branch).sum(axis=1)) >= (1.0 - TOUCH) * np.linalg.norm(state.branch, axis=1)
    return bool((near & along)[between].mean() > 0.5)
