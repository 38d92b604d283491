"""Following a path at a material point: the control in six equations, the run, the labelled result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.chang_hicher.drive.point_curve import point_curve
from rendulic.chang_hicher.kernels import integrate
from rendulic.chang_hicher.kernels.arrays import (
    CONSISTENT,
    DROP,
    EPS_START,
    ETA_SIDE,
    FLOOR,
    KAPPA,
    MODULUS,
    N_UNTIL,
    Q_START,
    REACH,
    REACH_AXIS,
    SIGMA,
    STIFFNESS,
    TAN_PEAK,
    TAU,
    UNTIL_ETA,
    VOID_RATIO,
    Control,
    Log,
    Work,
    work_for,
)
from rendulic.chang_hicher.kernels.rates import homogenise, look, sliding
from rendulic.chang_hicher.kernels.watch import ENDS, PLANE_COLUMNS, RECORD_COLUMNS
from rendulic.foundation.checks import increasing_fractions, positive_number, whole_number
from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.progress import Progress, silent
from rendulic.loading.paths import Path
from rendulic.tensors.invariants import stress_ratio

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.chang_hicher.point import MaterialPoint

__all__ = ["TOLERANCE", "control_for", "follow_path", "least_memory", "load", "look_at", "probe", "reference_scales"]

TOLERANCE = 1e-8
ROWS_AT_A_TIME = 512
LARGEST_STRAIN = 0.3  # of any axis, where a probe of stresses has no bound of its own
EMPTY = 1e-5  # of the mean stress at the start: a plane with less normal stress carries nothing
BEYOND = 50.0  # bounds of strain that the parameter of a path may go where another axis has the bound
EXCHANGE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])  # of the lateral axes
MIRRORS = (np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0]), np.diag([1.0, 1.0, -1.0]))
FIRST_STEP = 1e-3  # of arc length, in which the elastic response to the present stress is about 1


def look_at(point: MaterialPoint, active: np.ndarray | None = None):
    """The kernels' view of a point's planes; raises `InvalidInput` if its state is not admissible."""
    n = len(point.memory)
    active = np.zeros(n, dtype=bool) if active is None else active
    work = work_for(n)
    if not look(point.material, point.model.planes, point.sigma, point.eps, point.memory, active, work):
        raise InvalidInput(
            f"the stress {np.round(point.sigma[:3] / 1e3, 3).tolist()} kPa puts a contact plane in tension or beyond "
            f"its peak friction (void ratio {point.void_ratio:.4g}): choose a stress nearer to isotropic compression"
        )
    return work


def least_memory(point: MaterialPoint) -> np.ndarray:
    """The hardening that every plane needs to carry the present stress."""
    work = look_at(point, np.ones(len(point.memory), dtype=bool))
    sigma, kappa, modulus = work.plane[:, SIGMA], work.plane[:, KAPPA], work.plane[:, MODULUS]
    if point.material.formulation != CONSISTENT:
        return kappa.copy()
    return sliding(kappa, sigma, point.material.k_pR * modulus, work.scalar[TAN_PEAK])


def control_for(point: MaterialPoint, stress_rows: np.ndarray, strain_rows: np.ndarray, target: np.ndarray) -> Control:
    """The kernels' control from three principal equations; strain equations are multiplied by a stiffness."""
    stress_six, strain_six, goal = six_equations(point, stress_rows, strain_rows, target)
    work = look_at(point)
    p, stiffness = reference_scales(point, work)
    goal = np.where(np.abs(strain_six).max(axis=1) > 0.0, goal * stiffness, goal)
    strain_six *= stiffness
    homogenise(point.material, point.model.planes, np.zeros(len(point.memory), dtype=bool), work)
    sign = float(np.sign(np.linalg.det(stress_six + strain_six @ work.compliance)))
    return Control(stress_six, strain_six, goal, sign, p, p / stiffness)


def reference_scales(point: MaterialPoint, work: Work) -> tuple[float, float]:
    """Mean stress and normal stiffness of a plane under it, Pa."""
    p = float(point.sigma[:3].sum()) / 3.0
    return p, float(work.scalar[STIFFNESS] * p**point.material.exponent)


