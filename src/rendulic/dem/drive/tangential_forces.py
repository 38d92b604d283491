"""Tangential forces that another engine computed."""

from __future__ import annotations

import numpy as np

from rendulic.dem.drive.stepping import compute_forces
from rendulic.dem.state.assembly_state import AssemblyState

__all__ = ["set_tangential_forces"]


def set_tangential_forces(
    assembly: AssemblyState, first: np.ndarray, second: np.ndarray, force: np.ndarray, age: float
) -> None:
    """Give contacts `first < second` the tangential forces (n, 3) on `second` in N, `age` seconds old, in place."""
    contacts = assembly.contacts
    place = {pair: c for c, pair in enumerate(zip(contacts.first.tolist(), contacts.second.tolist(), strict=True))}
    for pair, value in zip(zip(first.tolist(), second.tolist(), strict=True), force, strict=True):
        c = place.get(pair)
        if c is not None and contacts.force_n[c] > 0:
            contacts.force_t[c] = value
    compute_forces(assembly, age)
