"""Following a path, or a probe, at a material point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.chang_hicher.drive.equations import control_of
from rendulic.chang_hicher.drive.integration import TOLERANCE, Integration
from rendulic.chang_hicher.drive.phase import PhaseRecord, at_rest
from rendulic.chang_hicher.drive.point_curve import point_curve
from rendulic.chang_hicher.state import PointState
from rendulic.foundation.checks import increasing_fractions, positive_number, whole_number
from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.progress import Progress, silent
from rendulic.foundation.whole_change import heed_interrupts
from rendulic.loading.paths import Path
from rendulic.tensors.invariants import stress_ratio

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PathRecord", "admissible_tolerance", "follow_path", "load", "probe"]

BEYOND = 50.0  # bounds of strain that the parameter of a path may go where another axis has the bound


@dataclass
class PathRecord:
    """What was recorded along a path, and what stopped it."""

    ramp: PhaseRecord | None = None  # that brought stresses to where the path has them
    driven: PhaseRecord | None = None  # in which the controlled strains advanced
    stopped_by: str = "target"

    @property
    def phases(self) -> list[PhaseRecord]:
        """Those that there were."""
        return [phase for phase in (self.ramp, self.driven) if phase is not None]


def load(
    point: PointState,
    path: Path,
    tolerance: float,
    least_records: int,
    progress: Progress = silent,
    on_record: Callable[[Any], None] | None = None,
) -> xr.Dataset:
    """See `MaterialPoint.load`."""

    def on_piece(share: float) -> None:
        q = point.sigma[0] - 0.5 * (point.sigma[1] + point.sigma[2])
        progress(share, 1.0, f"{path.name}: axial strain {point.eps[0]:.4f}, q {q / 1e3:.1f} kPa")
        if on_record is not None:
            on_record(point)
        heed_interrupts()

    followed = follow_path(point, path, tolerance, least_records, on_piece)
    return point_curve(point, path.name, followed.phases, followed.stopped_by)


def follow_path(
    point: PointState,
    path: Path,
    tolerance: float = TOLERANCE,
    least_records: int = 1,
    on_piece: Callable[[float], None] = lambda _share: None,
    watches_planes: bool = True,
) -> PathRecord:
    """Follow the one or two phases of a path, in place."""
    tolerance = admissible_tolerance(tolerance)
    largest = 1.0 / whole_number("least_records", least_records, 1)
    is_stress = path.control.is_stress
    stress_rows = np.where(is_stress[:, None], path.control.stress_basis, 0.0)
    strain_rows = np.where(is_stress[:, None], 0.0, np.asarray(path.control.strain_basis))
    present = path.control.stress_basis @ point.sigma[:3]
    goals = np.array([now if goal is None else goal for goal, now in zip(path.stress, present, strict=True)])
    missing = np.where(is_stress, goals - present, 0.0)
    followed = PathRecord()

    def follow(target: np.ndarray, scale: float, ends: dict[str, Any], report: Callable[[float], None]):
        control = control_of(point, stress_rows, strain_rows, target)
        own = Integration(point, control, tolerance, largest / scale, watches_planes=watches_planes, ends=ends)
        end = own.to_end(report)
        return own.record, end

    ramps = bool((np.abs(missing) > 1e-12 * np.abs(point.sigma[:3]).max()).any())
    if ramps:
        share, reach = (0.1 if path.is_driven else 1.0), {"reach": path.until.strain}
        followed.ramp, followed.stopped_by = follow(missing, 1.0, reach, lambda done: on_piece(share * done))
    elif not path.is_driven:
        followed.ramp = at_rest(point)
    if path.is_driven and followed.stopped_by == "target":
        eta = path.until.eta
        if eta is not None and abs(eta - float(stress_ratio(point.stress))) <= 1e-12:
            followed.driven, followed.stopped_by = at_rest(point), "eta"
        else:
            first = 0.1 if ramps else 0.0
            target, scale, ends = _drive(point, path)
            followed.driven, end = follow(
                target, scale, ends, lambda done: on_piece(min(first + (1 - first) * scale * done, 1.0))
            )
            followed.stopped_by = "strain" if end == "target" else end
    n_rows = sum(len(phase) for phase in followed.phases)
    if n_rows <= 1 and followed.stopped_by not in ("target", "strain", "eta"):
        raise InvalidInput(
            f"the control of the path '{path.name}' cannot be followed from this state at all "
            f"({followed.stopped_by}): {point!r}"
        )
    return followed


def admissible_tolerance(tolerance: float) -> float:
    """The error per step, once it is small enough for errors not to add up to something."""
    tolerance = positive_number("tolerance", tolerance)
    if tolerance > 1e-2:
        raise InvalidInput(f"tolerance must be at most 0.01, got {tolerance:g}: errors add up along the path")
    return tolerance


def _drive(point: PointState, path: Path) -> tuple[np.ndarray, float, dict[str, Any]]:
    """What the controlled strains advance to, how many bounds of strain that is, and what ends the phase."""
    until, is_stress = path.until, path.control.is_stress
    relative = np.where(is_stress, 0.0, path.strain_rate)
    basis = np.asarray(path.control.strain_basis)
    driven = np.abs(np.linalg.inv(basis) @ relative)
    axis = 0 if driven[0] > 0.0 else int(driven.argmax())
    # where the axis of the bound is itself controlled, the path ends there by its own parameter
    controlled = basis[~is_stress]
    is_own = bool(np.linalg.matrix_rank(np.vstack((controlled, np.eye(3)[axis]))) == len(controlled))
    scale = 1.0 if is_own else BEYOND
    ends: dict[str, Any] = {"reach": 0.0 if is_own else until.strain, "reach_axis": axis}
    if until.peak:
        ends["drop"] = until.peak_drop
    if until.eta is not None:
        ends |= {"eta": until.eta, "eta_side": float(np.sign(until.eta - float(stress_ratio(point.stress))))}
    return relative * until.strain / driven[axis] * scale, scale, ends


def probe(
    point: PointState,
    increment: np.ndarray,
    kind: str,
    marks: tuple[float, ...],
    on_mark: Callable[[float], None] | None,
) -> None:
    """See `MaterialPoint.probe`."""
    stress_rows, strain_rows = (np.eye(3), np.zeros((3, 3)))[:: 1 if kind == "stress" else -1]
    marks = increasing_fractions("marks", marks)
    done, goes_on = 0.0, bool(np.abs(increment).max() > 0.0)
    for mark in marks:
        if goes_on:
            control = control_of(point, stress_rows, strain_rows, (mark - done) * increment)
            # imposed strains end by themselves
            ends = {"reach": 0.0} if kind == "strain" else None
            goes_on = Integration(point, control, ends=ends).to_end() == "target"
        done = mark
        if on_mark is not None:
            on_mark(mark)
