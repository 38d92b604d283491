"""Regular packings whose stiffness and strength are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.dem.drive.servo import drive_for

K, R = 356e6, 0.01


def simple_cubic(n, overlap, friction=0.7, damping=0.5, rule="mean_diameter"):
    """`n^3` equal spheres in columns between walls; every contact has the same overlap."""
    pitch = 2 * R - overlap
    places = R - overlap + pitch * np.arange(n)
    position = np.stack(np.meshgrid(places, places, places, indexing="ij"), axis=-1).reshape(-1, 3)
    length = 2 * (R - overlap) + (n - 1) * pitch
    law = rd.dem.LinearFrictional(K, 0.42, friction, rule)
    return rd.dem.Assembly(position, np.full(n**3, R), [0.0, length] * 3, law=law, damping=damping)


def column_stress(n, lengths):
    """Principal stresses of the lattice: n + 1 equal springs 2 K R in series in every column."""
    overlap = (2 * R * n - lengths) / (n + 1)
    areas = np.prod(lengths) / lengths
    return n**2 * 2 * K * R * overlap / areas


@pytest.mark.parametrize("n", [1, 2, 4])
@pytest.mark.parametrize("strain", [(1e-5, 0, 0), (0, 0, -2e-5), (1e-5, -1e-5, 3e-5)])
def test_cubic_lattice_is_springs_in_series(n, strain, straining):
    """Stress at rest equals that of `n - 1` grain and 2 wall contacts per column, for finite strains.

    All n + 1 springs have 2 K R. Brought to rest by damping, and compared, to 1e-9 of the stress increment.
    """
    sample = simple_cubic(n, 1e-5)
    # overlaps of 1e-5 m between coordinates of up to 0.08 m, which are rounded by 7e-18 m: 1e-12
    assert_allclose(np.diag(sample.stress), column_stress(n, sample.lengths), rtol=3e-12)
    before = np.diag(sample.stress)
    sample.probe(strain, 500)
    sample.advance(2000, straining())
    expected = column_stress(n, sample.lengths)
    assert_allclose(np.diag(sample.strain), strain, rtol=1e-9, atol=1e-15)
    assert_allclose(
        np.diag(sample.stress) - before, expected - before, rtol=0, atol=1e-9 * np.abs(expected - before).max()
    )


@pytest.mark.parametrize("n", [2, 5])
def test_cubic_lattice_modulus(n, straining):
    """`d sigma_1 / d eps_1 = K n / (n + 1)`: a closed form without the walls' positions.

    Springs `2 K R / (n + 1)` per area `(2R)^2` and length `2 R n`, for vanishing overlap and strain:
    both are 1e-3 of a radius at most, so 0.5 %.
    """
    sample = simple_cubic(n, 1e-5)
    before = np.diag(sample.stress)
    sample.probe((1e-5, 0, 0), 500)
    sample.advance(2000, straining())
    modulus = (np.diag(sample.stress) - before) / 1e-5
    assert_allclose(modulus[0], K * n / (n + 1), rtol=5e-3)
    assert np.abs(modulus[1:]).max() < 5e-3 * modulus[0]


def test_stress_probe_inverts_the_strain_probe():
    """Asked for a stress increment, the servo finds the strain of the springs, within 1e-3."""
    n = 3
    sample = simple_cubic(n, 1e-5)
    before = np.diag(sample.stress)
    sample.probe((2e3, 0.0, -1e3), 3000, kind="stress")
    assert_allclose(np.diag(sample.stress) - before, [2e3, 0.0, -1e3], rtol=0, atol=2.0)
    assert_allclose(column_stress(n, sample.lengths) - before, [2e3, 0.0, -1e3], rtol=0, atol=2.0)


def face_centred(cells, overlap, friction):
    """Face-centred cubic packing, axis along [001], between walls that each touch a plane of spheres."""
    sites = np.stack(np.meshgrid(*[np.arange(2 * cells + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    sites = sites[sites.sum(axis=1) % 2 == 0]
    half = (2 * R - overlap) / np.sqrt(2.0)
    position = R - overlap + half * sites
    length = 2 * (R - overlap) + 2 * cells * half
    law = rd.dem.LinearFrictional(K, 0.42, friction)
    return rd.dem.Assembly(position, np.full(len(sites), R), [0.0, length] * 3, law=law, damping=0.3)


@pytest.mark.parametrize("friction", [0.2, 0.4])
def test_face_centred_packing_fails_where_thornton_says(friction):
    """`sigma_1 / sigma_3` tends to `2 (1 + mu) / (1 - mu)` at failure (Thornton 1979), for spheres that do not turn.

    At failure all contacts between layers slide and those within a layer are open; between flat walls
    the count of contacts across any plane gives the same ratio. Spins are suppressed by a large
    moment of inertia: free spheres next to the walls would roll before they slide. The springs give
    way by 1e-4 before failure and turn the lattice by that much, and loading is slow, but not
    infinitely so: 0.5 %.
    """
    pressure, rate = 1e4, 0.005
    sample = face_centred(2, 2e-8, friction)
    sample.grains.inertia[:] *= 1e6
    isotropic, axial = rd.paths.isotropic(pressure), rd.paths.drained_triaxial(lateral_stress=pressure)
    sample.advance(8000, drive_for(sample, isotropic.control, isotropic.stress, np.zeros(3), 0.02), 0.3)
    # the servo needs one step; what is left is the motion of 8000 damped steps
    assert_allclose(np.diag(sample.stress), pressure, rtol=1e-6)
    sample.reset_strain()
    drive = drive_for(sample, axial.control, axial.stress, np.array([rate, 0.0, 0.0]), 10 * rate)
    ratios = []
    while sample.strain[0, 0] < 2e-4:
        sample.advance(100, drive, 0.3)
        ratios.append(sample.stress[0, 0] / np.diag(sample.stress)[1:])
    assert_allclose(np.max(ratios, axis=0), 2 * (1 + friction) / (1 - friction), rtol=5e-3)
    snapshot = sample.snapshot()
    between_layers = ~snapshot.is_wall & (np.abs(snapshot.normal[:, 0]) > 0.1)
    assert snapshot.is_sliding[between_layers].all()
    assert between_layers.sum() + snapshot.is_wall.sum() == sample.n_contacts  # none left within a layer


def test_imposed_strain_is_exact():
    """Strain probes are kinematics: the strain asked for is reached to the rounding of the walls' coordinates.

    5 000 additions to coordinates of 0.04 m, rounded by 3e-18 m each: 3e-11 of the increment with an
    exact exponential.
    """
    sample = simple_cubic(2, 1e-5)
    sample.probe((5e-5, 2.5e-5, -3e-5), 5000)
    assert_allclose(np.diag(sample.strain), (5e-5, 2.5e-5, -3e-5), rtol=2e-10)
