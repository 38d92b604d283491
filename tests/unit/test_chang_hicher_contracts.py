"""What the Chang-Hicher model and the cone refuse and with which words, why paths stop, what datasets say."""

from __future__ import annotations

import inspect
import re
import warnings

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import rendulic as rd
from fakes import constant, single, working
from rendulic.chang_hicher import (
    MaterialPoint,
    Parameters,
    closed_form_cone,
    load_many,
    material,
    plane_law,
    stability,
    tangent,
)
from rendulic.chang_hicher.law.critical_state import critical_void_ratio, peak_friction
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.io.tables import read_dataset, write_dataset
from rendulic.loading.paths import Path
from rendulic.tensors.sphere_rules import SphereRule, bazant_oh_37, lebedev

P = 300e3
UNDRAINED = rd.paths.constant_volume(0.01)
NAN = float("nan")


@pytest.fixture
def point():
    """Hostun sand at 300 kPa, virgin."""
    return rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)


# --- states --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"void_ratio": 0.0}, "void_ratio must be a positive number, got 0.0"),
        ({"void_ratio": -0.5}, "void_ratio must be a positive number, got -0.5"),
        ({"void_ratio": NAN}, "void_ratio must be a positive number, got nan"),
        ({"void_ratio": "loose"}, "void_ratio must be a positive number, got 'loose'"),
        ({"void_ratio": 3.01}, "void_ratio must be between 0 and 3, got 3.01"),
        ({"pressure": 0.0}, "pressure must be a positive number in Pa, got 0.0"),
        ({"pressure": -1e5}, "pressure must be a positive number in Pa, got -100000.0"),
        ({"pressure": NAN}, "pressure must be a positive number in Pa, got nan"),
        ({"pressure": float("inf")}, "pressure must be a positive number in Pa, got inf"),
        ({"pressure": None}, "needs a pressure or a stress, one of the two"),
        ({"stress": P * np.eye(3)}, "needs a pressure or a stress, one of the two"),
        ({"pressure": 2e9}, "critical void ratio .* must be positive: lower the pressure below 1e.09 Pa"),
    ],
    ids=str,
)
def test_states_refused(given, words):
    """Void ratio and pressure out of range, both or neither of pressure and stress, no critical void ratio."""
    with pytest.raises(InvalidInput, match=words):
        rd.ChangHicher(rule=bazant_oh_37()).at(**({"pressure": P, "void_ratio": 0.9} | given))


@pytest.mark.parametrize(
    ("stress", "words"),
    [
        (np.diag([900e3, 100e3, 100e3]), r"the stress \[900.0, 100.0, 100.0\] kPa puts a contact plane .* friction"),
        (np.diag([300e3, 300e3, -1e3]), "puts a contact plane in tension"),
        (np.diag([-300e3] * 3), "mean stress must be compressive"),
        (np.zeros((3, 3)), "mean stress must be compressive"),
        (np.array([[3e5, 1e5, 0], [0, 3e5, 0], [0, 0, 3e5]]), "stress must be symmetric"),
        (np.eye(2), r"stress must have shape \(3, 3\), got \(2, 2\)"),
        (np.full((3, 3), NAN), "stress must be finite everywhere"),
    ],
    ids=["beyond friction", "tension", "negative", "none", "skew", "shape", "NaN"],
)
def test_stresses_refused(stress, words):
    """What planes cannot carry, and what is no stress."""
    with pytest.raises(InvalidInput, match=words):
        rd.ChangHicher(rule=bazant_oh_37()).at(stress=stress, void_ratio=0.9)


def test_a_dense_sand_carries_more():
    """The same stress is beyond the friction of loose planes and within that of dense ones."""
    stress = np.diag([560e3, 140e3, 140e3])
    with pytest.raises(InvalidInput, match="beyond its peak friction"):
        rd.ChangHicher(rule=bazant_oh_37()).at(stress=stress, void_ratio=0.95)
    assert_allclose(rd.ChangHicher(rule=bazant_oh_37()).at(stress=stress, void_ratio=0.55).stress, stress, rtol=1e-15)


