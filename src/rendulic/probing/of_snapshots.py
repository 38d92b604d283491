"""Probes that were made elsewhere: a state before and states after, as snapshots."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.loading.directions import axisymmetric
from rendulic.probing.anatomy import anatomy_of, summary
from rendulic.probing.probe import dataset_of_readings
from rendulic.probing.second_order_work import second_order_work
from rendulic.specimen.snapshot import Snapshot
from rendulic.tensors.rendulic_plane import direction_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["probes_of_snapshots"]


def probes_of_snapshots(
    before: Snapshot, after: Iterable[Snapshot], null: Snapshot | None = None, *, anatomy: bool = False
) -> xr.Dataset:
    """The dataset of `rd.probe` from snapshots of any engine, for `rd.cone_of` and the figures.

    Parameters
    ----------
    before : Snapshot
        The state that was probed.
    after : iterable of Snapshot
        After each probe, in any order; strains are read from the boxes, and directions from the strains.
        All probes must be of like size.
    null : Snapshot, optional
        After a probe of zero increment and equal duration; without it drifts are taken as zero.
    anatomy : bool
        As for `rd.probe`.

    Raises
    ------
    InvalidInput
        If there is no probe, one has no strain or is not axisymmetric, two have the same direction, sizes differ
        by more than a tenth, or snapshots are not of the same grains.
    """

    def read(now: Snapshot) -> dict:
        work = second_order_work(before, now)
        reading = {"d_sigma": work.d_sigma, "d_eps": work.d_eps, "work": work, "unbalanced_force": now.unbalanced_force}
        if anatomy:
            reading["anatomy"] = summary(anatomy_of(work, before, now))
        return reading

    readings = [read(now) for now in after]
    if not readings:
        raise InvalidInput("there are no snapshots after probes: give one at least")
    d_eps = np.array([reading["d_eps"] for reading in readings])
    size = np.linalg.norm(d_eps, axis=1)
    for k, (one, norm) in enumerate(zip(d_eps, size, strict=True)):
        if norm == 0.0:
            raise InvalidInput(f"probe {k + 1} has no strain: its box is that of the state before")
        if abs(one[1] - one[2]) > 0.02 * norm:
            raise InvalidInput(
                f"probe {k + 1} is not axisymmetric about axis 1: its strains are {one[0]:.3g}, {one[1]:.3g}, {one[2]:.3g}"
            )
        if abs(norm - size[0]) > 0.1 * size[0]:
            raise InvalidInput(
                f"probes must be of like size: that of probe 1 is {size[0]:.3g}, of probe {k + 1} {norm:.3g}"
            )
    alpha = np.round(direction_of(d_eps), 6) % 360.0
    order = np.argsort(alpha)
    same = np.flatnonzero(np.diff(alpha[order]) == 0.0)
    if len(same):
        first, second = sorted(order[same[0] : same[0] + 2] + 1)
        raise InvalidInput(f"probes {first} and {second} have the same direction, {alpha[order[same[0]]]:g} degrees")
    nothing = read(before) if null is None else read(null)
    return dataset_of_readings(
        [nothing],
        [[readings[k]] for k in order],
        axisymmetric(alpha[order]),
        np.array([float(np.median(size))]),
        True,
        "strain",
        np.diag(before.wall_stress),
    )
