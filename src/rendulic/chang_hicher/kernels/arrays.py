"""What the kernels of the model take: numbers and arrays, grouped. All float64 unless said otherwise.

The material and the planes come from `law`: `MaterialConstants` and `Planes`. Stress and strain are Mandel vectors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rendulic.chang_hicher.kernels.columns import (
    EVENT_COLUMNS,
    PLANE_COLUMNS,
    PLANE_RECORD_COLUMNS,
    RECORD_COLUMNS,
    SHARED_ENTRIES,
    width,
)
from rendulic.chang_hicher.law.parameters import MaterialConstants
from rendulic.chang_hicher.law.plane_law import FORMULATIONS
from rendulic.chang_hicher.law.planes import Planes

__all__ = [
    "CONSISTENT", "EQ32", "LARGEST_CHANGE", "NEXT_STEP", "N_TRIED", "PRINTED", "ControlArrays", "Ends", "PathState",
    "Problem", "Records", "Scratch", "Settings", "Trial", "new_path_state", "new_records", "new_scratch",
]  # fmt: skip

# numbers of the formulations
PRINTED, EQ32, CONSISTENT = (FORMULATIONS.index(name) for name in ("printed", "eq32", "consistent"))
# entries of `PathState.cursor`: arc length of the next step (0 at the start), steps tried, largest change of q
NEXT_STEP, N_TRIED, LARGEST_CHANGE = range(3)


class ControlArrays(NamedTuple):
    """Six linear equations per unit of the path's parameter: `S d_sigma + E d_eps = r d_lambda`."""

    stress_rows: np.ndarray  # (6, 6)
    strain_rows: np.ndarray  # (6, 6), times a reference stiffness
    target: np.ndarray  # (6,)
    sign: float  # of the determinant in the elastic state
    stress_scale: float
    strain_scale: float


class Ends(NamedTuple):
    """What ends a path before its parameter is 1."""

    q_start: float  # q where the path starts
    eps_start: tuple[float, float, float]  # and the principal strains
    floor: float  # normal stress of a plane below which it carries nothing
    reach: float  # largest change of a principal strain; 0: no bound
    reach_axis: int = -1  # the axis that this bound is of; -1: any
    eta: float = 0.0  # stress ratio, and the side from which it is reached, 1 or -1; 0: none
    eta_side: float = 0.0
    drop: float = 0.0  # by this share of its largest change q falls back from a peak; 0: peaks are passed


class Problem(NamedTuple):
    """What is asked of a point; nothing of it changes along the path."""

    material: MaterialConstants
    planes: Planes
    control: ControlArrays
    ends: Ends


class Settings(NamedTuple):
    """How the integration goes on."""

    tolerance: float  # error per step, relative to the stress
    largest_step: float  # of the path's parameter
    first_step: float  # of arc length
    watches_planes: bool  # whether events of single planes are noted


class PathState(NamedTuple):
    """What moves on along a path, in place."""

    y: np.ndarray  # (13,) see `columns.STATE_ENTRIES`
    plane_strain: np.ndarray  # (n, 4) normal and shear strains of the planes
    memory: np.ndarray  # (n,) hardening of the planes
    active: np.ndarray  # (n,) bool, planes that load
    cursor: np.ndarray  # (3,) where to go on, see above


class Scratch(NamedTuple):
    """Room for the kernels, and what they found at the last state."""

    plane: np.ndarray  # (n, ...) see `columns.PLANE_COLUMNS`
    shear: np.ndarray  # (n, 3) tau
    flow: np.ndarray  # (n, 3) direction of plastic shear
    local_rate: np.ndarray  # (n, 4) of normal strain and of shear strain
    compliance: np.ndarray  # (6, 6)
    matrix: np.ndarray  # (6, 6)
    shared: np.ndarray  # (...,) see `columns.SHARED_ENTRIES`
    gather: np.ndarray  # (2, 6)
    shear_mandel: np.ndarray  # (n, 6)


class Trial(NamedTuple):
    """A step that is tried: its stages and its end."""

    k: np.ndarray  # (7, 13) rates at the stages
    y: np.ndarray  # (13,) state at the end
    local: np.ndarray  # (n, 4) strains that the planes gained
    values: np.ndarray  # (2 + 2 n,) monitors


class Records(NamedTuple):
    """Room for what is recorded on the way."""

    rows: np.ndarray  # (m, ...) see `columns.RECORD_COLUMNS`
    plane_rows: np.ndarray  # (m, n, ...) see `columns.PLANE_RECORD_COLUMNS`
    compliances: np.ndarray  # (m, 6, 6)
    events: np.ndarray  # (k, ...) see `columns.EVENT_COLUMNS`
    counts: np.ndarray  # (2,) int64, records and events so far

    def filled(self) -> Records:
        """Without the room that is left; views."""
        n_rows, n_events = self.counts
        return Records(
            self.rows[:n_rows], self.plane_rows[:n_rows], self.compliances[:n_rows], self.events[:n_events], self.counts
        )


def new_scratch(n_planes: int) -> Scratch:
    """Empty room for this many planes."""
    return Scratch(
        np.zeros((n_planes, width(PLANE_COLUMNS))), np.zeros((n_planes, 3)), np.zeros((n_planes, 3)),
        np.zeros((n_planes, 4)), np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(width(SHARED_ENTRIES)), np.zeros((2, 6)),
        np.zeros((n_planes, 6)),
    )  # fmt: skip


def new_records(n_rows: int, n_planes: int, n_events: int) -> Records:
    """Room for this many records and events."""
    return Records(
        np.empty((n_rows, width(RECORD_COLUMNS))), np.empty((n_rows, n_planes, width(PLANE_RECORD_COLUMNS))),
        np.empty((n_rows, 6, 6)), np.empty((n_events, width(EVENT_COLUMNS))), np.zeros(2, dtype=np.int64),
    )  # fmt: skip


def new_path_state(sigma: np.ndarray, eps: np.ndarray, plane_strain: np.ndarray, memory: np.ndarray) -> PathState:
    """The beginning of a path; strains and memory of the planes are those of the point itself."""
    return PathState(
        np.concatenate((sigma, eps, [0.0])), plane_strain, memory, np.zeros(len(memory), dtype=bool), np.zeros(3)
    )
