"""Circular diagrams of the normalised second-order work (Fig. 3 of the paper)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.tensors.rendulic_plane import AXIAL_COMPRESSION, ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION
from rendulic.views.catalogue import StudyFigure
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
    """

    label: str
    alpha: np.ndarray
    w2_normalised: np.ndarray
    is_significant: np.ndarray
    state: str = ""

    @property
    def smallest(self) -> int:
        """Index of the smallest value."""
        return int(np.nanargmin(self.w2_normalised))


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
        From `rd.probe` at one norm, directions all around, in the order to be drawn.
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
        caption=CAPTION,
        verdict=_verdict(curves),
        tables=(_table(curves, [one.state or one.label for one in curves]),),
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
        replace(one, label=f"{heading}, {one.label}".replace("\n", ", "))
        for heading, panel in made.items() for one in panel.curves
    )  # fmt: skip
    return CircularPanels(
        title=title, caption=CAPTION, verdict=_verdict(curves), tables=(_table(curves, [one.label for one in curves]),), panels=made,
        columns=min(columns, len(made)),
    )  # fmt: skip


def _around(label: str, data: xr.Dataset, state: str) -> Around:
    if data.w2_normalised.dims != ("alpha",):
        raise InvalidInput(
            "a circular diagram needs probes in the Rendulic plane at one norm, got dimensions "
            f"{', '.join(map(str, data.w2_normalised.dims))}: select a norm with probes.sel(norm=...)"
        )
    data = data.sortby("alpha")
    return Around(label, data.alpha.values, data.w2_normalised.values, data.is_significant.values, state)


def _verdict(curves: tuple[Around, ...]) -> str:
    """Which states have a direction of surely negative work."""
    sure = [one.label for one in curves if ((one.w2_normalised < 0.0) & one.is_significant).any()]
    if not sure:
        return "Second-order work is not surely negative in any direction that was probed."
    return f"Second-order work is negative in some directions at {'; '.join(sure)}."


def _table(curves: tuple[Around, ...], names: Sequence[str]) -> Table:
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


def _labels(states: Mapping[StateId, Any]) -> dict[str, str]:
    return {f"η = {state.eta:g}": str(state) for state in states}


def _of_sample(
    results: Results, sample: SampleId, states: Mapping[StateId, xr.Dataset], norm: float
) -> CircularDiagram:
    probes = {f"η = {state.eta:g}": data.sel(norm=norm) for state, data in states.items()}
    title = f"{sample} ({results.about(sample)}), strain probes of norm {norm:g}"
    return circular_diagram(probes, title, _labels(states))


def of_grains(results: Results) -> list[tuple[str, SampleId, dict[StateId, xr.Dataset]]]:
    """Those of `in_the_plane` that are of grains."""
    return [one for one in in_the_plane(results) if results.plan.specimen(one[1].specimen).has_grains]


def stems(stem: str, names: list[tuple[str, SampleId]]) -> list[str]:
    """Names of files: short where there is one sample, else with the sample and, where it comes twice, the set."""
    if len(names) == 1:
        return [stem]
    twice = len({sample for _, sample in names}) < len(names)
    return [f"{stem}_{sample.folder}" + (f"_{name}" if twice else "") for name, sample in names]


def _fig3(results: Results) -> dict[str, View]:
    found = of_grains(results)
    views: dict[str, View] = {}
    for (name, sample, states), stem in zip(found, stems("fig3", [one[:2] for one in found]), strict=True):
        views[stem] = _of_sample(results, sample, states, norm_of(results, name))
        norms = results.sets("probes")[name].norms
        if len(norms) > 1:
            panels = {
                f"norm {norm:g}": {f"η = {state.eta:g}": data.sel(norm=norm) for state, data in states.items()}
                for norm in norms
            }
            title = f"{sample} ({results.about(sample)})"
            views[stem.replace("fig3", "fig3_amplitudes")] = circular_panels(panels, title, columns=len(norms))
    return views


def _families(results: Results) -> dict[str, View]:
    """Every set, sample and size; the size that the study asks for first."""
    views: dict[str, View] = {}
    for name, sample, states in in_the_plane(results):
        first = norm_of(results, name)
        for norm in sorted(results.sets("probes")[name].norms, key=lambda norm: norm != first):
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
    """Grains and sands side by side, where a study has both: of packings that differ in their seeds only, one."""
    chosen: dict[SampleId, tuple[str, dict[StateId, xr.Dataset]]] = {}
    for name, sample, states in in_the_plane(results):
        is_another_seed = any(sample.by == "seed" and sample.specimen == other.specimen for other in chosen)
        if sample not in chosen and not is_another_seed:
            chosen[sample] = name, states
    if len({results.plan.specimen(sample.specimen).has_grains for sample in chosen}) < 2:
        return {}
    common = set.intersection(*({state.eta for state in states} for _, states in chosen.values()))
    panels = {
        f"{sample}\n{results.about(sample)}": _of_sample(
            results, sample,
            {state: data for state, data in states.items() if state.eta in common or not common}, norm_of(results, name),
        )
        for sample, (name, states) in chosen.items()
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
