"""`rd.probe` asks nothing of a specimen but the protocol: here a linear elastic solid in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from fakes import of_matrix

LAME, SHEAR = 40e6, 30e6
STIFFNESS = LAME * np.ones((3, 3)) + 2 * SHEAR * np.eye(3)


@pytest.mark.parametrize("kind", ["strain", "stress"])
def test_second_order_work_is_the_quadratic_form(kind):
    """`d_sigma : d_eps` is the stiffness's (or compliance's) form in every direction and at every norm; no cone."""
    start = np.array([1e-3, 2e-4, 0.0])
    solid = of_matrix(STIFFNESS, eps=start, sigma=STIFFNESS @ start)
    norms = [1e-6, 1e-4] if kind == "strain" else [1e2, 1e4]
    around = rd.directions.rendulic(step=15)
    probes = rd.probe(solid, around, norm=norms, kind=kind)
    form = STIFFNESS if kind == "strain" else np.linalg.inv(STIFFNESS)
    for norm in norms:
        asked = around.increments(norm)
        expected = np.einsum("ai,ij,aj->a", asked, form, asked)
        # increments are differences of strains of 1e-3, rounded by 2e-19: 2e-13 of an increment of 1e-6, and of its answer
        assert_allclose(probes.w2_macro.sel(norm=norm), expected, rtol=4e-12)
    assert probes.is_reached.all()
    assert probes.is_significant.all()
    assert (probes.w2_normalised > 0).all()
    assert_allclose(
        probes.w2_normalised.sel(alpha=30, norm=norms[0]),
        probes.w2_normalised.sel(alpha=210, norm=norms[1]),
        rtol=4e-12,
    )
    np.testing.assert_array_equal(solid.eps, start)
    assert "w2_contacts" not in probes
