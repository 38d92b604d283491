"""What holds at every point of the Chang-Hicher model: its state, its frame, its paths, its cone."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid
from scipy.spatial.transform import Rotation

import rendulic as rd
from rendulic.chang_hicher import MaterialPoint, closed_form_cone, load_many, stability, tangent
from rendulic.chang_hicher.law.plane_law import mobilised_friction
from rendulic.loading.paths import Path
from rendulic.specimen.protocol import HasGrains
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION, increment_along
from rendulic.tensors.sphere_rules import SphereRule, bazant_oh_37, lebedev

P = 300e3
FORMULATIONS = ["printed", "eq32", "consistent"]
FABRICS = {"isotropic": None, "axial": np.diag([0.40, 0.30, 0.30])}
AXIAL_UNDRAINED = ([1, 0, 0], [1, 1, 1], [0, 1, -1])


def sheared(formulation="consistent", fabric=None, void_ratio=0.9, **parameters):
    """A point in the middle of an undrained test, some planes unloaded."""
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric, **parameters).at(P, void_ratio)
    point.load(rd.paths.constant_volume(0.02))
    return point


def of_kind(curve, kind, name):
    """Values at all events of a kind."""
    return curve[f"event_{name}"].values[curve.event_kind.values == kind]


# --- state ---------------------------------------------------------------------------------------------


def test_is_a_specimen():
    """A point obeys the protocol of specimens, and has no grains."""
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    assert isinstance(point, rd.Specimen)
    assert not isinstance(point, HasGrains)
    assert point.stress.shape == point.strain.shape == (3, 3)


@pytest.mark.parametrize("through", ["memory", "file"])
@pytest.mark.parametrize("fabric", FABRICS.values(), ids=FABRICS)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_restored_state_continues_bitwise(formulation, fabric, through, tmp_path):
    """In the middle of a test, through memory and file, into a point of another sand: curve and state."""
    point = sheared(formulation, fabric, exponent=1 / 3)
    state = point.save()
    kept = state if through == "memory" else rd.State.from_file(state.to_file(tmp_path / "point.h5"))
    curve = point.load(rd.paths.drained_triaxial(0.02))
    twin = rd.ChangHicher(k_pR=0.7, rule=lebedev(5)).at(100e3, 0.8)
    twin.restore(kept)
    xr.testing.assert_identical(twin.load(rd.paths.drained_triaxial(0.02)), curve)
    assert twin.save().checksum == point.save().checksum != state.checksum
    xr.testing.assert_identical(MaterialPoint.from_state(kept).load(rd.paths.drained_triaxial(0.02)), curve)


def test_saved_arrays_are_copies():
    """A state does not change when its point, or one restored from it, goes on."""
    point = sheared()
    state = point.save()
    before = state.checksum
    twin = MaterialPoint.from_state(state)
    for own in (point, twin):
        own.load(rd.paths.constant_volume(0.005))
    point.restore(state)
    point.load(rd.paths.constant_volume(0.005))
    assert state.checksum == before


def test_a_clone_shares_nothing():
    """Loading a clone leaves the original as it was, and both go the same way."""
    point = sheared()
    before = point.save().checksum
    clone = point.clone()
    assert clone.save().checksum == before
    curve = clone.load(rd.paths.drained_triaxial(0.01))
    clone.probe(np.array([1e-5, 0.0, 0.0]))
    assert point.save().checksum == before
    xr.testing.assert_identical(point.load(rd.paths.drained_triaxial(0.01)), curve)


def test_looking_leaves_the_point_untouched():
    """Probes of both kinds, tangents, stability, cones: not a bit of the state changes."""
    point = sheared()
    before = point.save().checksum
    for kind, norm in (("strain", [1e-6, 1e-4]), ("stress", [1e2, 5e3])):
        rd.probe(point, rd.directions.rendulic(step=60), norm=norm, kind=kind)
    rd.instability_cone(point, rd.directions.rendulic(step=60), norm=1e-7, tolerance=1.0)
    closed_form_cone(point)
    tangent(point, [1.0, -0.5, -0.5])
    stability(point, [1.0, -0.5, -0.5])
    point.planes()
    repr(point)
    assert point.save().checksum == before


@pytest.mark.parametrize("kind", ["strain", "stress"])
def test_workers_do_not_matter_to_probes(kind):
    """One, two and five threads give the same data set, to the bit."""
    point = sheared()
    norm = [1e-6, 1e-5] if kind == "strain" else [1e2, 1e3]
    results = [rd.probe(point, rd.directions.rendulic(step=20), norm, kind=kind, workers=n) for n in (1, 2, 5)]
    assert float(np.abs(results[0].w2_macro).max()) > 0
    for other in results[1:]:
        xr.testing.assert_identical(other, results[0])


def test_workers_do_not_matter_to_batches():
    """One, two and five threads give the same data set, to the bit."""
    samples = {"k_pR": np.linspace(0.6, 2.0, 7), "void_ratio": np.linspace(0.8, 0.95, 7)}
    own = {"k_pR": samples["k_pR"]}
    results = [
        load_many(own, rd.paths.constant_volume(0.02), void_ratio=samples["void_ratio"], n_records=21, workers=n)
        for n in (1, 2, 5)
    ]
    for other in results[1:]:
        xr.testing.assert_identical(other, results[0])


@pytest.mark.parametrize(
    "path", [rd.paths.constant_volume(0.04), rd.paths.drained_triaxial(0.04)], ids=lambda p: p.name
)
def test_a_batch_is_many_single_tests(path):
    """Each sample is its own test: peaks as located there, values between records to 1e-6 of them.

    Interpolation errs by the fourth power of a step.
    """
    factors = np.array([0.6, 1.0, 1.3])
    batch = rd.ChangHicher.load_many(
        {"dilatancy": factors, "k_pR": 1.2}, path, void_ratio=0.92, n_records=41, rule=bazant_oh_37()
    )
    for sample, factor in enumerate(factors):
        own = batch.isel(sample=sample)
        curve = (
            rd.ChangHicher(rule=bazant_oh_37(), dilatancy=factor, k_pR=1.2).at(P, 0.92).load(path, least_records=400)
        )
        for name in ("q", "p", "eps_1"):
            # NaN where there is no peak
            first = np.append(of_kind(curve, "q_peak", name), np.nan)[0]
            assert_allclose(own[f"{name}_peak"], first, rtol=1e-6)
        for name in ("q", "p", "eps_v"):
            expected = np.interp(own.eps_1, curve.eps_1, curve[name])
            # the curve itself is read linearly between its 400 records
            assert_allclose(own[name], expected, rtol=0, atol=1e-4 * float(np.abs(curve[name]).max()) + 1e-12)
        assert_allclose(own.eps_1, own.share * 0.04, rtol=0, atol=1e-15)
        assert_allclose(own.q[-1], curve.q[-1], rtol=1e-6)


# --- frame and planes ----------------------------------------------------------------------------------


def rotated_six(six, turn):
    """Mandel vector of the turned tensor."""
    root = np.sqrt(2.0)
    a, b, c, d, e, f = six / np.array([1, 1, 1, root, root, root])
    own = turn @ np.array([[a, f, e], [f, b, d], [e, d, c]]) @ turn.T
    return np.array([own[0, 0], own[1, 1], own[2, 2], root * own[1, 2], root * own[0, 2], root * own[0, 1]])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_frame_indifference(formulation, seed):
    """Planes, fabric, stress and strain turned together: the tangent turns with them, to rounding."""
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    stress = np.diag([450e3, 300e3, 250e3])
    fabric = np.diag([0.38, 0.34, 0.28])
    here = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric).at(
        stress=stress, void_ratio=0.85
    )
    there = rd.ChangHicher(
        rule=bazant_oh_37().rotated(turn), formulation=formulation, fabric=turn @ fabric @ turn.T
    ).at(stress=turn @ stress @ turn.T, void_ratio=0.85)  # fmt: skip
    direction = rng.standard_normal((3, 3))
    direction = direction + direction.T
    own, other = tangent(here, direction), tangent(there, turn @ direction @ turn.T)
    np.testing.assert_array_equal(own.is_loading, other.is_loading)
    assert 0 < own.is_loading.sum() < 37
    size = np.abs(own.stiffness).max()
    for six in np.eye(6):
        expected = rotated_six(own.stiffness @ six, turn)
        assert_allclose(other.stiffness @ rotated_six(six, turn), expected, rtol=0, atol=1e-13 * size)


def quarter_turns():
    """Rotations of the cube: of order two, three and four."""
    return {
        "about a face": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
        "about a corner": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
        "about an edge": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    }


@pytest.mark.parametrize("turn", quarter_turns().values(), ids=quarter_turns())
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_symmetries_of_the_cube_are_exact(formulation, turn):
    """They map the 37 planes onto themselves: the same curve to rounding grown over 200 steps."""
    path = rd.paths.constant_volume(0.05)
    own = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, 0.9).load(path)
    other = rd.ChangHicher(formulation=formulation, rule=bazant_oh_37().rotated(turn)).at(P, 0.9).load(path)
    for name in ("q", "p"):
        assert_allclose(other[name], own[name], rtol=0, atol=1e-12 * P)


def test_relabelling_and_turning_over_planes():
    """The order of the planes and the side from which they are seen do not matter; local values follow."""
    rule = bazant_oh_37()
    order = np.random.default_rng(2).permutation(len(rule))
    sides = np.random.default_rng(3).choice([-1.0, 1.0], len(rule))
    other_rule = SphereRule("shuffled", (rule.normals * sides[:, None])[order], rule.weights[order], rule.degree)
    path = rd.paths.constant_volume(0.05)
    own, other = (rd.ChangHicher(rule=r).at(P, 0.9).load(path) for r in (rule, other_rule))
    assert_allclose(other.q, own.q, rtol=0, atol=1e-12 * P)
    for name in ("sigma_plane", "tau_plane", "eps_plane", "w2_plane"):
        size = float(np.abs(own[name]).max())
        assert_allclose(other[name], own[name].values[:, order], rtol=0, atol=1e-11 * size)
    np.testing.assert_array_equal(other.is_loading, own.is_loading.values[:, order])


def test_turned_planes_differ_by_the_error_of_the_rule():
    """With the planes turned at random, q at the peak differs by what the rule errs, steeply less for more planes."""
    degrees, spread = np.array([5, 7, 11, 23, 47]), []
    for degree in degrees:
        rule = lebedev(int(degree))
        turned = [rule] + [rule.rotated(Rotation.random(random_state=k).as_matrix()) for k in range(3)]
        peaks = [float(load_many({}, rd.paths.constant_volume(0.02), rule=r).q_peak[0]) for r in turned]
        spread.append(np.ptp(peaks) / np.mean(peaks))
    assert (np.diff(spread) < 0.0).all()
    assert np.polyfit(np.log(degrees), np.log(spread), 1)[0] < -2.0
    assert spread[0] > 1e-2
    assert spread[-1] < 1e-3


# --- unloading and reversal ----------------------------------------------------------------------------

CONSTANT_FRICTION = {"exponent": 0.0, "critical_slope": 0.0, "interlocking": 0.0}


@pytest.mark.parametrize("parameters", [CONSTANT_FRICTION, {}], ids=["constant friction", "hostun"])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_unloading_and_reloading_lead_back(formulation, parameters):
    """Drained, from q/p = 0.6 to 0.1 and back to the same stress: strain, planes and memory as before.

    All elastic: along one stress path a rate that depends on stress and void ratio alone runs back as it
    came, for any exponent. The 200 steps there and back are of order five and err by far less than tolerated.
    """
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, **parameters).at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.3, until_eta=0.6))
    before = point.save()
    down = point.load(to_axial_stress(1.1 * P))
    middle = point.save()
    point.load(to_axial_stress(float(before.arrays["sigma"][0])))
    after = point.save()
    travelled = abs(middle.arrays["eps"] - before.arrays["eps"]).max()
    assert travelled > 1e-3
    assert down.event_kind.size == 0
    # no plane that carries shear slides on the way down; those without have nothing to slide with
    sliding = down.is_loading.values[1:] & (down.tau_plane.values[1:] > 1.0)
    assert not sliding.any()
    np.testing.assert_array_equal(middle.arrays["memory"], before.arrays["memory"])
    assert_allclose(after.arrays["sigma"], before.arrays["sigma"], rtol=0, atol=1e-13 * P)
    for name in ("eps", "plane_strain"):
        assert_allclose(after.arrays[name], before.arrays[name], rtol=0, atol=1e-12 * travelled)
    assert_allclose(after.arrays["memory"], before.arrays["memory"], rtol=1e-12, atol=0)


def to_axial_stress(axial):
    """Bring the axial stress to a value, the lateral ones held."""
    return Path("axial stress", rd.Control.of_strains(np.eye(3), ("stress",) * 3), stress=(axial, None, None))


@pytest.mark.parametrize("formulation", ["printed", "eq32", "consistent"])
def test_planes_slide_again_where_they_stopped(formulation):
    """After reversal a plane slides again at the friction that its memory mobilises, whatever the sign of the shear.

    `printed` and `eq32` remember the friction; `consistent` the sliding, which Eq. 31 turns into friction at
    the normal stress and the number of contacts of that moment (exponent 0, constant peak friction).
    """
    sand = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, **CONSTANT_FRICTION)
    own = sand.parameters
    point = sand.at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.02))
    memory = point.memory.copy()
    back = point.load(rd.paths.drained_triaxial(0.06, extension=True))
    planes = back.event_plane.values[back.event_kind.values == "plane_reloads"]
    assert len(set(planes.tolist())) >= 8
    q, p, eps_v = (of_kind(back, "plane_reloads", name) for name in ("q", "p", "eps_v"))
    assert (q < 0.0).all()
    cosine = np.abs(back.plane_normal.values[planes, 0])
    normal = p - q / 3.0 + q * cosine**2
    obliquity = np.abs(q) * cosine * np.sqrt(1.0 - cosine**2) / normal
    e = 1.9 * np.exp(-eps_v) - 1.0
    # k_p of a plane in Pa, `k_pR k_n0 N l^2 / (3 V)`
    k_p = own.k_pR * own.k_n0 * 4.0 / (np.pi * (1.0 + e) * e * own.branch_length)
    friction = mobilised_friction(memory[planes], normal, k_p, own.tan_phi_mu)
    assert_allclose(obliquity, friction if formulation == "consistent" else memory[planes], rtol=1e-7)


# --- limits of the model, as its page states them ------------------------------------------------------------


def to_stress(axial, lateral):
    """Bring the stress to these values."""
    return Path("to a stress", rd.Control.of_strains(np.eye(3), ("stress",) * 3), stress=(axial, lateral, lateral))


@pytest.mark.parametrize("sense", [1, -1])
def test_limit_a_closed_stress_cycle_gains_or_loses_energy(sense):
    """Five equal elastic cycles take, or give, 34.45 J/m3 each and leave the same strain each: it is no elastic energy.

    The cycle is a parallelogram in axial and lateral stress, within what an earlier loading has mobilised.
    """
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    point.load(rd.paths.drained_triaxial(until_eta=0.9))
    corners = [(450e3, 300e3), (350e3, 200e3), (250e3, 200e3), (350e3, 300e3)]
    point.load(to_stress(*corners[-1]))
    memory, strains, works = point.memory.copy(), [point.eps.copy()], []
    for _ in range(5):
        work = 0.0
        for corner in corners if sense > 0 else [*corners[-2::-1], corners[-1]]:
            curve = point.load(to_stress(*corner), least_records=1000)
            stress, strain = ([curve[f"{name}_{axis}"].values for axis in (1, 2, 3)] for name in ("sigma", "eps"))
            work += sum(trapezoid(s, e) for s, e in zip(stress, strain, strict=True))
        works.append(work)
        strains.append(point.eps.copy())
    # elastic: no plane that carries shear has slid
    assert_allclose(point.memory, memory, rtol=1e-12, atol=0)
    assert_allclose(works, -34.45 * sense, rtol=1e-3)
    gained = np.diff(strains, axis=0)
    assert_allclose(gained, np.broadcast_to(gained[0], gained.shape), rtol=0, atol=1e-12)
    assert_allclose(gained[0][:3], sense * np.array([-3.504e-4, 1.752e-4, 1.752e-4]), rtol=1e-3)


def test_limit_undrained_cycles_neither_build_up_pressure_nor_degrade():
    """After the first, ten undrained cycles of q follow one line: hardening is isotropic, and nothing slides again.

    A real loose sand loses effective pressure in every cycle.
    """
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    pressures, spans = [], []
    for _ in range(10):
        for extension in (False, True):
            sign = -1.0 if extension else 1.0
            curve = point.load(rd.paths.constant_volume(0.05, until_eta=0.4 * sign, extension=extension))
        pressures.append(float(curve.p[-1]))
        spans.append(float(np.ptp(curve.eps_1.values)))
    assert pressures[0] < 0.95 * P
    assert_allclose(pressures[1:], pressures[0], rtol=1e-9)
    assert_allclose(spans[1:], spans[1], rtol=1e-9)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_reversal_begins_elastically(formulation):
    """At constant lateral stress q falls with Young's modulus of the elastic packing, exponent 0."""
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, exponent=0.0).at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.01))
    young = (
        1.0
        / tangent(rd.ChangHicher(rule=bazant_oh_37(), exponent=0.0).at(P, point.void_ratio), np.ones(3)).compliance[
            0, 0
        ]
    )
    back = point.load(rd.paths.drained_triaxial(1e-6, extension=True))
    modulus = (back.q[-1] - back.q[0]) / (back.eps_1[-1] - back.eps_1[0])
    # rounding of 6e-11 Pa in 100 Pa; the void ratio changes by 1e-6
    assert_allclose(modulus, young, rtol=1e-5)


