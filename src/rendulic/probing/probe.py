"""Probing a state in many directions, each from the identical saved state."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import TYPE_CHECKING, Any
from warnings import warn

import numpy as np

from rendulic.foundation.cores import workers_or_cores
from rendulic.foundation.errors import DoubtfulResult, InvalidInput, one_of
from rendulic.foundation.progress import Progress, silent
from rendulic.loading.directions import Directions, SphereDirections, as_directions
from rendulic.loading.rate import SETTLING_STEPS, STRAIN_PER_STEP, norms_of, rate_of, steps_to
from rendulic.micro.contact_work import CLASSES
from rendulic.probing.anatomy import anatomy_of, summary
from rendulic.probing.error_bar import LAST, PARTS, TOO_FAST, error_of, imbalance, meets_collapse, rounding
from rendulic.probing.second_order_work import SecondOrderWork, normalised, second_order_work
from rendulic.specimen.protocol import HasGrains, ProbesTogether, Specimen
from rendulic.specimen.way import Way

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dataset_of_readings", "doubts", "probe", "probed_specimen", "probes_of", "warn_of_doubts"]

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
ON_THE_WAY = {
    "unbalanced_on_way": ("mean resultant over mean contact force on the smooth parts of the way", "1"),
    "unbalanced_largest": ("largest mean resultant over mean contact force on the way", "1"),
}
ERRORS = {
    "w2_error": ("error of w2_macro: the sum of its parts", "J/m3"),
    "w2_normalised_error": ("the same of w2_normalised", "1"),
}
STEPS_WITHOUT_INERTIA = 5000  # equal parts of the increment, for specimens that do not choose their own
LARGEST_STRAIN = 0.01  # of what is still an increment
AT_REST = 1e-4  # unbalanced force of a specimen that is still worth probing


def probe(
    specimen: Specimen,
    directions: Directions | SphereDirections,
    norm: float | Sequence[float] | None = None,
    n_steps: int | None = None,
    *,
    rate: float | None = None,
    settle: bool = True,
    check_rate: bool = False,
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
    3. Grains are read at rest: at each norm a copy is held, walls fixed, until its unbalanced force is below 1e-5. The sweep goes
       on from the norm itself, so that a norm gives the same alone or in a sweep.
    4. For specimens with grains the micro terms and the identity residual come along.

    Parameters
    ----------
    specimen : Specimen
        In the state to probe; it should be at rest.
    directions : Directions or SphereDirections
        E.g. `rd.directions.rendulic(step=10)`, a list of angles in degrees, or `rd.directions.sphere(500)` for all principal increments.
    norm : float or increasing sequence of float, optional
        Size of the increment: strain, 5e-5 if not given, or Pa for `kind="stress"`, where it must be given.
    rate : float, optional
        Strain, or Pa, per time step; for specimens with inertia. By default 1e-8 of strain, or 5e-6 of the mean stress.
    settle : bool
        Whether grains are read at rest, after at most 60 000 steps with walls held; otherwise while they move.
    check_rate : bool
        Whether all is probed at half the rate, too; the change becomes part of the error.
    kind : {"strain", "stress"}
        What is imposed. The directions are angles in the Rendulic plane of that quantity.
    anatomy : bool
        For specimens with grains: whether every direction tells where its second-order work comes from, too; see
        `rd.anatomy`, of which this keeps all but single contacts and grains.
    workers : int, optional
        Threads; by default one per core. The results do not depend on it.
    progress : Progress
        Called as directions finish.
    n_steps : int, optional
        Will no longer be read: use `rate`.

    Returns
    -------
    xarray.Dataset
        Dimensions `alpha` (degrees) or, on the sphere, `direction`; `component`, for grains `contact_class`, and `norm` if a
        sequence was given.

        `w2_error` and `w2_normalised_error` are the sums of the parts `error_drift`, `error_inertia`, `error_imbalance`, `error_size`, `error_rate`,
        `error_sphere_rule` and `error_rounding`, as far as the specimen has them, in J/m3. A sign `is_significant` where |w2_macro|
        exceeds `w2_error`, the increment asked for `is_reached`, the probe was not too fast, and contacts are left. A stress that the
        state cannot carry is not `is_reached`: the values are then those of the increment that was.

        For grains, `is_too_fast` where the unbalanced force on the smooth parts of the way, `unbalanced_on_way`, exceeds 1e-3;
        `meets_collapse` where the largest one, `unbalanced_largest`, stands out from it; `is_settled` where they were at rest when they
        were read, after `settling_steps`. A direction that never settles has no equilibrium near.

    Raises
    ------
    InvalidInput
        For norms or rates that are not positive, an unknown kind, stress probes without a size, or an anatomy of a specimen
        without grains.

    Warns
    -----
    DoubtfulResult
        If probes were too fast or not settled, or the specimen is not at rest; with what to do.
    """
    found = probes_of(
        specimen, directions, norm, rate=rate, settle=settle, check_rate=check_rate, kind=kind, anatomy=anatomy, workers=workers,
        progress=progress, n_steps=n_steps,
    )  # fmt: skip
    warn_of_doubts(found)
    return found


