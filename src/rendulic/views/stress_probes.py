"""Stress probes compared with strain probes of the same state, at equal direction and size of strain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.probing.consistency import stress_on_strain
from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "Compared", "StressProbesView", "stress_probes"]

CAPTION = (
    "Normalised second-order work W2n of stress probes (dots) and, interpolated at the same direction and size of strain, of "
    "strain probes (rings). They must agree where the state can carry the stress. Where a dot has no ring, its strain is larger "
    "or smaller than that of all strain probes."
)


@dataclass(frozen=True, eq=False)
class Compared:
    """One state: directions of strain in degrees, increasing, and both values there."""

    label: str
    strain_alpha: np.ndarray
    found: np.ndarray
    expected: np.ndarray
    rms: float
    n_compared: int


@dataclass(frozen=True, kw_only=True, eq=False)
class StressProbesView(View):
    """A panel for each state."""

    panels: tuple[Compared, ...]


def stress_probes(tables: Mapping[str, xr.Dataset], title: str = "") -> StressProbesView:
    """The view of tables from `rendulic.probing.consistency.stress_on_strain`, by label."""
    panels = []
    for label, table in tables.items():
        order = np.argsort(table.strain_alpha.values)
        panels.append(Compared(
            label, table.strain_alpha.values[order], table.w2_normalised.values[order], table.expected.values[order],
            float(table.attrs["rms"]), int(table.attrs["n_compared"]),
        ))  # fmt: skip
    rows = [(one.label, f"{one.rms:.2g}", str(one.n_compared), str(len(one.found))) for one in panels]
    heads = ("state", "rms of W2n", "compared", "probes")
    labels = [one.label for one in panels]
    shown = Table("Difference of stress probes from strain probes", heads, rows, goes_to=labels)
    worst = max(panels, key=lambda one: one.rms if np.isfinite(one.rms) else -1.0)
    verdict = f"The largest root mean square difference of W2n is {worst.rms:.2g}, at {worst.label}."
    return StressProbesView(title=title, caption=CAPTION, verdict=verdict, tables=(shown,), panels=tuple(panels))


def _needs(plan: Plan) -> list[Unit]:
    return [unit for units in plan.of("stress_probes").values() for unit in (*units, units[0].needs["cone"])]


def _stress_probes(results: Results) -> dict[str, View]:
    """Of sets whose cones have several sizes: only these can be interpolated."""
    tables: dict[str, xr.Dataset] = {}
    cones = results.of("cones")
    for (name, state), probes in results.of("stress_probes").items():
        own = results.sets("stress_probes")[name].cones
        if (own, state) in cones and len(results.sets("cones")[own].sizes) > 1:
            tables[str(state)] = stress_on_strain(cones[own, state], probes)
    return {"stress_probes": stress_probes(tables, "Stress probes")} if tables else {}


STUDY_FIGURES = (
    StudyFigure("stress_probes", "stress probes against strain probes", "[[stress_probes]]", _needs, _stress_probes),
)
