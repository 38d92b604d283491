"""Cones that are known: none of elastic lattices, the closed form of the model, tangents written down, with drift."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from test_lattices import K, R, face_centred

import rendulic as rd
from fakes import FRAME, Answering, constant, linear, single
from rendulic.probing.cone_table import cone_table
from rendulic.probing.consistency import stress_on_strain
from rendulic.probing.edges import wrap
from rendulic.tensors.rendulic_plane import direction_of, increment_along

HUGE = 1e6  # a friction that no contact overcomes


# --- elastic lattices ----------------------------------------------------------------------------------


def columns(counts, overlap=1e-5):
    """Equal spheres in columns between walls, so many along each axis; every contact has the same overlap."""
    pitch = 2 * R - overlap
    places = [R - overlap + pitch * np.arange(n) for n in counts]
    position = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 3)
    walls = [wall for n in counts for wall in (0.0, 2 * (R - overlap) + (n - 1) * pitch)]
    return rd.dem.Assembly(position, np.full(len(position), R), walls, law=rd.dem.LinearFrictional(K, 0.42, HUGE))


def test_a_lattice_of_columns_has_the_work_of_its_springs():
    """`W2 = sum K n_i / (n_i + 1) d_eps_i^2`: springs in series along each axis, and no cone.

    The response to a circle of strains is an ellipse with these moduli as half axes. They are those of vanishing
    overlap: it is 1e-3 of a radius, and the springs are followed in motion, so 0.5 %.
    """
    counts = np.array([1, 4, 4])
    modulus = K * counts / (counts + 1)
    norm = 1e-6
    cone = rd.instability_cone(
        columns(counts), rd.directions.rendulic(step=15), norm=norm, rate=norm / 2000, settle=False, workers=1
    )
    assert cone.is_empty
    assert cone.strain_sectors == ()
    assert cone.smallest_w2n > 0.9
    assert cone.drift_share < 1e-6
    probes = cone.probes
    assert_allclose(probes.w2_macro, probes.d_eps.values**2 @ modulus, rtol=5e-3)
    assert_allclose(np.linalg.norm(probes.d_sigma / modulus, axis=1), norm, rtol=5e-3)


@pytest.mark.parametrize("kind", ["strain", "stress"])
def test_a_frictional_lattice_that_cannot_slide_is_linear(kind):
    """Two probes of a face-centred packing foretell all others: a symmetric matrix, an ellipse, and no cone.

    1e-3: the walls have moved by that part of an overlap; the servo of stress probes follows within it, too.
    """
    packing = face_centred(2, 1e-5, HUGE)
    rd.dem.bring_to_rest(packing)
    norm = 1e-6 if kind == "strain" else 300.0
    around = rd.directions.rendulic(step=15)
    cone = rd.instability_cone(packing, around, norm=norm, rate=norm / 4000, settle=False, kind=kind, workers=1)
    assert cone.is_empty
    assert cone.smallest_w2n > 0.9
    given, answer = (
        cone.probes[f"d_{name}"].values @ FRAME.T
        for name in (("eps", "sigma") if kind == "strain" else ("sigma", "eps"))
    )
    matrix = np.linalg.solve(given[[1, 8]], answer[[1, 8]])  # of 15 and 120 degrees
    size = np.abs(matrix).max()
    assert_allclose(matrix, matrix.T, rtol=0, atol=1e-3 * size)
    assert abs(matrix[0, 1]) > 0.1 * size  # no direction but two answers along itself
    assert_allclose(given @ matrix, answer, rtol=0, atol=1e-3 * np.abs(answer).max())
    on_ellipse = np.linalg.norm(answer @ np.linalg.inv(matrix), axis=1)
    assert_allclose(on_ellipse, norm, rtol=2e-3)
    assert_allclose(cone.probes.w2_macro, np.einsum("ai,ij,aj->a", given, matrix, given), rtol=3e-3)


# --- the model in closed form --------------------------------------------------------------------------


def drained(eta):
    return rd.paths.drained_triaxial(0.3, until_eta=eta)


def loose():
    return rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)


@pytest.fixture(scope="module")
def sand():
    """Loose Hostun sand on a drained path, at q/p = 1."""
    point = loose()
    point.load(drained(1.0))
    return point


@pytest.fixture(scope="module")
def closed(sand):
    """Its one sector in closed form."""
    (sector,) = rd.chang_hicher.closed_form_cone(sand)
    return sector


def test_edges_of_the_model(sand, closed):
    """Probes of 1e-8 show the closed form within the bracket; no drift, so that nothing else makes an edge unsure."""
    cone = rd.instability_cone(sand, norm=1e-8, tolerance=0.01, workers=1)
    ((low, high),) = cone.edge_uncertainty
    assert cone.tolerance <= 0.01
    # the last digits of stresses of 300 kPa make 5e-5 of that
    assert_allclose([low, high], 0.5 * cone.tolerance, rtol=1e-4)
    # the finite size of the probes turns an edge by less than 2e-3 degrees
    assert_allclose(cone.sectors, [closed], rtol=0, atol=low + 2e-3)
    assert cone.strain_sectors == cone.sectors
    assert cone.smallest_strain_alpha == cone.smallest_alpha


def test_stress_probes_show_the_same_sector_of_strain(sand, closed):
    """Imposed stresses have a sector elsewhere, but the strains that answer within it span that of strain probes."""
    cone = rd.instability_cone(sand, norm=3.0, kind="stress", tolerance=0.02, workers=1)
    (sector,) = cone.strain_sectors
    error = np.abs(np.subtract(sector, closed))
    assert (error <= np.array(cone.strain_edge_uncertainty[0]) + 2e-3).all()
    # a step of 0.02 degrees of stress near an edge hardly turns the strain that answers
    assert error.max() < 2e-3
    assert abs(wrap(cone.sectors[0][0] - closed[0])) > 45.0
    assert closed[0] < cone.smallest_strain_alpha < closed[1]
    table = cone_table(np.array([cone], dtype=object), {"specimen": [0]})
    assert_allclose(table.smallest_alpha, cone.smallest_strain_alpha)
    assert_allclose(table.opening, sector[1] - sector[0])
    assert_allclose(table.edge_to - table.edge_from, sector[1] - sector[0])
    # within the sector the increments of stress and strain point apart
    inside = cone.probes.isel(alpha=cone.probes.w2_normalised.values < 0.0)
    assert_allclose(inside.strain_alpha, direction_of(inside.d_eps), rtol=1e-12)
    assert ((inside.strain_alpha > sector[0]) & (inside.strain_alpha < sector[1])).all()


def test_the_plateau_of_the_model(sand, closed):
    """Small norms agree on the closed form; the plateau ends where the state changes under the probe."""
    norms = np.geomspace(1e-8, 1e-2, 7)
    table = rd.cones_by_amplitude(sand, norms, tolerance=0.05, change=0.002, workers=1)
    assert table.attrs["plateau_from"] == norms[0]
    assert 1e-6 <= table.attrs["plateau_to"] < norms[-1]
    assert_array_equal(table.is_plateau, norms <= table.attrs["plateau_to"])
    for name, edge in zip(("edge_from", "edge_to"), closed, strict=True):
        assert_allclose(table[name].sel(sector=0)[norms < 1e-5], edge, rtol=0, atol=0.025 + 2e-3)
    # W2n of the tangent in the direction of the smallest value
    unit = increment_along(float(table.smallest_alpha[0]))
    answer = (rd.chang_hicher.tangent(sand, unit).stiffness @ [*unit, 0.0, 0.0, 0.0])[:3]
    assert_allclose(table.attrs["plateau_w2n"], answer @ unit / np.linalg.norm(answer), rtol=0, atol=0.001)


def test_the_first_stress_ratio_of_the_model():
    """The map's first ratio is where the closed form first has a sector, found by bisection.

    Between ratios 0.02 apart the smallest W2n bends by less than 1e-3 of its slope.
    """
    low, high = loose(), 0.94
    low.load(drained(0.84))
    reached = 0.84
    while high - reached > 1e-4:
        further = low.clone()
        further.load(drained(0.5 * (reached + high)))
        if rd.chang_hicher.closed_form_cone(further):
            high = 0.5 * (reached + high)
        else:
            low, reached = further, 0.5 * (reached + high)
    etas = [0.84, 0.86, 0.88, 0.90, 0.92]
    table = rd.bifurcation_map(rd.states_along(loose(), drained, etas), norm=1e-8, workers=1)
    assert_allclose(table.first_eta, high, rtol=0, atol=1e-3)
    assert (table.first_eta_from, table.first_eta_to) == (0.88, 0.90)
    assert_allclose(table.measured_eta[:, 0], etas, rtol=1e-9)
    assert_array_equal(table.n_sectors[:, 0], [0, 0, 0, 1, 1])
    assert_array_equal(np.isfinite(table.edge_from_summary.sel(statistic="median")), table.is_unstable[:, 0])


# --- tangents written down -----------------------------------------------------------------------------


def cone_of(specimen, kind="strain", **options):
    return rd.instability_cone(specimen, norm=1.0, kind=kind, workers=1, **options)


def edges(cone):
    """All edges in directions of strain, and their uncertainties."""
    return np.ravel(cone.strain_sectors), np.ravel(cone.strain_edge_uncertainty)


@pytest.mark.parametrize("twist", [0.4, 2.0], ids=["turned over", "not turned over"])
@pytest.mark.parametrize("middle", [130.0, 177.3])
def test_both_kinds_of_probes_show_the_same_sectors(middle, twist):
    """Stress probes of a linear material, whichever way its answers turn; one sector lies across 0 degrees."""
    expected = np.array([middle - 25.0, middle + 25.0, middle + 155.0, middle + 205.0])
    for kind in ("strain", "stress"):
        cone = cone_of(linear(middle, 25.0, twist), kind, tolerance=0.1)
        assert len(cone.strain_sectors) == 2
        found, uncertainty = edges(cone)
        error = np.abs(wrap(np.sort(found % 360.0) - np.sort(expected % 360.0)))
        assert (error <= uncertainty[np.argsort(found % 360.0)]).all()
        assert error.max() <= 0.2
        assert_allclose([last - first for first, last in cone.strain_sectors], 50.0, rtol=0, atol=0.4)


@pytest.mark.parametrize("kind", ["strain", "stress"])
@pytest.mark.parametrize("twist", [0.5, 2.0])
def test_the_uncertainty_holds_the_edge_without_drift(kind, twist):
    """Drifts in random directions move edges, never further than the uncertainty, which shrinks with the drift.

    Between the last probes that the drift can and cannot turn, the uncertainty is linear: 2 % for what bends there.
    """
    rng = np.random.default_rng(7)
    true = np.array([105.0, 155.0, 285.0, 335.0])
    typical = []
    for size in (0.0, 1e-3, 1e-2, 5e-2):
        widths, errors = [], []
        for drift in rng.standard_normal((6, 3)):
            made = linear(130.0, 25.0, twist, drift=size * drift / np.linalg.norm(drift))
            found, uncertainty = edges(cone_of(made, kind))
            error = np.abs(wrap(found[:, None] - true))
            assert_array_equal(np.sort(error.argmin(axis=1)), range(4))
            assert (error.min(axis=1) <= 1.02 * uncertainty + 1e-9).all()
            errors.append(error.min(axis=1).max())
            widths.append(uncertainty.mean())
        typical.append(np.median(widths))
    assert (np.diff(typical) > 0.0).all()
    # not by being boundless: the largest drift moves edges by as much as the uncertainty, within a factor of 12
    assert max(errors) > np.median(widths) / 12.0
    assert typical[0] < 1.0


def test_a_sector_of_the_drift_alone_is_unknown():
    """Where W2 is positive everywhere but for the drift, no sector is found, but an unknown one; a true one keeps its edges."""
    drift = -0.05 * increment_along(130.0)
    false, true = cone_of(constant(0.02, drift=drift)), cone_of(single(130.0, 60.0, drift=drift))
    assert (len(false.sectors), len(true.sectors)) == (0, 1)
    assert (false.verdict, true.verdict) == ("unknown", "unstable")
    ((low, high),) = false.unknown_sectors
    assert low < 130.0 < high
    assert not false.is_significant
    assert max(true.edge_uncertainty[0]) < 10.0
    assert true.is_significant


def test_directions_without_an_answer_are_not_unstable():
    """W2n is no number where the stress does not answer; the edge hidden there is within the uncertainty."""
    whole = single(130.0, 30.0)
    answer = whole.answers["strain"]
    cone = cone_of(Answering(lambda d: answer(d) * (not 92.0 < direction_of(d) < 112.0)))
    ((first, last),) = cone.sectors
    low, high = first - cone.edge_uncertainty[0][0], first + cone.edge_uncertainty[0][0]
    assert 90.0 <= low <= 92.0 < 112.0 <= high < 114.0
    assert_allclose(cone.unknown_sectors, [(low, high)], rtol=1e-12)
    assert_allclose(last, 160.0, rtol=0, atol=0.3)
    assert cone.edge_uncertainty[0][1] < 0.5
    assert np.isfinite(cone.smallest_w2n)


def test_everywhere_and_nowhere_have_no_edges():
    """No edge has no uncertainty, and an ensemble counts such states without making edges of them."""
    everywhere, nowhere = cone_of(constant(-0.3)), cone_of(constant(0.3))
    assert everywhere.strain_sectors == ((0.0, 360.0),)
    assert np.isnan(everywhere.strain_edge_uncertainty).all()
    assert str(everywhere).startswith("unstable in all directions")
    assert (nowhere.strain_sectors, nowhere.edge_uncertainty) == ((), ())
    table = rd.cone_ensemble([constant(-0.3), constant(0.3), single(130.0, 20.0)], norm=1.0, workers=1)
    assert_allclose(table.unstable_share, 2 / 3)
    assert_allclose(table.edge_from_summary, 110.0, rtol=0, atol=0.2)
    assert_allclose(table.opening[:2], [360.0, 0.0])
    assert_array_equal(np.isnan(table.edge_from_uncertainty[:, 0]), [True, True, False])


@pytest.mark.parametrize("middle", [130.0, 0.0, 350.0])
def test_medians_of_an_ensemble(middle):
    """Sectors of 30 degrees about known middles, and one specimen without any: circular, in order, also across 0."""
    shifts = np.array([-10.0, -2.0, 3.0, 12.0, 20.0])
    specimens = [single(middle + shift, 15.0) for shift in shifts] + [constant(0.2)]
    labels = list("abcdef")
    table = rd.cone_ensemble(specimens, norm=1.0, tolerance=0.1, labels=labels, workers=1)
    assert_array_equal(table.specimen, labels)
    assert_allclose(table.unstable_share, 5 / 6)
    order = ["smallest", "lower_quartile", "median", "upper_quartile", "largest"]
    for name, side in (("edge_from", -15.0), ("edge_to", 15.0)):
        found = table[f"{name}_summary"].sel(statistic=order).values
        assert_allclose(wrap(found - (middle + shifts + side)), 0.0, atol=0.06)
        assert_allclose(found - found[2], shifts - shifts[2], rtol=0, atol=0.12)
    median = table.sel(statistic="median")
    assert_allclose(median.edge_to_summary - median.edge_from_summary, 30.0, rtol=0, atol=0.12)
    assert_allclose(median.opening_summary, 30.0, rtol=0, atol=0.12)


def test_the_map_of_two_sands():
    """Edges and first ratios of made-up states: W2n vanishes at 0.42 in one specimen; in the other, nowhere.

    `w / sqrt(1 + w^2)` with w = 0.42 - eta bends by less than 1e-4 of eta between 0.4 and 0.5.
    """
    rows = {eta: [constant(0.42 - eta), constant(0.3)] for eta in (0.2, 0.4, 0.5, 0.6)}
    table = rd.bifurcation_map(rows, norm=1.0, labels=["one", "other"], workers=1)
    assert_allclose(table.first_eta.sel(specimen="one"), 0.42, rtol=0, atol=1e-4)
    assert_array_equal([table.first_eta_from[0], table.first_eta_to[0]], [0.4, 0.5])
    assert table.first_eta_reason.values.tolist() == ["found", "not by eta = 0.6"]
    assert_allclose(table.unstable_share, [0.0, 0.0, 0.5, 0.5])
    assert_allclose(table.stable_share, [1.0, 1.0, 0.5, 0.5])
    # the other vanishes above 0.6, if at all: of the median only the lower bound is known
    assert_allclose([table.first_eta_median_from, table.first_eta_median_to], [0.4, np.nan])


def test_stress_probes_lie_on_strain_probes(sand):
    """Of one state of the model, W2n is that of its direction of strain, whichever of the two is imposed.

    Strain probes every tenth of a degree: linear interpolation about the kinks of W2n leaves less than 1e-3.
    """
    strain = rd.probe(sand, rd.directions.rendulic(step=0.1), norm=[1e-9, 1e-5])
    stress = rd.probe(sand, rd.directions.rendulic(step=10), norm=0.1, kind="stress")
    table = stress_on_strain(strain, stress)
    assert table.attrs["n_compared"] >= 30
    assert table.attrs["rms"] < 1e-3
    assert np.ptp(table.w2_normalised.values) > 0.5
