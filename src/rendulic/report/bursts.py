"""Bursts: failure predicted by second-order work against failure observed."""

from __future__ import annotations

from rendulic.probing.burst import VERDICTS, judged
from rendulic.probing.edges import NEAR_EDGE
from rendulic.report.figure import Section, Table
from rendulic.report.findings import Findings

__all__ = ["bursts"]


def bursts(findings: Findings) -> Section | None:
    """Every direction of every state."""
    if not findings.bursts:
        return None
    return Section(
        "bursts",
        "Bursts: predicted and observed failure",
        [
            "Each state is pushed in a direction and then left to itself under the load it had. Failure is predicted "
            "where second-order work is negative "
            f"from the size of the push to ten times it. Not counted are directions closer than {NEAR_EDGE:g} degrees to "
            "an edge of a cone, and stable "
            "ones whose opposite is unstable."
        ],
        [_summary(findings), _every(findings)],
    )


def _summary(findings: Findings) -> Table:
    rows, marks, targets = [], [], []
    for (name, place), table in findings.bursts.items():
        agrees, counted = judged(table)
        good, count = int((agrees & counted).sum()), int(counted.sum())
        fails = int(table.observed.values.sum())
        rows.append([str(place), name, f"{good} of {count}", str(int(table.predicted.values.sum())), str(fails),
                     str(table.sizes["alpha"])])  # fmt: skip
        marks.append("good" if good == count else "doubtful" if good else "bad")
        targets.append(str(place))
    heads = ("state", "bursts", "prediction agrees", "predicted to fail", "failed", "directions")
    return Table("How many directions agree", heads, rows, marks=marks, marked=2, goes_to=targets)


def _every(findings: Findings) -> Table:
    rows, marks = [], []
    for (_, place), table in findings.bursts.items():
        agrees, counted = judged(table)
        for k in range(table.sizes["alpha"]):
            one = table.isel(alpha=k)
            rows.append([
                str(place), f"{float(one.alpha):.4g}", f"{float(one.ratio) + 0.0:.3g}", f"{float(one.w2_normalised):+.3f}",
                f"{float(one.w2_normalised_lasting):+.3f}", "fails" if one.predicted else "settles",
                VERDICTS[int(one.verdict)],
                "not counted" if not counted[k] else "agrees" if agrees[k] else "disagrees",
            ])  # fmt: skip
            marks.append("" if not counted[k] else "good" if agrees[k] else "bad")
    heads = ("state", "α [°]", "R", "W2n", "lasting W2n", "predicted", "observed", "judged")
    return Table("Every burst", heads, rows, marks=marks, marked=7, filter_by="judged")