# --- parameters ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"k_pr": 1.0}, "k_pr: there is no such entry; did you mean 'k_pR'"),
        ({"dilatency": 1.0}, "dilatency: there is no such entry; did you mean 'dilatancy'"),
        ({"k_n0": 0.0}, "k_n0: Input should be greater than 0, got 0"),
        ({"k_n0": NAN}, "k_n0: Input should be a finite number, got nan"),
        ({"k_n0": "stiff"}, "k_n0: Input should be a valid number.* got 'stiff'"),
        ({"f_ref": -1.0}, "f_ref: Input should be greater than 0, got -1"),
        ({"exponent": 1.0}, "exponent: Input should be less than 1, got 1"),
        ({"exponent": -0.1}, "exponent: Input should be greater than or equal to 0, got -0.1"),
        ({"k_rR": 1.6}, "k_rR: Input should be less than or equal to 1.5, got 1.6"),
        ({"k_rR": 0.0}, "k_rR: Input should be greater than 0, got 0"),
        ({"k_pR": 0.0}, "k_pR: Input should be greater than 0, got 0"),
        ({"dilatancy": 11.0}, "dilatancy: Input should be less than or equal to 10, got 11"),
        ({"dilatancy": NAN}, "dilatancy: .* got nan"),
        ({"tan_phi_mu": 2.1}, "tan_phi_mu: Input should be less than or equal to 2, got 2.1"),
        ({"tan_phi_0": 0.0}, "tan_phi_0: Input should be greater than 0, got 0"),
        ({"e_ref": 0.0}, "e_ref: Input should be greater than 0, got 0"),
        ({"critical_slope": -0.1}, "critical_slope: Input should be greater than or equal to 0, got -0.1"),
        ({"p_ref": 0.0}, "p_ref: Input should be greater than 0, got 0"),
        ({"interlocking": -1.0}, "interlocking: Input should be greater than or equal to 0, got -1"),
        ({"branch_length": -1e-3}, "branch_length: Input should be greater than 0, got -0.001"),
    ],
    ids=str,
)
def test_parameters_refused(parameters, words):
    """Unknown names with the nearest valid one, values with the range that they are out of."""
    with pytest.raises(InvalidInput, match=words):
        rd.ChangHicher(rule=bazant_oh_37(), **parameters)


@pytest.mark.parametrize("formulation", plane_law.FORMULATIONS)
def test_stiffness_that_snaps_back_is_refused(formulation):
    """`B > 0` is violated: the message names the formula and what to change, and the bound that it gives is enough."""
    own = {"dilatancy": 3.0, "formulation": formulation}
    words = r"k_rR = 0.05 is too small: B > 0 .*k_rR > D\^2 t\^4 / \(4 \(k_pR \+ D t\^2\)\).*raise k_rR"
    with pytest.raises(InvalidInput, match=words) as refusal:
        rd.ChangHicher(rule=bazant_oh_37(), k_rR=0.05, **own)
    bound = float(re.search(r"needs k_rR > ([0-9.]+) with", str(refusal.value))[1])
    assert 0.05 < bound <= plane_law.least_shear_ratio(1.0, 3.0, 0.65) * 1.001
    assert rd.ChangHicher(rule=bazant_oh_37(), k_rR=1.001 * bound, **own).parameters.k_rR > bound


@pytest.mark.parametrize("formulation", plane_law.FORMULATIONS)
@pytest.mark.parametrize("void_ratio", [0.45, 0.60, 0.80, 0.95])
def test_admitted_states_never_snap_back(formulation, void_ratio):
    """Where a state is admitted, `B > 0` at every obliquity up to the peak, with the formulation's own slope."""
    admitted = 0
    for k_r, k_p, factor in [(0.02, 0.5, 9.0), (0.05, 0.5, 1.0), (0.15, 0.5, 2.0), (0.22, 1.0, 3.0), (0.37, 1.0, 5.0), (0.57, 2.0, 8.0),
                             (0.40, 1.0, 1.0), (1.20, 1.0, 8.0)]:  # fmt: skip
        try:
            own = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, k_rR=k_r, k_pR=k_p, dilatancy=factor)
            own.at(P, void_ratio)
        except InvalidInput:
            continue
        admitted += 1
        e_c = critical_void_ratio(P, 1.0, 0.2, 10e3)
        tan_peak = peak_friction(void_ratio, e_c, 1.0, 0.65)
        eta = np.linspace(0.0, 1.0, 301) * tan_peak
        slope = plane_law.loading_slope(eta, tan_peak, 0.5) if formulation == "consistent" else eta
        beta = plane_law.dilatancy(factor, tan_peak if formulation == "printed" else 0.65, eta)
        b = plane_law.stiffness_denominator(1.0, k_r, plane_law.hardening_modulus(k_p, eta / tan_peak), slope, beta)
        assert b.min() > 0.0, (k_r, k_p, factor)
    assert 0 < admitted < 8


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"formulation": "consistant"}, "unknown formulation 'consistant': did you mean 'consistent'"),
        ({"formulation": None}, "unknown formulation 'None': valid ones are printed, eq32, consistent"),
        ({"fabric": np.eye(3)}, "fabric must be a symmetric tensor of trace 1"),
        ({"fabric": np.diag([0.4, 0.3, 0.3]) + 0.1 * np.eye(3, k=1)}, "fabric must be a symmetric tensor of trace 1"),
        ({"fabric": np.diag([0.9, 0.05, 0.05])}, "too anisotropic: the density of contacts would be -1.1"),
        ({"fabric": np.eye(2)}, r"fabric must have shape \(3, 3\), got \(2, 2\)"),
        ({"fabric": np.full((3, 3), NAN)}, "fabric must be finite everywhere"),
    ],
    ids=["misspelt", "none", "trace", "skew", "anisotropic", "shape", "NaN"],
)
def test_models_refused(options, words):
    """Unknown formulations, and fabrics that no packing has."""
    with pytest.raises(InvalidInput, match=words):
        rd.ChangHicher(rule=bazant_oh_37(), **options)


