"""What the scalar kernel and every lane do alike: a grain's damping, and two grains in contact."""

from __future__ import annotations

from math import copysign, sqrt

from rendulic.dem.kernels.arithmetic import cross, dot, fma
from rendulic.dem.kernels.contact_law import law_contact_force
from rendulic.foundation.compiling import kernel


@kernel(forceinline=True)
def damped(force, velocity, half_impulse, damping):
    """Cundall's non-viscous damping of one component, `F (1 - lambda sign(F (v + F dt / 2m)))`.

    `half_impulse` is `dt / 2m`.
    """
    return force * (1.0 - damping * copysign(1.0, force * fma(half_impulse, force, velocity)))


@kernel(forceinline=True)
def pair_force(
    nx, ny, nz, distance2, r1, r2, k_n, k_t, vx, vy, vz, sx, sy, sz, ux, uy, uz, fx, fy, fz, dt, parameters
):  # fmt: skip
    """Forces of a closed contact; section 2 of the theory.

    The old tangential force is projected on the new tangent plane and turned with the pair's mean spin
    about the normal, then sheared by the contact-point velocity.

    Parameters
    ----------
    nx, ny, nz, distance2 : float
        From the first centre to the second, and its square.
    vx, vy, vz : float
        Velocity of the second centre less that of the first.
    sx, sy, sz, ux, uy, uz : float
        Spins of the first grain and of the second.
    fx, fy, fz : float
        Tangential force of the step before, on the second grain.

    Returns
    -------
    force_n, tx, ty, tz : float
        Normal force and tangential force on the second grain.
    px, py, pz : float
        Whole force on the second grain.
    mx, my, mz, a1, a2 : float
        Normal x tangential force, and the arms: each grain's torque is `-arm * m`.
    dissipated : float
        What friction took.
    """
    distance = sqrt(distance2)
    overlap = (r1 + r2) - distance
    scale = 1.0 / distance
    nx *= scale
    ny *= scale
    nz *= scale
    a1, a2 = r1 - 0.5 * overlap, r2 - 0.5 * overlap
    cx, cy, cz = cross(
        fma(a1, sx, a2 * ux), fma(a1, sy, a2 * uy), fma(a1, sz, a2 * uz), nx, ny, nz
    )  # fmt: skip
    vx -= cx
    vy -= cy
    vz -= cz
    vn = dot(vx, vy, vz, nx, ny, nz)
    fn = dot(fx, fy, fz, nx, ny, nz)
    fx = fma(-fn, nx, fx)
    fy = fma(-fn, ny, fy)
    fz = fma(-fn, nz, fz)
    turn = (0.5 * dt) * dot(sx + ux, sy + uy, sz + uz, nx, ny, nz)
    cx, cy, cz = cross(nx, ny, nz, fx, fy, fz)
    fn, tx, ty, tz, dissipated = law_contact_force(
        overlap,
        k_n,
        k_t,
        fma(turn, cx, fx),
        fma(turn, cy, fy),
        fma(turn, cz, fz),
        dt * fma(-vn, nx, vx),
        dt * fma(-vn, ny, vy),
        dt * fma(-vn, nz, vz),
        parameters,
    )
    mx, my, mz = cross(nx, ny, nz, tx, ty, tz)
    return fn, tx, ty, tz, fma(fn, nx, tx), fma(fn, ny, ty), fma(fn, nz, tz), mx, my, mz, a1, a2, dissipated
