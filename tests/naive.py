"""Readable definitions of what the compiled kernels compute, written from the theory, in plain NumPy.

Nothing here is fast and nothing is taken from the kernels: the contact law of the theory's section 2
in vectors, and neighbours by looking at every pair.
"""

from __future__ import annotations

import numpy as np


def normal_stiffness(r1, r2, modulus, rule):
    """`k_n = K D_s` or `k_n = 2 E R1 R2 / (R1 + R2)` with `E = 2 K`."""
    if rule == "mean_diameter":
        return modulus * (r1 + r2)
    return 2.0 * (2.0 * modulus) * r1 * r2 / (r1 + r2)


def wall_stiffness(r, modulus):
    """`k_n = 2 K R`."""
    return 2.0 * modulus * r


def pair_force(x1, x2, r1, r2, v1, v2, w1, w2, old_t, dt, modulus, ratio, friction, rule):
    """Force on 2, its normal and tangential part, and the lever arms; None for an open contact.

    The old tangential force is projected on the tangent plane, turned about the normal with the mean
    spin of the two spheres, sheared by the slip of the contact point, and cut at the Coulomb limit.
    """
    branch = x2 - x1
    overlap = r1 + r2 - np.linalg.norm(branch)
    if overlap <= 0.0:
        return None
    n = branch / np.linalg.norm(branch)
    arm1, arm2 = r1 - overlap / 2, r2 - overlap / 2
    k_n = normal_stiffness(r1, r2, modulus, rule)
    k_t = ratio * k_n
    f_n = k_n * overlap
    v = v2 - v1 - np.cross(arm1 * w1 + arm2 * w2, n)
    v_t = v - np.dot(v, n) * n
    f_t = old_t - np.dot(old_t, n) * n
    f_t = f_t + dt * np.dot((w1 + w2) / 2, n) * np.cross(n, f_t)
    f_t = f_t - k_t * v_t * dt
    size = np.linalg.norm(f_t)
    if size > friction * f_n:
        f_t = f_t * (friction * f_n / size)
    return f_n, f_t, n, arm1, arm2


def forces(assembly, dt, old):
    """Resultants, torques, contact forces and wall forces at the present positions.

    Parameters
    ----------
    assembly : Assembly
        Read only, with a `LinearFrictional` law.
    dt : float
        Time step in s.
    old : dict of (i, j) to (3,) array
        Tangential force of each pair `i < j` in the previous step.

    Returns
    -------
    force, torque : (n, 3) arrays
    contacts : dict of (i, j) to (f_n, (3,) f_t)
    walls : (6,) array
        Pressing force on each wall.
    """
    grains, law = assembly.grains, assembly.law
    x, r, v, w = grains.position, grains.radius, grains.velocity, grains.angular_velocity
    force, torque, contacts, walls = np.zeros_like(x), np.zeros_like(x), {}, np.zeros(6)
    for i in range(len(r)):
        for j in range(i + 1, len(r)):
            found = pair_force(
                x[i], x[j], r[i], r[j], v[i], v[j], w[i], w[j], old.get((i, j), np.zeros(3)), dt,
                law.modulus, law.tangential_ratio, law.friction, law.stiffness_rule,
            )  # fmt: skip
            if found is None:
                continue
            f_n, f_t, n, arm1, arm2 = found
            contacts[i, j] = f_n, f_t
            on_2 = f_n * n + f_t
            force[j] += on_2
            force[i] -= on_2
            torque[j] += np.cross(-arm2 * n, on_2)
            torque[i] += np.cross(arm1 * n, -on_2)
        for wall in range(6):
            axis = wall // 2
            gap = abs(x[i, axis] - assembly.walls.position[wall])
            overlap = r[i] - gap
            if overlap > 0.0:
                pressing = wall_stiffness(r[i], law.modulus) * overlap
                walls[wall] += pressing
                force[i, axis] += pressing if wall % 2 == 0 else -pressing
    return force, torque, contacts, walls


def damped(force, velocity, mass, dt, damping):
    """Cundall's damping, `F (1 - lambda sign(F (v + F dt / 2m)))` by component."""
    return force * (1.0 - damping * np.sign(force * (velocity + force * dt / (2.0 * mass))))


def near_pairs(position, radius, margin):
    """All pairs closer than the sum of radii plus `margin`, by looking at each."""
    i, j = np.triu_indices(len(radius), 1)
    gap = np.linalg.norm(position[j] - position[i], axis=1)
    near = gap < radius[i] + radius[j] + margin
    return set(zip(i[near].tolist(), j[near].tolist(), strict=True))


def near_walls(position, radius, walls, margin):
    """All grains closer than radius plus `margin` to a wall, as (grain, wall)."""
    found = set()
    for wall in range(6):
        inside = (position[:, wall // 2] - walls[wall]) * (1 if wall % 2 == 0 else -1)
        found |= {(int(i), wall) for i in np.flatnonzero(inside < radius + margin)}
    return found


def different_arrays(state, other):
    """Names of the arrays that differ in any bit between two saved states."""
    assert state.arrays.keys() == other.arrays.keys()
    return [
        name for name, array in state.arrays.items()
        if array.shape != other.arrays[name].shape or array.tobytes() != other.arrays[name].tobytes()
    ]  # fmt: skip
