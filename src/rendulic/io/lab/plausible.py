"""What in a test is not as tests are: one sentence for each, for the user to look at."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

__all__ = ["notes_on"]

DRIFT = 0.1  # of the lateral stress at the start, in a drained test
FAR_FROM_ZERO = 0.1  # a strain at the first reading
LARGEST_STRESS, LEAST_STRESS = 200e6, 100.0  # Pa, of q in a laboratory
LEAST_STRAIN = 2e-4  # gone through


def notes_on(
    columns: Mapping[str, np.ndarray], drainage: str, undrained: bool, extension: bool, has_mean_stress: bool
) -> list[str]:
    """Sentences on a test in SI units, compression positive.

    Parameters
    ----------
    columns : mapping of str to (n,) array
        Stresses, logarithmic strains.
    drainage : str
        As it is said.
    undrained, extension : bool
        Kind of test.
    has_mean_stress : bool
        Whether the lateral stress was computed from p.
    """
    notes = []
    lateral, q = columns["sigma_3"], columns["q"]
    if not undrained and lateral[0] > 0.0:
        drift = float(lateral[np.argmax(np.abs(lateral - lateral[0]))] - lateral[0])
        if abs(drift) > DRIFT * lateral[0]:
            share = float(np.polyfit(q, lateral, 1)[0]) if np.ptp(q) > 0.0 else 0.0
            half = has_mean_stress and abs(share - 1.0 / 6.0) < 0.02
            why = ": is p the half sum (sigma_1 + sigma_3) / 2?" if half else "; it is constant in most drained tests"
            notes.append(
                f"the lateral stress goes from {lateral[0] / 1e3:.4g} to {(lateral[0] + drift) / 1e3:.4g} kPa{why}"
            )
    eps_v = 1.0 - np.exp(-columns["eps_v"])
    if abs(eps_v[0]) > FAR_FROM_ZERO:
        notes.append(f"eps_v is {100 * eps_v[0]:.3g} % at the first reading: is this the void ratio?")
    if abs(columns["eps_1"][0]) > max(FAR_FROM_ZERO, 0.2 * float(np.ptp(columns["eps_1"]))):
        notes.append(
            f"the axial strain is {100 * columns['eps_1'][0]:.3g} % at the first reading; it begins near zero in most tests"
        )
    largest = float(q[np.argmax(np.abs(q - q[0]))] - q[0])
    if extension and largest > 0.0 and q[0] <= 0.1 * abs(largest):
        notes.append("q is positive in extension: here it is sigma_1 - sigma_3, which is negative there")
    if not extension and largest < 0.0 and abs(q[0]) <= 0.1 * abs(largest):
        notes.append("q is negative in compression: are its sign, or those of the strains, the other way round?")
    size = float(np.abs(q).max())
    if size > LARGEST_STRESS or 0.0 < size < LEAST_STRESS:
        notes.append(f"q reaches {size:.3g} Pa, which no such test does: is its unit right?")
    if float(np.ptp(columns["eps_1"])) < LEAST_STRAIN:
        notes.append(f"the axial strain goes over {float(np.ptp(columns['eps_1'])):.2g} only: is its unit right?")
    return notes