@pytest.mark.parametrize("make", [material, rd.ChangHicher.preset])
def test_unknown_presets(make):
    """The nearest name is suggested."""
    with pytest.raises(InvalidInput, match="unknown material 'hostun_lose': did you mean 'hostun_loose'"):
        make("hostun_lose")


def test_signatures_show_every_option():
    """Parameters of a sand by name, with their defaults where they hold; nothing hides behind `**`."""
    shown = inspect.signature(rd.ChangHicher).parameters
    assert {name: shown[name].default for name in Parameters.model_fields} == dict(Parameters())
    for make in (rd.ChangHicher.preset, rd.ChangHicher.with_parameters):
        assert set(Parameters.model_fields) <= set(inspect.signature(make).parameters)
    for owner in (rd.ChangHicher, MaterialPoint):
        methods = [function for name, function in inspect.getmembers(owner, callable) if not name.startswith("_")]
        assert len(methods) >= 5
        for parameter in (own for function in methods for own in inspect.signature(function).parameters.values()):
            assert parameter.kind not in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL), parameter


def test_presets_are_the_papers():
    """Sections 5.2 and 5.3 of the paper, and what is given beside a preset replaces its value."""
    sand, base = material("hostun_loose"), material("fig6_base")
    assert (sand.e_ref, sand.critical_slope, sand.p_ref, sand.interlocking) == (1.0, 0.2, 10e3, 1.0)
    assert (sand.exponent, sand.k_rR, sand.k_pR, sand.tan_phi_mu, sand.dilatancy) == (0.5, 0.4, 1.0, 0.65, 1.0)
    assert (base.k_n0, base.k_rR, base.k_pR, base.dilatancy, base.tan_phi_mu) == (15e3, 0.5, 1.0, 1.0, 0.65)
    changed = rd.ChangHicher.preset("fig6_base", k_pR=2.0, formulation="printed")
    assert (changed.parameters.k_pR, changed.parameters.k_rR, changed.formulation) == (2.0, 0.5, "printed")
    assert rd.ChangHicher(rule=bazant_oh_37(), **sand).parameters == sand


# --- sphere rules --------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", [4, 6, 33, 37, 133])
def test_lebedev_degrees_that_do_not_exist(degree):
    """The degree is named, and those that there are."""
    with pytest.raises(InvalidInput, match=f"no Lebedev rule of degree {degree} .*: there are 3, 5, 7"):
        lebedev(degree)


@pytest.mark.parametrize("degree", [0, 2, -5, 5.5, "five", NAN])
def test_degrees_that_are_none(degree):
    """A whole number of at least 3."""
    with pytest.raises(InvalidInput, match="degree of a Lebedev rule must be a whole number of at least 3"):
        lebedev(degree)


@pytest.mark.parametrize("degree", [13, 25, 27])
def test_lebedev_rules_with_negative_weights(degree):
    """They exist, and serve no packing: no plane has less than no contacts. The message names degree and reason."""
    with pytest.raises(InvalidInput, match=f"degree {degree} with positive weights"):
        lebedev(degree)


@pytest.mark.parametrize(
    ("normals", "weights", "words"),
    [
        ([[1, 0, 0]], [0.5], "weights of a sphere rule must be positive and of sum 1, got 0.5"),
        ([[1, 0, 0], [0, 1, 0]], [1.5, -0.5], "weights of a sphere rule must be positive"),
        ([[2, 0, 0]], [1.0], "normals of a sphere rule must be unit vectors"),
        (np.zeros((0, 3)), [], "normals of a sphere rule must be unit vectors"),
        ([[1, 0]], [1.0], r"normals of a sphere rule must have shape \(n, 3\)"),
        ([[1, 0, 0]], [0.5, 0.5], r"weights of a sphere rule must have shape \(1\), got \(2,\)"),
    ],
)
def test_sphere_rules_refused(normals, weights, words):
    """Points off the sphere, weights that do not average."""
    with pytest.raises(InvalidInput, match=words):
        SphereRule("made up", normals, weights, 3)


@pytest.mark.parametrize(
    ("rotation", "words"),
    [(2 * np.eye(3), "orthogonal"), (np.eye(2), "a rotation must have shape"), (NAN * np.eye(3), "finite")],
)
def test_rotations_refused(rotation, words):
    """Rules are turned by orthogonal matrices."""
    with pytest.raises(InvalidInput, match=words):
        bazant_oh_37().rotated(rotation)


