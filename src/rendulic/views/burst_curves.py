"""One state left to itself after pushes: its motion, where its energy went, and Eq. 1 step by step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.probing.burst import VERDICTS
from rendulic.views.view import View

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["BurstCurve", "BurstCurves", "Energies", "Equation1", "burst_curves", "equation_1"]

HELD = 2  # phase of the curve in which the load is held
SMALLEST = 1e-14  # of the stored energy; what is smaller is drawn there
WORDS = {"settles": "settle", "fails": "fail"}
CURVES = (
    "Left: kinetic energy over the energy stored at rest. Middle: strain along the direction of the push, over its "
    "size. Time counts from when the load is back; grey: the push is given and taken back. Right: where the energy of the direction with "
    "the largest kinetic energy came from and went; the error of its balance is {error:.0e} of the largest term."
)
EQUATION = (
    "Eq. 1 of the paper in single time steps: the change of kinetic energy against the work that should equal it, of "
    "first and second order (blue), and of second order alone (orange), which differs where a state is not in "
    "equilibrium. The largest difference is {residual:.0e} of the largest term."
)


@dataclass(frozen=True, eq=False)
class BurstCurve:
    """One direction: `kinetic` over the stored energy and `strain` over the size of the push, against `time` in ms."""

    label: str
    verdict: str
    time: np.ndarray
    kinetic: np.ndarray
    strain: np.ndarray


@dataclass(frozen=True, eq=False)
class Energies:
    """Energies since rest in J against `time` in ms from when the load is back, by their names, and the error of their balance."""

    alpha: float
    time: np.ndarray
    parts: Mapping[str, np.ndarray]
    error: float


@dataclass(frozen=True, kw_only=True, eq=False)
class BurstCurves(View):
    """Directions of one state; the first push began at the time `begun` in ms, and the load is back at 0."""

    curves: tuple[BurstCurve, ...]
    energies: Energies
    begun: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Equation1(View):
    """In each step the change of kinetic energy and the works of first and second order, in J."""

    d_kinetic: np.ndarray
    first: np.ndarray
    second: np.ndarray

    @property
    def smallest(self) -> float:
        """Changes of kinetic energy that matter are larger: where axes turn from logarithmic to linear."""
        return max(float(np.quantile(np.abs(self.d_kinetic), 0.05)), 1e-300)


def burst_curves(curves: Mapping[str, xr.Dataset], title: str = "") -> BurstCurves:
    """Kinetic energy and strain of every direction, and the energies of the one with the largest kinetic energy.

    Parameters
    ----------
    curves : mapping of label to xarray.Dataset
        From `rd.burst` of grains; the labels are directions in degrees.
    title : str
        Above.

    Raises
    ------
    InvalidInput
        If there are no curves, or they are not of grains.
    """
    _check(curves)
    worst = max(curves.values(), key=lambda curve: curve.attrs["kinetic_share"])
    energies = _energies(worst)
    verdicts = [curve.attrs["verdict"] for curve in curves.values()]
    found = ", ".join(f"{verdicts.count(one)} {WORDS.get(one, one)}" for one in VERDICTS if one in verdicts)
    return BurstCurves(
        title=title,
        caption=CURVES.format(error=energies.error),
        verdict=f"{f'{title}: ' if title else ''}of {len(curves)} directions {found}.",
        curves=tuple(_curve(label, curve) for label, curve in curves.items()),
        energies=energies,
        begun=min(float(_time(curve)[0]) for curve in curves.values()),
    )


def equation_1(curves: Mapping[str, xr.Dataset], title: str = "") -> Equation1:
    """The terms of Eq. 1 in all steps of these curves, as for `burst_curves`."""
    _check(curves)
    residual = max(float(curve.attrs["equation_1_residual"]) for curve in curves.values())
    return Equation1(
        title=title,
        caption=EQUATION.format(residual=residual),
        d_kinetic=np.concatenate([curve.d_kinetic.values[1:] for curve in curves.values()]),
        first=np.concatenate([curve.first_order.values[1:] for curve in curves.values()]),
        second=np.concatenate([0.5 * (curve.b2 - curve.w2).values[1:] for curve in curves.values()]),
    )


def _check(curves: Mapping[str, xr.Dataset]) -> None:
    if not curves:
        raise InvalidInput("curves of bursts need one direction at least, got none")
    for label, curve in curves.items():
        if "kinetic_energy" not in curve or "d_kinetic" not in curve:
            raise InvalidInput(f"curves of bursts are those of rd.burst of grains, {label!r} is none")


def _time(curve: xr.Dataset) -> np.ndarray:
    """In ms, from when the load is back."""
    first = int(np.flatnonzero(curve.phase.values == HELD)[0])
    return 1e3 * (curve.time.values - float(curve.time[first - 1]))


def _curve(label: str, curve: xr.Dataset) -> BurstCurve:
    return BurstCurve(
        label,
        curve.attrs["verdict"],
        _time(curve),
        np.maximum(curve.kinetic_energy.values / curve.attrs["stored_energy"], SMALLEST),
        curve.strain_along.values / curve.attrs["norm"],
    )


def _energies(curve: xr.Dataset) -> Energies:
    parts = {
        "work of the walls": curve.boundary_work.values,
        "stored": curve.elastic_energy.values,
        "friction": curve.friction_work.values,
        "damping": curve.damping_work.values,
        "kinetic": curve.kinetic_energy.values - curve.kinetic_energy.values[0],
    }
    alpha = float(curve.attrs.get("alpha", np.nan))
    return Energies(alpha, _time(curve), parts, float(curve.attrs["balance_error"]))