def test_in_pieces_or_at_once():
    """A path in three pieces ends where it does at once: both have 200 steps and more, of order five."""
    whole, parts = (rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9) for _ in range(2))
    whole.load(rd.paths.constant_volume(0.03))
    for strain in (0.004, 0.016, 0.010):
        parts.load(rd.paths.constant_volume(strain))
    assert_allclose(parts.sigma, whole.sigma, rtol=0, atol=1e-10 * P)
    assert_allclose(parts.memory, whole.memory, rtol=0, atol=1e-9 * whole.memory.max())


# --- paths hold what they say --------------------------------------------------------------------------


@pytest.mark.parametrize("fabric", FABRICS.values(), ids=FABRICS)
@pytest.mark.parametrize("void_ratio", [0.65, 0.95])
@pytest.mark.parametrize("formulation", FORMULATIONS)
class TestPaths:
    """Loose and dense, in compression and extension: what is held is held to rounding."""

    @pytest.mark.parametrize("extension", [False, True])
    def test_drained(self, formulation, void_ratio, fabric, extension):
        """Both lateral stresses keep their value."""
        point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric).at(P, void_ratio)
        curve = point.load(rd.paths.drained_triaxial(0.04, extension=extension))
        assert_allclose(curve.sigma_2, P, rtol=1e-13)
        assert_allclose(curve.sigma_3, P, rtol=1e-13)
        assert abs(float(curve.q[-1])) > 0.4 * P

    @pytest.mark.parametrize("extension", [False, True])
    def test_undrained(self, formulation, void_ratio, fabric, extension):
        """The void ratio does not change, the lateral strains are half the axial one."""
        point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric).at(P, void_ratio)
        curve = point.load(rd.paths.constant_volume(0.04, extension=extension))
        # rounding of the rates, which the softness of planes near their limit raises
        assert_allclose(curve.void_ratio, void_ratio, rtol=1e-11)
        assert_allclose(curve.eps_v, 0.0, atol=1e-11)
        assert_allclose(curve.eps_3, -0.5 * curve.eps_1, rtol=0, atol=1e-11)
        assert_allclose(curve.sigma_2, curve.sigma_3, rtol=0, atol=1e-14 * P)

    def test_oedometric(self, formulation, void_ratio, fabric):
        """No lateral strain; the void ratio follows the axial one, and stresses grow."""
        point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric).at(P, void_ratio)
        curve = point.load(rd.paths.oedometric(0.02))
        assert_allclose(curve.eps_2, 0.0, atol=1e-16)
        assert_allclose(curve.eps_3, 0.0, atol=1e-16)
        assert_allclose(curve.void_ratio, (1 + void_ratio) * np.exp(-curve.eps_1) - 1, rtol=1e-12)
        # equal where a plane changes sides: that state is on record twice
        assert (np.diff(curve.sigma_1) >= 0.0).all()
        assert float(curve.sigma_3[-1]) > P

    def test_constant_p(self, formulation, void_ratio, fabric):
        """Mean stress constant, lateral stresses equal."""
        point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric).at(P, void_ratio)
        curve = point.load(rd.paths.constant_p(0.03))
        assert_allclose(curve.p, P, rtol=1e-13)
        assert_allclose(curve.sigma_2, curve.sigma_3, rtol=1e-13)
        assert float(curve.q[-1]) > 0.5 * P

    @pytest.mark.parametrize("ratio", [0.8, 1.0, 1.3])
    def test_proportional(self, formulation, void_ratio, fabric, ratio):
        """`d_eps_1 + 2 R d_eps_3 = 0`; R = 1 is the undrained test, to the bit."""
        sand = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric)
        curve = sand.at(P, void_ratio).load(rd.paths.proportional(ratio, 0.015))
        assert_allclose(curve.eps_1 + 2 * ratio * curve.eps_3, 0.0, atol=1e-16)
        undrained = sand.at(P, void_ratio).load(rd.paths.constant_volume(0.015))
        assert np.array_equal(curve.q, undrained.q) == (ratio == 1.0)

    def test_isotropic(self, formulation, void_ratio, fabric):
        """Equal stresses all the way, up to the pressure asked for."""
        point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric).at(P, void_ratio)
        curve = point.load(rd.paths.isotropic(2 * P))
        assert_allclose(curve.q, 0.0, atol=1e-9 * P)
        assert_allclose(np.diag(point.stress), 2 * P, rtol=1e-13)
        assert curve.attrs["stopped_by"] == "target"