# --- loading -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tolerance": 0.0}, "tolerance must be a positive number, got 0.0"),
        ({"tolerance": NAN}, "tolerance must be a positive number, got nan"),
        ({"tolerance": 0.02}, "tolerance must be at most 0.01, got 0.02"),
        ({"least_records": 0}, "least_records must be a whole number of at least 1, got 0"),
        ({"least_records": 2.5}, "least_records must be a whole number of at least 1, got 2.5"),
    ],
    ids=str,
)
def test_options_refused(point, options, words):
    """Options of a load, before anything moves."""
    before = point.save().checksum
    with pytest.raises(InvalidInput, match=words):
        point.load(UNDRAINED, **options)
    assert point.save().checksum == before


def q_imposed(q):
    """Undrained, with q brought to a value."""
    control = rd.Control.of_strains([[1, 0, 0], [1, 1, 1], [0, 1, -1]], ("stress", "strain", "strain"))
    return Path("q imposed", control, stress=(q, None, None))


def test_impossible_controls_are_told(point):
    """Beyond the peak q cannot be raised undrained: nothing moves, and the message says path, reason and state."""
    point.load(rd.paths.constant_volume(0.02))
    before = point.save().checksum
    words = (
        r"path 'q imposed' cannot be followed .*\(loss of controllability\): MaterialPoint\(stress=\(2.*void_ratio=0.9"
    )
    with pytest.raises(InvalidInput, match=words):
        point.load(q_imposed(1e6))
    assert point.save().checksum == before


@pytest.mark.parametrize(
    ("formulation", "void_ratio", "path", "reason"),
    [
        ("consistent", 0.90, q_imposed(1e6), "loss of controllability"),
        ("eq32", 0.55, rd.paths.drained_triaxial(0.3), "plastic limit"),
        ("consistent", 0.90, rd.paths.oedometric(0.1, extension=True), "no stress left"),
        ("consistent", 0.90, rd.paths.isotropic(1.0), "no stress left"),
        ("consistent", 0.55, rd.paths.drained_triaxial(0.3), "strain"),
        ("consistent", 0.90, rd.paths.drained_triaxial(0.3, until_eta=0.5), "eta"),
        ("consistent", 0.90, rd.paths.constant_volume(0.3, until_peak=True), "peak"),
        ("consistent", 0.90, rd.paths.isotropic(2 * P), "target"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_why_paths_stop(formulation, void_ratio, path, reason):
    """`stopped_by` says it, the state where it stopped is finite, admissible, and the last on record."""
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, void_ratio)
    curve = point.load(path)
    assert curve.attrs["stopped_by"] == reason
    assert_allclose(np.diag(point.stress), [curve[f"sigma_{k}"][-1] for k in (1, 2, 3)], rtol=0, atol=0)
    assert_allclose(np.diag(point.strain), [curve[f"eps_{k}"][-1] for k in (1, 2, 3)], rtol=0, atol=0)
    assert np.isfinite(point.save().arrays["memory"]).all()
    assert float(point.planes()["sigma"].min()) > 0.0
    assert float(curve.x_plane.max()) < 1.0


def test_at_the_plastic_limit_a_plane_is_there():
    """`eq32` stops where x is 1 to 1e-6, where the determinant of that plane's K vanishes; `consistent` goes on."""
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation="eq32").at(P, 0.55)
    curve = point.load(rd.paths.drained_triaxial(0.3))
    assert_allclose(curve.x_plane[-1].max(), 1.0, rtol=0, atol=1.1e-6)
    assert float(curve.eps_1[-1]) < 0.29
    assert stability(point, [1.0, -0.3, -0.3]).least_plane_determinant < 1e-9


def test_no_stress_left_is_said_of_a_plane():
    """The path ends where some plane has lost nearly all of its normal stress, and others have not."""
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    point.load(rd.paths.oedometric(0.1, extension=True))
    assert 0.0 < point.planes()["sigma"].min() < 2e-3 * P
    assert point.planes()["sigma"].max() > 1.5 * point.planes()["sigma"].min()


def test_a_void_ratio_never_vanishes():
    """Crushed towards no voids the contacts stiffen without end: the path stops, with a reason, before e = 0."""
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.10)
    curve = point.load(rd.paths.isotropic(8e8), least_records=1, tolerance=1e-4)
    assert curve.attrs["stopped_by"] == "no voids left"
    # the root of that, as exact as that of any event
    assert_allclose(point.void_ratio, 0.02, rtol=0, atol=1e-9)
    assert curve.sizes["record"] < 100


@pytest.mark.parametrize("formulation", ["consistent", "eq32", "printed"])
def test_a_critical_void_ratio_that_vanishes_is_the_cause(formulation):
    """Beyond the mean stress where Eq. 34 is zero there is no friction: the path says so, and where it is."""
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, critical_slope=0.6).at(P, 0.9)
    curve = point.load(rd.paths.isotropic(1e6))
    assert curve.attrs["stopped_by"] == "no critical void ratio left"
    # e_c = 1 - 0.6 log10(p / 10 kPa) = 0.001
    assert_allclose(curve.p[-1], 10e3 * 10 ** (0.999 / 0.6), rtol=1e-9)
    assert point.load(rd.paths.isotropic(1e6)).attrs["stopped_by"] == "no critical void ratio left"


