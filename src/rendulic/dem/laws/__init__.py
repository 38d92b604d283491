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
    `parameters` (a tuple of floats) as their last argument. `contact_force` is called while two grains
    overlap and must return a normal force above zero: zero marks a pair without contact. (Where several
    copies of an assembly advance together, it is also computed for pairs that touch in another copy, and
    the result thrown away.)
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
