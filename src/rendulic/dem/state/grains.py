"""Spheres: their arrays, made and validated."""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.arrays import Grains, aligned_rows
from rendulic.dem.kernels.layout import N_GRAIN
from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput

__all__ = ["make_grains", "morton_order", "sphere_masses"]


def sphere_masses(radius: np.ndarray, density: float, inertial_radius: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Mass [kg] and moment of inertia [kg m2] of solid spheres, scaled up below `inertial_radius`.

    A contact's stiffness grows with the radius, the mass with its cube, so the stable time step of
    a grain grows with its radius. Grains smaller than `inertial_radius` R get the mass `(R / r)^2`
    times their own, hence the time step of a grain of radius R: legitimate where inertia does not
    matter (quasi-static loading), and then several times faster.
    """
    mass = density * 4.0 / 3.0 * np.pi * radius * np.maximum(radius, inertial_radius) ** 2
    return mass, 0.4 * mass * radius**2


def make_grains(position, radius, density: float, velocity=None, angular_velocity=None) -> Grains:
    """Grains at rest (or with the given velocities) without forces.

    Raises
    ------
    InvalidInput
        For an empty packing, wrong shapes, numbers that are not finite, radii or density <= 0.
    """
    radius = finite_array("radius", radius, (None,))
    n = len(radius)
    if n == 0:
        raise InvalidInput("a packing needs at least one grain, got none")
    if (radius <= 0.0).any():
        worst = int(radius.argmin())
        raise InvalidInput(
            f"radii must be positive; {int((radius <= 0).sum())} are not, the smallest is {radius[worst]:.3g} m (grain {worst})"
        )
    density = positive_number("density", density, "kg/m3")
    grains = Grains(aligned_rows(np.zeros((n, N_GRAIN))), *sphere_masses(radius, density))
    grains.radius[:] = radius
    for name, value in (("velocity", velocity), ("angular_velocity", angular_velocity), ("position", position)):
        if value is not None:
            getattr(grains, name)[:] = finite_array(name, value, (n, 3))
    return grains


def morton_order(position: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Order of grains along a Z-curve, so that neighbours in space are near in memory."""
    # cubic cells, whatever the box: stretched ones would set neighbours far apart in memory
    scaled = np.clip((position - low) / (high - low).max(), 0.0, 1.0 - 1e-12)
    cells = (scaled * 1024).astype(np.uint64)
    code = np.zeros(len(position), np.uint64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(code, kind="stable")