def test_progress_and_records_are_told(point):
    """Progress ends at the whole path with a line that names it; `on_record` is given the point."""
    told, seen = [], []
    point.load(UNDRAINED, progress=lambda *a: told.append(a), on_record=lambda own: seen.append(own is point))
    assert told
    assert_allclose(told[-1][0], told[-1][1])
    assert "constant volume" in told[-1][2]
    assert seen
    assert all(seen)


# --- probing -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("increment", "kind", "words"),
    [
        ([0, 0, 0], "strin", "unknown kind of probe 'strin': did you mean 'strain'"),
        ([0, 0], "strain", r"increment must have shape \(3\), got \(2,\)"),
        ([NAN, 0, 0], "stress", "increment must be finite everywhere"),
    ],
)
def test_probes_refused(point, increment, kind, words):
    """Kinds and increments without meaning."""
    with pytest.raises(InvalidInput, match=words):
        point.probe(increment, kind=kind)


def test_a_probe_of_nothing_does_nothing(point):
    """No increment: the state stays, and every mark is called."""
    before, seen = point.save().checksum, []
    point.probe(np.zeros(3), marks=(0.5, 1.0), on_mark=seen.append)
    assert seen == [0.5, 1.0]
    assert point.save().checksum == before


def test_steps_of_a_disturbance_do_not_matter(point):
    """Probes and bursts of the model have no rate: thousands of steps give the bits of one, and no more records."""
    point.load(rd.paths.drained_triaxial(until_eta=0.8))
    clones = {n_steps: point.clone() for n_steps in (1, 5000)}
    for n_steps, own in clones.items():
        own.probe(np.array([1e-5, -2e-6, -2e-6]), n_steps)
    assert clones[1].save().checksum == clones[5000].save().checksum
    curves = [rd.burst(point, 125.0, 1e-5, rate=rate) for rate in (1e-5, 2e-9)]
    xr.testing.assert_identical(*curves)
    assert curves[0].sizes["record"] < 50


def test_a_stress_that_cannot_be_carried_is_not_reached():
    """A stress probe beyond the loose sand's strength stops on the way; the dataset says so, marks are called."""
    own = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    own.load(rd.paths.constant_volume(0.03))
    probes = rd.probe(own, rd.directions.axisymmetric([90.0, 215.26]), [1e3, 1e6], kind="stress")
    assert probes.is_reached.sel(alpha=90.0).values.tolist()[-1] is False
    assert np.isfinite(probes.d_eps).all()


@pytest.mark.parametrize("direction", [np.zeros(3), np.zeros((3, 3)), np.eye(3) + np.eye(3, k=1), [NAN, 0, 0], [1, 0]])
@pytest.mark.parametrize("ask", [tangent, stability])
def test_directions_refused(point, ask, direction):
    """A tangent needs a direction: a symmetric tensor other than zero."""
    with pytest.raises(InvalidInput, match=r"a strain direction must be|d_eps must"):
        ask(point, direction)


# --- batches -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"parameters": {"k_pR": [1, 2], "k_rR": [0.3, 0.4, 0.5]}}, r"arrays of one length, got lengths \[2, 3\]"),
        ({"parameters": {"k_pR": [1, 2]}, "void_ratio": [0.9, 0.8, 0.7]}, r"one length, got lengths \[2, 3\]"),
        ({"parameters": {"k_pR": [[1, 2]]}}, "must be numbers or arrays of one length"),
        ({"parameters": {"k_pr": [1, 2]}}, "unknown parameter 'k_pr': did you mean 'k_pR'"),
        ({"parameters": {"dilatency": 1}}, "unknown parameter 'dilatency': did you mean 'dilatancy'"),
        ({"parameters": {"pressure": [1, 2]}}, "unknown parameter 'pressure'"),
        ({"parameters": {"k_pR": NAN}}, "k_pR must be finite everywhere"),
        ({"parameters": {"k_pR": ["soft"]}}, "k_pR must be an array of numbers"),
        ({"parameters": {}, "n_records": 1}, "n_records must be a whole number of at least 2, got 1"),
        ({"parameters": {}, "workers": 0}, "workers must be a whole number of at least 1, got 0"),
        ({"parameters": {}, "tolerance": 1.0}, "tolerance must be at most 0.01, got 1"),
        ({"parameters": {}, "formulation": "eq23"}, "unknown formulation 'eq23': did you mean 'eq32'"),
        ({"parameters": {}, "fabric": np.eye(3)}, "fabric must be a symmetric tensor of trace 1"),
    ],
    ids=str,
)
def test_batches_refused(options, words):
    """Lengths, names, and what holds for all sets."""
    with pytest.raises(InvalidInput, match=words):
        load_many(path=UNDRAINED, **options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"parameters": {"k_pR": [1, -2]}}, "k_pR: Input should be greater than 0, got -2"),
        ({"parameters": {"k_pR": [1, NAN]}}, "k_pR must be a finite number, got nan"),
        ({"parameters": {"k_pR": [1, np.inf]}}, "k_pR must be a finite number, got inf"),
        ({"parameters": {"k_pR": [1, None]}}, "k_pR must be a finite number, got nan: is the entry empty?"),
        ({"parameters": {"k_pR": ["1", ""]}}, "k_pR must be a finite number, got nan: is the entry empty?"),
        ({"parameters": {"k_pR": 1, "k_rR": [0.4, 0.01], "dilatancy": 3}}, "k_rR = 0.01 is too small"),
        ({"parameters": {"k_pR": 1}, "void_ratio": [0.9, -1]}, "void_ratio must be a positive number, got -1"),
        ({"parameters": {"k_pR": 1}, "pressure": [3e5, 0]}, "pressure must be a positive number in Pa, got 0"),
        ({"parameters": {"k_pR": 1}, "pressure": [3e5, 1e12]}, "critical void ratio"),
    ],
    ids=str,
)
def test_a_bad_set_spoils_nothing_else(options, words):
    """Its verdict says what is wrong with it; the other set gives the same bits as alone."""
    batch = load_many(path=UNDRAINED, n_records=11, **options)
    kept = {name: value if np.ndim(value) == 0 else [float(value[0])] for name, value in options["parameters"].items()}
    state = {name: value[:1] for name, value in options.items() if name != "parameters"}
    alone = load_many(kept, UNDRAINED, n_records=11, **state)
    for name in ("q", "p", "eps_1", "q_peak", "stopped_by", "verdict"):
        np.testing.assert_array_equal(batch[name][0], alone[name][0])
    assert np.isfinite(batch.q[0]).all()
    assert batch.verdict.values[0] == "followed to the end (strain)"
    assert batch.verdict.values[1].startswith("refused: ")
    assert words in batch.verdict.values[1]
    assert batch.stopped_by.values[1] == "refused"
    assert np.isnan(batch.q[1]).all()
    assert np.isnan(batch.q_peak[1])


