"""Tangential forces for LAMMPS, which takes none from a file: velocities that bring them about in one step.

LAMMPS adds the slip of each contact to its history at every step, whether or not anything moves the grains. One step
without an integrator, at velocities `v` and spins `w`, therefore leaves the slip

    s = P (v_2 - v_1) dt - (r_1 w_1 + r_2 w_2) x n dt,    P = 1 - n n,

at every contact and every grain where it was. The force on grain 2 is `-k_t s`. So the forces wanted are two linear
equations per contact in six unknowns per grain, which have a solution if there are at most three contacts per grain,
wherever these are.
"""

from __future__ import annotations

import numpy as np

from rendulic.specimen.snapshot import Snapshot

__all__ = ["velocities_for"]


def velocities_for(snapshot: Snapshot, k_t: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Velocities and spins that bring about the tangential forces between grains in one step of 1 s.

    Parameters
    ----------
    k_t : (n_contacts between grains,) array
        Tangential stiffnesses that LAMMPS will use, in N/m.

    Returns
    -------
    velocity, spin : (n, 3) arrays
        In m/s and 1/s: the smallest that come nearest.
    residual : float
        Norm of the forces that are not met, relative to that of all.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import lsmr

    between = ~snapshot.is_wall
    n, force = snapshot.n_grains, snapshot.force_t[between]
    first, second, normal = snapshot.first[between], snapshot.second[between], snapshot.normal[between]
    if not force.any():
        return np.zeros((n, 3)), np.zeros((n, 3)), 0.0
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]  # the axis farthest from the normal
    across = np.cross(normal, least)
    across /= np.linalg.norm(across, axis=1)[:, None]
    tangents = np.stack((across, np.cross(normal, across)), axis=1)  # contact, which, axis
    turning = np.cross(normal[:, None, :], tangents)
    # unknowns: v of all grains, then r w of all grains; a row per tangent
    row = np.broadcast_to(np.arange(2 * len(first)).reshape(-1, 2, 1), tangents.shape)
    blocks = [(first, 0, -tangents), (second, 0, tangents), (first, 3 * n, -turning), (second, 3 * n, -turning)]
    columns = [
        np.broadcast_to(start + 3 * grain[:, None, None] + np.arange(3), row.shape) for grain, start, _ in blocks
    ]
    entries = np.concatenate([value.reshape(-1) for *_, value in blocks])
    place = np.tile(row.reshape(-1), len(blocks)), np.concatenate([column.reshape(-1) for column in columns])
    matrix = coo_array((entries, place), shape=(2 * len(first), 6 * n)).tocsr()
    slip = (-np.einsum("cta,ca->ct", tangents, force) / k_t[:, None]).reshape(-1)
    found = lsmr(matrix, slip, atol=1e-13, btol=1e-13, conlim=0.0, maxiter=40 * n)[0]
    missed = ((matrix @ found - slip).reshape(-1, 2) * k_t[:, None]).reshape(-1)
    velocity, turn = found.reshape(2, n, 3)
    return velocity, turn / snapshot.radius[:, None], float(np.linalg.norm(missed) / np.linalg.norm(force))
