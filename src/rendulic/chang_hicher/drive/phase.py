"""What is recorded while one control is followed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rendulic.chang_hicher.kernels.arrays import Records, new_records
from rendulic.chang_hicher.kernels.columns import (
    EVENT_COLUMNS,
    PLANE,
    PLANE_RECORD_COLUMNS,
    RECORD_COLUMNS,
    SHARED,
    named,
)
from rendulic.chang_hicher.kernels.events import EVENTS
from rendulic.chang_hicher.measure.planes import state_of_planes
from rendulic.chang_hicher.state import PointState

__all__ = ["PhaseRecord", "at_rest", "joined"]


@dataclass(frozen=True, eq=False)
class PhaseRecord:
    """Records and events of one phase of a path, in which one control is followed.

    Parameters
    ----------
    record : dict of (m, ...) arrays
        Stress, strain, their rates and more at every record, by the names of `columns.RECORD_COLUMNS`.
    plane_record : dict of (m, n, ...) arrays
        Of every plane, by the names of `columns.PLANE_RECORD_COLUMNS`.
    compliance : (m, 6, 6) array
        Of the assembly.
    event : dict of (k, ...) arrays
        By the names of `columns.EVENT_COLUMNS`; the kind by its place in `EVENTS`.
    """

    record: dict[str, np.ndarray]
    plane_record: dict[str, np.ndarray]
    compliance: np.ndarray
    event: dict[str, np.ndarray]

    @classmethod
    def of(cls, pieces: Sequence[Records]) -> PhaseRecord:
        """Of all that the kernels recorded, piece by piece."""
        rows, plane_rows, compliance, events = (
            np.concatenate([piece[k] for piece in pieces]) if len(pieces) > 1 else pieces[0][k] for k in range(4)
        )
        return cls(
            named(rows, RECORD_COLUMNS), named(plane_rows, PLANE_RECORD_COLUMNS), compliance,
            named(events, EVENT_COLUMNS),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.compliance)

    def events(self, kind: str) -> dict[str, np.ndarray]:
        """Those of one kind, one of `EVENTS`."""
        own = self.event["kind"] == EVENTS.index(kind)
        return {name: values[own] for name, values in self.event.items()}


def joined(phases: Sequence[PhaseRecord]) -> PhaseRecord:
    """Several phases as one."""

    def by_name(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    return PhaseRecord(
        by_name([phase.record for phase in phases]),
        by_name([phase.plane_record for phase in phases]),
        np.concatenate([phase.compliance for phase in phases]),
        by_name([phase.event for phase in phases]),
    )


def at_rest(point: PointState) -> PhaseRecord:
    """One record of a state that goes nowhere: its rates are not known."""
    seen, n = state_of_planes(point), len(point.memory)
    rows = new_records(1, n, 0)
    for array in (rows.rows, rows.plane_rows, rows.compliances):
        array.fill(np.nan)
    phase = PhaseRecord.of([rows])
    record, planes = phase.record, phase.plane_record
    record["stress"][:], record["strain"][:], record["parameter"][:] = point.sigma, point.eps, 0.0
    record["tan_phi_p"][:], record["void_ratio"][:] = seen.shared[SHARED.tan_peak], seen.shared[SHARED.void_ratio]
    sigma, tau = seen.plane[:, PLANE.sigma], seen.plane[:, PLANE.tau]
    planes["sigma"][:], planes["tau"][:], planes["x"][:] = sigma, tau, tau / sigma / seen.shared[SHARED.tan_peak]
    planes["eps"][:], planes["gamma"][:] = point.plane_strain[:, 0], point.plane_strain[:, 1:]
    planes["is_loading"][:] = 0.0
    return phase
