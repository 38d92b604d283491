"""One of the planes that a symmetry maps onto each other, for all of them: against all of them, one by one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rendulic as rd
from rendulic.chang_hicher.drive import integration
from rendulic.chang_hicher.drive.equations import control_of, symmetry_of
from rendulic.chang_hicher.law.planes import AXISYMMETRIC, GENERAL, ORTHOTROPIC
from rendulic.tensors.sphere_rules import bazant_oh_37, lebedev

P = 300e3
FABRICS = {
    "isotropic": None,
    "axial": np.diag([0.40, 0.30, 0.30]),
    "orthotropic": np.diag([0.37, 0.35, 0.28]),
    "inclined": np.array([[0.36, 0.03, -0.02], [0.03, 0.33, 0.01], [-0.02, 0.01, 0.31]]),
}
STRAINS, STRESSES = (np.zeros((3, 3)), np.eye(3)), (np.eye(3), np.zeros((3, 3)))


@pytest.fixture
def all_planes(monkeypatch):
    """Run a function with every plane for itself."""

    def run(function):
        with monkeypatch.context() as patch:
            patch.setattr(integration, "symmetry_of", lambda _point, _control: GENERAL)
            return function()

    return run


def followed(rule, fabric, formulation, legs):
    """The point and the curves of some legs."""
    point = rd.ChangHicher(rule=rule, fabric=fabric, formulation=formulation).at(P, 0.9)
    return point, [point.load(leg) for leg in legs]


TESTS = {
    "undrained": [rd.paths.constant_volume(0.05)],
    "reversed": [rd.paths.drained_triaxial(0.02), rd.paths.drained_triaxial(0.03, extension=True)],
}


@pytest.mark.parametrize("legs", TESTS.values(), ids=TESTS)
@pytest.mark.parametrize("formulation", ["printed", "eq32", "consistent"])
@pytest.mark.parametrize("fabric", ["isotropic", "axial", "orthotropic"])
@pytest.mark.parametrize("rule", [bazant_oh_37(), lebedev(23)], ids=["37", "97"])
def test_planes_that_respond_alike(rule, fabric, formulation, legs, all_planes):
    """States, records and events of every plane are the same to rounding, which softening planes raise."""
    own, curves = followed(rule, FABRICS[fabric], formulation, legs)
    other, others = all_planes(lambda: followed(rule, FABRICS[fabric], formulation, legs))
    assert_allclose(own.sigma, other.sigma, rtol=0, atol=1e-9 * P)
    assert_allclose(own.memory, other.memory, rtol=0, atol=1e-9 * other.memory.max())
    assert_allclose(own.plane_strain, other.plane_strain, rtol=0, atol=1e-9 * np.abs(other.plane_strain).max())
    for curve, wanted in zip(curves, others, strict=True):
        assert curve.attrs["stopped_by"] == wanted.attrs["stopped_by"]
        if wanted.attrs["stopped_by"] == "plastic limit":
            # how many steps lead into it, and how soft it is there, is a matter of rounding
            curve, wanted = (one.isel(record=one.x_plane.values.max(axis=1) < 0.999) for one in (curve, wanted))
        assert curve.sizes == wanted.sizes
        assert_array_equal(curve.event_kind, wanted.event_kind)
        at_once = np.round(wanted.event_eps_1.values, 10)
        # planes that change at one strain may be told in another order
        for kind in set(wanted.event_kind.values):
            of_kind = wanted.event_kind.values == kind
            assert_array_equal(
                sorted(zip(at_once[of_kind], curve.event_plane.values[of_kind], strict=True)),
                sorted(zip(at_once[of_kind], wanted.event_plane.values[of_kind], strict=True)),
            )
        assert_allclose(curve.event_eps_1, wanted.event_eps_1, rtol=0, atol=1e-9)
        for name in ("w2", "hill", "det_control", "sigma_plane", "tau_plane", "eps_plane", "gamma_plane", "w2_plane"):
            wide = float(np.abs(wanted[name]).max())
            assert_allclose(curve[name], wanted[name], rtol=0, atol=1e-6 * wide, err_msg=name)
        assert_array_equal(curve.is_loading, wanted.is_loading)


def symmetry(point, rows, target):
    """That of a control of three strains, or stresses."""
    return symmetry_of(point, control_of(point, *rows, np.array(target)))


@pytest.mark.parametrize(("fabric", "alike"), [("isotropic", 2), ("axial", 2), ("orthotropic", 1), ("inclined", 0)])
def test_symmetry_of_planes_and_control(fabric, alike):
    """No more than planes and control have."""
    point = rd.ChangHicher(fabric=FABRICS[fabric]).at(P, 0.9)
    for rows in (STRAINS, STRESSES):
        assert symmetry(point, rows, [1e-4, -2e-5, -2e-5]) == min(alike, AXISYMMETRIC)
        assert symmetry(point, rows, [1e-4, -2e-5, -3e-5]) == min(alike, ORTHOTROPIC)


def test_symmetry_of_states():
    """What memory, stress, or strains of the planes tell apart is told apart."""
    strained = rd.ChangHicher().at(P, 0.9)
    strained.probe(np.array([1e-3, 0.0, -5e-4]))
    assert symmetry(strained, STRAINS, [1e-4, 0.0, 0.0]) == ORTHOTROPIC
    shear = np.diag([300e3, 200e3, 200e3]) + np.array([[0, 1e4, 0], [1e4, 0, 0], [0, 0, 0]])
    assert symmetry(rd.ChangHicher().at(stress=shear), STRAINS, [1e-4, 0.0, 0.0]) == GENERAL
    for entry in (0, 2):
        marked = rd.ChangHicher().at(P, 0.9)
        marked.load(rd.paths.drained_triaxial(0.01))
        assert symmetry(marked, STRAINS, [1e-4, 0.0, 0.0]) == AXISYMMETRIC
        marked.plane_strain[5, entry] += 1e-6
        assert symmetry(marked, STRAINS, [1e-4, 0.0, 0.0]) == GENERAL
    rolled = rd.ChangHicher(rule=bazant_oh_37().rotated(np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]))).at(
        P, 0.9
    )
    assert symmetry(rolled, STRAINS, [1e-4, 0.0, 0.0]) == GENERAL


def test_orbits_are_whole():
    """Vectors carried from the first plane of an orbit to the others are what stress makes of these."""
    sand = rd.ChangHicher(rule=lebedev(23))
    stress = np.diag([300e3, 200e3, 200e3])
    traction = sand.planes.branch @ stress
    for kind in (ORTHOTROPIC, AXISYMMETRIC):
        orbits = sand.geometry.orbits(kind)
        # tractions of opposite normals are opposite: even in the pair, as shear strains are
        assert_allclose(orbits.every_vector(traction[orbits.first]), traction, rtol=0, atol=1e-9 * 300e3)
        assert_allclose(sand.planes_under(kind).weight3.sum(), 3.0, rtol=1e-14)
    assert len(sand.planes_under(AXISYMMETRIC).weight3) == 19


def test_events_within_steps_are_those_of_the_path():
    """Where W2 of planes is lost is the same with a hundredfold finer tolerance, to the error of the integration."""
    ends = []
    for tolerance in (1e-8, 1e-12):
        point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
        curve = point.load(rd.paths.constant_volume(0.02), tolerance=tolerance)
        lost = np.isin(curve.event_kind.values, ["plane_w2_lost", "w2_lost", "q_peak"])
        ends.append([curve.event_eps_1.values[lost], curve.event_q.values[lost] / P])
    assert ends[0][0].size > 10
    assert_allclose(ends[0], ends[1], rtol=0, atol=1e-7)
