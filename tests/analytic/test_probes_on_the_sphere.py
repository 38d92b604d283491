"""Probes in all principal directions: the quadratic form of the tangent, and what of the sphere is unstable."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rendulic as rd
from rendulic.chang_hicher import tangent
from rendulic.foundation.errors import InvalidInput
from rendulic.tensors.increment_sphere import DEVIATORIC_AXES, equal_area


@pytest.fixture(scope="module")
def near_failure():
    """Loose Hostun sand on a drained path, at q/p = 1."""
    point = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
    point.load(rd.paths.drained_triaxial(until_strain=0.3, until_eta=1.0))
    return point


def test_the_work_is_the_tangents(near_failure):
    """Every direction has a tangent of its own, and W2 is its quadratic form; some directions are unstable."""
    around = rd.directions.sphere(60)
    probes = rd.probe(near_failure, around, norm=1e-8)
    # 1e-8 of strain is 1e-5 of that of the stress, by which the state changes under the probe
    for k, unit in enumerate(around.unit):
        stiffness = tangent(near_failure, unit).stiffness
        stress = stiffness @ np.array([*unit, 0.0, 0.0, 0.0])
        expected = stress[:3] @ unit / np.linalg.norm(stress[:3])
        assert float(probes.w2_normalised[k]) == pytest.approx(expected, abs=1e-5)
    assert (probes.w2_normalised < 0.0).any()
    assert (probes.w2_normalised > 0.9).any()


def test_an_elastic_material_has_no_unstable_direction():
    """Isotropic elasticity in closed form: W2 = lambda (tr)^2 + 2 G |d_eps|^2 in all directions."""
    point = rd.ChangHicher(k_pR=1e9).at(pressure=100e3, void_ratio=0.8)
    around = rd.directions.sphere(50)
    probes = rd.probe(point, around, norm=1e-8)
    uniaxial = tangent(point, [1.0, 0.0, 0.0]).stiffness
    first, shear = uniaxial[0, 1], 0.5 * (uniaxial[0, 0] - uniaxial[0, 1])
    expected = 1e-16 * (first * around.unit.sum(axis=1) ** 2 + 2.0 * shear)
    assert_allclose(probes.w2_macro, expected, rtol=1e-5)
    assert (probes.w2_normalised > 0.0).all()


def test_the_rendulic_plane_is_part_of_the_sphere(near_failure):
    """The same increment is the same probe, named by its angle or by its unit vector."""
    plane = rd.directions.rendulic(step=30)
    unit = plane.increments(1.0)
    both = rd.directions.SphereDirections(unit, np.full(len(plane), 1.0 / len(plane)))
    one = rd.probe(near_failure, plane, norm=1e-6)
    other = rd.probe(near_failure, both, norm=1e-6)
    assert_allclose(other.w2_macro, one.w2_macro, rtol=1e-9)
    assert other.w2_macro.dims == ("direction",)
    assert_array_equal(other.along_1, unit[:, 0])


def test_grains_on_the_sphere(sheared):
    """Grains answer, too: identity to rounding, and axes 2 and 3 told apart."""
    around = rd.directions.sphere(12)
    probes = rd.probe(sheared, around, norm=2e-5, rate=2e-07, settle=False)
    assert (probes.identity_residual < 1e-12).all()
    assert_allclose(probes.d_eps, 2e-5 * around.unit, atol=1e-12)
    assert set(probes.d_sigma.dims) == {"direction", "component"}


def test_directions_are_even():
    """Equal weights that integrate quadratic forms, and no gap much wider than the spacing."""
    around = rd.directions.sphere(400)
    second_moment = (around.weight[:, None, None] * around.unit[:, :, None] * around.unit[:, None, :]).sum(axis=0)
    assert_allclose(second_moment, np.eye(3) / 3.0, atol=2e-3)
    closest = np.degrees(np.arccos(np.clip(np.sort(around.unit @ around.unit.T, axis=1)[:, -2], -1.0, 1.0)))
    assert closest.min() > 0.7 * around.spacing
    assert closest.max() < 1.2 * around.spacing


def test_the_map_keeps_areas_and_landmarks():
    """Isotropic compression in the centre, isochoric increments on the unit circle, equal areas anywhere."""
    along, across, pole = np.array(DEVIATORIC_AXES)
    assert_allclose(equal_area(pole), [0.0, 0.0], atol=1e-15)
    assert_allclose(equal_area(-pole, expansion=True), [0.0, 0.0], atol=1e-15)
    for angle in np.linspace(0.0, 2.0 * np.pi, 7):
        rim = np.cos(angle) * along + np.sin(angle) * across
        assert_allclose(np.linalg.norm(equal_area(rim)), 1.0)
        assert_allclose(equal_area(rim), equal_area(rim, expansion=True), atol=1e-12)
    spots = np.linalg.norm(equal_area(rd.directions.sphere(4000).unit), axis=1)
    # the directions are evenly spaced along the pole: to one of them
    for radius in (0.3, 0.7, 1.0):
        assert (spots < radius).mean() == pytest.approx(0.5 * radius**2, abs=1 / 4000)


@pytest.mark.parametrize(
    ("unit", "weight", "words"),
    [
        ([[1.0, 1.0, 0.0]], [1.0], "unit vectors"),
        ([[1.0, 0.0, 0.0]], [0.5], "sum 1"),
        ([[1.0, 0.0, 0.0]], [0.5, 0.5], "weights of directions"),
        ([[np.nan, 0.0, 0.0]], [1.0], "directions"),
    ],
)
def test_directions_refused(unit, weight, words):
    """What is no direction, and weights that are no shares."""
    with pytest.raises(InvalidInput, match=words):
        rd.directions.SphereDirections(unit, weight)


def test_a_sphere_of_few_directions_is_refused():
    """Eleven directions say nothing of a sphere."""
    with pytest.raises(InvalidInput, match="number of directions"):
        rd.directions.sphere(11)


def test_a_cone_is_of_the_plane(near_failure):
    """Edges are bisected in one angle; a sphere has none."""
    with pytest.raises(InvalidInput, match="Rendulic plane"):
        rd.instability_cone(near_failure, rd.directions.sphere(40))


def test_a_stereogram_needs_the_sphere(near_failure):
    """Probes of the Rendulic plane are not a map; those of the sphere are, with the unstable share on top."""
    with pytest.raises(InvalidInput, match="sphere"):
        rd.figures.stereogram(rd.probe(near_failure, rd.directions.rendulic(step=60), norm=1e-8))
    probes = rd.probe(near_failure, rd.directions.sphere(40), norm=1e-8)
    share = float(probes.weight[probes.w2_normalised.values < 0.0].sum())
    figure = rd.figures.stereogram(probes, "sand")
    assert f"{share:.1%}" in figure.get_suptitle()