@pytest.mark.parametrize(
    "path",
    [
        rd.paths.drained_triaxial(0.02), rd.paths.drained_triaxial(0.02, extension=True), rd.paths.constant_volume(0.02),
        rd.paths.oedometric(0.02), rd.paths.oedometric(0.02, extension=True), rd.paths.proportional(1.2, 0.02),
        rd.paths.constant_p(0.02),
    ],
    ids=["drained", "extension", "undrained", "oedometric", "stretched", "proportional", "constant p"],
)  # fmt: skip
def test_paths_end_at_the_axial_strain_they_were_given(path):
    """`until_strain` is axial strain, travelled exactly."""
    curve = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).load(path)
    assert curve.attrs["stopped_by"] == "strain"
    assert_allclose(abs(curve.eps_1[-1]), 0.02, rtol=1e-10)


@pytest.mark.parametrize("fabric", [np.diag([0.30, 0.40, 0.30]), np.diag([0.36, 0.36, 0.28])], ids=str)
def test_strains_are_imposed_whatever_the_fabric(fabric):
    """Also where the planes resist differently along the two lateral axes: undrained, oedometric, probes."""
    sand = rd.ChangHicher(rule=bazant_oh_37(), fabric=fabric)
    undrained = sand.at(P, 0.9).load(rd.paths.constant_volume(0.005))
    assert_allclose(undrained.eps_2, -0.5 * undrained.eps_1, rtol=0, atol=1e-15)
    oedometric = sand.at(P, 0.9).load(rd.paths.oedometric(0.005))
    assert_allclose(oedometric.eps_2, 0.0, atol=1e-15)
    assert bool(rd.probe(sand.at(P, 0.9), rd.directions.rendulic(step=30), norm=1e-5).is_reached.all())


