"""`rd.probe` asks nothing of a specimen but the protocol: here a linear elastic solid in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.specimen.state import State

LAME, SHEAR = 40e6, 30e6
STIFFNESS = LAME * np.ones((3, 3)) + 2 * SHEAR * np.eye(3)


class Solid:
    """Isotropic linear elasticity in principal axes."""

    def __init__(self, eps):
        self.eps = np.array(eps, dtype=float)

    @property
    def strain(self):
        return np.diag(self.eps)

    @property
    def stress(self):
        return np.diag(STIFFNESS @ self.eps)

    def load(self, path, **options):
        raise AssertionError("a probe never follows a path")

    def probe(self, increment, n_steps, *, kind="strain", marks=(1.0,), on_mark=None):
        whole = np.asarray(increment) if kind == "strain" else np.linalg.solve(STIFFNESS, increment)
        start = self.eps.copy()
        for mark in marks:
            self.eps = start + mark * whole
            on_mark(mark)

    def save(self):
        return State("Solid", {"eps": self.eps.copy()}, {})

    def restore(self, state):
        self.eps = state.arrays["eps"].copy()

    def clone(self):
        return Solid(self.eps)


@pytest.mark.parametrize("kind", ["strain", "stress"])
def test_second_order_work_is_the_quadratic_form(kind):
    """`d_sigma : d_eps` is the stiffness's (or compliance's) form in every direction and at every norm; no cone."""
    solid = Solid([1e-3, 2e-4, 0.0])
    norms = [1e-6, 1e-4] if kind == "strain" else [1e2, 1e4]
    around = rd.directions.rendulic(step=15)
    probes = rd.probe(solid, around, norm=norms, n_steps=3, kind=kind)
    form = STIFFNESS if kind == "strain" else np.linalg.inv(STIFFNESS)
    for norm in norms:
        asked = around.increments(norm)
        expected = np.einsum("ai,ij,aj->a", asked, form, asked)
        # increments are differences of strains of 1e-3: ten digits are left of an increment of 1e-6
        assert_allclose(probes.w2_macro.sel(norm=norm), expected, rtol=1e-9)
    assert probes.is_reached.all()
    assert probes.is_significant.all()
    assert (probes.w2_normalised > 0).all()
    assert_allclose(
        probes.w2_normalised.sel(alpha=30, norm=norms[0]), probes.w2_normalised.sel(alpha=210, norm=norms[1]), rtol=1e-9
    )
    assert_allclose(solid.eps, [1e-3, 2e-4, 0.0], rtol=0)
    assert "w2_contacts" not in probes