def probes_of(
    specimen: Specimen,
    directions: Directions | SphereDirections,
    norm: float | Sequence[float] | None = None,
    n_steps: int | None = None,
    *,
    rate: float | None = None,
    settle: bool = True,
    check_rate: bool = False,
    kind: str = "strain",
    anatomy: bool = False,
    workers: int | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """As `probe`, without warnings: `doubts` has them."""
    one_of(kind, ("strain", "stress"), "kind of probe")
    directions = as_directions(directions)
    norms = norms_of(norm, kind)
    sigma, eps = specimen.stress, specimen.strain
    rate = rate_of(rate, n_steps, norms, kind, float(np.trace(sigma)) / 3.0)
    has_inertia = isinstance(specimen, ProbesTogether)
    total_steps = steps_to(float(norms[-1]), rate) if has_inertia else STEPS_WITHOUT_INERTIA
    workers = workers_or_cores(workers)
    increments = np.concatenate((np.zeros((1, 3)), directions.increments(float(norms[-1]))))
    marks = tuple((norms / norms[-1]).tolist())
    before = specimen.snapshot() if isinstance(specimen, HasGrains) else None
    if anatomy and before is None:
        raise InvalidInput(f"an anatomy needs a specimen with grains and contacts, which {specimen!r} does not have")
    slower = check_rate and has_inertia
    finished, count, lock = 0, len(increments) * (1 + slower), Lock()

    def read(now: Specimen, way: Way | None = None) -> dict[str, Any]:
        reading: dict[str, Any] = {"d_sigma": np.diag(now.stress - sigma), "d_eps": np.diag(now.strain - eps)}
        if way is not None:
            reading["way"] = way
        if before is not None and isinstance(now, HasGrains):
            after = now.snapshot()
            reading["work"] = second_order_work(before, after)
            reading["unbalanced_force"] = after.unbalanced_force
            if anatomy:
                reading["anatomy"] = summary(anatomy_of(reading["work"], before, after))
        return reading

    def on_done(more: int) -> None:
        nonlocal finished
        with lock:
            finished += more
            progress(finished, count, f"probe {finished} of {count}")

    def follow(increment: np.ndarray) -> list[dict[str, Any]]:
        clone = specimen.clone()
        readings: list[dict[str, Any]] = []
        clone.probe(increment, total_steps, kind=kind, marks=marks, on_mark=lambda _share: readings.append(read(clone)))
        on_done(1)
        return readings

    def follow_all(n_steps: int) -> list[list[dict[str, Any]]]:
        if isinstance(specimen, ProbesTogether):
            return specimen.probe_together(
                increments, n_steps, kind=kind, marks=marks, settling_steps=SETTLING_STEPS if settle else 0, read=read,
                workers=workers, on_done=on_done,
            )  # fmt: skip
        with ThreadPoolExecutor(max_workers=workers) as pool:
            return list(pool.map(follow, increments))

    results = follow_all(total_steps)
    at_half = follow_all(2 * total_steps)[1:] if slower else None
    found = dataset_of_readings(
        results[0],
        results[1:],
        directions,
        norms,
        norm is None or isinstance(norm, float | int),
        kind,
        np.diag(sigma),
        at_half,
    ).assign_attrs(rate=rate, settle=int(settle))
    return found.assign_attrs(unbalanced_before=before.unbalanced_force) if before is not None else found


def probed_specimen(
    specimen: Specimen, increment: np.ndarray, rate: float | None = None, settle: bool = True
) -> Specimen:
    """A copy of a specimen after a strain probe (3,), as `probe` reads it."""
    if isinstance(specimen, ProbesTogether):
        steps = steps_to(float(np.linalg.norm(increment)), rate or STRAIN_PER_STEP)
        ((found,),) = specimen.probe_together(
            increment[None], steps, kind="strain", marks=(1.0,), settling_steps=SETTLING_STEPS if settle else 0,
            read=lambda now, _way: now, workers=1, on_done=lambda _more: None,
        )  # fmt: skip
        return found
    one = specimen.clone()
    one.probe(increment, STEPS_WITHOUT_INERTIA)
    return one


def dataset_of_readings(
    null: list[dict], probes: list[list[dict]], directions: Directions | SphereDirections, norms: np.ndarray, single: bool, kind: str,
    sigma: np.ndarray, at_half: list[list[dict]] | None = None,
) -> xr.Dataset:  # fmt: skip
    """Readings (`d_sigma`, `d_eps`, for grains `work`, `unbalanced_force`, `way`) of every probe and norm as `probe` returns them.

    `sigma` (3,) are the principal stresses before, in Pa; `at_half` the readings of the same probes at half the rate.
    """
    import xarray as xr

    def stacked(pick, of=probes) -> np.ndarray:
        return np.array([[pick(reading) for reading in readings] for readings in of]).swapaxes(0, 1)

    d_sigma, d_eps = stacked(lambda r: r["d_sigma"]), stacked(lambda r: r["d_eps"])
    # a strain probe drifts in stress, a stress probe in strain
    sigma_drift = np.array([reading["d_sigma"] for reading in null])[:, None, :]
    eps_drift = np.array([reading["d_eps"] for reading in null])[:, None, :]
    without = (d_sigma - sigma_drift, d_eps - eps_drift)
    w2 = (d_sigma * d_eps).sum(axis=-1)
    values = {
        "w2_macro": w2,
        "w2_normalised": normalised(d_sigma, d_eps),
        "w2_drift": w2 - (without[0] * without[1]).sum(axis=-1),
        "w2_normalised_without_drift": normalised(*without),
    }
    parts = {"error_drift": np.abs(values["w2_drift"]), "error_rounding": rounding(sigma, d_eps)}
    asked = norms[:, None, None] * directions.increments(1.0)
    missed = np.linalg.norm((d_eps if kind == "strain" else d_sigma) - asked, axis=-1)
    is_reached = missed <= 0.05 * norms[:, None]
    is_slow, has_contacts = np.ones(w2.shape, dtype=bool), np.ones(w2.shape, dtype=bool)
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
        "is_reached": (axes, is_reached, {"long_name": f"{kind} asked for was reached within 5 % of its norm"}),
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
        parts["error_inertia"] = np.abs(values["w2_grains"])
        has_contacts = np.isfinite(values["unbalanced_force"])
        parts["error_imbalance"] = imbalance(values["unbalanced_force"], sigma, d_sigma, d_eps)
        coords["contact_class"] = ("contact_class", list(CLASSES))
        variables["w2_by_class"] = (
            (*axes, "contact_class"),
            stacked(lambda r: [r["work"].by_class[name] for name in CLASSES]),
            {"long_name": "second-order work of the contacts by class", "units": "J/m3"},
        )
    if "way" in null[0]:
        labels |= ON_THE_WAY
        values["unbalanced_on_way"] = stacked(lambda r: r["way"].smooth)
        moving = stacked(lambda r: r["way"].change_of_work(LAST))
        parts["error_size"] = moving * np.linalg.norm(d_sigma, axis=-1) * np.linalg.norm(d_eps, axis=-1)
        values["unbalanced_largest"] = stacked(lambda r: r["way"].largest)
        too_fast = values["unbalanced_on_way"] > TOO_FAST
        is_slow = ~too_fast
        for name, flags, words in (
            ("is_too_fast", too_fast, f"unbalanced force on the smooth parts of the way above {TOO_FAST:g}"),
            ("meets_collapse", meets_collapse(values["unbalanced_on_way"], values["unbalanced_largest"]),
             "unbalanced force on the way that stands out: grains broke loose"),
            ("is_settled", stacked(lambda r: r["way"].is_settled), "read at rest"),
        ):  # fmt: skip
            variables[name] = (axes, flags, {"long_name": words})
        steps = stacked(lambda r: r["way"].settling_steps)
        variables["settling_steps"] = (
            axes,
            steps,
            {"long_name": "steps for which the walls were held before reading", "units": "1"},
        )
    if at_half is not None:
        slower = stacked(lambda r: (r["d_sigma"] * r["d_eps"]).sum(), at_half)
        parts["error_rate"] = np.abs(w2 - slower)
        labels["w2_at_half_rate"] = ("second-order work d_sigma : d_eps at half the rate", "J/m3")
        values["w2_at_half_rate"] = slower
    error = error_of(parts)
    size = np.linalg.norm(d_sigma, axis=-1) * np.linalg.norm(d_eps, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        values |= {**parts, "w2_error": error, "w2_normalised_error": np.where(size > 0.0, error / size, np.nan)}
    labels |= {name: (PARTS[name], "J/m3") for name in parts} | ERRORS
    variables["is_significant"] = (
        axes,
        (np.abs(w2) > error) & is_reached & is_slow & has_contacts,
        {
            "long_name": "second-order work beyond its error, of a probe that was reached, slow enough, and left contacts"
        },
    )
    for name, value in values.items():
        variables[name] = (axes, value, {"long_name": labels[name][0], "units": labels[name][1]})
    result = xr.Dataset(variables, coords, {"kind": kind, "sign": "compression positive"})
    if "anatomy" in null[0]:
        parts_of = [[reading["anatomy"] for reading in at_norm] for at_norm in zip(*probes, strict=True)]
        nested = xr.combine_nested(parts_of, list(axes), combine_attrs="drop").transpose(*axes, ...)
        result = result.assign({name: nested[name] for name in nested.data_vars if name not in result})
    return result.squeeze("norm") if single else result


def doubts(probes: xr.Dataset) -> list[str]:
    """Why probes may not say what slow probes between states at rest would, each with what to do."""
    count, said = probes.is_significant.size, []
    if not (before := probes.attrs.get("unbalanced_before", 0.0)) <= AT_REST:
        said.append(
            f"the specimen is not at rest: its unbalanced force is {before:.1e}; bring it to rest first, for "
            'example with rd.dem.bring_to_rest(specimen, "stress")'
        )
    if probes.attrs["kind"] == "strain" and (norm := float(np.max(probes.norm))) > LARGEST_STRAIN:
        said.append(
            f"a strain of {norm:g} is no small increment: second-order work is read from increments of about 1e-5 to 1e-3"
        )
    if "is_too_fast" in probes and (fast := int(probes.is_too_fast.sum())):
        said.append(
            f"{fast} of {count} probes were too fast, and their signs do not count: the unbalanced force on the way was "
            f"{float(probes.unbalanced_on_way.max()):.1e}, and may be {TOO_FAST:g}; probe with a smaller rate"
        )
    if probes.attrs.get("settle") and "is_settled" in probes and (moving := int((~probes.is_settled).sum())):
        said.append(
            f"{moving} of {count} probes had not come to rest after {int(probes.settling_steps.max())} steps: there is no equilibrium "
            "near, or it is reached by slow creep; their errors say what that makes"
        )
    if not bool(probes.is_reached.all()):
        missed = int((~probes.is_reached).sum())
        said.append(
            f"{missed} of {count} probes did not reach the {probes.attrs['kind']} asked for: the state cannot carry it, or the probe "
            "is too large; their signs do not count"
        )
    return said


def warn_of_doubts(probes: xr.Dataset) -> None:
    """Say the `doubts` of probes as warnings, to the caller of a public function."""
    for sentence in doubts(probes):
        warn(sentence, DoubtfulResult, stacklevel=3)


def _share_negative(work: SecondOrderWork) -> float:
    pairs = work.per_contact.work
    return float((pairs < 0.0).mean()) if len(pairs) else 0.0