@pytest.mark.parametrize("kind", ["strain", "stress"])
def test_probes_impose_what_they_say(kind):
    """Every increment is reached, and marks on the way are its parts, in every direction around."""
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.3, until_eta=0.6))
    norms = np.array([1e-6, 1e-5] if kind == "strain" else [1e2, 1e3])
    around = rd.directions.rendulic(step=15)
    probes = rd.probe(point, around, norms, kind=kind)
    got = probes.d_eps if kind == "strain" else probes.d_sigma
    assert probes.is_reached.all()
    # differences of strains of 1e-2, or of stresses of 5e5 Pa
    scale = 1e-2 if kind == "strain" else 5e5
    for norm in norms:
        assert_allclose(got.sel(norm=norm), around.increments(norm), rtol=0, atol=1e-14 * scale)
    assert probes.is_significant.all()
    assert_allclose(probes.d_sigma_null, 0.0, atol=0)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("offset", [1.0, 0.1, 1e-2, 1e-3, 1e-4, -1e-3])
def test_directions_next_to_isotropic_strain(formulation, offset):
    """In a virgin state the answer to almost isotropic strain is almost that to isotropic strain.

    It departs from it by no more than the shear strain does, and probes impose what they say.
    """
    for alpha in (ISOTROPIC_COMPRESSION, ISOTROPIC_COMPRESSION + 180.0):
        point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, 0.9)
        directions = [increment_along(alpha + own) for own in (0.0, offset)]
        mean, near = (tangent(point, d).stiffness[:3, :3] @ d for d in directions)
        assert_allclose(near, mean, rtol=0, atol=5.0 * np.radians(abs(offset)) * np.abs(mean).max())
        point.probe(1e-5 * directions[1])
        assert_allclose(np.diag(point.strain), 1e-5 * directions[1], rtol=0, atol=1e-11)


