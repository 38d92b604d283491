"""The Chang-Hicher sands that grains are shown beside: their states, maps and bursts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from rendulic.chang_hicher import ChangHicher
from rendulic.loading import directions, paths
from rendulic.probing.bifurcation import bifurcation_map, states_along
from rendulic.probing.burst import bursts
from rendulic.probing.cone import Cone, instability_cone
from rendulic.specimen.protocol import Specimen

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "DENSE",
    "LOOSE",
    "MODEL_BURSTS",
    "PROBE_NORM",
    "SANDS",
    "around_and_within",
    "sand_at",
    "sand_bursts",
    "sand_map",
]

LOOSE, DENSE = 0.9, 0.65  # void ratios
PROBE_NORM = 1e-6  # small enough for the tangent, as there is no noise
# density, void ratio, kind of test
SANDS: dict[str, tuple[float, Callable[..., paths.Path]]] = {
    "loose, drained": (LOOSE, paths.drained_triaxial),
    "dense, drained": (DENSE, paths.drained_triaxial),
    "loose, undrained": (LOOSE, paths.constant_volume),
}
MODEL_ETAS = (0.1, 0.3, 0.48, 0.6, 0.7, 0.8, 0.85, 0.9, 0.925, 0.95, 0.975, 1.0, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4, 1.5)
MODEL_BURSTS = (("loose, drained", 0.6), ("loose, drained", 0.95), ("loose, drained", 1.0), ("loose, undrained", 1.0))
MODEL_TOLERANCE = 0.05  # degrees
BURST_NORM = 1e-9  # small enough that the path of the load stays in the tangent's zone
LONGEST = 0.5  # axial strain of the model's tests


def sand_at(sand: str, pressure: float, etas: Iterable[float]) -> Iterator[tuple[float, Specimen]]:
    """A Chang-Hicher sand at one stress ratio after another, as far as its test goes."""
    void_ratio, path = SANDS[sand]
    point = ChangHicher.preset("hostun_loose").at(pressure, void_ratio)
    for eta, (state,) in states_along(point, lambda eta: path(LONGEST, until_eta=eta), list(etas)):
        if state is None:
            return
        yield eta, state


def sand_map(sand: str, pressure: float) -> xr.Dataset:
    """How the cone of a sand opens."""
    states = sand_at(sand, pressure, MODEL_ETAS)
    return bifurcation_map(states, directions.rendulic(5), PROBE_NORM, 1, tolerance=MODEL_TOLERANCE)


def sand_bursts(sand: str, pressure: float, eta: float, step: float) -> xr.Dataset | None:
    """Predicted against observed loss of controllability of a sand, around and within its cone."""
    for _, point in sand_at(sand, pressure, [eta]):
        cone = instability_cone(point, directions.rendulic(2), PROBE_NORM, 1, tolerance=MODEL_TOLERANCE)
        return bursts(point, around_and_within(cone, step), BURST_NORM, 1, cone=cone)
    return None


def around_and_within(cone: Cone, step: float) -> directions.Directions:
    """Directions all around, and at a quarter, a half and three quarters of every sector of a cone."""
    within = [first + share * (last - first) for first, last in cone.sectors for share in (0.25, 0.5, 0.75)]
    return directions.axisymmetric(np.unique(np.concatenate((directions.rendulic(step).alpha, np.mod(within, 360.0)))))
