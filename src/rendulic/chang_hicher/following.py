"""Following a path at a material point: the control in six equations, the run, the labelled result."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from rendulic.chang_hicher.kernels import integrate
from rendulic.chang_hicher.kernels.arrays import CONSISTENT, STIFFNESS, TAN_PEAK, Control, Log, work_for
from rendulic.chang_hicher.kernels.rates import homogenise, look, sliding
from rendulic.chang_hicher.point_curve import point_curve
from rendulic.checks import positive_number, whole_number
from rendulic.errors import InvalidInput
from rendulic.loading.paths import Path
from rendulic.progress import Progress, silent
from rendulic.tensors.invariants import stress_ratio

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.chang_hicher.point import MaterialPoint

__all__ = ["TOLERANCE", "control_for", "follow_path", "least_memory", "load", "look_at", "probe"]

TOLERANCE = 1e-8
ROWS_AT_A_TIME = 512
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
    sigma, kappa, modulus = work.plane[:, 0], work.plane[:, 11], work.plane[:, 2]
    if point.material.formulation != CONSISTENT:
        return kappa.copy()
    return sliding(kappa, sigma, point.material.k_pR * modulus, work.scalar[TAN_PEAK])


def control_for(point: MaterialPoint, stress_rows: np.ndarray, strain_rows: np.ndarray, target: np.ndarray) -> Control:
    """The kernels' control from three principal equations; strain equations are multiplied by a stiffness."""
    stress_six, strain_six, goal = six_equations(stress_rows, strain_rows, target, point.sigma)
    work = look_at(point)
    p = float(point.sigma[:3].sum()) / 3.0
    stiffness = float(work.scalar[STIFFNESS] * p**point.material.exponent)
    goal = np.where(np.abs(strain_six).max(axis=1) > 0.0, goal * stiffness, goal)
    strain_six *= stiffness
    homogenise(point.material, point.model.planes, np.zeros(len(point.memory), dtype=bool), work)
    sign = float(np.sign(np.linalg.det(stress_six + strain_six @ work.compliance)))
    return Control(stress_six, strain_six, goal, sign, p, p / stiffness)