def test_no_sets_at_all():
    """An empty table gives an empty one."""
    assert load_many({"k_pR": []}, UNDRAINED, n_records=11).sizes == {"sample": 0, "record": 11}


def test_batches_say_where_they_stopped():
    """Two sands that stop short are NaN beyond, and `stopped_by` says why; the third goes to the end."""
    batch = load_many(
        {}, rd.paths.drained_triaxial(0.3), void_ratio=[0.5, 0.55, 0.95], formulation="eq32", n_records=31
    )
    assert batch.stopped_by.values.tolist() == ["plastic limit", "plastic limit", "strain"]
    assert batch.verdict.values.tolist()[1:] == ["stopped short: plastic limit", "followed to the end (strain)"]
    missing = np.isnan(batch.q.values)
    assert missing[:2, -1].all()
    assert not missing[2].any()
    assert not missing[:, 0].any()
    # once it has stopped, it stays so
    assert (np.diff(missing.astype(int), axis=1) >= 0).all()
    assert batch.sizes == {"sample": 3, "record": 31}
    assert batch.void_ratio.values.tolist() == [0.5, 0.55, 0.95]


# --- restoring -----------------------------------------------------------------------------------------


def without(name):
    """A state that lacks an array."""
    state = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).save()
    return rd.State(state.kind, {key: value for key, value in state.arrays.items() if key != name}, state.attributes)


def replaced(name, value):
    """A state with another array."""
    state = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).save()
    return rd.State(state.kind, state.arrays | {name: value}, state.attributes)


def said(**attributes):
    """A state with other attributes."""
    state = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).save()
    return rd.State(state.kind, state.arrays, state.attributes | attributes)


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (rd.State("assembly of grains", {}, {}), "kind 'Chang-Hicher point', got one of kind 'assembly of grains'"),
        (rd.State("Chang-Hicher point", {}, {}), "state of a Chang-Hicher point lacks the array"),
        (without("memory"), "state of a Chang-Hicher point lacks the array 'memory'"),
        (without("plane_weights"), "state of a Chang-Hicher point lacks the array 'plane_weights'"),
        (replaced("memory", np.zeros(3)), r"memory must have the shape \(37\), found \(3,\)"),
        (replaced("memory", np.r_[np.zeros(5), -1.0, np.zeros(31)]), "memory, row 5: expected zero or more, found -1"),
        (replaced("memory", np.zeros(37, ">f8")), "memory must be of float64, found >f8"),
        (replaced("plane_strain", np.zeros((37, 3))), "plane_strain must have the shape"),
        (replaced("plane_weights", np.ones(37)), "of sum 1"),
        (replaced("sigma", np.full(6, NAN)), "sigma, row 0: expected a finite number"),
        (replaced("sigma", np.zeros(6)), "sigma must be of positive mean stress"),
        (replaced("other", np.zeros(6)), "has an unknown array 'other'"),
        (said(void_ratio_0="0.9"), "void_ratio_0 must be a number above 0, found '0.9'"),
        (said(void_ratio_0=True), "void_ratio_0 must be a number above 0, found 'True'"),
        (said(void_ratio_0=10**400), "void_ratio_0 must be a number"),
        (said(parameters={"k_n0": -1.0}), "k_n0: Input should be greater than 0"),
        (said(formulation="other"), "unknown formulation 'other'"),
        (said(rule=None), "rule must be a name"),
    ],
)
def test_states_that_are_not_restored(point, state, words):
    """States of other specimens, incomplete ones, and ones whose arrays do not fit together."""
    before = point.save().checksum
    with pytest.raises(InvalidInput if state.kind != "Chang-Hicher point" else CorruptFile, match=words):
        point.restore(state)
    assert point.save().checksum == before


