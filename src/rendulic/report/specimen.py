"""The specimen in three dimensions: data for the page's own script."""

from __future__ import annotations

from collections.abc import Mapping

from rendulic.report.draw import interactive
from rendulic.report.figure import Figure, Trace, numbers
from rendulic.report.spheres import scene
from rendulic.views.specimen import InSpace

__all__ = ["specimen"]


@interactive(InSpace)
def specimen(name: str, views: Mapping[str, InSpace]) -> Figure:
    """Grains and contacts by second-order work, force or class."""
    view = next(iter(views.values()))
    return Figure(name, f"{view.title}. {view.caption}", {"": {"": [_data(view)]}}, scene(), drawn_by="specimen")


def _data(view: InSpace) -> Trace:
    centre = view.centre
    return {
        "hasWork": view.has_work,
        "classes": list(view.classes),
        "grains": {
            "x": numbers(centre[:, 1], 4), "y": numbers(centre[:, 2], 4), "z": numbers(centre[:, 0], 4),
            "r": numbers(view.radius, 3), "w2": numbers(view.grain_w2, 3),
        },
        "contacts": {
            "from": numbers(view.begin[:, [1, 2, 0]], 4), "to": numbers(view.end[:, [1, 2, 0]], 4),
            "w2": numbers(view.w2, 3), "force": numbers(view.force, 3), "kind": view.kind.tolist(),
        },
    }  # fmt: skip
