"""Second-order work along a measured or computed path, and where it turns negative."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.second_order_work import normalised
from rendulic.specimen.curve import COLUMNS, labelled_curve, stress_columns

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["w2_along"]

WINDOW = 0.005  # of axial strain, the narrowest by default
LONGEST = 0.25  # share of the curve, for a window by default
PRECISE = 0.1  # of the usual W2: its error at which a window is wide enough
FEWEST = 7  # axial strains in a window: a parabola, and what tells how well it fits
CERTAIN = 3.0  # standard deviations by which W2 is negative
AT = ("eps_1", "p", "q", "eta")


def w2_along(curve: xr.Dataset, window: float | None = None) -> xr.Dataset:
    """Second-order work per squared axial strain along a path, and where instability becomes possible.

    1. About each record, parabolas in the axial strain travelled s are fitted to stresses and strains of all records
       within half a window on either side (the filter of Savitzky and Golay, for records at any distance).
    2. `w2 = sum_i (d sigma_i / ds) (d eps_i / ds)` from their slopes. Times the square of a small axial strain it is
       the second-order work of that increment.
    3. `w2_error`, one standard deviation, follows from the scatter about the parabolas, taken as independent from record
       to record.
    4. Instability is possible from where `w2` first turns negative and stays so for a window, on which it is somewhere
       below `-3 w2_error`. Undrained, that is the peak of q. It is known to half a window, or to where `w2` was last above
       `3 w2_error` and is first below `-3 w2_error`, if that is wider.

    Parameters
    ----------
    curve : xarray.Dataset
        With `sigma_1`, `sigma_3` in Pa and `eps_1`, `eps_3` along `record`, and `sigma_2`, `eps_2` unless equal to those
        of axis 3: from `load` of any specimen, or `rd.io.read_triaxial`. The axial strain goes one way; it may pause.
    window : float, optional
        Axial strain of a window. By default the narrowest of 0.005 (or more, where seven different strains need more),
        0.01, 0.02, ..., a quarter of the curve, whose `w2_error` is below a tenth of `w2` (medians of both). Wider
        windows divide noise by about `window^1.5`, and flatten what bends within them.

    Returns
    -------
    xarray.Dataset
        Of the records about which a whole window fits: stresses and strains as fitted, `w2` and `w2_error` in Pa,
        `w2_normalised`. `instability_eps_1`, `instability_p`, `instability_q`, `instability_eta`: interpolated at the
        change of sign (at the first record if `w2` is negative from there), and `instability_within`, how far off in axial
        strain it may be; NaN if there is none.
        Attributes `window` and `verdict`.

    Raises
    ------
    InvalidInput
        If a column is missing or not finite, the axial strain rests or turns back, a window holds fewer than seven
        different strains, or the curve is shorter than two windows.

    References
    ----------
    Savitzky, Golay (1964), Analytical Chemistry 36, 1627-1639, doi 10.1021/ac60214a047.

    Examples
    --------
    >>> import numpy as np
    >>> import xarray as xr
    >>> eps_1 = np.linspace(0.0, 0.1, 201)
    >>> q = 200e3 * (1.0 - (eps_1 / 0.04 - 1.0) ** 2)  # undrained, with its peak at 4 %
    >>> columns = {"eps_1": eps_1, "eps_3": -eps_1 / 2, "sigma_1": 100e3 + q, "sigma_3": 100e3 + 0 * q}
    >>> found = w2_along(xr.Dataset({name: ("record", values) for name, values in columns.items()}))
    >>> found.attrs["verdict"]
    'W2 turns negative at eps_1 = 0.04 +- 0.0025'
    """
    sigma, eps = (_axes(curve, name) for name in ("sigma", "eps"))
    steps = np.diff(eps[:, 0])
    if not (steps.any() and ((steps >= 0.0).all() or (steps <= 0.0).all())):
        raise InvalidInput("the axial strain of the curve must go one way: give the legs of a test one by one")
    s = np.abs(eps[:, 0] - eps[0, 0])
    for width in _windows(s, window):
        middle, value, d_sigma, d_eps, error = _smoothed(s, np.hstack((sigma, eps)), width)
        w2 = (d_sigma * d_eps).sum(axis=1)
        if np.median(error) <= PRECISE * np.median(np.abs(w2)):
            break
    fitted = stress_columns(value[:, :3, None] * np.eye(3), value[:, 3:, None] * np.eye(3))
    at, within, verdict = _instability(s[middle], w2, error, width)
    point = {name: at @ fitted[name] if at.any() else np.nan for name in AT}
    if at.any():
        verdict += f" at eps_1 = {point['eps_1']:.4g} +- {within:.2g}"
    along = {
        "w2": (w2, "second-order work per squared axial strain", "Pa"),
        "w2_error": (error, "its standard deviation", "Pa"),
        "w2_normalised": (normalised(d_sigma, d_eps), "normalised second-order work", "1"),
    }
    found = labelled_curve(curve.attrs.get("path", "path"), fitted, window=width, verdict=verdict)
    return found.assign(
        {name: ("record", values, {"long_name": label, "units": unit}) for name, (values, label, unit) in along.items()}
        | {f"instability_{name}": ((), point[name], _labels(name)) for name in AT}
        | {"instability_within": ((), within, {"long_name": "uncertainty of its axial strain", "units": "1"})}
    )


def _labels(name: str) -> dict[str, str]:
    return {"long_name": f"{COLUMNS[name][0]} where W2 turns negative", "units": COLUMNS[name][1]}


def _axes(curve: xr.Dataset, name: str) -> np.ndarray:
    """(n, 3) principal stresses or strains; axis 2 as axis 3 where it is not told."""
    columns = [f"{name}_{k}" if f"{name}_{k}" in curve else f"{name}_3" for k in (1, 2, 3)]
    missing = [column for column in (f"{name}_1", f"{name}_3") if column not in curve]
    if missing:
        raise InvalidInput(
            f"second-order work along a path needs sigma_1, sigma_3, eps_1, eps_3; the curve lacks {missing[0]}"
        )
    return np.stack([finite_array(f"{column} of the curve", curve[column], (None,)) for column in columns], axis=1)


def _windows(s: np.ndarray, window: float | None) -> list[float]:
    """The window asked for, or those to try, the narrowest first: with enough records and two of them in the curve."""
    strains = np.unique(s)
    reach = FEWEST // 2
    narrowest = 2.000001 * float((strains[reach:] - strains[:-reach]).max()) if len(strains) > reach else np.inf
    first = max(WINDOW, narrowest) if window is None else positive_number("window", window)
    if first < narrowest and narrowest <= 0.5 * s[-1]:
        raise InvalidInput(
            f"a window must hold {FEWEST} different axial strains everywhere: one of {first:g} does not; give at least "
            f"{1.001 * narrowest:.4g}"
        )
    if max(first, narrowest) > 0.5 * s[-1]:
        raise InvalidInput(
            f"the curve must be two windows long: its {len(strains)} different axial strains go over {s[-1]:.3g}, a window "
            f"needs {max(first, narrowest):.3g}"
        )
    wider = [] if window is not None else [first * 2**k for k in range(1, 30) if first * 2**k <= LONGEST * s[-1]]
    return [first, *wider]


def _smoothed(s: np.ndarray, y: np.ndarray, window: float) -> tuple[np.ndarray, ...]:
    """Records about which a window fits; their values, slopes of stress and strain, and the error of the product."""
    half = 0.5 * window
    middle = np.flatnonzero((s >= half) & (s <= s[-1] - half))
    low, high = np.searchsorted(s, s[middle] - half, "left"), np.searchsorted(s, s[middle] + half, "right")
    fits = [_fit((s[a:b] - s[k]) / half, y[a:b]) for k, a, b in zip(middle, low, high, strict=True)]
    value, slope, error = (np.array(part) for part in zip(*fits, strict=True))
    return middle, value, slope[:, :3] / half, slope[:, 3:] / half, error / half**2


def _fit(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Values and slopes at t = 0 of parabolas through stresses and strains y (n, 6), and the error of their product."""
    basis = np.stack((np.ones_like(t), t, t**2), axis=1)
    coefficients = np.linalg.lstsq(basis, y, rcond=None)[0]
    slope = coefficients[1]
    # W2 changes by this combination of errors in stress and strain, whether or not they are correlated
    rest = (y - basis @ coefficients) @ np.concatenate((slope[3:], slope[:3]))
    variance = np.linalg.inv(basis.T @ basis)[1, 1] * (rest @ rest) / (len(t) - 3)
    return coefficients[0], slope, float(np.sqrt(variance))


