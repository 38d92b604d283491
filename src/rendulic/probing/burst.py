"""Failure shown: bursts of a specimen disturbed under a held load, beside what second-order work predicts."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.cores import workers_or_cores
from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.progress import Progress, silent
from rendulic.loading.directions import Directions, axisymmetric
from rendulic.loading.rate import rate_of, steps_to
from rendulic.probing.cone import Cone
from rendulic.probing.probe import probes_of
from rendulic.probing.second_order_work import second_order_work
from rendulic.specimen.protocol import CanBurst, Specimen
from rendulic.specimen.window import Window
from rendulic.tensors.rendulic_plane import increment_along

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["VERDICTS", "burst", "bursts", "distance_to_edge", "repeated"]

VERDICTS = ("settles", "fails", "arrested", "undecided", "too fast")
# sizes, in pushes, over which W2 must be negative for a failure that finds no equilibrium on its way
LASTS = (1.0, 2.0, 5.0, 10.0)
LEAVES = 0.5  # norms beyond the push: who went so far has lost its equilibrium, and may find another or not
SLOWER = (0.8, 0.65, 0.5)  # of the rate, at which it is then pushed again
NUMBERS = {
    "kinetic_share": ("largest kinetic energy after the push over the stored energy at rest", "1"),
    "travelled": ("largest strain along the direction, with its sign, over the norm", "1"),
    "beyond": ("strain beyond the range of the push, over the elastic strain of the state", "1"),
    "unbalanced_typical": ("median unbalanced force during the push", "1"),
    "pushes": ("pushes, at one to half the rate", "1"),
    "pushes_failed": ("pushes that failed", "1"),
    "steps_held": ("steps for which the load was held", "1"),
    "balance_error": ("error of the energy balance, relative to the largest term", "1"),
    "equation_1_residual": ("largest error of Eq. 1 over single steps, relative to the largest term", "1"),
}


def burst(
    specimen: Specimen,
    alpha,
    norm: float = 5e-5,
    *,
    rate: float | None = None,
    hold_steps: int | None = None,
    repeat: bool = True,
    n_steps: int | None = None,
    **options: Any,
) -> xr.Dataset:
    """Disturb a state under the load conjugate to a direction, and see whether it settles or fails.

    The specimen itself is left as it was. Grains: a push or a kick, then free motion under the held load until it has
    come to rest or has run away; see `dem.Assembly.burst` for the options. A material point: a small increase of the load; see
    `chang_hicher.drive.controllability.burst`.

    Parameters
    ----------
    specimen : Specimen
        At rest.
    alpha : float or (3,) array
        Direction of strain: degrees in the Rendulic plane, or principal strains of any length.
    norm : float
        Size of the disturbance, as for `rd.probe`.
    rate : float, optional
        Strain of the push per time step, for specimens with inertia; by default 1e-8, the rate of probes.
    hold_steps : int, optional
        Steps after which an undecided motion is given up, by default 200 000. A larger limit can decide what a smaller one left
        open; it does not change a verdict.
    repeat : bool
        Whether grains that left the range of the push by more than half of it are pushed again, at 0.8, 0.65 and 0.5 times the rate. They
        have lost their equilibrium, and where the next one is not far it is chance whether that catches them. So they fail only
        if all pushes fail; if some do, the verdict is "undecided". Where grains stayed, one push is enough.
    n_steps : int, optional
        Will no longer be read: use `rate`.

    Returns
    -------
    xarray.Dataset
        The curve of the first push, with `verdict` (one of `VERDICTS`) in its attributes, that of all pushes, of which there were
        `pushes`, and `alpha` and `ratio`
        (R of `d_eps_1 + 2 R d_eps_3 = 0`) for directions of the Rendulic plane. For grains also Eq. 1 of the paper over one step at
        each record: `d_kinetic` against `first_order + (b2 - w2) / 2`, where `first_order` is the work of the resultants on
        the grains at the beginning, which vanishes at rest.

    Raises
    ------
    InvalidInput
        If the specimen cannot be left to itself, or a value is out of range.
    """
    if not isinstance(specimen, CanBurst):
        raise InvalidInput(f"a burst needs a specimen with a method 'burst', as grains have: {specimen!r} has none")
    direction = finite_array("alpha", alpha, () if np.ndim(alpha) == 0 else (3,))
    if direction.ndim and not np.linalg.norm(direction) > 0.0:
        raise InvalidInput("the direction of a burst must not be zero")
    u = direction / np.linalg.norm(direction) if direction.ndim else increment_along(float(direction), 1.0)
    norm = positive_number("norm", norm)
    rate = rate_of(rate, n_steps, np.array([norm]))
    if hold_steps is not None:
        options["hold_steps"] = hold_steps
    windows: list[tuple[float, float, float, float]] = []

    def on_window(window: Window) -> None:
        work = second_order_work(window.before, window.after)
        n, volume = window.before.n_grains, window.before.volume
        moved = window.after.position - window.before.position
        first = float((window.before.resultant[:n] * moved).sum())
        windows.append((window.kinetic, first, work.boundary * volume, work.contacts * volume))

    def push(share: float = 1.0, watch: Callable[[Window], None] | None = None) -> xr.Dataset:
        own = specimen.clone()
        assert isinstance(own, CanBurst)  # as the specimen that it is a clone of
        return own.burst(u, norm, steps_to(norm, share * rate), on_window=watch, **options)

    curve = push(watch=on_window)
    if windows:
        curve.attrs["rate"] = rate
        _add_equation_1(curve, np.array([(np.nan,) * 4, *windows]))
        curve.attrs |= repeated(curve, push) if repeat else {}
    if not direction.ndim:
        with np.errstate(divide="ignore"):
            curve.attrs |= {"alpha": float(direction), "ratio": float(np.divide(-u[0], 2.0 * u[2]))}
    return curve


def repeated(curve: xr.Dataset, push: Callable[[float], xr.Dataset]) -> dict[str, Any]:
    """The verdict of several pushes, where one alone may be chance, as attributes."""
    first = curve.attrs
    left = first["beyond"] * first["elastic_strain"] > LEAVES * first["norm"]
    if first["disturbance"] != "push" or first["verdict"] not in ("fails", "settles", "arrested") or not left:
        return {"pushes": 1, "pushes_failed": int(first["verdict"] == "fails")}
    found = [first["verdict"]]
    for share in SLOWER:
        found.append(push(share).attrs["verdict"])
        if (found[-1] == "fails") != (found[0] == "fails"):
            break
    failed = found.count("fails")
    counts = {"pushes": len(found), "pushes_failed": failed}
    if failed == len(found):
        return counts
    if failed or "undecided" in found:
        return {"verdict": "undecided", **counts}
    return {"verdict": "arrested" if "arrested" in found else "settles", **counts}


def _add_equation_1(curve: xr.Dataset, columns: np.ndarray) -> None:
    """The terms of Eq. 1 in one step at each record, and the largest residual of the hold, in place."""
    named = {
        "d_kinetic": "change of kinetic energy (translation, damping added back) in one step",
        "first_order": "work of the resultants at its beginning",
        "b2": "second-order work of the walls in it",
        "w2": "second-order work of the contacts in it",
    }
    for (name, label), values in zip(named.items(), columns.T, strict=True):
        curve[name] = ("record", values, {"long_name": label, "units": "J"})
    error = columns[:, 0] - columns[:, 1] - 0.5 * (columns[:, 2] - columns[:, 3])
    curve.attrs["equation_1_residual"] = float(np.nanmax(np.abs(error)) / np.nanmax(np.abs(columns)))


def bursts(
    specimen: Specimen,
    directions: Directions,
    norm: float = 5e-5,
    *,
    rate: float | None = None,
    hold_steps: int | None = None,
    n_steps: int | None = None,
    cone: Cone | None = None,
    workers: int | None = None,
    progress: Progress = silent,
    on_burst: Callable[[float, xr.Dataset], None] | None = None,
    **options: Any,
) -> xr.Dataset:
    """Predicted against observed failure, direction by direction; the specimen is left as it was.

    Prediction: failure where the second-order work of strain probes (`rd.probe`) is negative at the size of the push
    and stays so up to ten times that size, as far as a specimen must run to have failed. Where it is negative only
    at first, as grains in one avalanche show it, an equilibrium waits on the way. Observation: the verdict of a
    burst in that direction.

    Parameters
    ----------
    directions : Directions
        In the Rendulic plane, e.g. `rd.directions.rendulic(step=10)`.
    rate : float, optional
        Strain per time step of probes and pushes; see `burst`, also for `hold_steps` and `n_steps`.
    cone : Cone, optional
        Of this state, norm and rate (`rd.instability_cone`): its edges are those that `to_edge` is measured from.
    on_burst : callable, optional
        Called with alpha and the curve of each burst.
    options
        For the burst of this kind of specimen.

    Returns
    -------
    xarray.Dataset
        Dimension `alpha`: `w2_normalised`, also of the opposite direction, and `..._lasting`, its largest value on the way,
        `w2_drift`; `predicted` failure, and whether the sign that predicts `is_sure`; `verdict`, index into `VERDICTS`, and `observed`
        failure; `to_edge`, degrees to the nearest edge of a cone (if none is given, interpolated between the probes);
        `ratio` R, and of grains what `dem.Assembly.burst` says of the motion. `rd.agreement` counts.
    """
    if not isinstance(directions, Directions):
        raise InvalidInput(
            f"a table of bursts needs directions of the Rendulic plane, rd.directions.rendulic(...), not {directions!r}"
        )
    norm = positive_number("norm", norm)
    rate = rate_of(rate, n_steps, np.array([norm]))
    workers = workers_or_cores(workers)
    count, followed, lock = 2 * len(directions), 0, Lock()

    def on_probe(done: float, total: float, note: str = "") -> None:
        progress(done / total * count / 2, count, note)

    around = np.array(directions.alpha)
    both = np.unique(np.concatenate((around, (around + 180.0) % 360.0)))
    probed = probes_of(specimen, axisymmetric(both), norm, rate=rate, workers=workers, progress=on_probe)
    opposite = probed.w2_normalised.sel(alpha=(around + 180.0) % 360.0).values
    probed = probed.sel(alpha=around)
    lasting, is_sure = _lasting(specimen, probed, norm, rate, workers)

    def follow(alpha: float) -> xr.Dataset:
        nonlocal followed
        curve = burst(specimen, alpha, norm, rate=rate, hold_steps=hold_steps, **options)
        with lock:
            followed += 1
            progress(
                count // 2 + followed, count, f"burst {followed} of {count // 2}: {alpha:g} degrees {curve.verdict}"
            )
        return curve

    with ThreadPoolExecutor(max_workers=workers) as pool:
        curves = list(pool.map(follow, directions.alpha))
    if on_burst is not None:
        for alpha, curve in zip(directions.alpha, curves, strict=True):
            on_burst(alpha, curve)
    w2n = probed.w2_normalised.values
    if cone is None:
        to_edge = distance_to_edge(around, w2n)
    else:
        to_edge = _nearest(around, np.ravel([] if cone.opening >= 360.0 else cone.sectors))
    verdict = np.array([VERDICTS.index(curve.attrs["verdict"]) for curve in curves])
    columns: dict[str, tuple[np.ndarray, str, str]] = {
        "w2_normalised_opposite": (opposite, "normalised second-order work of the opposite direction", "1"),
        "w2_normalised_lasting": (
            lasting,
            f"largest from the size of the push to {LASTS[-1]:g} times it, if negative there",
            "1",
        ),
        "predicted": (lasting < 0.0, "second-order work negative over that range", "1"),
        "is_sure": (is_sure, "sign that predicts beyond its error", "1"),
        "observed": (verdict == VERDICTS.index("fails"), "failure observed", "1"),
        "verdict": (verdict, f"index into {', '.join(VERDICTS)}", "1"),
        "to_edge": (to_edge, "angle to the nearest edge of a cone", "degree"),
        "ratio": (np.array([curve.attrs["ratio"] for curve in curves]), "R of d_eps_1 + 2 R d_eps_3 = 0", "1"),
    }
    for name, (label, unit) in NUMBERS.items():
        if all(name in curve.attrs for curve in curves):
            columns[name] = (np.array([curve.attrs[name] for curve in curves]), label, unit)
    table = probed[["w2_normalised", "w2_drift", "is_significant"]].copy()
    for name, (values, label, unit) in columns.items():
        table[name] = ("alpha", values, {"long_name": label, "units": unit})
    return table.assign_attrs(norm=norm, rate=rate)


def _lasting(
    specimen: Specimen, probed: xr.Dataset, norm: float, rate: float, workers: int
) -> tuple[np.ndarray, np.ndarray]:
    """The largest W2n of each direction over the sizes `LASTS`, where it is positive at the first that value; is its sign sure?

    NaN where one of them is not known.
    """
    largest, is_sure = probed.w2_normalised.values.copy(), probed.is_significant.values.copy()
    negative = np.flatnonzero(largest < 0.0)
    if len(negative):
        further = axisymmetric(probed.alpha.values[negative])
        sizes = [norm * share for share in LASTS]
        followed = probes_of(specimen, further, sizes, rate=rate, workers=workers).transpose("norm", "alpha", ...)
        w2n = followed.w2_normalised.values
        w2n[0] = np.maximum(w2n[0], largest[negative])
        largest[negative] = w2n.max(axis=0)
        deciding = np.where(np.isnan(w2n), np.inf, w2n).argmax(axis=0)
        is_sure[negative] = followed.is_significant.values[deciding, np.arange(len(negative))]
    return largest, is_sure & np.isfinite(largest)


def distance_to_edge(alpha: np.ndarray, w2n: np.ndarray) -> np.ndarray:
    """Degrees from each direction to the nearest change of sign of W2n around the circle; infinite without any.

    >>> distance_to_edge(np.array([0.0, 90.0, 180.0, 270.0]), np.array([1.0, -1.0, 1.0, 1.0])).tolist()
    [45.0, 45.0, 45.0, 135.0]
    """
    order = np.argsort(alpha)
    angle, value = alpha[order], w2n[order]
    after, gap = np.roll(value, -1), (np.roll(angle, -1) - angle) % 360.0
    crosses = (value < 0.0) != (after < 0.0)
    edges = (angle + gap * value / np.where(crosses, value - after, 1.0))[crosses]
    return _nearest(alpha, edges)


def _nearest(alpha: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Degrees to the nearest of some directions; infinite if there are none."""
    if not len(edges):
        return np.full(len(alpha), np.inf)
    apart = np.abs((alpha[:, None] - edges + 180.0) % 360.0 - 180.0)
    return apart.min(axis=1)