class Run:
    """One control followed from a point, and the records of all its pieces.

    `ends` gives entries of `until` by their place; by default any principal strain may change by 0.3.
    """

    def __init__(
        self, point: MaterialPoint, control: Control, tolerance: float, largest: float,
        ends: Mapping[int, float] | None = None, watches_planes: bool = True,
    ) -> None:  # fmt: skip
        n = len(point.memory)
        self.point, self.control, self.work = point, control, work_for(n)
        self.until = np.zeros(N_UNTIL)
        self.until[[REACH, REACH_AXIS]] = LARGEST_STRAIN, -1.0
        for place, value in (ends or {}).items():
            self.until[place] = value
        self.until[Q_START] = point.sigma[0] - 0.5 * (point.sigma[1] + point.sigma[2])
        self.until[EPS_START : EPS_START + 3] = point.eps[:3]
        # a plane that carries little already may go on from there
        least = float(look_at(point).plane[:, SIGMA].min())
        self.until[FLOOR] = min(EMPTY * control.stress_scale, 0.5 * least)
        self.settings = np.array([tolerance, largest, FIRST_STEP, float(watches_planes)])
        self.y = np.concatenate((point.sigma, point.eps, [0.0]))
        self.active, self.cursor = np.zeros(n, dtype=bool), np.zeros(2)
        self.logs: list[Log] = []

    def go(self, on_piece: Callable[[float], None] = lambda _share: None) -> str:
        """Follow to the end and return what it was; the point moves along."""
        n, size = len(self.active), ROWS_AT_A_TIME
        while True:
            log = Log(
                np.empty((size, RECORD_COLUMNS)), np.empty((size, n, PLANE_COLUMNS)),
                np.empty((size, 6, 6)), np.empty((20 * n + 50, 15)), np.zeros(2, dtype=np.int64),
            )  # fmt: skip
            end = ENDS[
                integrate.follow(
                    self.point.material, self.point.model.planes, self.control, self.until, self.settings, self.y,
                    self.point.plane_strain, self.point.memory, self.active, self.cursor, self.work, log,
                )
            ]  # fmt: skip
            n_rows, n_events = log.counts
            rows, planes, compliances = (part[:n_rows] for part in log[:3])
            self.logs.append(Log(rows, planes, compliances, log.events[:n_events], log.counts))
            self.point.sigma, self.point.eps = self.y[:6].copy(), self.y[6:12].copy()
            on_piece(float(self.y[12]))
            if end != "full":
                return end


def standing(point: MaterialPoint) -> Log:
    """A record of a state that goes nowhere: its rates are not known."""
    work, n = look_at(point), len(point.memory)
    row = np.full((1, RECORD_COLUMNS), np.nan)
    row[0, :13] = *point.sigma, *point.eps, 0.0
    row[0, 27], row[0, 28] = work.scalar[TAN_PEAK], work.scalar[VOID_RATIO]
    planes = np.full((1, n, PLANE_COLUMNS), np.nan)
    planes[0, :, 0], planes[0, :, 1] = work.plane[:, SIGMA], work.plane[:, TAU]
    planes[0, :, 2] = work.plane[:, TAU] / work.plane[:, SIGMA] / work.scalar[TAN_PEAK]
    planes[0, :, 4:8], planes[0, :, 8] = point.plane_strain, 0.0
    return Log(row, planes, np.full((1, 6, 6), np.nan), np.empty((0, 15)), np.array([1, 0]))


