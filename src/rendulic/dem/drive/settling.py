"""Walls held after an increment, until the grains are at rest."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

import numpy as np

from rendulic.dem.drive.quasi_static import STEPS_PER_LOOK, QuasiStatic
from rendulic.dem.drive.servo import drive_for, hold
from rendulic.dem.drive.stepping import advance
from rendulic.dem.drive.stopping import stop_rattlers
from rendulic.dem.measure.equilibrium import unbalanced_force
from rendulic.dem.state.assembly_state import AssemblyState, copy_of
from rendulic.specimen.way import Way

__all__ = ["SETTLED", "SETTLING_DAMPING", "Watch", "looks", "settled_copy", "stands_still"]

AnyAssembly = TypeVar("AnyAssembly", bound=AssemblyState)

# unbalanced force of grains at rest after an increment: a thirtieth of what a probe at the default rate has on its way
SETTLED = 1e-5
# of Cundall, as where states are brought to rest: less lets what swings on break more grains loose, and takes longer
SETTLING_DAMPING = QuasiStatic.damping


def stands_still(assembly: AssemblyState) -> bool:
    """Whether the grains are at rest, or none touches another; rattlers, which nothing would ever stop, are stopped first."""
    stop_rattlers(assembly)
    unbalanced = unbalanced_force(assembly)
    return unbalanced <= SETTLED or not np.isfinite(unbalanced)


def settled_copy(assembly: AnyAssembly, max_steps: int) -> tuple[AnyAssembly, int]:
    """A copy with its walls held until the grains are at rest, and the steps it took, at most about `max_steps`.

    Lanes do the same to the bit.
    """
    one, done = copy_of(assembly), 0
    drive = drive_for(one, hold("strain"), (None,) * 3, np.zeros(3), 1.0)
    while max_steps and not stands_still(one) and done < max_steps:
        advance(one, STEPS_PER_LOOK, drive, SETTLING_DAMPING)
        done += STEPS_PER_LOOK
    return one, done


def looks(n_steps: int) -> Iterator[int]:
    """Steps between looks at a moving assembly, together `n_steps`."""
    for start in range(0, n_steps, STEPS_PER_LOOK):
        yield min(STEPS_PER_LOOK, n_steps - start)


class Watch:
    """What is seen of a moving assembly at every look: its unbalanced force and second-order work.

    Parameters
    ----------
    start : AssemblyState
        Before the increment.
    """

    def __init__(self, start: AssemblyState) -> None:
        self.stress, self.strain = np.diag(start.stress), np.diag(start.strain)
        self.unbalanced: list[float] = []
        self.work: list[tuple[float, float]] = []

    def look(self, assembly: AssemblyState) -> None:
        """Look at it, once more."""
        self.unbalanced.append(unbalanced_force(assembly))
        d_sigma, d_eps = np.diag(assembly.stress) - self.stress, np.diag(assembly.strain) - self.strain
        size = float(np.linalg.norm(d_sigma) * np.linalg.norm(d_eps))
        self.work.append((float(assembly.n_steps), float(d_sigma @ d_eps) / size if size else float("nan")))

    def way(self, assembly: AssemblyState, settling_steps: int, n_steps: int) -> Way:
        """The way so far: `n_steps` steps, and then `settling_steps` until `assembly` was read."""
        work = np.array(self.work)
        work[:, 0] = (work[:, 0] - work[-1, 0]) / n_steps + 1.0
        return Way(
            float(np.quantile(self.unbalanced, 0.1)), float(np.max(self.unbalanced)), work, settling_steps,
            unbalanced_force(assembly) <= SETTLED,
        )  # fmt: skip
