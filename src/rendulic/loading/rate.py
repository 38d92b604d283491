"""How fast probes and pushes are made: a rate that belongs to the material, the same for every size of increment."""

from __future__ import annotations

from math import ceil
from warnings import warn

import numpy as np

from rendulic.foundation.checks import finite_array, positive_number, whole_number
from rendulic.foundation.errors import ComingChange, InvalidInput

__all__ = ["MOST_STEPS", "NORM", "SETTLING_STEPS", "STRAIN_PER_STEP", "STRESS_PER_STEP", "norms_of", "rate_of", "steps_to"]  # fmt: skip

NORM = 5e-5  # of a strain probe, if nothing is said: the paper's
# of grains, per time step; the paper's: 5e-5 in 5 000 steps. `docs/convergence.md` shows what it does
STRAIN_PER_STEP = 1e-8
STRESS_PER_STEP = (
    5e-6  # of the mean stress: about the same, where grains are a hundred times as stiff as the mean stress
)
SETTLING_STEPS = 60_000  # for which walls are held at most after an increment
MOST_STEPS = 20_000_000  # of one probe


def norms_of(norm, kind: str) -> np.ndarray:
    """Sizes of the increments of a sweep, increasing; None: the default for strains. Stresses have none.

    Raises
    ------
    InvalidInput
        For sizes that are missing, not positive, or not increasing.
    """
    if norm is None:
        if kind == "stress":
            raise InvalidInput(
                "stress probes have no default size: give the norm in Pa, for example a hundredth of the mean stress"
            )
        norm = NORM
    norms = finite_array("norm", norm, () if np.ndim(norm) == 0 else (None,)).reshape(-1)
    if len(norms) == 0 or (norms <= 0).any() or (np.diff(norms) <= 0).any():
        raise InvalidInput(f"probe norms must be positive and increasing, got {norm!r}")
    return norms


def rate_of(
    rate: float | None, n_steps: int | None, norms: np.ndarray, kind: str = "strain", pressure: float = 0.0
) -> float:
    """Increment per time step: as given, from a number of steps up to the smallest norm, or the default.

    Parameters
    ----------
    rate : float, optional
        Strain, or Pa for stress, per step.
    n_steps : int, optional
        The former way to say it.
    norms : (k,) array
        Sizes of the sweep.
    kind : {"strain", "stress"}
        What is imposed.
    pressure : float
        Mean stress in Pa, for the default rate of stresses.
    """
    if n_steps is not None:
        if rate is not None:
            raise InvalidInput("give the rate or n_steps, not both; n_steps will no longer be read")
        own = float(norms[0]) / whole_number("n_steps", n_steps, 1)
        unit = "strain" if kind == "strain" else "Pa"
        warn(
            f"n_steps belonged to the smallest norm of a sweep; write rate={own:.3g} ({unit} per step), or leave it out: the default is "
            f"{STRAIN_PER_STEP:g} of strain",
            ComingChange,
            stacklevel=3,
        )
        return own
    if rate is not None:
        return positive_number("rate", rate, "strain per step" if kind == "strain" else "Pa per step")
    return STRAIN_PER_STEP if kind == "strain" else STRESS_PER_STEP * abs(pressure) or float(norms[0]) / 5000


def steps_to(norm: float, rate: float) -> int:
    """Time steps in which an increment of this size is made at a rate.

    >>> steps_to(5e-5, 1e-8)
    5000

    Raises
    ------
    InvalidInput
        If there would be more than `MOST_STEPS`.
    """
    steps = max(ceil(norm / rate * (1.0 - 1e-9)), 1)
    if steps > MOST_STEPS:
        raise InvalidInput(
            f"an increment of {norm:g} at {rate:g} per step takes {steps:.2g} steps, more than the {MOST_STEPS:.0g} that are made: "
            "give a smaller norm or a larger rate"
        )
    return steps
