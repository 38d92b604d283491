"""How often noise makes a hardening test unstable, and hides a peak: `python benchmarks/laboratory_noise.py [TRIALS]`.

Noise of standard deviation up to 3 % of the largest q, correlated over 1 to 50 readings (autoregressive, moving averages), on
records of 100 to 1 200 readings. Hardening curves rise to the last reading, the flattest by less than a thousandth over its
last half. Those with a peak fall by 20 % and stay there.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr
from scipy.signal import lfilter

import rendulic as rd

LENGTHS = (100, 200, 400, 800, 1200)
CORRELATIONS = (1, 2, 5, 10, 20, 35, 50)  # readings
STRAIN = 0.15
LARGEST = 300e3  # Pa
HARDENING = {
    "hyperbola": lambda e: e / (0.02 + e),
    "slow hyperbola": lambda e: e / (0.1 + e),
    "exponential": lambda e: 1.0 - np.exp(-e / 0.05),
    "nearly level": lambda e: 1.0 - np.exp(-e / 0.02) + 0.01 * e,
    "towards a line": lambda e: 2.0 * e + e / (0.05 + e),
}


def peaked(at: float, fall: float, over: float):
    """A parabola up to its peak, then a fall by a share that settles over a strain."""

    def curve(e: np.ndarray) -> np.ndarray:
        u = e / at
        after = 1.0 - fall + fall * np.exp(-0.5 * ((e - at) / over) ** 2)
        return np.where(u < 1.0, 2.0 * u - u * u, after)

    return curve


def peaks(fall: float) -> dict:
    """Early, in the middle and late."""
    return {"early": peaked(0.012, fall, 0.02), "middle": peaked(0.05, fall, 0.04), "late": peaked(0.1, fall, 0.02)}


def noise(draw: np.random.Generator, n: int, readings: int, kind: str) -> np.ndarray:
    """(n,) of standard deviation 1, correlated over so many readings."""
    if readings <= 1:
        return draw.normal(size=n)
    if kind == "moving average":
        return np.convolve(draw.normal(size=n + readings - 1), np.full(readings, readings**-0.5), "valid")
    keeps = np.exp(-1.0 / readings)
    begin = 10 * readings
    return lfilter([np.sqrt(1.0 - keeps**2)], [1.0, -keeps], draw.normal(size=n + begin))[begin:]


def trial(
    draw: np.random.Generator, curves: dict, drained: bool, level: float | None = None
) -> tuple[dict, xr.Dataset]:
    """One noisy record, and what is found in it; the standard deviation is `level`, or 0.1 to 3 % of the largest q."""
    n, readings = int(draw.choice(LENGTHS)), int(draw.choice(CORRELATIONS))
    kind, name = str(draw.choice(["autoregressive", "moving average"])), str(draw.choice(list(curves)))
    size = np.exp(draw.uniform(np.log(0.001), np.log(0.03))) if level is None else level
    e = np.linspace(0.0, STRAIN, n)
    shape = curves[name](e)
    q = LARGEST * (shape / shape.max() + size * noise(draw, n, readings, kind))
    columns = {"eps_1": e, "eps_3": -0.5 * e * (0.6 if drained else 1.0), "sigma_1": 1e5 + q, "sigma_3": 1e5 + 0.0 * q}
    if not drained:
        pressure = 2e4 * size * noise(draw, n, readings, kind)
        columns |= {"sigma_1": columns["sigma_1"] - pressure, "sigma_3": columns["sigma_3"] - pressure}
    about = {"curve": name, "readings": n, "correlated over": readings, "kind": kind, "level": float(size)}
    return about, rd.w2_along(xr.Dataset({key: ("record", values) for key, values in columns.items()}))


def main(trials: int = 300) -> None:
    """Shares of false alarms and of peaks found, by what was drawn."""
    draw = np.random.default_rng(0)
    false = [
        about for k in range(trials) for about, found in [trial(draw, HARDENING, k % 2 == 0)] if found.sizes["edge"]
    ]
    print(
        f"hardening: {len(false)} of {trials} said to turn negative ({100 * len(false) / trials:.1f} %)",
        *false,
        sep="\n  ",
    )
    print("share of peaks found (a tenth of the trials each); the last column: places within the error told")
    print("fall    noise 0.3 %    1 %    3 %    placed")
    for fall in (0.05, 0.1, 0.2):
        shares, within = [], []
        for level in (0.003, 0.01, 0.03):
            seen = 0
            for k in range(trials // 10):
                about, found = trial(draw, peaks(fall), k % 2 == 0, level)
                seen += found.sizes["edge"] > 0
                if found.sizes["edge"]:
                    true = {"early": 0.012, "middle": 0.05, "late": 0.1}[about["curve"]]
                    off = np.abs(found.from_eps_1 - true)
                    within.append(bool((off <= found.from_error).any()))
            shares.append(seen / (trials // 10))
        print(
            f"{100 * fall:3.0f} %   "
            + "".join(f"{100 * share:8.0f} %" for share in shares)
            + f"{100 * np.mean(within):8.0f} %"
        )


if __name__ == "__main__":
    main(*(int(value) for value in sys.argv[1:2]))
