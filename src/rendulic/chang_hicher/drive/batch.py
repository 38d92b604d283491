"""One element test with many sets of parameters, for calibration and sensitivity."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.chang_hicher.drive.following import admissible_tolerance, follow_path
from rendulic.chang_hicher.drive.integration import TOLERANCE
from rendulic.chang_hicher.drive.phase import PhaseRecord
from rendulic.chang_hicher.drive.virgin import VOID_RATIO, virgin_state
from rendulic.chang_hicher.law.parameters import Parameters
from rendulic.chang_hicher.law.plane_model import DEFAULT_FORMULATION, PlaneModel
from rendulic.foundation.checks import finite_array, whole_number
from rendulic.foundation.cores import workers_or_cores
from rendulic.foundation.errors import InvalidInput, RendulicError, one_of
from rendulic.foundation.progress import Progress, silent
from rendulic.loading.paths import Path
from rendulic.specimen.curve import COLUMNS, stress_columns
from rendulic.tensors.mandel import to_tensor
from rendulic.tensors.sphere_rules import SphereRule

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["load_many"]

STATE = ("pressure", "void_ratio")
WHOLE = ("strain", "target", "eta", "peak")  # ends that the path asks for


def load_many(
    parameters: Mapping[str, Any],
    path: Path,
    *,
    pressure: Any = 300e3,
    void_ratio: Any = VOID_RATIO,
    n_records: int = 201,
    tolerance: float = TOLERANCE,
    formulation: str = DEFAULT_FORMULATION,
    rule: SphereRule | None = None,
    fabric: np.ndarray | None = None,
    workers: int | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Follow a path from the same kind of state with every set of parameters.

    A set that the model refuses costs nothing but itself: its numbers are NaN, and its `verdict` says why.

    Parameters
    ----------
    parameters : mapping of name to number or (n,) array
        As for `ChangHicher`; numbers hold for all. An entry that is empty (None, "") or NaN refuses its set.
    path : Path
        Stresses that it holds at other values are brought there first, off the record.
    pressure, void_ratio : number or (n,) array
        The virgin isotropic states, Pa.
    n_records : int
        Points along the path, equally spaced in the driven strain; values between integration steps are
        interpolated with the rates at both.
    tolerance, formulation, rule, fabric
        As for `MaterialPoint.load` and `ChangHicher`.
    workers : int, optional
        Threads; by default one per core. The results do not depend on it.
    progress : Progress
        Called as tests finish.

    Returns
    -------
    xarray.Dataset
        Dimensions `sample` and `record`: `eps_1`, ..., `q`, `p`, `eta`, `eps_v`; NaN beyond where a test
        stopped, `stopped_by` says why ("refused": it never began). `verdict`: the same in words for each set, with the
        reason why it was refused. `q_peak`, `p_peak`, `eps_1_peak`: the first peak of q, exactly; NaN if there is none.
        The parameters that vary come along.

    Raises
    ------
    InvalidInput
        If names are unknown, lengths differ, or what holds for all sets (a number, the tolerance, the rule, ...) is
        inadmissible.
    """
    import xarray as xr

    n_records = whole_number("n_records", n_records, 2)
    for name in parameters:
        one_of(name, Parameters.model_fields, "parameter")
    given = {name: value for name, value in parameters.items() if value is not None}
    given |= {"pressure": pressure, "void_ratio": void_ratio}
    table = {name: _column(name, value) for name, value in given.items()}
    lengths = {len(value) for value in table.values() if value.ndim == 1}
    if len(lengths) > 1 or any(value.ndim > 1 for value in table.values()):
        raise InvalidInput(f"parameters must be numbers or arrays of one length, got lengths {sorted(lengths)}")
    n = lengths.pop() if lengths else 1
    values = {name: np.broadcast_to(value, n) for name, value in table.items()}
    tolerance = admissible_tolerance(tolerance)
    workers = workers_or_cores(workers)
    base = PlaneModel(rule, fabric, formulation, {})
    marks = np.linspace(0.0, 1.0, n_records)
    states = np.full((n, n_records, 12), np.nan)
    peaks = np.full((n, 12), np.nan)
    ends, verdicts = ["refused"] * n, [""] * n
    finished, lock = 0, Lock()

    def one(sample: int) -> None:
        nonlocal finished
        own = {name: float(column[sample]) for name, column in values.items()}
        try:
            follow(sample, own)
        except RendulicError as error:
            verdicts[sample] = f"refused: {error}"
        with lock:
            finished += 1
            if finished % 50 == 0 or finished == n:
                progress(finished, n, f"test {finished} of {n}")

    def follow(sample: int, own: dict[str, float]) -> None:
        empty = [name for name, value in own.items() if not np.isfinite(value)]
        if empty:
            raise InvalidInput(f"{empty[0]} must be a finite number, got {own[empty[0]]}: is the entry empty?")
        state = {name: own.pop(name) for name in STATE}
        point = virgin_state(base.with_parameters(**own), state["pressure"], state["void_ratio"])
        followed = follow_path(point, path, tolerance, watches_planes=False)
        ends[sample] = followed.stopped_by
        whole = followed.stopped_by in WHOLE
        verdicts[sample] = f"followed to the end ({ends[sample]})" if whole else f"stopped short: {ends[sample]}"
        phase = followed.driven if path.is_driven else followed.ramp
        if phase is not None:
            states[sample] = _interpolated(phase, path, marks)
            peak = phase.events("q_peak")
            if len(peak["kind"]):
                peaks[sample] = np.concatenate((peak["stress"][0], peak["strain"][0]))

    with ThreadPoolExecutor(max_workers=workers) as pool:
        list(pool.map(one, range(n)))
    columns = stress_columns(to_tensor(states[..., :6]), to_tensor(states[..., 6:]))
    at_peak = stress_columns(to_tensor(peaks[:, :6]), to_tensor(peaks[:, 6:]))
    labels = {name: {"long_name": COLUMNS[name][0], "units": COLUMNS[name][1]} for name in columns}
    result = xr.Dataset(
        {name: (("sample", "record"), column, labels[name]) for name, column in columns.items()}
        | {f"{name}_peak": ("sample", at_peak[name], labels[name]) for name in ("q", "p", "eps_1")}
        | {"stopped_by": ("sample", np.array(ends, dtype=str)), "verdict": ("sample", np.array(verdicts, dtype=str))},
        attrs={"path": path.name, "formulation": formulation, "sign": "compression and contraction positive"},
    )
    varied = {name: ("sample", values[name]) for name, value in table.items() if value.ndim == 1}
    return result.assign_coords({"share": ("record", marks, {"long_name": "share of the path"})} | varied)