def test_stress_probes_undo_strain_probes():
    """The stress that a strain probe gave, imposed, gives that strain, where all is stable."""
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.3, until_eta=0.5))
    for alpha in (20.0, 90.0, 125.0, 200.0, 300.0):
        by_strain, by_stress = point.clone(), point.clone()
        by_strain.probe(increment_along(alpha, 1e-5))
        by_stress.probe(np.diag(by_strain.stress - point.stress), kind="stress")
        assert_allclose(by_stress.strain, by_strain.strain, rtol=0, atol=2e-12)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_controlled_in_q_an_undrained_test_ends_at_the_peak(formulation):
    """With q imposed at constant volume, control is lost exactly where q peaks under strain control.

    To 1e-7, after steps of a tolerance of 1e-8: the determinant of the controlled problem vanishes there, the paper's
    loss of controllability.
    """
    sand = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation)
    reference = sand.at(P, 0.9).load(rd.paths.constant_volume(0.05))
    control = rd.Control.of_strains(AXIAL_UNDRAINED, ("stress", "strain", "strain"))
    assert_allclose(control.stress_basis[0], [1.0, -0.5, -0.5], atol=1e-15)
    point = sand.at(P, 0.9)
    curve = point.load(Path("q imposed", control, stress=(2 * P, None, None)))
    assert curve.attrs["stopped_by"] == "loss of controllability"
    assert_allclose(curve.q[-1], of_kind(reference, "q_peak", "q")[0], rtol=1e-7)
    # q is flat at its peak: its strain is found to less digits
    assert_allclose(curve.eps_1[-1], of_kind(reference, "q_peak", "eps_1")[0], rtol=1e-6)
    assert_allclose(curve.eps_v, 0.0, atol=1e-15)
    assert abs(float(curve.det_control[-1])) < 1e-8  # 1 at the beginning; events are found to 1e-9
    assert (np.diff(curve.q) > -1e-9 * P).all()


