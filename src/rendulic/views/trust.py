"""How far to trust a study: each check with its number, the limit it is held against, and a verdict."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rendulic.probing.audits import audits
from rendulic.probing.edges import NEAR_EDGE
from rendulic.probing.error_bar import TOO_FAST
from rendulic.specimen.curve import QUASI_STATIC_LIMIT
from rendulic.views.catalogue import StudyFigure
from rendulic.views.paths import labels_of
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.results import Results

__all__ = ["LIMITS", "STUDY_FIGURES", "Check", "Trust", "checks", "energy_error", "trust"]

Verdict = Literal["good", "doubtful", "bad"]
# what a number must not exceed
LIMITS = {
    "identity": 1e-9,  # of the largest term: sums of many terms in rounded numbers
    "energy": 1e-2,  # of the boundary work
    "equation_1": 1e-6,  # of the largest term
    "edge": NEAR_EDGE,
}
WORDS: Mapping[Verdict, str] = {"good": "✓ passed", "doubtful": "≈ in part", "bad": "✗ failed"}
CAPTION = (
    "What each number of this study is held against. 'In part': some of the states or probes are beyond the limit."
)


@dataclass(frozen=True)
class Check:
    """One check.

    Parameters
    ----------
    question, measured, limit, where : str
        In words; `where` names the worst, or those that are beyond the limit.
    verdict : {"good", "doubtful", "bad"}
        All, some or none are within the limit.
    """

    question: str
    measured: str
    limit: str
    verdict: Verdict
    where: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Trust(View):
    """All checks that finished results allow."""

    checks: tuple[Check, ...]


def trust(results: Results) -> Trust | None:
    """The view of all checks that the finished results allow; None if there are none."""
    found = tuple(checks(results))
    if not found:
        return None
    rows = [(check.question, WORDS[check.verdict], check.measured, check.limit, check.where) for check in found]
    heads = ("check", "verdict", "measured", "limit", "where")
    passed = sum(check.verdict == "good" for check in found)
    table = Table("Checks", heads, rows, marks=[check.verdict for check in found])
    short = [check.question for check in found if check.verdict != "good"]
    verdict = f"{passed} of {len(found)} checks passed" + (f"; not passed: {' '.join(short)}" if short else ".")
    return Trust(title="How far to trust it", caption=CAPTION, verdict=verdict, tables=(table,), checks=found)


def checks(results: Results) -> Iterator[Check]:
    """All checks that the finished results allow."""
    for ask in (
        _quasi_static,
        _at_rest,
        _audits,
        _identity,
        _drift,
        _reached,
        _slow_enough,
        _settled,
        _energy,
        _bursts,
        _edges,
        _planes,
    ):
        yield from ask(results)


def _judged(question: str, found: Mapping[str, float], limit: float, what: str = "") -> Iterator[Check]:
    """Largest of some numbers against their limit; none of them missing."""
    if not found:
        return
    beyond = [name for name, value in found.items() if not value <= limit]
    worst = max(found, key=lambda name: found[name] if np.isfinite(found[name]) else np.inf)
    where = f"largest: {worst}" if not beyond else f"beyond in {len(beyond)} of {len(found)}: {_some(beyond)}"
    yield Check(question, f"{what}{found[worst]:.2g}", f"{limit:g}", _verdict(len(beyond), len(found)), where)


def _verdict(beyond: int, count: int) -> Verdict:
    return "good" if beyond == 0 else "bad" if beyond == count else "doubtful"


def _some(names: list[str], most: int = 4) -> str:
    return "; ".join(names[:most]) + (f"; and {len(names) - most} more" if len(names) > most else "")


def _probed(results: Results) -> Iterator[tuple[str, bool, xr.Dataset]]:
    """All strain and stress probes: label, whether they bracket a cone, and the table."""
    for (name, state), probes in results.of("probes").items():
        yield f"{name}, {state}", False, probes
    for name, state in results.of("cones"):
        if state is not None:
            yield f"{name}, {state}", True, results.cone(name, state).probes


def _quasi_static(results: Results) -> Iterator[Check]:
    found = {}
    for sample in results.samples:
        curve = results.whole_curve(sample)
        if curve is not None and "largest_inertial_number" in curve.attrs:
            found[str(sample)] = float(curve.attrs["largest_inertial_number"])
    yield from _judged("Was the loading of the grains quasi-static?", found, QUASI_STATIC_LIMIT, "inertial number ")


def _grains_at_rest(results: Results) -> dict[str, Any]:
    return {str(state): results.state(state) for state in results.states if results.plan.has_grains(state)}


def _at_rest(results: Results) -> Iterator[Check]:
    found = {state: specimen.equilibrium() for state, specimen in _grains_at_rest(results).items()}
    if not found:
        return
    short = [name for name, state in found.items() if not state.reached]
    force = max(state.unbalanced_force for state in found.values())
    kinetic = max(state.kinetic_ratio for state in found.values())
    one = next(iter(found.values()))
    yield Check(
        "Were the grains at rest when probed?",
        f"unbalanced force {force:.1e}, kinetic over elastic energy {kinetic:.1e}",
        f"{one.tolerance:g}, {one.kinetic_tolerance:g}",
        _verdict(len(short), len(found)),
        f"all {len(found)} states" if not short else f"not in {_some(short)}",
    )


def _audits(results: Results) -> Iterator[Check]:
    """Independent numbers of every state of grains: forces on walls and grains, overlaps, stresses."""
    found = {state: audits(specimen.snapshot()) for state, specimen in _grains_at_rest(results).items()}
    if not found:
        return
    failed = {state: list(each.failed) for state, each in found.items() if each.failed}
    names = sorted({name for each in failed.values() for name in each})
    yield Check(
        "Do independent numbers of the states agree?",
        f"{max(map(len, found.values()))} audits of each state, {sum(map(len, failed.values()))} failed in all"
        + (f": {_some(names)}" if names else ""),
        "none fails",
        _verdict(len(failed), len(found)),
        f"all {len(found)} states" if not failed else f"not in {_some(list(failed))}",
    )


def _identity(results: Results) -> Iterator[Check]:
    """Algebra on one list of contacts: it tests the code, not the data."""
    found = {
        label: float(probes.identity_residual.max())
        for label, _, probes in _probed(results)
        if "identity_residual" in probes
    }
    yield from _judged(
        "A test of the code's sums: is W2 of contacts and grains equal to W2 of the boundary?",
        found,
        LIMITS["identity"],
        "residual ",
    )


def _drift(results: Results) -> Iterator[Check]:
    """The sign of the smallest value decides whether a state is unstable."""
    unsure, count, share = [], 0, 0.0
    for label, _, probes in _probed(results):
        at_end = probes.isel(norm=-1) if "norm" in probes.dims else probes
        worst = int(np.nanargmin(at_end.w2_normalised.values))
        count += 1
        size = abs(float(at_end.w2_macro.values[worst]))
        share = max(share, float(at_end.w2_error.values[worst]) / size if size > 0.0 else np.inf)
        if not bool(at_end.is_significant.values[worst]):
            unsure.append(label)
    if count:
        yield Check(
            "Is the sign of the smallest W2 sure?",
            f"error over smallest W2, largest: {share:.2g}",
            "1",
            _verdict(len(unsure), count),
            f"all {count} sets of probes" if not unsure else f"not in {_some(unsure)}",
        )


def _reached(results: Results) -> Iterator[Check]:
    short, count = [], 0
    for label, _, probes in _probed(results):
        missed = int((~probes.is_reached.values).sum())
        count += probes.is_reached.size
        if missed:
            short.append((label, missed))
    if count:
        total = sum(missed for _, missed in short)
        yield Check(
            "Did every probe reach the increment asked for?",
            f"{count - total} of {count}",
            "within 5 %",
            _verdict(total, count),
            "all" if not short else f"not in {_some([f'{name} ({missed})' for name, missed in short])}",
        )


def _flagged(results: Results, name: str, bad: bool, only: str = "") -> tuple[list[str], int, int]:
    """Sets of probes in which a flag is bad, with how often; how often in all; and how many probes there are.

    `only` is an attribute of sets that counts: probes that are read while they move are meant so, and no failure.
    """
    short, total, count = [], 0, 0
    for label, _, probes in _probed(results):
        if name in probes and (not only or probes.attrs.get(only)):
            missed = int((probes[name].values == bad).sum())
            count, total = count + probes[name].size, total + missed
            short += [f"{label} ({missed})"] if missed else []
    return short, total, count


def _slow_enough(results: Results) -> Iterator[Check]:
    short, total, count = _flagged(results, "is_too_fast", True)
    if count:
        yield Check(
            "Were the probes of grains slow enough?", f"{count - total} of {count}", f"unbalanced force {TOO_FAST:g} on the way",
            _verdict(total, count), "all" if not short else f"not in {_some(short)}",
        )  # fmt: skip


def _settled(results: Results) -> Iterator[Check]:
    short, total, count = _flagged(results, "is_settled", False, only="settle")
    if count:
        yield Check(
            "Were the grains at rest when the probes were read?", f"{count - total} of {count}", "unbalanced force 1e-05",
            _verdict(total, count), "all" if not short else f"no equilibrium near in {_some(short)}",
        )  # fmt: skip


def _energy(results: Results) -> Iterator[Check]:
    first: dict[Any, dict[str, float]] = {}
    found = {}
    for state in results.states:
        if not results.plan.has_grains(state):
            continue
        if state.sample not in first:
            made: Any = results.sample(state.sample)
            first[state.sample] = made.energies()
        now: Any = results.state(state)
        found[str(state)] = energy_error(first[state.sample], now.energies())
    yield from _judged(
        "Is the work of shearing found again as energy, friction and damping?",
        found,
        LIMITS["energy"],
        "missing share ",
    )


def energy_error(before: Mapping[str, float], now: Mapping[str, float]) -> float:
    """What of the boundary work since then is not accounted for, over the largest term."""
    change = {name: now[name] - before[name] for name in now}
    missing = change["boundary"] - sum(value for name, value in change.items() if name != "boundary")
    return abs(missing) / max(map(abs, change.values()))


def _bursts(results: Results) -> Iterator[Check]:
    for name, limit, question in (
        ("balance_error", "energy", "Do the energies of bursts balance?"),
        (
            "equation_1_residual",
            "equation_1",
            "A test of the code's sums: does Eq. 1 hold in every step of the bursts?",
        ),
    ):
        found = {
            f"{own}, {state}": float(table[name].max())
            for (own, state), (table, _) in results.of("bursts").items()
            if name in table
        }
        yield from _judged(question, found, LIMITS[limit], "error ")


def _edges(results: Results) -> Iterator[Check]:
    found = {}
    for name, state in results.of("cones"):
        assert state is not None
        ends = [
            each for pair in results.cone(name, state).strain_edge_uncertainty for each in pair if np.isfinite(each)
        ]
        if ends:
            found[f"{name}, {state}"] = max(ends)
    yield from _judged("Are the edges of the cones sharp?", found, LIMITS["edge"], "uncertainty in degrees ")


def _planes(results: Results) -> Iterator[Check]:
    """Eq. 45: the work of the planes is that of the assembly."""
    found = {}
    for key, label in labels_of(results).items():
        curve = results.of("path")[key]
        if "plane" not in curve.dims:
            continue
        error = 3.0 * (curve.plane_weight * curve.w2_plane).sum("plane") - curve.w2
        found[label] = float(np.nanmax(np.abs(error.values)) / np.nanmax(np.abs(curve.w2.values)))
    yield from _judged(
        "A test of the code's sums: is W2 of the contact planes equal to W2 of the model?",
        found,
        LIMITS["identity"],
        "residual ",
    )


def _views(results: Results) -> dict[str, View]:
    view = trust(results)
    return {"trust": view} if view is not None else {}


STUDY_FIGURES = (
    StudyFigure(
        "trust",
        "all checks, as a table",
        "something to do",
        lambda plan: list(plan.units.values()),
        _views,
        in_report_only=True,
    ),
)