def six_equations(
    point: MaterialPoint, stress_rows: np.ndarray, strain_rows: np.ndarray, target: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Equations (6, 6), (6, 6), (6,) of stress and strain rates from three principal ones.

    Shear strains are held, or shear stresses if only stresses are controlled. Where planes, memory and
    stress do not tell the signs of the axes apart, shear stresses are held in any case, and where the
    lateral axes are interchangeable, the difference of the lateral stresses is held in place of that of
    the strains. By symmetry that is the same test; but the planes can lose all resistance to a difference
    of lateral strains, and then imposing it exactly would make rounding errors grow without bound.
    """
    by_strain = np.abs(strain_rows).max(axis=1) > 0.0
    strains, imposed = strain_rows[by_strain], target[by_strain]
    stresses, held = stress_rows[~by_strain], target[~by_strain]
    lateral = np.array([0.0, 1.0, -1.0]) / np.sqrt(2.0)
    if len(strains):
        rate = np.linalg.pinv(strains) @ imposed
        spanned = np.linalg.matrix_rank(np.vstack((strains, lateral))) == len(strains)
        if spanned and abs(rate @ lateral) <= 1e-14 * np.abs(rate).max() and is_symmetric(point, EXCHANGE):
            # a basis of the controlled strains without their lateral difference
            _, size, basis = np.linalg.svd(strains - np.outer(strains @ lateral, lateral))
            strains = basis[: int((size > 1e-9).sum())]
            imposed = strains @ rate
            stresses, held = np.vstack((stresses, lateral)), np.append(held, 0.0)
    six, k = np.zeros((2, 6, 6)), len(stresses)
    six[0, :k, :3], six[1, k:3, :3] = stresses, strains
    free = not len(strains) or all(is_symmetric(point, mirror) for mirror in MIRRORS)
    six[0 if free else 1, 3:, 3:] = np.eye(3)
    return six[0], six[1], np.concatenate((held, imposed, np.zeros(3)))


def is_symmetric(point: MaterialPoint, operation: np.ndarray) -> bool:
    """Whether planes, memory and stress are the same after an orthogonal operation (3, 3) on the axes."""
    image = point.model.geometry.image(operation)
    stress = point.stress
    return (
        image is not None
        and bool(np.abs(operation @ stress @ operation.T - stress).max() <= 1e-9 * np.abs(stress).max())
        and bool(np.abs(point.memory[image] - point.memory).max() <= 1e-6 * np.abs(point.memory).max())
    )


@dataclass
class Followed:
    """The records of a path's legs, and what stopped it."""

    ramp: list[Log] | None = None  # that brought stresses to where the path has them
    driven: list[Log] | None = None  # in which the controlled strains advanced
    stopped_by: str = "target"

    @property
    def legs(self) -> list[list[Log]]:
        """Those that there were."""
        return [leg for leg in (self.ramp, self.driven) if leg is not None]


def load(
    point: MaterialPoint,
    path: Path,
    tolerance: float,
    least_records: int,
    progress: Progress = silent,
    on_record: Callable[[MaterialPoint], None] | None = None,
) -> xr.Dataset:
    """See `MaterialPoint.load`."""

    def on_piece(share: float) -> None:
        q = point.sigma[0] - 0.5 * (point.sigma[1] + point.sigma[2])
        progress(share, 1.0, f"{path.name}: axial strain {point.eps[0]:.4f}, q {q / 1e3:.1f} kPa")
        if on_record is not None:
            on_record(point)

    followed = follow_path(point, path, tolerance, least_records, on_piece)
    return point_curve(point, path.name, followed.legs, followed.stopped_by)


def follow_path(
    point: MaterialPoint,
    path: Path,
    tolerance: float = TOLERANCE,
    least_records: int = 1,
    on_piece: Callable[[float], None] = lambda _share: None,
    watches_planes: bool = True,
) -> Followed:
    """Follow the one or two legs of a path, in place."""
    tolerance = positive_number("tolerance", tolerance)
    if tolerance > 1e-2:
        raise InvalidInput(f"tolerance must be at most 0.01, got {tolerance:g}: errors add up along the path")
    largest = 1.0 / whole_number("least_records", least_records, 1)
    is_stress = path.control.is_stress
    stress_rows = np.where(is_stress[:, None], path.control.stress_basis, 0.0)
    strain_rows = np.where(is_stress[:, None], 0.0, np.asarray(path.control.strain_basis))
    present = path.control.stress_basis @ point.sigma[:3]
    goals = np.array([now if goal is None else goal for goal, now in zip(path.stress, present, strict=True)])
    missing = np.where(is_stress, goals - present, 0.0)
    followed = Followed()

    def follow(
        target: np.ndarray, scale: float, ends: Mapping[int, float], report: Callable[[float], None]
    ) -> tuple[list[Log], str]:
        control = control_for(point, stress_rows, strain_rows, target)
        run = Run(point, control, tolerance, largest / scale, ends, watches_planes)
        return run.logs, run.go(report)

    ramps = bool((np.abs(missing) > 1e-12 * np.abs(point.sigma[:3]).max()).any())
    if ramps:
        share, reach = (0.1 if path.is_driven else 1.0), {REACH: path.until.strain}
        followed.ramp, followed.stopped_by = follow(missing, 1.0, reach, lambda done: on_piece(share * done))
    elif not path.is_driven:
        followed.ramp = [standing(point)]
    if path.is_driven and followed.stopped_by == "target":
        eta = path.until.eta
        if eta is not None and abs(eta - float(stress_ratio(point.stress))) <= 1e-12:
            followed.driven, followed.stopped_by = [standing(point)], "eta"
        else:
            first = 0.1 if ramps else 0.0
            target, scale, ends = _drive(point, path)
            followed.driven, end = follow(
                target, scale, ends, lambda done: on_piece(min(first + (1 - first) * scale * done, 1.0))
            )
            followed.stopped_by = "strain" if end == "target" else end
    n_rows = sum(len(log.rows) for leg in followed.legs for log in leg)
    if n_rows <= 1 and followed.stopped_by not in ("target", "strain", "eta"):
        raise InvalidInput(
            f"the control of the path '{path.name}' cannot be followed from this state at all "
            f"({followed.stopped_by}): {point!r}"
        )
    return followed


def _drive(point: MaterialPoint, path: Path) -> tuple[np.ndarray, float, dict[int, float]]:
    """What the controlled strains advance to, how many bounds of strain that is, and what ends the leg."""
    until, is_stress = path.until, path.control.is_stress
    relative = np.where(is_stress, 0.0, path.strain_rate)
    basis = np.asarray(path.control.strain_basis)
    driven = np.abs(np.linalg.inv(basis) @ relative)
    axis = 0 if driven[0] > 0.0 else int(driven.argmax())
    # where the axis of the bound is itself controlled, the path ends there by its own parameter
    controlled = basis[~is_stress]
    is_own = bool(np.linalg.matrix_rank(np.vstack((controlled, np.eye(3)[axis]))) == len(controlled))
    scale = 1.0 if is_own else BEYOND
    ends = {REACH: 0.0 if is_own else until.strain, REACH_AXIS: axis, DROP: until.peak_drop if until.peak else 0.0}
    if until.eta is not None:
        ends |= {UNTIL_ETA: until.eta, ETA_SIDE: float(np.sign(until.eta - float(stress_ratio(point.stress))))}
    return relative * until.strain / driven[axis] * scale, scale, ends


def probe(
    point: MaterialPoint,
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
            control = control_for(point, stress_rows, strain_rows, (mark - done) * increment)
            run = Run(point, control, TOLERANCE, 1.0, {REACH: 0.0} if kind == "strain" else None)
            goes_on = run.go() == "target"
        done = mark
        if on_mark is not None:
            on_mark(mark)
