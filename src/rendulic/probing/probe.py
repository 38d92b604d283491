"""Probing a state in many directions, each from the identical saved state."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.checks import finite_array, whole_number
from rendulic.foundation.cores import workers_or_cores
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.foundation.progress import Progress, silent
from rendulic.loading.directions import Directions, SphereDirections
from rendulic.micro.contact_work import CLASSES
from rendulic.probing.anatomy import anatomy_of, summary
from rendulic.probing.second_order_work import SecondOrderWork, normalised, second_order_work
from rendulic.specimen.protocol import HasGrains, ProbesTogether, Specimen

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dataset_of_readings", "probe"]

MACRO = {
    "w2_macro": ("second-order work d_sigma : d_eps (Cauchy)", "J/m3"),
    "w2_normalised": ("normalised second-order work", "1"),
    "w2_drift": ("part of w2_macro that the null probe's drift makes", "J/m3"),
    "w2_normalised_without_drift": ("normalised second-order work, null probe subtracted", "1"),
}
MICRO = {
    "w2_boundary": ("second-order work of the walls, exact", "J/m3"),
    "w2_lagrangian": ("second-order work dPi : dF", "J/m3"),
    "w2_contacts": ("sum of df . dl over contacts before or after", "J/m3"),
    "w2_grains": ("sum of df . dx over grains (inertial term)", "J/m3"),
    "w2_paper": ("Eq. 17 over contacts present before and after", "J/m3"),
    "identity_residual": ("error of the exact micro-macro identity, relative", "1"),
    "negative_contacts": ("share of contacts with negative second-order work", "1"),
    "unbalanced_force": ("mean resultant over mean contact force at the end", "1"),
}


def probe(
    specimen: Specimen,
    directions: Directions | SphereDirections,
    norm: float | Sequence[float] = 5e-5,
    n_steps: int = 5000,
    *,
    kind: str = "strain",
    anatomy: bool = False,
    workers: int | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Second-order work of a state in many directions; the specimen itself is left as it was.

    1. The state is saved once; every direction starts from it, and so does a null probe of zero
       increment and equal duration, whose drift (in stress, or in strain for stress probes) is reported
       with every value.
    2. The increment grows at constant rate. A sequence of norms is one sweep: each direction is
       followed to the largest norm and read where it passes the others.
    3. For specimens with grains the micro terms and the identity residual come along.

    Parameters
    ----------
    specimen : Specimen
        In the state to probe; it should be at rest.
    directions : Directions or SphereDirections
        E.g. `rd.directions.rendulic(step=10)`, or `rd.directions.sphere(500)` for all principal increments.
    norm : float or increasing sequence of float
        Size of the increment: strain, or Pa for `kind="stress"`.
    n_steps : int
        Steps up to the *smallest* norm; larger norms take proportionally more.
    kind : {"strain", "stress"}
        What is imposed. The directions are angles in the Rendulic plane of that quantity.
    anatomy : bool
        For specimens with grains: whether every direction tells where its second-order work comes from, too; see
        `rd.anatomy`, of which this keeps all but single contacts and grains.
    workers : int, optional
        Threads; by default one per core. The results do not depend on it.
    progress : Progress
        Called as directions finish.

    Returns
    -------
    xarray.Dataset
        Dimensions `alpha` (degrees) or, on the sphere, `direction`; `component`, for grains `contact_class`, and `norm` if a
        sequence was given. A sign is `is_significant` where |w2_macro| exceeds |w2_drift|. A stress that the
        state cannot carry is not `is_reached`: the values are then those of the increment that was.

    Raises
    ------
    InvalidInput
        For norms or steps that are not positive, an unknown kind, or an anatomy of a specimen without grains.
    """
    one_of(kind, ("strain", "stress"), "kind of probe")
    norms = finite_array("norm", norm, () if np.ndim(norm) == 0 else (None,)).reshape(-1)
    if len(norms) == 0 or (norms <= 0).any() or (np.diff(norms) <= 0).any():
        raise InvalidInput(f"probe norms must be positive and increasing, got {norm!r}")
    n_steps = whole_number("n_steps", n_steps, 1)
    workers = workers_or_cores(workers)
    increments = np.concatenate((np.zeros((1, 3)), directions.increments(float(norms[-1]))))
    marks = tuple((norms / norms[-1]).tolist())
    total_steps = round(n_steps * float(norms[-1] / norms[0]))
    before = specimen.snapshot() if isinstance(specimen, HasGrains) else None
    if anatomy and before is None:
        raise InvalidInput(f"an anatomy needs a specimen with grains and contacts, which {specimen!r} does not have")
    sigma, eps = specimen.stress, specimen.strain
    finished, lock = 0, Lock()

    def read(now: Specimen) -> dict[str, Any]:
        reading: dict[str, Any] = {"d_sigma": np.diag(now.stress - sigma), "d_eps": np.diag(now.strain - eps)}
        if before is not None and isinstance(now, HasGrains):
            after = now.snapshot()
            reading["work"] = second_order_work(before, after)
            reading["unbalanced_force"] = after.unbalanced_force
            if anatomy:
                reading["anatomy"] = summary(anatomy_of(reading["work"], before, after))
        return reading

    def on_done(count: int) -> None:
        nonlocal finished
        with lock:
            finished += count
            progress(finished, len(increments), f"probe {finished} of {len(increments)}")

    def follow(increment: np.ndarray) -> list[dict[str, Any]]:
        clone = specimen.clone()
        readings: list[dict[str, Any]] = []
        clone.probe(increment, total_steps, kind=kind, marks=marks, on_mark=lambda _share: readings.append(read(clone)))
        on_done(1)
        return readings

    if kind == "strain" and isinstance(specimen, ProbesTogether):
        results = specimen.probe_together(
            increments, total_steps, marks=marks, read=read, workers=workers, on_done=on_done
        )
    else:
        with ThreadPoolExecutor(max_workers=workers) as pool:
            results = list(pool.map(follow, increments))
    return dataset_of_readings(results[0], results[1:], directions, norms, np.ndim(norm) == 0, kind, total_steps)