def _column(name: str, value: Any) -> np.ndarray:
    """A number for all sets, which must be finite, or one for each, where what is empty becomes NaN."""
    column = np.asarray(value)
    if column.ndim != 1:
        return finite_array(name, column, column.shape)
    entries = [np.nan if entry is None or entry == "" else entry for entry in column.tolist()]
    try:
        return np.array(entries, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"{name} must be an array of numbers: {error}") from None


def _interpolated(phase: PhaseRecord, path: Path, marks: np.ndarray) -> np.ndarray:
    """Stress and strain (m, 12) at shares of a path; NaN beyond its end.

    The share is that of the axial strain (of the fastest axis where the axial one rests), or of the way to the
    stresses of a path without driven strains. Cubic between records, with the rates at both. Where a plane
    changes sides there are two records, with the rates before and after.
    """
    record = phase.record
    if len(phase) == 0:
        return np.full((len(marks), 12), np.nan)
    state = np.concatenate((record["stress"], record["strain"]), axis=1)
    place, place_rate = record["parameter"], record["parameter_rate"]
    if path.is_driven:
        travelled = np.abs(record["strain"][-1, :3] - record["strain"][0, :3])
        axis = 0 if travelled[0] > 0.0 else int(travelled.argmax())
        place, place_rate = record["strain"][:, axis], record["strain_rate"][:, axis]
    scale = np.sign(place[-1] - place[0]) * (path.until.strain if path.is_driven else 1.0) or 1.0
    share = (place - place[0]) / scale
    if len(phase) < 2:
        return np.where(marks[:, None] <= 0.0, state[0], np.nan)
    rates = np.concatenate((record["stress_rate"], record["strain_rate"]), axis=1) / place_rate[:, None] * scale
    after = np.clip(np.searchsorted(share, marks, side="left"), 1, len(phase) - 1)
    before = after - 1
    length = (share[after] - share[before])[:, None]
    t = (marks - share[before])[:, None] / np.where(length > 0.0, length, 1.0)
    values = (
        (1 + 2 * t) * (1 - t) ** 2 * state[before] + t * (1 - t) ** 2 * length * rates[before]
        + t**2 * (3 - 2 * t) * state[after] - t**2 * (1 - t) * length * rates[after]
    )  # fmt: skip
    return np.where(marks[:, None] <= share[-1] * (1.0 + 1e-9), values, np.nan)