def test_grains_refuse_the_state_of_a_point(point):
    """And the other way round: an assembly of grains is not made from a material point."""
    with pytest.raises(InvalidInput):
        rd.dem.Assembly.from_state(point.save())


# --- inputs unchanged ----------------------------------------------------------------------------------


def test_inputs_are_unchanged():
    """Fabric, stress, increments, directions and samples are read and not written; later writes do no harm."""
    fabric, stress = np.diag([0.4, 0.3, 0.3]), np.diag([400e3, 300e3, 300e3])
    increment, direction = np.array([1e-5, 0.0, 0.0]), np.array([1.0, -0.5, -0.5])
    samples = {"k_pR": np.array([1.0, 2.0])}
    kept = [np.copy(array) for array in (fabric, stress, increment, direction, samples["k_pR"])]
    point = rd.ChangHicher(rule=bazant_oh_37(), fabric=fabric).at(stress=stress, void_ratio=0.9)
    point.probe(increment)
    tangent(point, direction)
    load_many(samples, UNDRAINED, n_records=5, fabric=fabric)
    for array, before in zip((fabric, stress, increment, direction, samples["k_pR"]), kept, strict=True):
        np.testing.assert_array_equal(array, before)
    checksum = point.save().checksum
    fabric[:], stress[:] = 0.0, 0.0
    point.stress[:] = 0.0
    point.strain[:] = 1.0
    assert point.save().checksum == checksum


# --- datasets ------------------------------------------------------------------------------------------

DATASETS = {
    "undrained": lambda: rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).load(rd.paths.constant_volume(0.05)),
    "no events": lambda: rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).load(rd.paths.isotropic(2 * P)),
    "two legs": lambda: (
        rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).load(rd.paths.drained_triaxial(0.01, lateral_stress=2e5))
    ),
    "batch": lambda: load_many({"k_pR": [1.0, 2.0]}, rd.paths.constant_volume(0.02), n_records=11),
    "probes": lambda: rd.probe(
        rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9), rd.directions.rendulic(step=60), norm=[1e-6, 1e-5]
    ),
}


@pytest.mark.parametrize("make", DATASETS.values(), ids=DATASETS)
def test_datasets_say_what_and_in_which_unit(make):
    """Every number has a name and a unit, and the whole its sign."""
    dataset = make()
    for name, values in dataset.data_vars.items():
        is_number = np.issubdtype(values.dtype, np.floating)
        assert {"long_name", "units"} <= set(values.attrs) or not is_number, name
    assert "positive" in dataset.attrs["sign"]


@pytest.mark.parametrize("make", DATASETS.values(), ids=DATASETS)
def test_datasets_come_back_from_a_file(make, tmp_path):
    """NetCDF and back: identical, to the bit and to the attribute, without a warning."""
    dataset = make()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = read_dataset(write_dataset(dataset, tmp_path / "table.nc"))
    xr.testing.assert_identical(again, dataset)


def test_curves_are_complete():
    """Planes and events come along: normals, weights of sum 1, one state for each event, in order."""
    curve = DATASETS["undrained"]()
    assert curve.sizes["plane"] == 37
    assert_allclose(curve.plane_weight.sum(), 1.0, rtol=1e-14)
    assert_allclose(np.linalg.norm(curve.plane_normal, axis=1), 1.0, rtol=1e-14)
    assert (np.diff(curve.event_eps_1) >= 0.0).all()
    assert set(curve.event_kind.values) >= {"w2_lost", "q_peak", "plane_w2_lost", "plane_unloads"}
    of_planes = np.char.startswith(curve.event_kind.values.astype(str), "plane")
    assert (curve.event_plane.values[of_planes] >= 0).all()
    assert (curve.event_plane.values[~of_planes] == -1).all()
    assert_allclose([curve.det_tangent[0], curve.det_control[0]], 1.0, rtol=1e-12)


