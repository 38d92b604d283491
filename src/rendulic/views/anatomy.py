"""Where in the grains second-order work comes from: around all directions, and contact by contact in one of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.probing.anatomy_controls import cluster_controls
from rendulic.views.anatomy_controls import controls_view
from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.ids import SampleId, StateId
    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "AnatomyAround", "AnatomyView", "anatomy", "anatomy_around"]

AROUND = (
    "Against the direction of the increment: the share of contacts whose second-order work is negative; their work over that of "
    "the others; the fewest contacts that carry half of the negative work (the carriers); how much of it is in sliding contacts; "
    "and Moran's I of the carriers beyond a shared grain, in the negative and, of like size, in the positive work. The table has "
    "the most unstable direction."
)
HEADS = (
    "state", "α [°]", "W2n", "negative contacts", "negative / positive work", "carriers of half", "of it sliding",
    "I of carriers", "beyond a grain", "of positive ones", "displacements kept", "coordination", "without rattlers", "fabric",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class AnatomyView(View):
    """One probe, contact by contact: `found` is from `rd.anatomy`."""

    found: xr.Dataset

    @property
    def by_class(self) -> dict[str, float]:
        """Second-order work in J/m3 by class of contact, with the inertial term and the total."""
        found = self.found
        classes = dict(zip(map(str, found.contact_class.values), found.w2_by_class.values.tolist(), strict=True))
        return {**classes, "inertial": float(found.w2_inertial), "total": float(found.w2_boundary)}


@dataclass(frozen=True, kw_only=True, eq=False)
class AnatomyAround(View):
    """Probes with anatomy at one norm, in the plane, by label; sorted by direction."""

    probes: Mapping[str, xr.Dataset]


def anatomy(found: xr.Dataset, title: str = "") -> AnatomyView:
    """The view of `rd.anatomy`."""
    view = AnatomyView(title=title, found=found)
    words = ", ".join(f"{name} {value:.3g}" for name, value in view.by_class.items())
    at = f" at {found.attrs['alpha']:g} degrees" if "alpha" in found.attrs else ""
    caption = f"Second-order work in J/m³ by class of contact{at}: {words}."
    share = f"{100 * float(found.negative_contacts):.0f} % of the contacts have negative second-order work"
    verdict = f"{share}; {100 * float(found.carriers):.1f} % carry half of it. {clusters_of_pair(found)}"
    return AnatomyView(title=title, caption=caption, verdict=verdict, found=found)


def clusters_of_pair(found: xr.Dataset) -> str:
    """Whether the carriers of one probe cluster, in a sentence: stable directions are not at hand for comparison."""
    index, kept, signs = found.beyond_index.values, found.beyond_kept.values, found.beyond_signs.values
    if not np.isfinite([*index, *kept, *signs]).all():
        return "Whether these cluster is undetermined."
    apart = index[0] > kept[2], index[0] - index[1] > signs[2]
    what = f"Moran's I of these beyond a shared grain is {index[0]:.3f}; of positive contacts of like size {index[1]:.3f}; "
    what += f"with displacements kept, chance gives {kept[1]:.3f}, in one of twenty above {kept[2]:.3f}: "
    if all(apart):
        return what + "they cluster, if stable directions of the same state do not as much (rd.cluster_controls)."
    which = " and ".join(
        name for name, is_apart in zip(("shared displacements", "positive work"), apart, strict=True) if not is_apart
    )
    return what + f"no clustering is shown beyond {which}."


def anatomy_around(
    probes: Mapping[str, xr.Dataset], title: str = "", states: Mapping[str, str] | None = None
) -> AnatomyAround:
    """The view of probes with anatomy, by label.

    Raises
    ------
    InvalidInput
        If a dataset has no anatomy.
    """
    for label, data in probes.items():
        if "negative_over_positive" not in data or "norm" in data.dims:
            raise InvalidInput(
                f"{label!r} has no anatomy at one norm: probe with anatomy=True and choose one with .sel(norm=...)"
            )
    made = {label: data.sortby("alpha") for label, data in probes.items()}
    names = states or {}
    rows = [_row(names.get(label, label), data) for label, data in made.items()]
    table = Table("The most unstable direction of each state", HEADS, rows, goes_to=[row[0] for row in rows])
    return AnatomyAround(title=title, caption=AROUND, tables=(table,), probes=made)


def _row(state: str, data: xr.Dataset) -> tuple[str, ...]:
    one = data.isel(alpha=int(np.nanargmin(data.w2_normalised.values)))
    carry, before = one.sel(which="carriers"), one.sel(instant="before")
    index, kept = one.beyond_index, one.beyond_kept
    return (
        state, f"{float(one.alpha):g}", f"{float(one.w2_normalised):+.3f}", f"{100 * float(one.negative_contacts):.0f} %",
        f"{float(one.negative_over_positive):.2f}", f"{100 * float(one.carriers):.1f} %",
        f"{100 * float(one.w2_negative_sliding / one.w2_negative):.0f} %",
        f"{float(carry.cluster_index):.3f}", f"{float(index.sel(sign='negative')):.3f}", f"{float(index.sel(sign='positive')):.3f}",
        f"{float(kept.sel(bound='mean')):.3f} [{float(kept.sel(bound='low')):.3f}, {float(kept.sel(bound='high')):.3f}]",
        f"{float(before.coordination):.2f}",
        f"{float(before.mechanical_coordination):.2f}", f"{float(before.fabric_anisotropy):+.2f}",
    )  # fmt: skip


# -- of a study ----------------------------------------------------------------------------------


def _needs(plan: Plan) -> list[Unit]:
    found = plan.of("anatomy")
    probes = plan.of("probes")
    return [unit for key, units in found.items() for unit in (*probes[key], *units)]


def _around(results: Results) -> dict[str, View]:
    sets, found = results.sets("probes"), results.of("probes")
    families: dict[tuple[str, SampleId], dict[StateId, xr.Dataset]] = {}
    for name, state in results.plan.of("anatomy"):
        if (name, state) in found and state is not None and sets[name].is_in_the_plane:
            families.setdefault((name, state.sample), {})[state] = found[name, state].isel(norm=-1)
    views: dict[str, View] = {}
    for (name, sample), states in families.items():
        stem = "anatomy_around" if len(families) == 1 else f"anatomy_around_{sample.folder}_{name}"
        title = f"{sample} ({results.about(sample)}), probes '{name}' of {sets[name].norms[-1]:g}"
        labels = {f"η = {state.eta:g}": data for state, data in states.items()}
        views[stem] = anatomy_around(labels, title, {f"η = {state.eta:g}": str(state) for state in states})
    return views


def most_negative(results: Results) -> tuple[StateId, xr.Dataset] | None:
    """The state whose most unstable direction has the smallest W2n, and its anatomy."""
    found, probes = results.of("anatomy"), results.of("probes")
    keys = [key for key in found if key in probes and key[1] is not None]
    if not keys:
        return None
    worst = min(keys, key=lambda key: float(probes[key].isel(norm=-1).w2_normalised.min()))
    assert worst[1] is not None
    return worst[1], found[worst]


def _controls(results: Results) -> dict[str, View]:
    """For each specimen and set: its states, each of all packings that have it."""
    sets, found = results.sets("probes"), results.of("probes")
    families: dict[tuple[str, str], dict[float, dict[StateId, xr.Dataset]]] = {}
    for name, state in results.plan.of("anatomy"):
        if (name, state) in found and state is not None and state.eta is not None:
            of_set = families.setdefault((name, state.sample.specimen), {})
            of_set.setdefault(state.eta, {})[state] = found[name, state].isel(norm=-1)
    views: dict[str, View] = {}
    for (name, specimen), states in families.items():
        stem = "anatomy_controls" if len(families) == 1 else f"anatomy_controls_{specimen}_{name}"
        controls = {f"η = {eta:g}": cluster_controls(list(states[eta].values())) for eta in sorted(states)}
        goes_to = {f"η = {eta:g}": str(next(iter(states[eta]))) for eta in states}
        views[stem] = controls_view(controls, f"{specimen}, probes '{name}' of {sets[name].norms[-1]:g}", goes_to)
    return views


def _anatomy(results: Results) -> dict[str, View]:
    views = _around(results) | _controls(results)
    if (worst := most_negative(results)) is not None:
        state, found = worst
        views["anatomy"] = anatomy(found, f"{state}, {found.attrs['alpha']:g} degrees ({results.about(state.sample)})")
    return views


STUDY_FIGURES = (
    StudyFigure(
        "anatomy",
        "where in the grains W2 comes from",
        "[[probes]] with anatomy = true at states of grains",
        _needs,
        _anatomy,
    ),
)
