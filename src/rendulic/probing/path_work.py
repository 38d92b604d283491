"""Second-order work along a measured or computed path, and where its sign changes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.path_edges import adaptive, located, rise, turning_points
from rendulic.probing.path_fits import FEWEST, LocalFits, PathNoise, local_fits, noise_of, widths_of
from rendulic.probing.second_order_work import normalised
from rendulic.specimen.curve import COLUMNS, labelled_curve, stress_columns

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["w2_along"]

AT = ("eps_1", "p", "q", "eta")


def w2_along(curve: xr.Dataset, window: float | None = None) -> xr.Dataset:
    """Second-order work per squared axial strain along a path, and all stretches on which it is negative.

    1. About each reading, parabolas in the axial strain travelled s are fitted to stresses and strains of the nearest 5, 7,
       10, ... readings, up to half of them (the filter of Savitzky and Golay, weighted, for readings at any distance).
       `w2 = sum_i (d sigma_i / ds) (d eps_i / ds)` from their slopes. Times the square of a small axial strain it is the
       second-order work of that increment.
    2. What noise does to the fits of each width is read from their differences, for noise of any correlation: see
       `rendulic.probing.path_fits.noise_of`.
    3. At each reading the widest window is taken that agrees with all narrower ones. It flattens what bends, up to where a
       wider one would disagree; so the error told is that of half this window.
    4. The integral of W2 along the path is the conjugate stress; at constant volume, or at constant lateral stress, it is q.
       W2 changes its sign where this stress turns for good: from its largest to its smallest value, and back, by 4.5 standard
       deviations of their difference. Smaller falls are ones that noise could make.
    5. Each edge is placed by the window that knows it best.

    Parameters
    ----------
    curve : xarray.Dataset
        With `sigma_1`, `sigma_3` in Pa and `eps_1`, `eps_3` along `record`, and `sigma_2`, `eps_2` unless equal to those
        of axis 3: from `load` of any specimen, or `rd.io.read_triaxial`. The axial strain goes one way; it may pause.
    window : float, optional
        Axial strain of a window, the same everywhere, but for at least five readings. By default by the noise, as above.

    Returns
    -------
    xarray.Dataset
        Along `record`, one for each axial strain: stresses and strains as fitted, `w2` and `w2_error` in Pa, `w2_normalised`.

        Along `edge`, one for each stretch on which W2 is negative: `from_eps_1`, `to_eps_1`, and `from_error`, `to_error`, how far
        off they may be (nine times of ten). `from_eps_1` is that of the first reading, with an error of NaN, if W2 is negative from
        there; `to_eps_1` is NaN where the stretch goes on to the end.

        Along `fall`: `peak_eps_1`, `peak_q`, `minimum_eps_1`, `minimum_q` (the last reading if it goes on falling), and
        `falls_by`, of |q| beyond its noise.

        `instability_eps_1`, `instability_p`, `instability_q`, `instability_eta`: at the first edge, and
        `instability_within`, its error; NaN if there is none. Attributes: `verdict` in words; `window`, the median strain
        of a window; `is_undecided`, 1 if no stretch was found although the conjugate stress ends lower than it was.

    Raises
    ------
    InvalidInput
        If a column is missing or not finite, the axial strain rests or turns back, there are fewer than five
        different strains, or the curve is shorter than two windows.

    References
    ----------
    Savitzky, Golay (1964), Analytical Chemistry 36, 1627-1639, doi 10.1021/ac60214a047.
    Johnstone, Silverman (1997), J. R. Statist. Soc. B 59, 319-351, doi 10.1111/1467-9868.00071.

    Examples
    --------
    >>> import numpy as np
    >>> import xarray as xr
    >>> eps_1 = np.linspace(0.0, 0.1, 201)
    >>> q = 200e3 * (1.0 - (eps_1 / 0.04 - 1.0) ** 2)  # undrained, with its peak at 4 %
    >>> columns = {"eps_1": eps_1, "eps_3": -eps_1 / 2, "sigma_1": 100e3 + q, "sigma_3": 100e3 + 0 * q}
    >>> found = w2_along(xr.Dataset({name: ("record", values) for name, values in columns.items()}))
    >>> found.attrs["verdict"]
    'W2 turns negative at eps_1 = 0.04 +- 0.0006'
    """
    sigma, eps = (_axes(curve, name) for name in ("sigma", "eps"))
    steps = np.diff(eps[:, 0])
    if not (steps.any() and ((steps >= 0.0).all() or (steps <= 0.0).all())):
        raise InvalidInput("the axial strain of the curve must go one way: give the legs of a test one by one")
    s, y = _distinct(np.abs(eps[:, 0] - eps[0, 0]), np.hstack((sigma, eps)))
    if window is not None and positive_number("window", window) > 0.5 * s[-1]:
        raise InvalidInput(f"the curve must be two windows long: it goes over {s[-1]:.3g}, a window is {window:.3g}")
    fits = [local_fits(s, y, count) for count in widths_of(len(s))]
    found = _Path.of(s, y, fits)
    width = found.widths(window)
    shown = found.only(width)
    error = _picked(found.noise.w2, np.maximum(width - 2, 0)) if window is None else shown.noise.w2[0]
    found = found if window is None else shown
    value, slope = (_picked(np.stack([getattr(fit, name) for fit in fits]), width) for name in ("value", "slope"))
    fitted = stress_columns(value[:, :3, None] * np.eye(3), value[:, 3:, None] * np.eye(3))
    if curve.attrs.get("stress") == "total":
        fitted = {name: column for name, column in fitted.items() if name not in ("p", "eta")}
    sense = 1.0 if eps[-1, 0] > eps[0, 0] else -1.0
    stretches = _stretches(found.turns())
    edges = {
        "from": np.array([begin.at for begin, _end in stretches]),
        "from_error": np.array([begin.error for begin, _end in stretches]),
        "to": np.array([end.at if end else np.nan for _begin, end in stretches]),
        "to_error": np.array([end.error if end else np.nan for _begin, end in stretches]),
    }
    point: dict[str, float] = dict.fromkeys(AT, np.nan)
    if stretches:
        first = stretches[0][0]
        of_width = fits[first.width if window is None else int(np.interp(first.at, s, width))].value
        there = np.array([np.interp(first.at, s, column) for column in of_width.T])
        columns = stress_columns(np.diag(there[:3]), np.diag(there[3:]))
        point |= {name: float(columns[name]) for name in AT if name in fitted}
    for name in ("from", "to"):
        edges[name] = eps[0, 0] + sense * edges[name]
    verdict, is_undecided = _words(edges, found)
    along = {
        "w2": (np.sum(slope[:, :3] * slope[:, 3:], axis=1), "second-order work per squared axial strain", "Pa"),
        "w2_error": (error, "its standard deviation", "Pa"),
        "w2_normalised": (normalised(slope[:, :3], slope[:, 3:]), "normalised second-order work", "1"),
    }
    span = 2.0 * float(np.median(shown.reach))
    whole = labelled_curve(
        curve.attrs.get("path", "path"), fitted, window=span, verdict=verdict, is_undecided=is_undecided
    )
    return whole.assign(
        {name: ("record", values, {"long_name": label, "units": unit}) for name, (values, label, unit) in along.items()}
        | {
            column: ("edge", edges[key], {"long_name": label, "units": "1"})
            for column, key, label in (
                ("from_eps_1", "from", "axial strain where W2 turns negative"),
                ("to_eps_1", "to", "axial strain where W2 turns positive again"),
                ("from_error", "from_error", "how far off the first may be"),
                ("to_error", "to_error", "how far off the second may be"),
            )
        }
        | _falls(s, y, fits, window, eps[0, 0], sense)
        | {f"instability_{name}": ((), point[name], _labels(name)) for name in AT}
        | {
            "instability_within": (
                (), edges["from_error"][0] if len(edges["from"]) else np.nan,
                {"long_name": "uncertainty of its axial strain", "units": "1"},
            )
        }
    )  # fmt: skip


@dataclass(frozen=True)
class _Path:
    """W2 at all widths along a path, what noise does to it, and which width is taken where."""

    s: np.ndarray
    rows: np.ndarray  # (m, n) W2
    noise: PathNoise
    reach: np.ndarray  # (m, n)

    @classmethod
    def of(cls, s: np.ndarray, y: np.ndarray, fits: list[LocalFits]) -> _Path:
        return cls(s, np.stack([fit.w2 for fit in fits]), noise_of(y, fits), np.stack([fit.reach for fit in fits]))

    def only(self, width: np.ndarray) -> _Path:
        """With one width (n,) at each reading."""
        noise = PathNoise(*(_picked(part, width)[None] for part in self.noise))
        return _Path(self.s, _picked(self.rows, width)[None], noise, _picked(self.reach, width)[None])

    def widths(self, window: float | None = None) -> np.ndarray:
        """(n,) width that is taken at each reading."""
        if window is None:
            return adaptive(self.rows, self.noise.w2_detail)
        return np.abs(np.log(2.0 * self.reach / window)).argmin(axis=0)

    def turns(self) -> list[_Turn]:
        """Each lasting change of sign of W2."""
        width = self.widths()
        turns, _sense = turning_points(rise(self.s, _picked(self.rows, width)), _picked(self.noise.value, width))
        between = [0, *(at for at, _sign in turns), len(self.s) - 1]
        every = np.arange(len(self.rows))[:, None]
        found = []
        for k, (at, sign) in enumerate(turns):
            if at == 0:
                found.append(_Turn(0.0, np.nan, int(width[0]), sign))
                continue
            part = np.arange(between[k], between[k + 2] + 1)
            w2, error, noise, reach = (
                rows[every, part] for rows in (self.rows, self.noise.w2, self.noise.value_seen, self.reach)
            )
            found.append(_Turn(*located(self.s[part], w2, error, noise, reach, sign), sign))
        return found


class _Turn(NamedTuple):
    """A lasting change of sign of W2: its place in s, how far off that may be, the width that told it, 1 if it is a fall."""

    at: float
    error: float
    width: int
    sign: int


def _stretches(turns: list[_Turn]) -> list[tuple[_Turn, _Turn | None]]:
    """Where W2 turns negative, and positive again (None: it goes on to the end)."""
    begins, ends = ([turn for turn in turns if turn.sign == sign] for sign in (1, -1))
    return list(zip_longest(begins, ends))


def _picked(rows: np.ndarray, width: np.ndarray) -> np.ndarray:
    """(n, ...) of (m, n, ...), at the width that is taken at each reading."""
    return rows[width, np.arange(rows.shape[1])]


def _words(edges: dict[str, np.ndarray], path: _Path) -> tuple[str, int]:
    """What is said of the stretches, and whether nothing could be decided."""
    said = []
    for begin, begin_error, end, end_error in zip(*(edges[name] for name in edges), strict=True):
        words = f"turns negative at eps_1 = {begin:.4g} +- {begin_error:.2g}"
        if np.isnan(begin_error):
            words = "is negative from the first reading on"
        said.append(words + ("" if np.isnan(end) else f", positive again at {end:.4g} +- {end_error:.2g}"))
    if said:
        return "W2 " + "; ".join(said), 0
    width = path.widths()
    stress, noise = rise(path.s, _picked(path.rows, width)), np.sqrt(2.0) * _picked(path.noise.value, width)[-1]
    fall = float(stress.max() - stress[-1])
    if fall > 0.5 * noise:
        return (
            f"undecided: the stress that works on the axial strain ends {fall / 1e3:.2g} kPa below its largest value, and "
            "noise can make as much"
        ), 1
    return "W2 does not turn negative beyond its error", 0


def _falls(
    s: np.ndarray, y: np.ndarray, fits: list[LocalFits], window: float | None, start: float, sense: float
) -> dict[str, tuple]:
    """Peaks and minima of |q| and by how much it falls, along `fall`."""
    to_q = sense * np.array([1.0, -0.5, -0.5])

    def columns(values: np.ndarray, of_s: np.ndarray | float) -> np.ndarray:
        return np.stack((values[:, :3] @ to_q, of_s + 0.0 * values[:, 0]), axis=1)

    of_q = [replace(fit, value=columns(fit.value, s), slope=columns(fit.slope, 1.0)) for fit in fits]
    path = _Path.of(s, columns(y, s), of_q)
    width = path.widths(window)
    stretches = _stretches((path if window is None else path.only(width)).turns())

    def told(turn: _Turn | None) -> tuple[float, float]:
        """Place and |q|."""
        if turn is None:
            return float(s[-1]), float(of_q[width[-1]].value[-1, 0])
        row = turn.width if window is None else int(np.interp(turn.at, s, width))
        return turn.at, float(np.interp(turn.at, s, of_q[row].value[:, 0]))

    ends = np.array([[told(begin), told(end)] for begin, end in stretches]).reshape(-1, 2, 2)
    (peak, peak_q), (least, least_q) = ends[:, 0].T, ends[:, 1].T
    return {
        "peak_eps_1": ("fall", start + sense * peak, {"long_name": "axial strain at a peak of q", "units": "1"}),
        "peak_q": ("fall", sense * peak_q, {"long_name": "q at its peak", "units": "Pa"}),
        "minimum_eps_1": (
            "fall",
            start + sense * least,
            {"long_name": "axial strain at the minimum after it", "units": "1"},
        ),
        "minimum_q": ("fall", sense * least_q, {"long_name": "q at its minimum, or at the end", "units": "Pa"}),
        "falls_by": ("fall", peak_q - least_q, {"long_name": "fall of q", "units": "Pa"}),
    }


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


def _distinct(s: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Different strains, and the means of what was read at each.

    Raises
    ------
    InvalidInput
        If there are fewer than five.
    """
    starts = np.flatnonzero(np.append(True, np.diff(s) > 1e-12 * s[-1]))
    if len(starts) < FEWEST:
        raise InvalidInput(
            f"second-order work along a path needs at least {FEWEST} different axial strains, the curve has {len(starts)}"
        )
    counts = np.diff(np.append(starts, len(s)))
    return s[starts], np.add.reduceat(y, starts, axis=0) / counts[:, None]
