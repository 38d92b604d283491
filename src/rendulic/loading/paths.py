"""Loading paths: what is controlled, at which relative rates, and where to stop."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite

from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput
from rendulic.loading.control import Control

__all__ = [
    "Path",
    "Until",
    "constant_p",
    "constant_volume",
    "drained_triaxial",
    "isotropic",
    "oedometric",
    "proportional",
]

UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Until:
    """Where a path stops: at whichever comes first.

    Parameters
    ----------
    strain : float
        Axial strain travelled along this path (absolute), always a bound; of the fastest driven axis
        where the axial one is not driven.
    eta : float, optional
        Stress ratio q/p, reached from the side on which the path starts.
    peak : bool
        Stop once q has fallen back by `peak_drop` of its largest change along this path.
    peak_drop : float
        Fraction of that change.
    """

    strain: float = 0.3
    eta: float | None = None
    peak: bool = False
    peak_drop: float = 0.05

    def __post_init__(self) -> None:
        if not (isfinite(self.strain) and self.strain > 0.0):
            raise InvalidInput(f"a path stops at a positive axial strain, got {self.strain!r}")
        if self.eta is not None and not isfinite(self.eta):
            raise InvalidInput(f"until_eta must be a number, got {self.eta!r}")
        if not 0.0 < self.peak_drop < 1.0:
            raise InvalidInput(f"peak_drop must be in (0, 1), got {self.peak_drop!r}")


@dataclass(frozen=True)
class Path:
    """A loading path in principal axes.

    Parameters
    ----------
    name : str
        For tables and plots.
    control : Control
        The generalised components and which of each pair is imposed.
    strain_rate : (3,) tuple
        Relative rates of the strain-controlled components; the specimen scales them so that the
        fastest principal strain moves at its loading rate.
    stress : (3,) tuple
        Values in Pa of the stress-controlled components; None holds the value at the start.
    until : Until
        Where it stops.
    """

    name: str
    control: Control
    strain_rate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stress: tuple[float | None, float | None, float | None] = (None, None, None)
    until: Until = field(default_factory=Until)

    def __post_init__(self) -> None:
        finite_array("strain_rate of a path", self.strain_rate, (3,))
        finite_array("stress of a path", [value for value in self.stress if value is not None], (None,))
        if len(self.stress) != 3:
            raise InvalidInput(f"a path has three stresses (None holds the present one), got {self.stress!r}")

    @property
    def is_driven(self) -> bool:
        """Whether any strain-controlled component moves."""
        return any(r != 0.0 for r, s in zip(self.strain_rate, self.control.is_stress, strict=True) if not s)


def isotropic(pressure: float) -> Path:
    """Bring the specimen to an isotropic stress in Pa (all three stresses controlled)."""
    pressure = positive_number("pressure", pressure, "Pa")
    return Path("isotropic", Control(UNIT, ("stress",) * 3), stress=(pressure,) * 3)


def drained_triaxial(
    until_strain: float = 0.3,
    until_eta: float | None = None,
    until_peak: bool = False,
    extension: bool = False,
    lateral_stress: float | None = None,
) -> Path:
    """Axial compression (or extension) at constant lateral stresses.

    `lateral_stress` in Pa; by default each lateral stress keeps its present value.
    """
    sign = -1.0 if extension else 1.0
    if lateral_stress is not None:
        lateral_stress = positive_number("lateral_stress", lateral_stress, "Pa")
    return Path(
        "drained triaxial",
        Control(UNIT, ("strain", "stress", "stress")),
        strain_rate=(sign, 0.0, 0.0),
        stress=(None, lateral_stress, lateral_stress),
        until=Until(until_strain, until_eta, until_peak),
    )


def constant_volume(
    until_strain: float = 0.3,
    until_eta: float | None = None,
    until_peak: bool = False,
    extension: bool = False,
) -> Path:
    """Axisymmetric isochoric compression (undrained, saturated), exact kinematics without a servo."""
    sign = -1.0 if extension else 1.0
    return Path(
        "constant volume",
        Control(UNIT, ("strain",) * 3),
        strain_rate=(sign, -0.5 * sign, -0.5 * sign),
        until=Until(until_strain, until_eta, until_peak),
    )


def oedometric(until_strain: float = 0.3, extension: bool = False) -> Path:
    """Axial compression (or extension) at constant lateral strains."""
    rate = (-1.0 if extension else 1.0, 0.0, 0.0)
    return Path("oedometric", Control(UNIT, ("strain",) * 3), strain_rate=rate, until=Until(until_strain))


def constant_p(until_strain: float = 0.3, until_eta: float | None = None, until_peak: bool = False) -> Path:
    """Axial shear at constant mean stress and equal lateral stresses."""
    control = Control.of_stresses(
        [[1.0, -0.5, -0.5], [1.0 / 3.0] * 3, [0.0, 1.0, -1.0]], ("strain", "stress", "stress")
    )
    return Path("constant p", control, strain_rate=(1.0, 0.0, 0.0), until=Until(until_strain, until_eta, until_peak))


def proportional(
    ratio: float, until_strain: float = 0.3, until_eta: float | None = None, until_peak: bool = False
) -> Path:
    """Proportional strain path `d_eps_1 + 2 R d_eps_3 = 0`, `R = ratio` (1 is constant volume)."""
    if not (isfinite(ratio) and ratio != 0.0):
        raise InvalidInput(f"the ratio R of a proportional strain path must be a number other than 0, got {ratio!r}")
    lateral = -0.5 / ratio
    return Path(
        f"proportional strain, R = {ratio:g}",
        Control(UNIT, ("strain",) * 3),
        strain_rate=(1.0, lateral, lateral),
        until=Until(until_strain, until_eta, until_peak),
    )
