"""What is recorded while one control is followed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rendulic.chang_hicher.kernels.arrays import Records, new_records
from rendulic.chang_hicher.kernels.columns import (
    EVENT,
    EVENT_COLUMNS,
    PLANE,
    PLANE_RECORD,
    PLANE_RECORD_COLUMNS,
    RECORD,
    RECORD_COLUMNS,
    SHARED,
)
from rendulic.chang_hicher.kernels.events import EVENTS
from rendulic.chang_hicher.law.planes import Orbits
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
    plane_record : dict of (m, n) arrays
        Of the planes, by the names of `columns.PLANE_RECORD_COLUMNS`.
    compliance : (m, 6, 6) array
        Of the assembly.
    event : dict of (k, ...) arrays
        By the names of `columns.EVENT_COLUMNS`; the kind by its place in `EVENTS`.
    orbits : Orbits, optional
        The planes are then one of each orbit, as their numbers in events are; see `of_all_planes`.
    """

    record: dict[str, np.ndarray]
    plane_record: dict[str, np.ndarray]
    compliance: np.ndarray
    event: dict[str, np.ndarray]
    orbits: Orbits | None = None

    @classmethod
    def of(cls, pieces: Sequence[Records], orbits: Orbits | None = None) -> PhaseRecord:
        """Of all that the kernels recorded, piece by piece."""
        rows, plane_rows, compliance, events = (
            np.concatenate([piece[k] for piece in pieces]) if len(pieces) > 1 else pieces[0][k] for k in range(4)
        )
        return cls(
            _named(rows, RECORD_COLUMNS, RECORD), _named(plane_rows, PLANE_RECORD_COLUMNS, PLANE_RECORD), compliance,
            _named(events, EVENT_COLUMNS, EVENT), orbits,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.compliance)

    def of_all_planes(self) -> PhaseRecord:
        """The same, of every plane: what was recorded of one in each orbit holds for all of it, and so do its events."""
        orbits = self.orbits
        if orbits is None:
            return self
        planes = {name: orbits.every(values) for name, values in self.plane_record.items()}
        members = [np.flatnonzero(orbits.of_plane == orbit) for orbit in range(len(orbits.first))]
        number = self.event["plane"].astype(int)
        copies = [members[orbit] if orbit >= 0 else np.array([-1]) for orbit in number]
        rows = np.repeat(np.arange(len(number)), [len(own) for own in copies])
        event = {name: values[rows] for name, values in self.event.items()}
        if copies:
            event["plane"] = np.concatenate(copies).astype(float)
        return PhaseRecord(self.record, planes, self.compliance, event)

    def events(self, kind: str) -> dict[str, np.ndarray]:
        """Those of one kind, one of `EVENTS`."""
        own = self.event["kind"] == EVENTS.index(kind)
        return {name: values[own] for name, values in self.event.items()}


def _named(array: np.ndarray, columns: Mapping[str, int], starts: Sequence[int]) -> dict[str, np.ndarray]:
    """Views of the columns by name, where their places are known already."""
    return {
        name: array[..., start] if count == 1 else array[..., start : start + count]
        for (name, count), start in zip(columns.items(), starts, strict=True)
    }


def joined(phases: Sequence[PhaseRecord]) -> PhaseRecord:
    """Several phases as one."""
    if len(phases) == 1:
        return phases[0]

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
    planes["eps"][:], planes["gamma"][:] = point.plane_strain[:, 0], np.linalg.norm(point.plane_strain[:, 1:], axis=1)
    planes["is_loading"][:] = 0.0
    return phase
