"""Probes of specimens that are drawn from a known law, so that their mean response has a closed form."""

from __future__ import annotations

import numpy as np
import xarray as xr

import rendulic as rd
from rendulic.probing.second_order_work import normalised

UNIT = 1e8  # Pa, a stiffness
ALPHA = np.arange(0.0, 360.0, 10.0)
COLLAPSE_AT, WIDTH = 125.0, 30.0  # degrees


def around(alpha=ALPHA):
    """(n, 3) unit increments."""
    return rd.directions.axisymmetric(alpha).increments(1.0)


def bump(alpha):
    """How much of a collapse a direction meets: 1 in the middle, 0 beyond its half width."""
    off = np.abs((np.asarray(alpha) - COLLAPSE_AT + 180.0) % 360.0 - 180.0)
    return np.where(off < WIDTH, np.cos(0.5 * np.pi * off / WIDTH) ** 2, 0.0)


class Gaussian:
    """An isotropic tangent plus one whose entries vary; the mean is the tangent `mean`."""

    spread = 0.35

    def __init__(self, stiffness=0.05):
        # stiff along the isotropic axis, weak or negative across it
        iso = np.ones((3, 3)) / 3.0
        self.mean = UNIT * (iso + stiffness * (np.eye(3) - iso))

    def responses(self, generator, alpha=ALPHA):
        own = self.mean + self.spread * UNIT * generator.normal(size=(3, 3)) / 3.0
        return around(alpha) @ own.T

    def mean_response(self, alpha):
        return around(alpha) @ self.mean.T


class RareCollapses:
    """An elastic tangent; a share of the specimens collapses in a sector, by a size of its own (lognormal)."""

    share, typical, spread = 0.3, 1.1, 0.6

    def __init__(self):
        iso = np.ones((3, 3)) / 3.0
        self.elastic = UNIT * (iso + 0.5 * (np.eye(3) - iso))

    def responses(self, generator, alpha=ALPHA):
        unit = around(alpha)
        stiff = 1.0 + 0.1 * generator.normal()
        size = self.typical * np.exp(self.spread * generator.normal()) * (generator.random() < self.share)
        return stiff * unit @ self.elastic.T - UNIT * size * bump(alpha)[:, None] * unit

    def mean_response(self, alpha):
        unit = around(alpha)
        mean = self.share * self.typical * np.exp(0.5 * self.spread**2)
        return unit @ self.elastic.T - UNIT * mean * bump(alpha)[:, None] * unit


def probes_of(d_sigma, alpha=ALPHA, norm=1e-4, **more):
    """As `rd.probe` returns them, without drift unless given."""
    unit = around(alpha)
    d_eps, d_sigma = norm * unit, norm * np.asarray(d_sigma)
    work = (d_sigma * d_eps).sum(axis=1)
    values = {
        "w2_macro": work, "w2_normalised": normalised(d_sigma, d_eps), "w2_drift": np.zeros(len(alpha)),
        "is_significant": np.ones(len(alpha), dtype=bool), "is_reached": np.ones(len(alpha), dtype=bool),
    } | more  # fmt: skip
    return xr.Dataset(
        {
            "d_eps": (("alpha", "component"), d_eps), "d_sigma": (("alpha", "component"), d_sigma),
            **{name: ("alpha", value) for name, value in values.items()},
        },
        {"alpha": alpha, "norm": norm, "component": [1, 2, 3]},
        {"kind": "strain"},
    )  # fmt: skip


def specimens(law, count, seed, alpha=ALPHA):
    """Probes of some specimens of a law."""
    generator = np.random.default_rng(seed)
    return [probes_of(law.responses(generator, alpha), alpha) for _ in range(count)]
