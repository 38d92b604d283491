"""Circular diagrams of the normalised second-order work (Fig. 3 of the paper)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.tensors.rendulic_plane import AXIAL_COMPRESSION, ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION
from rendulic.views.catalogue import StudyFigure
from rendulic.views.ensembles import CHANCE, StudyEnsemble, ensemble_table, ensembles, said
from rendulic.views.view import Mark, Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.ids import SampleId, StateId
    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["CENTRE", "LANDMARKS", "Around", "CircularDiagram", "CircularPanels", "circular_diagram", "circular_panels"]

CENTRE = -1.0  # W2n at the centre of a diagram; the rim is at 1, the dashed circle at 0
LANDMARKS = {
    "isotropic compression": ISOTROPIC_COMPRESSION,
    "axial compression": AXIAL_COMPRESSION,
    "undrained compression": ISOCHORIC_COMPRESSION,
    "isotropic extension": ISOTROPIC_COMPRESSION + 180.0,
    "axial extension": AXIAL_COMPRESSION + 180.0,
    "undrained extension": ISOCHORIC_COMPRESSION + 180.0,
}
CAPTION = (
    "Normalised second-order work W2n by direction of the imposed increment in the Rendulic plane: -1 at the centre, 0 on the "
    "dashed circle, 1 at the rim. Second-order work is negative within the dashed circle. The sign of an open dot is not sure."
)
OF_MANY = " A full line is the mean response of many packings with its 95 % interval, faint lines are single packings."


@dataclass(frozen=True, eq=False)
class Around:
    """W2n of one state in all directions.

    Parameters
    ----------
    label : str
        Of the curve.
    alpha : (n,) array
        Directions in degrees, increasing.
    w2_normalised : (n,) array
        In [-1, 1].
    is_significant : (n,) array of bool
        Whether the sign is larger than its error.
    state : str
        Which state it is, for figures that move together; the label if empty.
    response : xarray.Dataset, optional
        For the mean of many specimens, of `rd.ensemble_response`.
    """

    label: str
    alpha: np.ndarray
    w2_normalised: np.ndarray
    is_significant: np.ndarray
    state: str = ""
    response: xr.Dataset | None = None

    @property
    def smallest(self) -> int:
        """Index of the smallest value."""
        return int(np.nanargmin(self.w2_normalised))

    @property
    def band(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Bounds of the mean of many specimens."""
        if self.response is None or self.response.attrs["n_specimens"] < 2:
            return None
        return self.response.w2_normalised_lower.values, self.response.w2_normalised_upper.values

    @property
    def single(self) -> np.ndarray:
        """W2n of each of many specimens, (m, n); empty for one."""
        if self.response is None:
            return np.empty((0, len(self.alpha)))
        each = self.response.w2_normalised_of.transpose("specimen", "alpha").values
        return each[np.isfinite(each).any(axis=1)]


