"""What the scalar kernel and every lane do alike: a grain's damping, and two grains in contact."""

from __future__ import annotations

from math import copysign, sqrt

from rendulic.dem.kernels.arithmetic import cross, dot, fma, fma_vector
from rendulic.dem.kernels.contact_law import law_contact_force
from rendulic.foundation.compiling import kernel


@kernel(forceinline=True)
def damped(force, velocity, half_impulse, damping):
    """Cundall's non-viscous damping of one component, `F (1 - lambda sign(F (v + F dt / 2m)))`.

    `half_impulse` is `dt / 2m`.
    """
    return force * (1.0 - damping * copysign(1.0, force * fma(half_impulse, force, velocity)))


@kernel(forceinline=True)
def pair_force(apart, distance2, r1, r2, k_n, k_t, velocity, spin_1, spin_2, held, dt, parameters):
    """Forces of a closed contact; section 2 of the theory.

    The old tangential force is projected on the new tangent plane and turned with the pair's mean spin
    about the normal, then sheared by the contact-point velocity. Vectors are three numbers each.

    Parameters
    ----------
    apart, distance2 : vector and float
        From the first centre to the second, and its square.
    velocity : vector
        Of the second centre less that of the first.
    spin_1, spin_2 : vectors
        Of the two grains.
    held : vector
        Tangential force of the step before, on the second grain.

    Returns
    -------
    force_n, force_t : float and vector
        Normal force, and tangential force on the second grain.
    force : vector
        Whole force on the second grain.
    moment, a1, a2 : vector and floats
        Normal x tangential force, and the arms: each grain's torque is `-arm * moment`.
    dissipated : float
        What friction took.
    """
    distance = sqrt(distance2)
    overlap = (r1 + r2) - distance
    scale = 1.0 / distance
    normal = (apart[0] * scale, apart[1] * scale, apart[2] * scale)
    a1, a2 = r1 - 0.5 * overlap, r2 - 0.5 * overlap
    turning = (
        fma(a1, spin_1[0], a2 * spin_2[0]), fma(a1, spin_1[1], a2 * spin_2[1]), fma(a1, spin_1[2], a2 * spin_2[2])
    )  # fmt: skip
    by_spin = cross(turning, normal)
    slip = (velocity[0] - by_spin[0], velocity[1] - by_spin[1], velocity[2] - by_spin[2])
    slip = fma_vector(-dot(slip, normal), normal, slip)
    held = fma_vector(-dot(held, normal), normal, held)
    spin = (spin_1[0] + spin_2[0], spin_1[1] + spin_2[1], spin_1[2] + spin_2[2])
    held = fma_vector((0.5 * dt) * dot(spin, normal), cross(normal, held), held)
    force_n, tx, ty, tz, dissipated = law_contact_force(
        overlap, k_n, k_t, held[0], held[1], held[2], dt * slip[0], dt * slip[1], dt * slip[2], parameters
    )
    force_t = (tx, ty, tz)
    return force_n, force_t, fma_vector(force_n, normal, force_t), cross(normal, force_t), a1, a2, dissipated