class Run:
    """One control followed from a point, and the records of all its pieces."""

    def __init__(
        self, point: MaterialPoint, control: Control, tolerance: float, largest: float, until=(0.0, 0.0, 0.0),
        watches_planes: bool = True,
    ) -> None:  # fmt: skip
        n = len(point.memory)
        q = float(point.sigma[0] - 0.5 * (point.sigma[1] + point.sigma[2]))
        self.point, self.control, self.work = point, control, work_for(n)
        self.until = np.array([*until, q, 0.0], dtype=float)
        self.settings = np.array([tolerance, largest, FIRST_STEP, float(watches_planes)])
        self.y = np.concatenate((point.sigma, point.eps, [0.0]))
        self.active, self.cursor = np.zeros(n, dtype=bool), np.zeros(1)
        self.logs: list[Log] = []

    def go(self, on_piece: Callable[[float], None] = lambda _share: None) -> str:
        """Follow to the end and return what it was; the point moves along."""
        n, size = len(self.active), ROWS_AT_A_TIME
        while True:
            log = Log(
                np.empty((size, integrate.RECORD_COLUMNS)), np.empty((size, n, integrate.PLANE_COLUMNS)),
                np.empty((size, 6, 6)), np.empty((20 * n + 50, 15)), np.zeros(2, dtype=np.int64),
            )  # fmt: skip
            end = integrate.ENDS[
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


def six_equations(
    stress_rows: np.ndarray, strain_rows: np.ndarray, target: np.ndarray, sigma: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Equations (6, 6), (6, 6), (6,) of stress and strain rates from three principal ones.

    Shear stresses are held. Where the controlled strains and the stress are the same with the lateral
    axes exchanged, the difference of the lateral stresses is held in place of that of the strains: an
    axisymmetric test stays axisymmetric, as one in a cell under pressure does, also where the planes no
    longer resist a difference of lateral strains.
    """
    by_strain = np.abs(strain_rows).max(axis=1) > 0.0
    strains, imposed = strain_rows[by_strain], target[by_strain]
    lateral = np.array([0.0, 1.0, -1.0]) / np.sqrt(2.0)
    rate = np.linalg.pinv(strains) @ imposed if len(strains) else np.zeros(3)
    spanned = np.linalg.norm(strains @ lateral) > 0.0 and np.linalg.matrix_rank(np.vstack((strains, lateral))) == len(
        strains
    )
    if spanned and abs(rate @ lateral) <= 1e-14 * np.abs(rate).max() and sigma[1] == sigma[2]:
        # a basis of the controlled strains without their lateral difference
        _, size, basis = np.linalg.svd(strains - np.outer(strains @ lateral, lateral))
        strains = basis[: int((size > 1e-9 * size.max()).sum())] if size.max() > 0.0 else np.empty((0, 3))
        imposed = strains @ rate
        stresses = np.vstack((stress_rows[~by_strain], lateral))
        held = np.append(target[~by_strain], 0.0)
    else:
        stresses, held = stress_rows[~by_strain], target[~by_strain]
    first, k = np.zeros((2, 6, 6)), len(stresses)
    first[0, :k, :3], first[1, k:3, :3], first[0, 3:, 3:] = stresses, strains, np.eye(3)
    return first[0], first[1], np.concatenate((held, imposed, np.zeros(3)))


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

    runs, stopped_by = follow_path(point, path, tolerance, least_records, on_piece)
    return point_curve(point, path.name, [run.logs for run in runs], stopped_by)


def follow_path(
    point: MaterialPoint,
    path: Path,
    tolerance: float = TOLERANCE,
    least_records: int = 1,
    on_piece: Callable[[float], None] = lambda _share: None,
    watches_planes: bool = True,
) -> tuple[list[Run], str]:
    """Follow the one or two legs of a path, in place; the runs and what stopped the last one."""
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
    runs: list[Run] = []

    def follow(target: np.ndarray, first: float, share: float, until=(0.0, 0.0, 0.0)) -> str:
        control = control_for(point, stress_rows, strain_rows, target)
        runs.append(Run(point, control, tolerance, largest, until, watches_planes))
        return runs[-1].go(lambda done: on_piece(first + share * done))

    stopped_by = "target"
    ramps = bool((np.abs(missing) > 1e-12 * np.abs(point.sigma[:3]).max()).any())
    if ramps or not path.is_driven:
        stopped_by = follow(missing, 0.0, 0.1 if path.is_driven else 1.0)
    if path.is_driven and stopped_by == "target":
        relative = np.where(is_stress, 0.0, path.strain_rate)
        driven = np.abs(np.linalg.inv(np.asarray(path.control.strain_basis)) @ relative)
        axis = 0 if driven[0] > 0.0 else int(driven.argmax())
        until, eta = path.until, float(stress_ratio(point.stress))
        if until.eta is not None and abs(until.eta - eta) <= 1e-12:
            return runs, "eta"
        side = 0.0 if until.eta is None else float(np.sign(until.eta - eta))
        ends = (until.eta or 0.0, side, until.peak_drop if until.peak else 0.0)
        done = 0.1 if ramps else 0.0
        stopped_by = follow(relative * until.strain / driven[axis], done, 1.0 - done, ends)
        stopped_by = "strain" if stopped_by == "target" else stopped_by
    if sum(len(log.rows) for run in runs for log in run.logs) <= 1 and stopped_by not in ("target", "strain"):
        raise InvalidInput(
            f"the control of the path '{path.name}' cannot be followed from this state at all ({stopped_by}): {point!r}"
        )
    return runs, stopped_by


def probe(
    point: MaterialPoint,
    increment: np.ndarray,
    kind: str,
    marks: tuple[float, ...],
    on_mark: Callable[[float], None] | None,
) -> None:
    """See `MaterialPoint.probe`."""
    stress_rows, strain_rows = (np.eye(3), np.zeros((3, 3)))[:: 1 if kind == "stress" else -1]
    done, goes_on = 0.0, bool(np.abs(increment).max() > 0.0)
    for mark in marks:
        if goes_on:
            control = control_for(point, stress_rows, strain_rows, (mark - done) * increment)
            run = Run(point, control, TOLERANCE, 1.0)
            goes_on = run.go() == "target"
        done = mark
        if on_mark is not None:
            on_mark(mark)