def test_controlled_in_q_the_stable_branch_is_the_same():
    """Up to 0.9 of the peak the two ways of driving an undrained test give one curve, to the tolerance of the steps."""
    control = rd.Control.of_strains(AXIAL_UNDRAINED, ("stress", "strain", "strain"))
    point, other = (rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9) for _ in range(2))
    point.load(Path("q imposed", control, stress=(170e3, None, None)))
    other.load(rd.paths.constant_volume(float(point.strain[0, 0])))
    assert_allclose(np.diag(other.stress), np.diag(point.stress), rtol=1e-12)


@pytest.mark.parametrize("until_strain", [0.1, 0.2, 0.3, 0.5])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_stress_ratio_is_reached_exactly(formulation, until_strain):
    """`until_eta` stops at the ratio to 1e-9, from below and above, however long the path could have been."""
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, 0.9)
    for eta, extension in ((0.5, False), (0.6, False), (0.3, True), (0.8, False), (-0.2, True)):
        path = rd.paths.drained_triaxial(until_strain, until_eta=eta, extension=extension)
        curve = point.load(path)
        assert curve.attrs["stopped_by"] == "eta"
        assert_allclose(curve.eta[-1], eta, rtol=0, atol=1e-9)
    # where it stands already, nothing moves
    before = point.save().checksum
    point.load(rd.paths.drained_triaxial(until_strain, until_eta=float(curve.eta[-1])))
    assert point.save().checksum == before


