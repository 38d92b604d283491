"""The protocol that everything which can be probed obeys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from rendulic.loading.paths import Path
from rendulic.specimen.snapshot import Snapshot
from rendulic.specimen.state import State

if TYPE_CHECKING:
    import xarray as xr

Reading = TypeVar("Reading")

__all__ = ["CanBeRefined", "CanBurst", "HasGrains", "ProbesTogether", "Specimen"]


@runtime_checkable
class Specimen(Protocol):
    """A material in a state: grains or a constitutive model.

    Stresses in Pa and strains are (3, 3), compression and contraction positive, axis 1 axial.
    """

    @property
    def stress(self) -> np.ndarray: ...

    @property
    def strain(self) -> np.ndarray: ...

    def load(self, path: Path) -> xr.Dataset:
        """Follow a path, in place, and return the curve; each kind of specimen has options of its own."""

    def probe(
        self,
        increment: np.ndarray,
        n_steps: int,
        *,
        kind: str = "strain",
        marks: tuple[float, ...] = (1.0,),
        on_mark: Callable[[float], None] | None = None,
    ) -> None:
        """Impose a principal strain or stress increment (3,) in equal parts, in place.

        `on_mark(fraction)` is called at each of the increasing `marks`.
        """

    def clone(self) -> Specimen:
        """An independent specimen in the same state."""

    def save(self) -> State:
        """Copy the whole state."""

    def restore(self, state: State) -> None:
        """Return to a saved state exactly."""


@runtime_checkable
class HasGrains(Protocol):
    """A specimen whose second-order work can also be read at its contacts."""

    def snapshot(self) -> Snapshot:
        """The present state for analysis."""


@runtime_checkable
class CanBeRefined(Protocol):
    """A specimen whose answers have an error of discretisation, such as that of a rule of quadrature."""

    def refined(self) -> Specimen:
        """The present state, discretised finer: how its answers differ from the specimen's own is that error."""


@runtime_checkable
class CanBurst(Protocol):
    """A specimen that can be disturbed under a held load, and then settles or fails."""

    def burst(self, direction: np.ndarray, norm: float, n_steps: int, **options: Any) -> xr.Dataset:
        """Disturb it under the load conjugate to a direction of strain (3,), in place; a curve with a `verdict`.

        The verdict in its attributes is "settles", "fails", "arrested" or "undecided". Specimens with grains and inertia call
        the option `on_window` with a `specimen.window.Window`.
        """


@runtime_checkable
class ProbesTogether(Protocol):
    """A specimen that can take many strain probes of its present state faster together than one by one."""

    def probe_together(
        self,
        increments: np.ndarray,
        n_steps: int,
        *,
        marks: Sequence[float],
        read: Callable[[Specimen], Reading],
        workers: int,
        on_done: Callable[[int], None],
    ) -> list[list[Reading]]:
        """Impose principal strain increments (m, 3), each on a copy; what `read` gave, by increment and mark.

        `read` is called with the copy at each of the increasing `marks`; `on_done` with the number of
        increments finished since the last call. The number of `workers` changes no result.
        """
