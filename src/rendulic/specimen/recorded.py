"""What an engine says about a state besides its list of contacts: numbers to hold that list against."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

__all__ = ["Recorded", "Springs"]


@dataclass(frozen=True)
class Springs:
    """The linear normal springs of an engine: `f_n = k_n overlap`.

    Parameters
    ----------
    modulus : float
        `K` in Pa, between two grains.
    rule : {"mean_diameter", "harmonic"}
        `k_n = K (R1 + R2)`, or `k_n = 4 K R1 R2 / (R1 + R2)`.
    wall_modulus : float or None
        `K` of `k_n = 2 K R` between a grain and a wall, in Pa; None if unknown.
    """

    modulus: float
    rule: str = "mean_diameter"
    wall_modulus: float | None = None

    def between(self, radius_1: np.ndarray, radius_2: np.ndarray) -> np.ndarray:
        """Stiffness in N/m of contacts between grains of these radii in m."""
        if self.rule == "harmonic":
            return 4.0 * self.modulus * radius_1 * radius_2 / (radius_1 + radius_2)
        return self.modulus * (radius_1 + radius_2)

    def on_wall(self, radius: np.ndarray) -> np.ndarray:
        """Stiffness in N/m of contacts with walls; NaN where it is unknown."""
        return 2.0 * (np.nan if self.wall_modulus is None else self.wall_modulus) * radius


@dataclass(frozen=True, eq=False)
class Recorded:
    """Numbers of the engine's own about one state, in rendulic's axes and signs; None where it says nothing.

    Nothing is computed with them: they are there for audits.

    Parameters
    ----------
    wall_force : (6,) array or None
        Force by the grains on each wall in N, positive if it presses the wall outward: 1-, 1+, 2-, 2+, 3-, 3+.
    grain_force : (n, 3) array or None
        Resultant of the contact forces on each grain in N.
    grain_moment : (n, 3) array or None
        Moment of the contact forces about the centre of each grain in N m.
    stress : (3, 3) array or None
        Cauchy stress in Pa, compression positive; NaN for components that it does not say.
    stress_of_pairs : bool
        Whether `stress` is of the contacts between grains only, those with walls left out.
    springs : Springs or None
        The normal law of all contacts.
    slack : (n,) array or None
        How far each grain has moved between the instant of the forces and that of the positions, in m. None: they
        are of one instant.
    are_spheres : bool or None
        Whether all grains are spheres of the radii given.
    step : int or None
        Number of the time step.
    n_merged : int
        Rows of the file that were added to another of the same two bodies.
    derived : tuple of str
        Fields of the snapshot that the file does not have, which its reader made of others.
    """

    wall_force: np.ndarray | None = None
    grain_force: np.ndarray | None = None
    grain_moment: np.ndarray | None = None
    stress: np.ndarray | None = None
    stress_of_pairs: bool = False
    springs: Springs | None = None
    slack: np.ndarray | None = None
    are_spheres: bool | None = None
    step: int | None = None
    n_merged: int = 0
    derived: tuple[str, ...] = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Recorded) and all(
            _same(getattr(self, one.name), getattr(other, one.name)) for one in fields(self)
        )

    __hash__ = None  # type: ignore[assignment]

    def with_axes(self, order: np.ndarray) -> Recorded:
        """The same with axes renamed in cyclic order: axis k is the former `order[k]`."""
        wall, grain, moment, stress = self.wall_force, self.grain_force, self.grain_moment, self.stress
        return replace(
            self,
            wall_force=None if wall is None else wall.reshape(3, 2)[order].reshape(-1),
            grain_force=None if grain is None else grain[:, order],
            grain_moment=None if moment is None else moment[:, order],
            stress=None if stress is None else stress[np.ix_(order, order)],
        )


def _same(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=True)
    return type(one) is type(other) and bool(np.all(one == other))
