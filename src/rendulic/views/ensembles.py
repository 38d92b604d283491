"""Packings of one recipe taken together: which they are in a study, their mean response, and what it says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from rendulic.probing.ensemble_response import FEW, ensemble_response
from rendulic.study.ids import StateId
from rendulic.views.view import Mark, Table

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["CHANCE", "StudyEnsemble", "ensemble_table", "ensemble_units", "ensembles", "interval", "said", "span"]

CHANCE = "one packing: chance"
HEADS = (
    "state", "packings", "smallest mean W2n [95 %]", "at α [°]", "surely unstable", "packings with W2 < 0 [95 %]", "to know",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class StudyEnsemble:
    """The packings of one specimen of a study, probed by one set.

    Parameters
    ----------
    name : str
        Of the set, and
    specimen : str
        of the specimen.
    about : str
        The packings in a few words.
    probes : dict of stress ratio to dict of packing to xarray.Dataset or str
        All packings that the study asks for; of one that has no probes the words why not.
    """

    name: str
    specimen: str
    about: str
    probes: Mapping[float, Mapping[str, xr.Dataset | str]]

    @cached_property
    def responses(self) -> dict[float, xr.Dataset]:
        """The mean response at each stress ratio at which any packing has been probed."""
        return {
            eta: ensemble_response(found)
            for eta, found in self.probes.items()
            if any(not isinstance(one, str) for one in found.values())
        }

    @property
    def size(self) -> int:
        """How many packings were asked for."""
        return max(len(found) for found in self.probes.values())

    def state(self, eta: float) -> str:
        """The ensemble at one stress ratio, in words."""
        return f"{self.specimen}, eta = {eta:g}"


_made: WeakKeyDictionary[Results, list[StudyEnsemble]] = WeakKeyDictionary()


def ensemble_units(plan: Plan) -> list[Unit]:
    """Units of strain probes around the plane of specimens with several packings, and the states they start from."""
    units: dict[str, Unit] = {}
    for states in _asked(plan).values():
        for name, state in states:
            own = (plan.state(state), *plan.of("probes")[name, state])
            units |= {unit.key: unit for unit in own}
    return list(units.values())


def _asked(plan: Plan) -> dict[tuple[str, str], list[tuple[str, StateId]]]:
    """By set and specimen the states that make ensembles."""
    asked: dict[tuple[str, str], list[tuple[str, StateId]]] = {}
    for name, state in plan.of("probes"):
        chosen = plan.study.sets("probes")[name]
        if (
            state is None
            or state.eta is None
            or chosen.kind != "strain"
            or not chosen.is_in_the_plane
            or chosen.anatomy
        ):
            continue
        if plan.has_grains(state):
            asked.setdefault((name, state.specimen), []).append((name, state))
    return {where: states for where, states in asked.items() if len({state.sample for _, state in states}) > 1}


def ensembles(results: Results) -> list[StudyEnsemble]:
    """Sets of strain probes around the Rendulic plane with several packings of a specimen, of which one is finished."""
    if results not in _made:
        _made[results] = _ensembles(results)
    return _made[results]


def _ensembles(results: Results) -> list[StudyEnsemble]:
    found, made = results.of("probes"), []
    for (name, specimen), states in _asked(results.plan).items():
        probes: dict[float, dict[str, xr.Dataset | str]] = {}
        for _, state in states:
            here = found[name, state] if (name, state) in found else _why_not(results, name, state)
            probes.setdefault(float(state.eta or 0.0), {})[state.sample.own] = here
        if any(not isinstance(one, str) for here in probes.values() for one in here.values()):
            about = results.about(states[0][1].sample)
            made.append(StudyEnsemble(name, specimen, about, dict(sorted(probes.items()))))
    return made


def _why_not(results: Results, name: str, state: StateId) -> str:
    """Why there are no probes of a state."""
    needed = [*results.plan.of("probes")[name, state], results.plan.state(state)]
    for unit in results.plan.needed_for(needed).values():
        if unit in results.failed:
            return f"failed: {results.failed[unit]}"
    return "not done yet"


# -- in words ------------------------------------------------------------------------------------


def span(first: float, last: float) -> str:
    """A sector in words.

    >>> span(350.0, 372.4), span(0.0, 360.0)
    ('350 to 12°', 'everywhere')
    """
    if last - first >= 360.0:
        return "everywhere"
    return f"{first % 360.0:.0f} to {last % 360.0:.0f}°"


def interval(value: float, low: float, high: float) -> str:
    """A value with its interval; without one if it has none.

    >>> interval(-0.331, -0.45, -0.3), interval(0.5, float("nan"), float("nan"))
    ('-0.33 [-0.45, -0.30]', '+0.50')
    """
    return f"{value:+.2f} [{low:+.2f}, {high:+.2f}]" if np.isfinite(low) and np.isfinite(high) else f"{value:+.2f}"


def spans(first: xr.DataArray, last: xr.DataArray) -> str:
    """Sectors of one cone in words."""
    pairs = zip(first.values.ravel(), last.values.ravel(), strict=True)
    return ", ".join(span(a, b) for a, b in pairs if np.isfinite(a))


def said(data: xr.Dataset) -> str:
    """What the mean response of packings at one state and norm says, in a clause."""
    count = data.attrs["n_specimens"]
    if count == 1:
        return CHANCE
    if sure := spans(data.sure_from, data.sure_to):
        return f"surely unstable from {sure}"
    mean = spans(data.sector_from, data.sector_to)
    if count < FEW:
        start = f"mean unstable from {mean}, " if mean else "mean stable, "
        return f"{start}but {count} packings are too few to be sure"
    if mean:
        return f"mean unstable from {mean}, but not surely"
    unknown = int((~data.is_significant).sum())
    return f"stable, but not surely in {unknown} of {data.sizes['alpha']} directions" if unknown else "surely stable"


def ensemble_table(responses: Mapping[str, xr.Dataset], states: Sequence[str] = ()) -> Table:
    """One row for each state: the mean at its smallest, what is sure, the share of packings, and what to know.

    `states` are those that figures show when a row is chosen, if they have other names than the rows.
    """
    rows, marks = [], list[Mark]()
    for label, data in responses.items():
        work = data.w2_normalised
        least = data.isel(alpha=int(np.nanargmin(work.values)))
        sure = spans(data.sure_from, data.sure_to)
        share = f"{float(data.negative_somewhere_share):.0%} [{float(data.negative_somewhere_share_lower):.0%}, {float(data.negative_somewhere_share_upper):.0%}]"
        rows.append((
            label, str(data.attrs["n_specimens"]),
            interval(float(least.w2_normalised), float(least.w2_normalised_lower), float(least.w2_normalised_upper)),
            f"{float(least.alpha):g}", sure or "nowhere", share, data.attrs["told_of_all"].replace("\n", " "),
        ))  # fmt: skip
        marks.append(
            "bad"
            if sure
            else "doubtful"
            if float(least.w2_macro_lower) < 0.0 or not np.isfinite(least.w2_macro_lower)
            else ""
        )
    return Table("Mean response of the packings", HEADS, rows, goes_to=list(states or responses), marks=marks, marked=4)
