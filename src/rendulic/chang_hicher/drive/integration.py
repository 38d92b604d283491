"""One control followed from a point, and all that is recorded on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rendulic.chang_hicher.drive.equations import symmetry_of
from rendulic.chang_hicher.drive.phase import PhaseRecord
from rendulic.chang_hicher.kernels import integrate
from rendulic.chang_hicher.kernels.arrays import (
    ControlArrays,
    Ends,
    Problem,
    Records,
    Settings,
    new_path_state,
    new_records,
    new_scratch,
)
from rendulic.chang_hicher.kernels.columns import PLANE, STATE
from rendulic.chang_hicher.kernels.events import ENDS
from rendulic.chang_hicher.law.planes import GENERAL
from rendulic.chang_hicher.measure.planes import state_of_planes
from rendulic.chang_hicher.state import PointState

__all__ = ["LEAST_RECORDS", "TOLERANCE", "Integration"]

TOLERANCE = 1e-8  # error per step, relative to the stress, and to the elastic strain of that stress
LEAST_RECORDS = 200  # along a path that is followed for its curve
ROWS_AT_A_TIME = 320
LARGEST_STRAIN = 0.3  # of any axis, where nothing else bounds it
EMPTY = 1e-5  # of the mean stress at the start: a plane with less normal stress carries nothing
FIRST_STEP = 1e-3  # of arc length, in which the elastic response to the present stress is about 1


class Integration:
    """One control, to be followed from a point.

    Parameters
    ----------
    point : PointState
        Moves along.
    control : Control
        From `equations.control_of`.
    tolerance : float
        Error per step.
    largest_step : float
        Of the path's parameter, which goes from 0 to 1.
    first_step : float
        Arc length of the first step; later ones follow from the error.
    watches_planes : bool
        Whether events of single planes are noted.
    ends : mapping, optional
        What else ends it, by the names of `Ends`; by default any principal strain may change by 0.3.
    """

    def __init__(
        self, point: PointState, control: ControlArrays, tolerance: float = TOLERANCE, largest_step: float = 1.0, *,
        first_step: float = FIRST_STEP, watches_planes: bool = True, ends: Mapping[str, Any] | None = None,
    ) -> None:  # fmt: skip
        self.point = point
        # a plane that carries little already may go on from there
        least = float(state_of_planes(point).plane[:, PLANE.sigma].min())
        always = {
            "q_start": point.sigma[0] - 0.5 * (point.sigma[1] + point.sigma[2]),
            "eps_start": tuple(point.eps[:3].tolist()),
            "floor": min(EMPTY * control.stress_scale, 0.5 * least),
            "reach": LARGEST_STRAIN,
        }
        # of planes that respond alike, one
        symmetry = symmetry_of(point, control)
        planes = point.model.planes_under(symmetry)
        self.orbits = None if symmetry == GENERAL else point.model.geometry.orbits(symmetry)
        own = slice(None) if self.orbits is None else self.orbits.first
        self.problem = Problem(point.material, planes, control, Ends(**{**always, **(ends or {})}))
        self.settings = Settings(tolerance, largest_step, first_step, watches_planes)
        self.now = new_path_state(point.sigma, point.eps, point.plane_strain[own], point.memory[own])
        self.scratch = new_scratch(len(self.now.memory))
        self._pieces: list[Records] = []

    def to_end(self, on_piece: Callable[[float], None] = lambda _share: None) -> str:
        """Follow to the end and return what it was; `on_piece` is told the share of the way now and then."""
        n, y = len(self.now.memory), self.now.y
        while True:
            records = new_records(ROWS_AT_A_TIME, n, 20 * n + 50)
            end = ENDS[integrate.follow(self.problem, self.settings, self.now, self.scratch, records)]
            self._pieces.append(records.filled())
            self.point.sigma = y[STATE.stress : STATE.strain].copy()
            self.point.eps = y[STATE.strain : STATE.parameter].copy()
            if self.orbits is not None:
                self.point.memory = self.orbits.every(self.now.memory)
                self.point.plane_strain[:, 0] = self.orbits.every(self.now.plane_strain[:, 0])
                self.point.plane_strain[:, 1:] = self.orbits.every_vector(self.now.plane_strain[:, 1:])
            on_piece(float(y[STATE.parameter]))
            if end != "full":
                return end

    @property
    def record(self) -> PhaseRecord:
        """All that was recorded so far; of planes that respond alike, one."""
        return PhaseRecord.of(self._pieces, self.orbits)
