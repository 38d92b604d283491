"""Cones of unstable directions, state by state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.views import amplitude, sphere, stress_probes
from rendulic.views.catalogue import StudyFigure
from rendulic.views.circular import circular_diagram, circular_panels, in_the_plane
from rendulic.views.sectors import MARKS, Sector, Verdict, direction_range, give_work, verdict_of
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    from rendulic.probing.cone import Cone
    from rendulic.study.ids import SampleId, StateId
    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "ConeOfState", "ConesView", "cones", "cones_of_study", "size_of_probes"]

CAPTION = (
    "Directions of the strain increment in which second-order work is surely negative (red), and those in which its sign is unknown "
    "(grey, hatched), for each state, and beside them its smallest normalised value W2n. Thin bars at the edges are their "
    "uncertainty; a question mark is an edge that the error alone could make. The bar about a value of W2n is its error; open "
    "where its sign is not sure. Unknown is not stable: only a state without any colour is."
)
# drawn with cones, where a study has them
BESIDE = (*amplitude.STUDY_FIGURES, *stress_probes.STUDY_FIGURES, *sphere.STUDY_FIGURES)
MOST_CURVES = 8  # in a circular diagram
MOST_SECTORS = 4  # that are named one by one
HEADS = (
    "state", "answer", "unstable from … to", "unknown from … to", "opening [°]", "smallest W2n", "at α [°]",
)  # fmt: skip


@dataclass(frozen=True)
class ConeOfState:
    """One state.

    Parameters
    ----------
    label : str
        Of its row.
    sectors, unknown : tuples of Sector
        Those that are unstable and those whose sign is unknown; of strain, also for stress probes.
    smallest : float
        Smallest W2n, and
    at : float
        the direction of strain in degrees that has it.
    error : float
        Its error.
    is_significant : bool
        Whether its sign is sure.
    state : str
        Which state it is, for figures that move together.
    """

    label: str
    sectors: tuple[Sector, ...]
    unknown: tuple[Sector, ...]
    smallest: float
    at: float
    error: float
    is_significant: bool
    state: str

    @property
    def verdict(self) -> Verdict:
        """Whether second-order work is surely negative in some direction, surely positive in all, or neither."""
        return verdict_of(bool(self.sectors), bool(self.unknown))

    @property
    def opening(self) -> float:
        """Angle of all sectors together, in degrees."""
        return sum(sector.last - sector.first for sector in self.sectors)

    @property
    def words(self) -> tuple[str, str]:
        """The sectors, and those of unknown sign."""
        return _several(self.sectors), _several(self.unknown)


def _several(sectors: tuple[Sector, ...]) -> str:
    if len(sectors) > MOST_SECTORS:
        return f"{len(sectors)} sectors, {sum(one.last - one.first for one in sectors):.4g}° together"
    return "; ".join(map(str, sectors)) or "none"


@dataclass(frozen=True, kw_only=True, eq=False)
class ConesView(View):
    """Rows of states, in sight between two directions in degrees."""

    rows: tuple[ConeOfState, ...]
    low: float
    high: float


def cones(found: Mapping[str, Cone], title: str = "", states: Mapping[str, str] | None = None) -> ConesView:
    """Cones one beneath the other.

    Parameters
    ----------
    found : mapping of label to Cone
        From `rd.instability_cone`; cones of stress probes are shown in directions of strain.
    title : str
        Above.
    states : mapping of label to str, optional
        The state of each label, where the label does not name it.
    """
    rows = tuple(_row(label, cone, (states or {}).get(label, label)) for label, cone in found.items())
    low, high = direction_range(sector for row in rows for sector in (*row.sectors, *row.unknown))
    return ConesView(
        title=title, caption=CAPTION, verdict=_verdict(rows), tables=(_table(rows),), rows=rows, low=low, high=high
    )


def _row(label: str, cone: Cone, state: str) -> ConeOfState:
    pairs = zip(cone.strain_sectors, cone.strain_edge_uncertainty, strict=True)
    return ConeOfState(
        label,
        tuple(Sector(*ends, *uncertainty) for ends, uncertainty in pairs),
        tuple(Sector(*ends, np.nan, np.nan) for ends in cone.strain_unknown_sectors),
        cone.smallest_w2n,
        cone.smallest_strain_alpha,
        cone.smallest_error,
        cone.is_significant,
        state,
    )


def _verdict(rows: tuple[ConeOfState, ...]) -> str:
    unstable = [row for row in rows if row.verdict == "unstable"]
    unknown = sum(row.verdict == "unknown" for row in rows)
    words = f"{len(unstable)} of {len(rows)} states {'has' if len(unstable) == 1 else 'have'} unstable directions"
    if unstable:
        worst = min(unstable, key=lambda row: row.smallest)
        words += f"; the smallest W2n is {worst.smallest:.3g}, of {worst.label} at {worst.at:.4g} degrees"
    if unknown:
        words += f"; of {unknown} it is not known, as the sign is not sure in some directions"
    return f"{words}."


def _table(rows: tuple[ConeOfState, ...]) -> Table:
    cells = [
        (
            row.label, row.verdict, *row.words, f"{row.opening:.4g}", give_work(row.smallest, row.error), f"{row.at:.4g}" if np.isfinite(row.smallest) else "",
        )
        for row in rows
    ]  # fmt: skip
    marks = [MARKS[row.verdict] for row in rows]
    return Table("Cones", HEADS, cells, goes_to=[row.state for row in rows], marks=marks, marked=1)


def cones_of_study(results: Results) -> Mapping[str, View]:
    """Cones of all states with their circular diagrams; and what belongs to them, see `BESIDE`."""
    if not results.cones:
        return {}
    made: dict[str, View] = {"cones": _all_cones(results), "cones_diagrams": _diagrams(results)}
    beside = {stem: view for figure in BESIDE for stem, view in figure.views(results).items()}
    return made | {f"cones_{stem}": view for stem, view in beside.items()}


def _families(results: Results) -> Mapping[str, View]:
    """Cones of all states, and of further sets that have some of them, too; circular diagrams of those samples whose only
    probes are those of their cones.
    """
    if not results.cones:
        return {}
    made: dict[str, View] = {"all states": _all_cones(results)}
    seen: set[StateId | None] = set()
    for name, chosen in results.sets("cones").items():
        own = [state for own, state in results.of("cones") if own == name and state is not None]
        if seen & set(own):
            found = {str(state): results.cone(name, state) for state in own}
            made[f"cones '{name}'"] = cones(found, f"Cones '{name}', strain probes of norm {chosen.norm:g}")
        seen |= set(own)
    probed = {sample for _, sample, _ in in_the_plane(results)}
    for sample in dict.fromkeys(state.sample for state in results.cones if state.sample not in probed):
        states = [state for state in results.cones if state.sample == sample]
        labels = {f"η = {state.eta:g}": str(state) for state in states}
        probes = {f"η = {state.eta:g}": results.cones[state].probes for state in states}
        made[f"{sample}, probes of the cones"] = circular_diagram(probes, str(sample), labels)
    return made


def _all_cones(results: Results) -> ConesView:
    found = {str(state): cone for state, cone in results.cones.items()}
    return cones(found, f"Cones, {size_of_probes(results)}")


def size_of_probes(results: Results) -> str:
    """Norms of the strain probes that the cones of a study are of, in words."""
    sets = results.sets("cones")
    first = {state: sets[name].norm for name, state in reversed(list(results.of("cones")))}
    norms = [f"{norm:g}" for norm in sorted(set(first.values()))]
    return f"strain probes of norm {norms[0]}" if len(norms) == 1 else f"strain probes of norms {', '.join(norms)}"


def _diagrams(results: Results) -> View:
    """Circular diagrams of all sands and of the first seed of each packing, at some of their states if there are many."""
    samples = list(dict.fromkeys(state.sample for state in results.cones))
    first: dict[object, SampleId] = {}
    for sample in samples:
        # seeds are chance, void ratios are not
        first.setdefault(sample.specimen if sample.by == "seed" else sample, sample)
    panels = {}
    for sample in first.values():
        states = [state for state in results.cones if state.sample == sample]
        some = np.unique(np.linspace(0, len(states) - 1, MOST_CURVES).round().astype(int)).tolist()
        panels[f"{sample}\n{results.about(sample)}"] = {
            f"η = {states[k].eta:g}": results.cones[states[k]].probes for k in some
        }
    left = len(samples) - len(first)
    more = f"; {left} more {'seed is' if left == 1 else 'seeds are'} not shown" if left else ""
    return circular_panels(panels, f"Probes of the cones, {size_of_probes(results)}{more}")


def _needs(plan: Plan) -> list[Unit]:
    units = [unit for units in plan.of("cones").values() for unit in units]
    return [*units, *(unit for figure in BESIDE for unit in figure.needs(plan))] if units else []


STUDY_FIGURES = (
    StudyFigure(
        "cones",
        "unstable sectors of all states, with their edges",
        "a [[cones]] set",
        _needs,
        cones_of_study,
        _families,
    ),
)
