"""How far to trust a study: each question with its number, the limit it is held against, and a verdict."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.dem.measure.energy import energies
from rendulic.dem.measure.equilibrium import KINETIC_TOLERANCE, TOLERANCE, assess
from rendulic.probing.edges import NEAR_EDGE
from rendulic.report.figure import Section, Table
from rendulic.report.findings import Findings, panel_label
from rendulic.specimen.curve import QUASI_STATIC_LIMIT

__all__ = ["LIMITS", "Check", "checks", "trust"]

# what a number must not exceed
LIMITS = {
    "identity": 1e-9,  # of the largest term: sums of many terms in rounded numbers
    "energy": 1e-2,  # of the boundary work
    "equation_1": 1e-6,  # of the largest term
    "edge": NEAR_EDGE,  # bursts nearer than this to an edge are not counted either
}
WORDS = {"good": "✓ yes", "doubtful": "≈ in part", "bad": "✗ no"}


@dataclass(frozen=True)
class Check:
    """One question.

    Parameters
    ----------
    question, measured, limit, where : str
        In words; `where` names the worst, or those that fall short.
    verdict : {"good", "doubtful", "bad"}
        All, some or none are within the limit.
    """

    question: str
    measured: str
    limit: str
    verdict: str
    where: str


def trust(findings: Findings) -> Section | None:
    """The table of all questions that the finished results can answer."""
    found = list(checks(findings))
    if not found:
        return None
    rows = [[check.question, WORDS[check.verdict], check.measured, check.limit, check.where] for check in found]
    heads = ("question", "verdict", "measured", "limit", "where")
    marks = [check.verdict for check in found]
    count = marks.count("good")
    return Section(
        "trust",
        "How far to trust it",
        [f"{count} of {len(found)} questions are answered with yes."],
        [Table("Questions that finished results answer", heads, rows, marks=marks)],
    )


def checks(findings: Findings) -> Iterator[Check]:
    """All questions that the finished results can answer."""
    for ask in (_quasi_static, _at_rest, _identity, _drift, _reached, _energy, _bursts, _edges, _planes):
        yield from ask(findings)


def _judged(question: str, found: dict[str, float], limit: float, what: str = "") -> Iterator[Check]:
    """Largest of some numbers against their limit; none of them missing."""
    if not found:
        return
    beyond = [name for name, value in found.items() if not value <= limit]
    worst = max(found, key=lambda name: found[name] if np.isfinite(found[name]) else np.inf)
    where = f"largest: {worst}" if not beyond else f"beyond in {len(beyond)} of {len(found)}: {_some(beyond)}"
    yield Check(question, f"{what}{found[worst]:.2g}", f"{limit:g}", _verdict(len(beyond), len(found)), where)


def _verdict(beyond: int, count: int) -> str:
    return "good" if beyond == 0 else "bad" if beyond == count else "doubtful"


def _some(names: list[str], most: int = 4) -> str:
    return "; ".join(names[:most]) + (f"; and {len(names) - most} more" if len(names) > most else "")


def _quasi_static(findings: Findings) -> Iterator[Check]:
    found = {panel_label(panel): curve.attrs["largest_inertial_number"] for panel, curve in findings.curves.items()}
    yield from _judged("Was the loading quasi-static?", found, QUASI_STATIC_LIMIT, "inertial number ")


def _at_rest(findings: Findings) -> Iterator[Check]:
    found = {str(place): assess(state) for place, state in findings.states.items()}
    if not found:
        return
    short = [name for name, state in found.items() if not state.reached]
    force = max(state.unbalanced_force for state in found.values())
    kinetic = max(state.kinetic_ratio for state in found.values())
    yield Check(
        "Were the states at rest when probed?",
        f"unbalanced force {force:.1e}, kinetic over elastic energy {kinetic:.1e}",
        f"{TOLERANCE:g}, {KINETIC_TOLERANCE:g}",
        _verdict(len(short), len(found)),
        f"all {len(found)} states" if not short else f"not in {_some(short)}",
    )


def _identity(findings: Findings) -> Iterator[Check]:
    found = {}
    for chosen in findings.study.probes:
        for place, probes in findings.probes(chosen).items():
            if "identity_residual" in probes:
                found[f"{chosen.name}, {place}"] = float(probes.identity_residual.max())
    for (name, place), cone in findings.cones.items():
        if "identity_residual" in cone.probes:
            found[f"{name}, {place}"] = float(cone.probes.identity_residual.max())
    yield from _judged("Is W2 of contacts and grains that of the boundary?", found, LIMITS["identity"], "residual ")


def _drift(findings: Findings) -> Iterator[Check]:
    """The sign of the smallest value decides whether a state is unstable."""
    unsure, count, share = [], 0, 0.0
    for chosen in findings.study.probes:
        for place, probes in findings.probes(chosen).items():
            at_end = probes.isel(norm=-1)
            worst = int(np.nanargmin(at_end.w2_normalised.values))
            count += 1
            size = abs(float(at_end.w2_macro.values[worst]))
            share = max(share, abs(float(at_end.w2_drift.values[worst])) / size if size > 0.0 else np.inf)
            if not bool(at_end.is_significant.values[worst]):
                unsure.append(f"{chosen.name}, {place}")
    for (name, place), cone in findings.cones.items():
        count += 1
        share = max(share, cone.drift_share / abs(cone.smallest_w2n) if cone.smallest_w2n else np.inf)
        if not cone.is_significant:
            unsure.append(f"{name}, {place}")
    if count:
        yield Check(
            "Is the smallest W2 larger than the drift of the null probe?",
            f"drift over smallest W2, largest: {share:.2g}",
            "1",
            _verdict(len(unsure), count),
            f"all {count} sets of probes" if not unsure else f"not in {_some(unsure)}",
        )


def _reached(findings: Findings) -> Iterator[Check]:
    short, count = [], 0
    every = [(f"{name}, {place}", cone.probes) for (name, place), cone in findings.cones.items()]
    for chosen in findings.study.probes:
        every += [(f"{chosen.name}, {place}", probes) for place, probes in findings.probes(chosen).items()]
    for name, probes in every:
        missed = int((~probes.is_reached.values).sum())
        count += probes.is_reached.size
        if missed:
            short.append((name, missed))
    if count:
        total = sum(missed for _, missed in short)
        yield Check(
            "Did every probe reach the increment asked for?",
            f"{count - total} of {count}",
            "within 5 %",
            _verdict(total, count),
            "all" if not short else f"not in {_some([f'{name} ({missed})' for name, missed in short])}",
        )


def _energy(findings: Findings) -> Iterator[Check]:
    first: dict[tuple[str, int], dict[str, float]] = {}
    found = {}
    for place, state in findings.states.items():
        panel = (place.packing, place.seed)
        if panel not in first:
            first[panel] = energies(findings.results.specimen(*panel))
        found[str(place)] = energy_error(first[panel], state)
    yield from _judged(
        "Is the work of shearing found again as energy, friction and damping?",
        found,
        LIMITS["energy"],
        "missing share ",
    )


def energy_error(before: dict[str, float], state: Assembly) -> float:
    """What of the boundary work since then is not accounted for, over the largest term."""
    now = energies(state)
    change = {name: now[name] - before[name] for name in now}
    missing = change["boundary"] - sum(value for name, value in change.items() if name != "boundary")
    return abs(missing) / max(map(abs, change.values()))


def _bursts(findings: Findings) -> Iterator[Check]:
    for name, limit, question in (
        ("balance_error", "energy", "Do the energies of bursts balance?"),
        ("equation_1_residual", "equation_1", "Does Eq. 1 hold in every step of the bursts?"),
    ):
        found = {
            f"{own}, {place}": float(table[name].max())
            for (own, place), table in findings.bursts.items()
            if name in table
        }
        yield from _judged(question, found, LIMITS[limit], "error ")


def _edges(findings: Findings) -> Iterator[Check]:
    """NaN: a sector without edges; 180: the drift alone could have made the edge."""
    found = {}
    for (name, place), cone in findings.cones.items():
        ends = [each for pair in cone.strain_edge_uncertainty for each in pair if np.isfinite(each)]
        if ends:
            found[f"{name}, {place}"] = max(ends)
    yield from _judged("Are the edges of the cones sharp?", found, LIMITS["edge"], "uncertainty in degrees ")


def _planes(findings: Findings) -> Iterator[Check]:
    """Eq. 45: the work of the planes is that of the assembly."""
    found = {}
    for name, curve in findings.tests.items():
        error = 3.0 * (curve.plane_weight * curve.w2_plane).sum("plane") - curve.w2
        found[name] = float(np.nanmax(np.abs(error.values)) / np.nanmax(np.abs(curve.w2.values)))
    yield from _judged("Is W2 of the contact planes that of the model?", found, LIMITS["identity"], "residual ")
