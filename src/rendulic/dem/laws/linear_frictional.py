"""Linear elastic, frictional, tensionless contact: the law of the paper's section 4.1.

A contact law is three functions of plain numbers, which the kernels compile into their loops, and
the numbers they share (`parameters`). `LinearFrictional` is the pattern to copy for another law.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

from rendulic.foundation.checks import positive_number
from rendulic.foundation.errors import InvalidInput, one_of

__all__ = ["LinearFrictional"]


def mean_diameter_stiffness(radius_1, radius_2, parameters):
    """Normal and tangential stiffness [N/m] for `k_n = K (R1 + R2)`."""
    k_n = parameters[0] * (radius_1 + radius_2)
    return k_n, parameters[1] * k_n


def harmonic_stiffness(radius_1, radius_2, parameters):
    """Normal and tangential stiffness [N/m] for `k_n = 2 E R1 R2 / (R1 + R2)`, `E = 2 K`."""
    k_n = 4.0 * parameters[0] * radius_1 * radius_2 / (radius_1 + radius_2)
    return k_n, parameters[1] * k_n


def wall_stiffness(radius, parameters):
    """Normal stiffness [N/m] of a grain on a wall, `k_n = 2 K R`, the same for both rules."""
    return 2.0 * parameters[0] * radius


def contact_force(overlap, k_n, k_t, force_x, force_y, force_z, slip_x, slip_y, slip_z, parameters):
    """Force on grain 2 of a closed contact after a tangential displacement increment.

    Parameters
    ----------
    overlap : float
        `R1 + R2 - |x2 - x1|`, positive, in m.
    k_n, k_t : float
        Stiffnesses of this contact in N/m.
    force_x, force_y, force_z : float
        Tangential force of the previous step, already in the current tangent plane, in N.
    slip_x, slip_y, slip_z : float
        Tangential displacement of 2 relative to 1 over the step, in m.
    parameters : tuple of float
        The law's `parameters`.

    Returns
    -------
    force_n, force_x, force_y, force_z, dissipated : float
        Normal force (positive in compression), tangential force, and the energy in J that
        friction took during the step: trapezoidal work on the sliding part of the displacement.
    """
    force_n = k_n * overlap
    trial_x = force_x - k_t * slip_x
    trial_y = force_y - k_t * slip_y
    trial_z = force_z - k_t * slip_z
    trial2 = trial_x * trial_x + trial_y * trial_y + trial_z * trial_z
    limit = parameters[2] * force_n
    if trial2 <= limit * limit:
        return force_n, trial_x, trial_y, trial_z, 0.0
    scale = limit / sqrt(trial2)
    new_x, new_y, new_z = scale * trial_x, scale * trial_y, scale * trial_z
    dissipated = (
        0.5
        / k_t
        * (
            (force_x + new_x) * (trial_x - new_x)
            + (force_y + new_y) * (trial_y - new_y)
            + (force_z + new_z) * (trial_z - new_z)
        )
    )
    return force_n, new_x, new_y, new_z, dissipated


def elastic_energy(force_n, force_t, k_n, k_t):
    """Energy stored in contacts, `f_n^2 / 2 k_n + f_t^2 / 2 k_t`, in J."""
    return 0.5 * (force_n * force_n / k_n + force_t * force_t / k_t)


STIFFNESS_RULES: dict[str, Callable] = {
    "mean_diameter": mean_diameter_stiffness,
    "harmonic": harmonic_stiffness,
}


@dataclass(frozen=True)
class LinearFrictional:
    """Linear springs, Coulomb friction, no tension (Nicot et al. 2014, section 4.1).

    Parameters
    ----------
    modulus : float
        `K` in Pa; `k_n = K (R1 + R2)` for the `mean_diameter` rule.
    tangential_ratio : float
        `k_t / k_n`, positive.
    friction : float
        Coulomb coefficient `mu` between grains; walls are frictionless.
    stiffness_rule : {"mean_diameter", "harmonic"}
        How `k_n` follows from the two radii; both give the same value for equal grains.

    Raises
    ------
    InvalidInput
        If a number is not finite or has the wrong sign, or the rule is unknown.

    Examples
    --------
    >>> law = LinearFrictional()
    >>> k_n, k_t = law.stiffness(0.01, 0.01, law.parameters)
    >>> float(k_n), round(k_t / k_n, 2)
    (7120000.0, 0.42)
    """

    modulus: float = 356e6
    tangential_ratio: float = 0.42
    friction: float = 0.7
    stiffness_rule: str = "mean_diameter"

    def __post_init__(self) -> None:
        one_of(self.stiffness_rule, STIFFNESS_RULES, "stiffness rule")
        for name in ("modulus", "tangential_ratio"):
            object.__setattr__(self, name, positive_number(name, getattr(self, name)))
        if self.friction != 0.0:
            try:
                object.__setattr__(self, "friction", positive_number("friction", self.friction))
            except InvalidInput:
                raise InvalidInput(f"friction must be zero or a positive number, got {self.friction!r}") from None

    @property
    def parameters(self) -> tuple[float, float, float]:
        """The numbers handed to the compiled functions."""
        return (float(self.modulus), float(self.tangential_ratio), float(self.friction))

    @property
    def stiffness(self) -> Callable:
        """`(radius_1, radius_2, parameters) -> k_n, k_t`."""
        return STIFFNESS_RULES[self.stiffness_rule]

    wall_stiffness = staticmethod(wall_stiffness)
    contact_force = staticmethod(contact_force)
    elastic_energy = staticmethod(elastic_energy)