@dataclass(frozen=True, kw_only=True, eq=False)
class CircularDiagram(View):
    """One closed curve for each state, light to dark in their order."""

    curves: tuple[Around, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class CircularPanels(View):
    """Diagrams side by side, by their headings."""

    panels: Mapping[str, CircularDiagram]
    columns: int = 2

    @property
    def labels(self) -> list[str]:
        """Labels of the curves of all panels, each once."""
        return list(dict.fromkeys(one.label for panel in self.panels.values() for one in panel.curves))


def circular_diagram(
    probes: Mapping[str, xr.Dataset], title: str = "", states: Mapping[str, str] | None = None
) -> CircularDiagram:
    """The diagram of probes at one norm.

    Parameters
    ----------
    probes : mapping of label to xarray.Dataset
        From `rd.probe` or `rd.ensemble_response` at one norm, directions all around, in the order to be drawn.
    title : str
        Above.
    states : mapping of label to str, optional
        The state of each label, where the label does not name it.

    Raises
    ------
    InvalidInput
        If there are no probes, or they are of several norms or not in the Rendulic plane.
    """
    curves = tuple(_around(label, data, (states or {}).get(label, label)) for label, data in probes.items())
    if not curves:
        raise InvalidInput("a circular diagram needs the probes of at least one state, got none")
    return CircularDiagram(
        title=title,
        caption=_caption(curves),
        verdict=_verdict(curves),
        tables=_tables(curves, [one.state or one.label for one in curves]),
        curves=curves,
    )


def circular_panels(
    panels: Mapping[str, Mapping[str, xr.Dataset]], title: str = "", columns: int = 2
) -> CircularPanels:
    """Diagrams side by side, each with its heading and its own states; see `circular_diagram`.

    Raises
    ------
    InvalidInput
        If there are no panels, or one has probes that `circular_diagram` refuses.
    """
    if not panels:
        raise InvalidInput("circular diagrams side by side need at least one panel, got none")
    return _beside({heading: circular_diagram(probes, heading) for heading, probes in panels.items()}, title, columns)


def _beside(made: Mapping[str, CircularDiagram], title: str, columns: int) -> CircularPanels:
    curves = tuple(
        replace(one, label=_heading(heading, panel, one))
        for heading, panel in made.items() for one in panel.curves
    )  # fmt: skip
    return CircularPanels(
        title=title, caption=_caption(curves), verdict=_verdict(curves), tables=_tables(curves, [one.label for one in curves]),
        panels=made, columns=min(columns, len(made)),
    )  # fmt: skip


def _heading(heading: str, panel: CircularDiagram, one: Around) -> str:
    """What a curve is of; the heading alone for the one mean in a panel."""
    alone = len(panel.curves) == 1 and one.response is not None
    return (heading if alone else f"{heading}, {one.label}").replace("\n", ", ")


def _caption(curves: Sequence[Around]) -> str:
    return CAPTION + (OF_MANY if any(one.response is not None for one in curves) else "")


def _around(label: str, data: xr.Dataset, state: str) -> Around:
    if data.w2_normalised.dims != ("alpha",):
        raise InvalidInput(
            "a circular diagram needs probes in the Rendulic plane at one norm, got dimensions "
            f"{', '.join(map(str, data.w2_normalised.dims))}: select a norm with probes.sel(norm=...)"
        )
    data = data.sortby("alpha")
    response = data if "w2_normalised_of" in data else None
    return Around(label, data.alpha.values, data.w2_normalised.values, data.is_significant.values, state, response)


def _verdict(curves: tuple[Around, ...]) -> str:
    """Which states have a direction of surely negative work; of many specimens what the mean of each state says."""
    many = [f"{one.label}: {said(one.response)}" for one in curves if one.response is not None]
    curves = tuple(one for one in curves if one.response is None)
    if many:
        return "; ".join(many) + "." + (f" {_verdict(curves)}" if curves else "")
    sure = [one.label for one in curves if ((one.w2_normalised < 0.0) & one.is_significant).any()]
    if not sure:
        return "Second-order work is not surely negative in any direction that was probed."
    return f"Second-order work is negative in some directions at {'; '.join(sure)}."


def _tables(curves: Sequence[Around], names: Sequence[str]) -> tuple[Table, ...]:
    """Of the means of many specimens, and of single ones, as far as there are such."""
    many = {name: one.response for name, one in zip(names, curves, strict=True) if one.response is not None}
    single = [(one, name) for name, one in zip(names, curves, strict=True) if one.response is None]
    tables = [ensemble_table(many)] if many else []
    return (*tables, _table(*zip(*single, strict=True))) if single else tuple(tables)


def _table(curves: Sequence[Around], names: Sequence[str]) -> Table:
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    for name, one in zip(names, curves, strict=True):
        work, sure = float(one.w2_normalised[one.smallest]), bool(one.is_significant[one.smallest])
        rows.append((
            name, f"{work:+.3f}", f"{one.alpha[one.smallest]:g}", str(int((one.w2_normalised < 0.0).sum())),
            "yes" if sure else "no",
        ))  # fmt: skip
        marks.append("doubtful" if not sure else "bad" if work < 0.0 else "")
    heads = ("state", "smallest W2n", "at α [°]", "directions with W2 < 0", "sign is sure")
    states = [one.state or one.label for one in curves]
    return Table("Smallest normalised second-order work", heads, rows, goes_to=states, marks=marks)


# -- of a study ----------------------------------------------------------------------------------


def in_the_plane(results: Results) -> Iterator[tuple[str, SampleId, dict[StateId, xr.Dataset]]]:
    """Finished strain probes around the Rendulic plane: each set, each sample in it, and its states."""
    found = results.of("probes")
    for name, chosen in results.sets("probes").items():
        if chosen.kind != "strain" or not chosen.is_in_the_plane or chosen.anatomy:
            continue
        states = [state for own, state in found if own == name and state is not None]
        for sample in dict.fromkeys(state.sample for state in states):
            yield name, sample, {state: found[name, state] for state in states if state.sample == sample}


def around_units(plan: Plan, has_grains: bool | None = None) -> list[Unit]:
    """Units of the strain probes around the plane, of grains, of sands, or of all; with the states they start from."""
    units: dict[str, Unit] = {}
    for (name, state), batches in plan.of("probes").items():
        chosen = plan.study.sets("probes")[name]
        if state is None or chosen.kind != "strain" or not chosen.is_in_the_plane or chosen.anatomy:
            continue
        if has_grains in (None, plan.has_grains(state)):
            units |= {unit.key: unit for unit in (plan.state(state), *batches)}
    return list(units.values())


def norm_of(results: Results, name: str) -> float:
    """The size of a set's probes that is shown first: that which the study asks for, or the smallest."""
    norms, asked = results.sets("probes")[name].norms, results.study.figures.diagram_norm
    return asked if asked is not None and asked in norms else norms[0]


def norms_of(results: Results, name: str) -> list[float]:
    """All sizes of a set's probes, that which is shown first before the others."""
    return sorted(results.sets("probes")[name].norms, key=lambda norm: norm != norm_of(results, name))


def _labels(states: Mapping[StateId, Any]) -> dict[str, str]:
    return {f"η = {state.eta:g}": str(state) for state in states}


def _of_sample(
    results: Results, sample: SampleId, states: Mapping[StateId, xr.Dataset], norm: float
) -> CircularDiagram:
    probes = {f"η = {state.eta:g}": data.sel(norm=norm) for state, data in states.items()}
    about = results.about(sample) + (f"; {CHANCE}" if results.plan.specimen(sample.specimen).has_grains else "")
    return circular_diagram(probes, f"{sample} ({about}), strain probes of norm {norm:g}", _labels(states))


def of_ensemble(ensemble: StudyEnsemble, norm: float) -> CircularDiagram:
    """Means of the packings of an ensemble, one curve for each stress ratio."""
    means = {f"η = {eta:g}": data.sel(norm=norm) for eta, data in ensemble.responses.items()}
    return circular_diagram(
        means, ensemble_title(ensemble, norm), {f"η = {eta:g}": ensemble.state(eta) for eta in ensemble.responses}
    )


def ensemble_title(ensemble: StudyEnsemble, norm: float | None = None) -> str:
    """What is shown of an ensemble."""
    size = "" if norm is None else f", strain probes of norm {norm:g}"
    return f"{ensemble.specimen}, mean of {ensemble.size} packings ({ensemble.about}){size}"


def of_grains(results: Results) -> list[tuple[str, SampleId, dict[StateId, xr.Dataset]]]:
    """Those of `in_the_plane` that are of a packing alone, in no ensemble."""
    together = {(one.name, one.specimen) for one in ensembles(results)}
    return [
        one for one in in_the_plane(results)
        if results.plan.specimen(one[1].specimen).has_grains and (one[0], one[1].specimen) not in together
    ]  # fmt: skip


def stems(stem: str, names: Sequence[tuple[str, str]]) -> list[str]:
    """Names of files, of sets and what they are of: short where there is one, else with the latter and, where it comes twice,
    the set."""
    if len(names) == 1:
        return [stem]
    twice = len({own for _, own in names}) < len(names)
    return [f"{stem}_{own}" + (f"_{name}" if twice else "") for name, own in names]


def _fig3(results: Results) -> dict[str, View]:
    """Of an ensemble a diagram for each stress ratio, of a packing alone one for all; and all norms side by side."""
    many, alone = ensembles(results), of_grains(results)
    names = stems("fig3", [(one.name, one.specimen) for one in many] + [(name, one.folder) for name, one, _ in alone])
    views: dict[str, View] = {}
    for one, stem in zip(many, names, strict=False):
        norm = norm_of(results, one.name)
        panels = {f"η = {eta:g}": {"mean, 95 %": data.sel(norm=norm)} for eta, data in one.responses.items()}
        views[stem] = circular_panels(panels, ensemble_title(one, norm), columns=3)
        means = {f"η = {eta:g}": data for eta, data in one.responses.items()}
        views |= _amplitudes(results, one.name, means, ensemble_title(one), stem)
    for (name, sample, states), stem in zip(alone, names[len(many) :], strict=True):
        views[stem] = _of_sample(results, sample, states, norm_of(results, name))
        own = {f"η = {state.eta:g}": data for state, data in states.items()}
        views |= _amplitudes(results, name, own, f"{sample} ({results.about(sample)}; {CHANCE})", stem)
    return views


def _amplitudes(
    results: Results, name: str, states: Mapping[str, xr.Dataset], title: str, stem: str
) -> dict[str, View]:
    norms = results.sets("probes")[name].norms
    if len(norms) == 1:
        return {}
    panels = {f"norm {norm:g}": {label: data.sel(norm=norm) for label, data in states.items()} for norm in norms}
    return {stem.replace("fig3", "fig3_amplitudes"): circular_panels(panels, title, columns=min(len(norms), 4))}


def _families(results: Results) -> dict[str, View]:
    """Every set, ensemble or sample, and size; the size that the study asks for first."""
    views: dict[str, View] = {}
    for one in ensembles(results):
        for norm in norms_of(results, one.name):
            views[f"{one.specimen}, mean of {one.size} packings, probes '{one.name}' of {norm:g}"] = of_ensemble(
                one, norm
            )
    together = {(one.name, one.specimen) for one in ensembles(results)}
    for name, sample, states in in_the_plane(results):
        if (name, sample.specimen) not in together:
            for norm in norms_of(results, name):
                views[f"{sample}, probes '{name}' of {norm:g}"] = _of_sample(results, sample, states, norm)
    return views


def _models(results: Results) -> dict[str, View]:
    """Sands side by side."""
    panels = {
        str(sample): _of_sample(results, sample, states, norm_of(results, name))
        for name, sample, states in in_the_plane(results) if not results.plan.specimen(sample.specimen).has_grains
    }  # fmt: skip
    return {"fig3_model": _beside(panels, "Chang-Hicher model", 2)} if panels else {}


def _side_by_side(results: Results) -> dict[str, View]:
    """Grains and sands side by side, where a study has both: packings that differ in their seeds only as their mean."""
    chosen: dict[str, tuple[str, dict[float, xr.Dataset], bool]] = {}
    for one in ensembles(results):
        heading = f"{one.specimen}, mean of {one.size}\n{one.about}"
        chosen.setdefault(heading, (one.name, one.responses, True))
    alone = [one[1] for one in of_grains(results)]
    for name, sample, states in in_the_plane(results):
        has_grains = results.plan.specimen(sample.specimen).has_grains
        if not has_grains or sample in alone:
            about = results.about(sample) + (f"; {CHANCE}" if has_grains else "")
            own = {float(state.eta or 0.0): data for state, data in states.items()}
            chosen.setdefault(f"{sample}\n{about}", (name, own, has_grains))
    if len({has_grains for _, _, has_grains in chosen.values()}) < 2:
        return {}
    common = set.intersection(*(set(states) for _, states, _ in chosen.values()))
    panels = {
        heading: circular_diagram({
            f"η = {eta:g}": data.sel(norm=norm_of(results, name)) for eta, data in states.items() if eta in common or not common
        })
        for heading, (name, states, _) in chosen.items()
    }  # fmt: skip
    title = "Grains beside the Chang-Hicher model"
    return {"side_by_side": _beside(panels, f"{title}, at common stress ratios" if common else title, 2)}


def _needs_both(plan: Plan) -> list[Unit]:
    both = around_units(plan, True), around_units(plan, False)
    return [*both[0], *both[1]] if all(both) else []


IN_THE_PLANE = "[[probes]] of strain in the Rendulic plane"
STUDY_FIGURES = (
    StudyFigure(
        "fig3", "circular diagrams of W2n, for grains", f"{IN_THE_PLANE} at states of grains",
        lambda plan: around_units(plan, True), _fig3, _families,
    ),
    StudyFigure(
        "fig3_model", "circular diagrams of W2n, for sands of the model", f"{IN_THE_PLANE} at states of a sand",
        lambda plan: around_units(plan, False), _models, lambda results: {},
    ),
    StudyFigure(
        "side_by_side", "circular diagrams of grains and sands side by side",
        f"{IN_THE_PLANE} at states of grains and of a sand", _needs_both, _side_by_side,
    ),
)  # fmt: skip
