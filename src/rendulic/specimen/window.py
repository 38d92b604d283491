"""One time step seen from both sides, for the balance of its energy."""

from __future__ import annotations

from dataclasses import dataclass

from rendulic.specimen.snapshot import Snapshot

__all__ = ["Window"]


@dataclass(frozen=True)
class Window:
    """One time step of a burst, for Eq. 1 of the paper.

    Parameters
    ----------
    before, after : Snapshot
        On both sides of the step.
    kinetic : float
        Change of the kinetic energy of translation in J, with what damping took of it added back.
    """

    before: Snapshot
    after: Snapshot
    kinetic: float
