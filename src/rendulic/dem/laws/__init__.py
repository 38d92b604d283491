"""Contact laws: one law, one file. Any object with the members of `ContactLaw` can be used."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from rendulic.dem.laws.linear_frictional import LinearFrictional

__all__ = ["LAWS", "ContactLaw", "LinearFrictional"]

# laws that a saved state can name; a user's own law is handed over when the state is read
LAWS: dict[str, Callable] = {"LinearFrictional": LinearFrictional}


class ContactLaw(Protocol):
    """What the engine needs of a contact law; `LinearFrictional` documents each member.

    The functions must be plain Python that numba can compile, without global state; they get
    `parameters` (a tuple of floats) as their last argument. `contact_force` must return a normal force above
    zero for two grains that overlap: zero marks a pair without contact. (Contacts are computed eight at a time,
    so it is also called, with a negative overlap, for neighbours that do not touch; what it returns for them is
    thrown away. The compiler makes vectors of it where it can: best without loops and with short branches.)
    """

    @property
    def parameters(self) -> tuple[float, ...]: ...

    @property
    def friction(self) -> float: ...

    @property
    def stiffness(self) -> Callable: ...

    @property
    def wall_stiffness(self) -> Callable: ...

    @property
    def contact_force(self) -> Callable: ...

    @property
    def elastic_energy(self) -> Callable: ...