# --- instability cone of any specimen ------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["strain", "stress"])
@pytest.mark.parametrize("tolerance", [1.0, 0.05])
@pytest.mark.parametrize(
    ("middle", "half"), [(130.0, 20.0), (133.37, 31.4159), (3.0, 15.0), (359.0, 40.0), (47.0, 150.0)]
)
def test_edges_of_a_made_up_cone(middle, half, tolerance, kind):
    """Both edges within half the bracket that is returned, which is no wider than asked; also across 0 degrees."""
    made = single(middle, half)
    cone = rd.instability_cone(made, norm=5e-5, kind=kind, tolerance=tolerance)
    assert cone.tolerance <= tolerance
    assert len(cone.sectors) == 1
    first, last = cone.sectors[0]
    assert 0.0 <= first < 360.0
    assert_allclose([(first - middle + half + 180.0) % 360.0, last - first], [180.0, 2 * half], rtol=0, atol=tolerance)
    assert abs((first - middle + half + 180.0) % 360.0 - 180.0) <= 0.5 * cone.tolerance + 1e-9
    assert_allclose(cone.opening, last - first, rtol=1e-15)
    assert not cone.is_empty
    # the smallest value is that of the middle, to the distance of the directions
    least = np.cos(np.radians(half)) - 1.0
    assert_allclose(cone.smallest_w2n, least / np.hypot(least, 1.0), rtol=0, atol=0.01)
    assert abs((cone.smallest_alpha - middle + 180.0) % 360.0 - 180.0) <= 5.0
    assert cone.is_significant


def test_two_sectors():
    """Opposite sectors, as a linear material has them, are told apart; one of them lies across 0 degrees."""
    cone = rd.instability_cone(working(lambda a: 0.5 - np.cos(2 * np.radians(a))), tolerance=0.1)
    assert_allclose(cone.sectors, [(150.0, 210.0), (330.0, 390.0)], rtol=0, atol=0.05 + 1e-9)
    assert_allclose(cone.opening, 120.0, rtol=0, atol=0.2)


@pytest.mark.parametrize(("work", "sectors"), [(-0.3, ((0.0, 360.0),)), (0.3, ())])
def test_everywhere_and_nowhere(work, sectors):
    """A cone all around, or none: no edge, and no bracket."""
    cone = rd.instability_cone(constant(work))
    assert cone.sectors == sectors
    assert cone.is_empty == (work > 0)
    assert (cone.tolerance, cone.opening) == (0.0, 360.0 if work < 0 else 0.0)
    assert len(cone.probes.alpha) == 36


def test_a_sector_between_directions_is_found():
    """One of 4 degrees lies between directions 10 degrees apart; with directions 1 degree apart it is the same."""
    made = single(135.0, 2.0)
    for directions in (None, rd.directions.rendulic(step=1)):
        cone = rd.instability_cone(made, directions, tolerance=0.01)
        assert_allclose(cone.sectors, [(133.0, 137.0)], rtol=0, atol=0.006)


def test_probes_of_a_cone_come_along():
    """Sorted, each direction once, with those that the bisection added; the specimen as it was."""
    made = single(133.0, 20.0)
    cone = rd.instability_cone(made, tolerance=0.1)
    alpha = cone.probes.alpha.values
    assert (np.diff(alpha) > 0.0).all()
    # two edges, bisected seven times from 10 degrees to less than 0.1
    assert len(alpha) == 36 + 2 * 7
    assert_allclose(made.sigma, 0.0, atol=0)
    assert cone.probes.w2_normalised.attrs["units"] == "1"


def test_drift_is_no_instability():
    """A stress that drifts makes W2 negative somewhere: no cone is there for sure, and no stability either."""
    norm = 5e-5
    cone = rd.instability_cone(constant(1.0, drift=-3.0 * norm * np.array([1.0, 0.0, 0.0])), norm=norm)
    assert cone.sectors == ()
    assert cone.verdict == "unknown"
    assert not cone.is_empty
    assert not cone.is_significant
    assert rd.instability_cone(constant(-1.0), norm=norm).is_significant


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tolerance": 0.0}, "tolerance of a cone's edges must be a positive number in degrees, got 0.0"),
        ({"tolerance": NAN}, "tolerance of a cone's edges must be a positive number"),
        ({"norm": -1e-5}, "norm must be a positive number, got -1e-05"),
        ({"norm": [1e-5, 1e-4]}, "norm must be a positive number"),
        ({"kind": "strains"}, "unknown kind of probe 'strains': did you mean 'strain'"),
        ({"n_steps": 0}, "n_steps must be a whole number of at least 1, got 0"),
    ],
    ids=str,
)
def test_cones_refuse(options, words):
    """Tolerances, norms and kinds without meaning."""
    with pytest.raises(InvalidInput, match=words):
        rd.instability_cone(constant(1.0), **options)


def test_states_of_points_are_told_in_their_repr(point):
    """Stress in kPa, void ratio, and what of the sand is not the default."""
    assert repr(point).startswith("MaterialPoint(stress=(300.0, 300.0, 300.0) kPa, void_ratio=0.9000, ChangHicher(")
    assert "k_pR=0.7" in repr(rd.ChangHicher(rule=bazant_oh_37(), k_pR=0.7))
    assert isinstance(point, MaterialPoint)
    assert closed_form_cone(point) == []