def dataset_of_readings(
    null: list[dict], probes: list[list[dict]], directions: Directions | SphereDirections, norms: np.ndarray, single: bool, kind: str,
    n_steps: int,
) -> xr.Dataset:  # fmt: skip
    """Readings (`d_sigma`, `d_eps`, for grains `work` and `unbalanced_force`) of every probe and norm as `probe` returns them."""
    import xarray as xr

    def stacked(pick) -> np.ndarray:
        return np.array([[pick(reading) for reading in readings] for readings in probes]).swapaxes(0, 1)

    d_sigma, d_eps = stacked(lambda r: r["d_sigma"]), stacked(lambda r: r["d_eps"])
    # a strain probe drifts in stress, a stress probe in strain
    sigma_drift = np.array([reading["d_sigma"] for reading in null])[:, None, :]
    eps_drift = np.array([reading["d_eps"] for reading in null])[:, None, :]
    without = (d_sigma - sigma_drift, d_eps - eps_drift)
    values = {
        "w2_macro": (d_sigma * d_eps).sum(axis=-1),
        "w2_normalised": normalised(d_sigma, d_eps),
        "w2_drift": (d_sigma * d_eps).sum(axis=-1) - (without[0] * without[1]).sum(axis=-1),
        "w2_normalised_without_drift": normalised(*without),
    }
    asked = norms[:, None, None] * directions.increments(1.0)
    error = np.linalg.norm((d_eps if kind == "strain" else d_sigma) - asked, axis=-1)
    labels = dict(MACRO)
    axes = ("norm", directions.dimension)
    variables: dict[str, Any] = {
        "d_eps": ((*axes, "component"), d_eps, {"long_name": "principal strain increment", "units": "1"}),
        "d_sigma": (
            (*axes, "component"),
            d_sigma,
            {"long_name": "principal stress increment", "units": "Pa"},
        ),
        "d_sigma_null": (
            ("norm", "component"),
            sigma_drift[:, 0, :],
            {"long_name": "principal stress drift of the null probe", "units": "Pa"},
        ),
        "d_eps_null": (
            ("norm", "component"),
            eps_drift[:, 0, :],
            {"long_name": "principal strain drift of the null probe", "units": "1"},
        ),
        "is_reached": (
            axes,
            error <= 0.05 * norms[:, None],
            {"long_name": f"{kind} asked for was reached within 5 % of its norm"},
        ),
        "is_significant": (
            axes,
            np.abs(values["w2_macro"]) > np.abs(values["w2_drift"]),
            {"long_name": "second-order work larger than the null probe's share"},
        ),
    }
    coords: dict[str, Any] = {
        **directions.coordinates(kind),
        "norm": (
            "norm",
            norms,
            {"long_name": f"norm of {kind} increment", "units": "1" if kind == "strain" else "Pa"},
        ),
        "component": ("component", [1, 2, 3], {"long_name": "principal axis, 1 axial"}),
    }
    if "work" in null[0]:
        labels |= MICRO
        for name, attribute in (
            ("w2_boundary", "boundary"), ("w2_lagrangian", "lagrangian"), ("w2_contacts", "contacts"),
            ("w2_grains", "grains"), ("w2_paper", "paper"), ("identity_residual", "identity_residual"),
        ):  # fmt: skip
            values[name] = stacked(lambda r, a=attribute: getattr(r["work"], a))
        values["negative_contacts"] = stacked(lambda r: _share_negative(r["work"]))
        values["unbalanced_force"] = stacked(lambda r: r["unbalanced_force"])
        coords["contact_class"] = ("contact_class", list(CLASSES))
        variables["w2_by_class"] = (
            (*axes, "contact_class"),
            stacked(lambda r: [r["work"].by_class[name] for name in CLASSES]),
            {"long_name": "second-order work of the contacts by class", "units": "J/m3"},
        )
    for name, value in values.items():
        variables[name] = (axes, value, {"long_name": labels[name][0], "units": labels[name][1]})
    result = xr.Dataset(variables, coords, {"kind": kind, "n_steps": n_steps, "sign": "compression positive"})
    if "anatomy" in null[0]:
        parts = [[reading["anatomy"] for reading in at_norm] for at_norm in zip(*probes, strict=True)]
        nested = xr.combine_nested(parts, list(axes), combine_attrs="drop").transpose(*axes, ...)
        result = result.assign({name: nested[name] for name in nested.data_vars if name not in result})
    return result.squeeze("norm") if single else result


def _share_negative(work: SecondOrderWork) -> float:
    pairs = work.per_contact.work
    return float((pairs < 0.0).mean()) if len(pairs) else 0.0
