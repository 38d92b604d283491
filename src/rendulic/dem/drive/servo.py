"""What the walls are told to do: a `Control` and its values, as the kernels take them."""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.arrays import Drive
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.foundation.errors import one_of
from rendulic.loading.control import Control

__all__ = ["drive_for", "hold"]


def drive_for(assembly: AssemblyState, control: Control, stress, rate, cap: float) -> Drive:
    """A drive that holds `stress` (None: the present value) where stress is controlled.

    `rate` (3,) are the strain rates of the strain-controlled components in 1/s; `cap` bounds the
    strain rate of the servo.
    """
    basis = np.asarray(control.strain_basis, dtype=float)
    conjugate = control.stress_basis  # C order, as all that goes into kernels: one signature, compiled once
    present = conjugate @ np.diag(assembly.stress)
    target = np.array([now if want is None else want for want, now in zip(stress, present, strict=True)], dtype=float)
    return Drive(
        inverse=np.linalg.inv(basis),
        conjugate=conjugate,
        is_stress=control.is_stress,
        rate=np.where(control.is_stress, 0.0, np.asarray(rate, dtype=float)),
        target=target,
        target_rate=np.zeros(3),
        rate_cap=np.array([cap]),
    )


def hold(what: str) -> Control:
    """The control of all three strains or all three stresses."""
    one_of(what, ("strain", "stress"), "quantity to hold")
    return Control(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (what,) * 3)
