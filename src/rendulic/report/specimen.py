"""The specimen in three dimensions: grains and contacts by second-order work, force or class."""

from __future__ import annotations

from typing import Any

import numpy as np

from rendulic.micro.contact_work import CLASSES
from rendulic.probing.anatomy import anatomy as anatomy_between
from rendulic.report.figure import Figure, Section, Trace, numbers
from rendulic.report.findings import Findings
from rendulic.report.spheres import scene

__all__ = ["MOST_CONTACTS", "MOST_GRAINS", "specimen"]

MOST_GRAINS, MOST_CONTACTS = 4000, 8000  # on the page; those of the largest work


def specimen(findings: Findings) -> Section | None:
    """The state that was dissected, else the last state with its forces."""
    found = findings.dissection
    if found is not None:
        heading = (
            f"{found.attrs['place']}: each contact's share of the second-order work of one probe, at "
            f"{found.attrs['alpha']:g} degrees."
        )
    elif findings.places:
        last = findings.places[-1]
        now = findings.states[last].snapshot()
        found = anatomy_between(now, now, n_shuffles=1)
        heading = (
            f"Forces in the last state, {last}; second-order work of single contacts needs the figure 'anatomy' in the "
            "study."
        )
    else:
        return None
    trace, words = _reduced(found)
    caption = f"Grains and contacts in three dimensions, axis 1 upward, lengths in metres. {heading} {words}"
    figure = Figure("specimen", caption, {"": {"": [trace]}}, scene(), drawn_by="specimen")
    return Section("specimen", "The specimen", parts=[figure])


def _reduced(found: Any) -> tuple[Trace, str]:
    """Grains and contacts for the page's script, those of the largest work first, and in words what they are."""
    centre, radius, grain_w2 = found.grain_position.values, found.grain_radius.values, found.grain_w2.values
    first, second = found.first.values, found.second.values
    w2, force = found.w2.values, found.relative_force.values
    has_work = bool((w2 != 0.0).any())
    end = found.position.values.copy()
    between = second < len(radius)
    # a pair across a periodic face is drawn to its contact only
    near = np.zeros(len(first), dtype=bool)
    apart = np.linalg.norm(centre[first[between]] - centre[second[between]], axis=1)
    near[between] = apart < 1.5 * (radius[first[between]] + radius[second[between]])
    end[near] = centre[second[near]]
    grains = np.argsort(-np.abs(grain_w2) if has_work else -radius, kind="stable")[:MOST_GRAINS]
    contacts = np.argsort(-np.abs(w2) if has_work else -force, kind="stable")[:MOST_CONTACTS]
    trace = {
        "hasWork": has_work,
        "classes": list(CLASSES),
        "grains": {
            "x": numbers(centre[grains, 1], 4), "y": numbers(centre[grains, 2], 4), "z": numbers(centre[grains, 0], 4),
            "r": numbers(radius[grains], 3), "w2": numbers(grain_w2[grains], 3),
        },
        "contacts": {
            "from": numbers(centre[first[contacts]][:, [1, 2, 0]], 4), "to": numbers(end[contacts][:, [1, 2, 0]], 4),
            "w2": numbers(w2[contacts], 3), "force": numbers(force[contacts], 3),
            "kind": found.class_of_pair.values[contacts].tolist(),
        },
    }  # fmt: skip
    words = f"{len(radius)} grains and {len(w2)} contacts"
    if len(grains) < len(radius) or len(contacts) < len(w2):
        words += f", of which the {len(grains)} and {len(contacts)} of the largest work are kept here"
    if has_work:
        words += f"; {100.0 * float((w2 < 0.0).mean()):.0f} % of the contacts have negative second-order work"
    return trace, words + "."
