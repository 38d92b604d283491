"""Second-order work of one increment, by class of contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rendulic.views.view import View

if TYPE_CHECKING:
    from rendulic.probing.second_order_work import SecondOrderWork

__all__ = ["WorkByClass", "work_by_class"]


@dataclass(frozen=True, kw_only=True, eq=False)
class WorkByClass(View):
    """Works in J/m3 by class of contact, the inertial term, and last their sum, the work of the walls."""

    works: Mapping[str, float]


def work_by_class(work: SecondOrderWork, title: str = "") -> WorkByClass:
    """The view of `rd.second_order_work`."""
    works = work.by_class | {"inertial": work.grains, "walls": work.boundary}
    words = ", ".join(f"{name} {value:.3g}" for name, value in works.items())
    return WorkByClass(title=title, caption=f"Second-order work in J/m³ by class of contact: {words}.", works=works)