def _instability(s: np.ndarray, w2: np.ndarray, error: np.ndarray, window: float) -> tuple[np.ndarray, float, str]:
    """Weights of the records at the first lasting change of sign (all zero: none), how sure it is, what is said of it."""
    weights = np.zeros(len(w2))
    last = s[-1] - window * (1.0 - 1e-9)
    for k in np.flatnonzero((w2 < 0.0) & (np.concatenate(([0.0], w2[:-1])) >= 0.0) & (s <= last)):
        on = slice(k, int(np.searchsorted(s, s[k] + window, "right")))
        if (w2[on] < 0.0).all() and (w2[on] < -CERTAIN * error[on]).any():
            share = w2[k - 1] / (w2[k - 1] - w2[k]) if k else 1.0
            weights[k - 1 : k + 1] = (1.0 - share, share) if k else (1.0,)
            positive = np.flatnonzero(w2[:k] > CERTAIN * error[:k])
            since = s[positive[-1]] if len(positive) else s[0]
            until = s[k + int(np.argmax(w2[k:] < -CERTAIN * error[k:]))]
            within = max(0.5 * window, float(weights @ s - since), float(until - weights @ s))
            return weights, within, "W2 turns negative" if k else "W2 is negative from the first window on,"
    return weights, float("nan"), "W2 does not turn negative for a whole window and beyond its error"