def test_a_peak_is_passed_by_its_drop():
    """`until_peak` stops where q has fallen by 5 % of its largest change."""
    curve = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).load(rd.paths.constant_volume(0.3, until_peak=True))
    assert curve.attrs["stopped_by"] == "peak"
    assert_allclose(curve.q[-1], 0.95 * of_kind(curve, "q_peak", "q")[0], rtol=1e-3)


def test_held_stresses_are_brought_to_their_value_first():
    """A lateral stress other than the present one is ramped at rest of the axial strain, then held."""
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    curve = point.load(rd.paths.drained_triaxial(0.01, lateral_stress=1.2 * P))
    assert_allclose(curve.sigma_3[-1], 1.2 * P, rtol=1e-12)
    ramp = curve.sigma_3 < 1.2 * P * (1 - 1e-12)
    assert bool(ramp[0])
    assert_allclose(curve.eps_1[ramp], 0.0, atol=1e-15)
    assert_allclose(curve.eps_1[-1], 0.01, rtol=1e-12)


# --- cones ---------------------------------------------------------------------------------------------


def drained(eta):
    return rd.paths.drained_triaxial(0.5, until_eta=eta)


STATES = {
    f"{formulation} {void_ratio} {name}": (formulation, void_ratio, path)
    for formulation in FORMULATIONS
    for void_ratio, name, path in [
        (0.90, "drained 0.3", drained(0.3)),
        (0.90, "drained 0.8", drained(0.8)),
        (0.90, "drained 0.95", drained(0.95)),
        (0.90, "drained 1.05", drained(1.05)),
        (0.90, "drained 1.1", drained(1.1)),
        (0.90, "undrained 0.3 %", rd.paths.constant_volume(0.003)),
        (0.90, "undrained 1.2 %", rd.paths.constant_volume(0.012)),
        (0.90, "undrained 3 %", rd.paths.constant_volume(0.03)),
        (0.60, "drained 0.8", drained(0.8)),
        (0.60, "drained 1.2", drained(1.2)),
        (0.60, "undrained 0.6 %", rd.paths.constant_volume(0.006)),
        (0.60, "undrained 1.2 %", rd.paths.constant_volume(0.012)),
        (0.60, "undrained 3 %", rd.paths.constant_volume(0.03)),
    ]
}


_PROBED = {}


def state(name):
    """The point at the end of its path."""
    formulation, void_ratio, path = STATES[name]
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, void_ratio)
    point.load(path)
    return point


