"""The protocol that everything which can be probed obeys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from rendulic.loading.paths import Path
from rendulic.specimen.snapshot import Snapshot
from rendulic.specimen.state import State
from rendulic.specimen.way import Way

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

        The verdict in its attributes is "settles", "fails", "arrested", "undecided" or "too fast". Options: `hold_steps`, the
        longest time under the held load, and `on_window`, which specimens with grains and inertia call with a
        `specimen.window.Window`.
        """


@runtime_checkable
class ProbesTogether(Protocol):
    """A specimen with inertia, which is held until it is at rest before a probe is read, and takes many probes together."""

    def probe_together(
        self,
        increments: np.ndarray,
        n_steps: int,
        *,
        kind: str,
        marks: Sequence[float],
        settling_steps: int,
        read: Callable[[Specimen, Way], Reading],
        workers: int,
        on_done: Callable[[int], None],
    ) -> list[list[Reading]]:
        """Impose principal increments (m, 3), each on a copy; what `read` gave, by increment and mark.

        At each of the increasing `marks`, a copy of the copy is held for at most `settling_steps` until it is at rest, and
        given to `read` with its `Way`; 0 reads it while it moves. `on_done` is called with the number of
        increments finished since the last call. The number of `workers` changes no result.
        """
