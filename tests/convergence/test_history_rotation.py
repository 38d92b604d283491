"""How much the turning of tangential forces, which is of first order in the time step, can change a probe."""

from __future__ import annotations

import numpy as np

from rendulic.dem import Assembly
from rendulic.tensors.rendulic_plane import increment_along


def largest_error(state, straining, norm, n_steps):
    """Largest relative error of a tangential force in a probe, and the largest angle that a contact turns by, in rad.

    A step that turns a contact by an angle changes its tangential force by half the square of it, wherever the angle lies: half for
    the normal's turn, half for the spin about it. What is summed over all steps bounds the error from above.
    """
    sample = Assembly.from_state(state)
    rates = increment_along(130.0, norm) / (n_steps * sample.time_step)
    first, second = (np.array(ends) for ends in (sample.contacts.first, sample.contacts.second))
    touching = sample.contacts.force_n > 0.0
    first, second = first[touching], second[touching]

    def normals():
        way = sample.grains.position[second] - sample.grains.position[first]
        return way / np.linalg.norm(way, axis=1)[:, None]

    error, angle, before = np.zeros(len(first)), np.zeros(len(first)), normals()
    for _ in range(n_steps):
        sample.advance(1, straining(rates))
        now = normals()
        spin = sample.grains.angular_velocity[first] + sample.grains.angular_velocity[second]
        turned = np.hypot(np.linalg.norm(now - before, axis=1), 0.5 * sample.time_step * (spin * now).sum(axis=1))
        error += 0.5 * turned**2
        angle += turned
        before = now
    return float(error.max()), float(angle.max())


def test_turning_of_tangential_forces_changes_a_probe_by_nothing_that_counts(sheared_state, straining, say):
    """A probe turns contacts by so little that the first order of the turning does not matter.

    For a motion that is the same at another number of steps, the error goes with 1 over that number: `angle^2 / 2 n` if the contact turns evenly.
    """
    coarse, _ = largest_error(sheared_state, straining, 5e-5, 1250)
    fine, angle = largest_error(sheared_state, straining, 5e-5, 5000)
    say(
        f"tangential forces of a probe of 5e-5 in 5 000 steps: turned by at most {angle:.1e} rad, with an error of {fine:.1e}"
    )
    assert fine < 1e-9
    assert fine >= angle**2 / 2 / 5000 * (1.0 - 1e-12)  # Cauchy and Schwarz
    assert fine < coarse