def probed_cone(name, point):
    """By probes of 1e-8 of strain, 1e-5 of the elastic strain of the stress; found once."""
    if name not in _PROBED:
        around = rd.directions.rendulic(step=2)
        _PROBED[name] = rd.instability_cone(point, around, norm=1e-8, tolerance=0.02)
    return _PROBED[name]


@pytest.mark.parametrize("name", STATES)
def test_cone_from_tangents_is_the_cone_from_probes(name):
    """The sectors of the closed form are those that probing and bisection find, to their tolerance.

    Beyond half of it, the finite size of the probes turns an edge by less than 2e-3 degrees.
    """
    point = state(name)
    closed, probed = closed_form_cone(point), probed_cone(name, point)
    assert len(closed) == len(probed.sectors)
    assert_allclose(np.reshape(closed, -1), np.reshape(probed.sectors, -1), rtol=0, atol=0.5 * 0.02 + 2e-3)


@pytest.mark.parametrize("name", STATES)
def test_hill_is_positive_where_the_cone_is_empty(name):
    """Smallest eigenvalues of all tangents around: none negative without a cone, one negative within it."""
    point = state(name)
    cone = probed_cone(name, point)
    hill = [stability(point, increment_along(alpha)).hill for alpha in range(0, 360, 10)]
    inside = [stability(point, increment_along(0.5 * (a + b))) for a, b in cone.sectors]
    assert min([*hill, *(own.hill for own in inside)]) > 0.0 or not cone.is_empty
    assert not any(own.is_stable for own in inside)


def test_both_kinds_of_states_are_compared():
    """Of the states above, some have a cone and some have none."""
    empty = [probed_cone(name, state(name)).is_empty for name in STATES]
    assert 10 < sum(empty) < len(empty) - 10


def test_cone_opens_in_the_papers_quadrant():
    """Loose: none at low stress ratio, then one among axial shortening and lateral extension, ever wider.

    It opens before the undrained direction is in it; the dense sand has none at the same ratios.
    """
    openings = []
    for eta in (0.3, 0.6, 0.95, 1.0, 1.05):
        loose, dense = (rd.ChangHicher(rule=bazant_oh_37()).at(P, void_ratio) for void_ratio in (0.90, 0.60))
        for point in (loose, dense):
            point.load(drained(eta))
        assert rd.instability_cone(dense, rd.directions.rendulic(step=2), norm=1e-8).is_empty
        cone = rd.instability_cone(loose, rd.directions.rendulic(step=2), norm=1e-8)
        assert all(90.0 < first < last < 180.0 for first, last in cone.sectors)
        openings.append(cone.opening)
    assert openings[:2] == [0.0, 0.0]
    assert (np.diff(openings[1:]) > 0.0).all()


@pytest.mark.parametrize("strain", [0.003, 0.01, 0.03])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_curve_says_what_the_tangent_says(formulation, strain):
    """Hill's eigenvalue, determinant and W2 on record are those of the tangent along the undrained strain rate."""
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, 0.9)
    rate = np.array([1.0, -0.5, -0.5])
    first = np.linalg.det(tangent(point, rate).stiffness)
    curve = point.load(rd.paths.constant_volume(strain))
    own = tangent(point, rate)
    # the same planes load: rounding, and the condition of the tangent
    assert_allclose(curve.hill[-1], stability(point, rate).hill, rtol=1e-11)
    assert_allclose(curve.w2[-1], rate @ own.stiffness[:3, :3] @ rate, rtol=1e-11)
    assert_allclose(curve.det_tangent[-1], np.linalg.det(own.stiffness) / first, rtol=1e-11)


def test_undrained_direction_enters_the_cone_at_the_peak():
    """Before the peak of q the isochoric direction is outside the cone, after it inside."""
    reference = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).load(rd.paths.constant_volume(0.02))
    peak = float(of_kind(reference, "q_peak", "eps_1")[0])
    for share, is_inside in ((0.995, False), (1.005, True)):
        point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
        point.load(rd.paths.constant_volume(share * peak))
        sectors = closed_form_cone(point)
        assert any(a < ISOCHORIC_COMPRESSION < b for a, b in sectors) == is_inside


def test_no_cone_in_elastic_states():
    """Neither in a virgin isotropic state, nor after a little unloading of a state that has one."""
    virgin = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    unloaded = state("consistent 0.9 drained 1.05")
    assert not rd.instability_cone(unloaded, norm=1e-8).is_empty
    unloaded.load(rd.paths.drained_triaxial(1e-4, extension=True))
    for point in (virgin, unloaded):
        assert closed_form_cone(point) == []
        cone = rd.instability_cone(point, norm=1e-8)
        assert cone.is_empty
        assert cone.opening == 0.0
        assert cone.smallest_w2n > 0.3
