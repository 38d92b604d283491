"""What assemblies, packings, loadings and probes refuse, and with which words."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import rendulic as rd
from rendulic.foundation.errors import DidNotConverge, InvalidInput, NotEquilibrated, UnstableTimeStep

BOX = [0.0, 1.0] * 3
TWO = {"position": [[0.5, 0.5, 0.5], [0.52, 0.5, 0.5]], "radius": [0.01, 0.01], "walls": BOX}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radius": [0.01, -0.01]}, r"radii must be positive; 1 are not, the smallest is -0.01 m \(grain 1\)"),
        ({"radius": [0.0, 0.01]}, "radii must be positive"),
        ({"radius": [np.nan, 0.01]}, r"radius must be finite everywhere; 1 entries are not, the first at \(0,\)"),
        ({"radius": [0.01]}, r"position must have shape \(1, 3\), got \(2, 3\)"),
        ({"radius": ["small", "large"]}, "radius must be an array of numbers"),
        ({"radius": [[0.01, 0.01]]}, r"radius must have shape \(n\), got \(1, 2\)"),
        ({"position": np.zeros((0, 3)), "radius": []}, "at least one grain, got none"),
        ({"position": [[0.5, 0.5, np.inf], [0.1, 0.1, 0.1]]}, r"position must be finite everywhere.*\(0, 2\)"),
        ({"position": [[0.5, 0.5], [0.1, 0.1]]}, r"position must have shape \(2, 3\), got \(2, 2\)"),
        ({"position": [[0.5, 0.5, 0.5], [0.504, 0.5, 0.5]]}, r"overlap by more than half.*grains 0 and 1 \(1.60 radii\)"),
        ({"position": [[0.5, 0.5, 0.5]] * 2}, r"grains 0 and 1 \(2.00 radii\)"),
        ({"walls": [0, 1, 1, 0, 0, 1]}, "each upper wall must lie above its lower wall"),
        ({"walls": [0, 1, 0.5, 0.5, 0, 1]}, "each upper wall must lie above its lower wall"),
        ({"walls": [0, 1]}, r"walls must have shape \(6\), got \(2,\)"),
        ({"walls": [0, 1, np.nan, 1, 0, 1]}, r"walls must be finite everywhere.*\(2,\)"),
        ({"density": 0.0}, "density must be a positive number in kg/m3, got 0.0"),
        ({"density": np.nan}, "density must be a positive number"),
        ({"damping": 1.0}, r"damping must be in \[0, 1\), got 1.0"),
        ({"damping": np.nan}, "damping must be in"),
        ({"time_step_fraction": 0.58}, r"time_step_fraction must be in \(0, 0.58\), got 0.58"),
        ({"velocity": [[0, 0, 0], [0, np.nan, 0]]}, r"velocity must be finite everywhere.*\(1, 1\)"),
        ({"angular_velocity": [1, 2, 3]}, r"angular_velocity must have shape \(2, 3\), got \(3,\)"),
        ({"position": [[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]]}, "outside"),
        ({"position": [[0.5, 0.5, 0.5], [0.004, 0.5, 0.5]]}, "wall"),
    ],
)  # fmt: skip
def test_assembly_refuses(change, words):
    """Each bad argument alone is refused with what was expected and what came."""
    rd.dem.Assembly(**TWO)
    with pytest.raises(InvalidInput, match=words):
        rd.dem.Assembly(**TWO | change)


@pytest.mark.parametrize("time_step", [1.0, 0.0, -1e-6, np.nan, np.inf])
def test_time_steps_beyond_the_limit_are_refused(time_step, packed):
    """At construction and later, with the limit in the message; the present step stays."""
    with pytest.raises(UnstableTimeStep, match=r"positive and at most .* got"):
        rd.dem.Assembly(**TWO, time_step=time_step)
    before = packed.time_step
    with pytest.raises(UnstableTimeStep):
        packed.set_time_step(time_step)
    assert packed.time_step == before


def test_time_step_limit_is_sharp(packed):
    """Just below 0.58 of the critical step is taken, just above is not."""
    from rendulic.dem.measure.time_step import critical_time_step

    limit = 0.58 * critical_time_step(packed)
    packed.set_time_step(0.9999 * limit)
    assert packed.time_step == 0.9999 * limit
    with pytest.raises(UnstableTimeStep):
        packed.set_time_step(1.0001 * limit)


@pytest.mark.parametrize(
    ("column", "value"),
    [(column, value) for column in ("velocity", "angular_velocity", "force", "torque") for value in (np.nan, np.inf)]
    + [("velocity", 1e9), ("force", 1e12)],
)
def test_diverged_motion_is_caught(packed, straining, column, value):
    """Not-a-number or infinity of one grain raises within a few steps, in any column, and so does absurd speed.

    An absurd but finite spin does not count: friction bounds what it can do to others.
    """
    getattr(packed.grains, column)[17, 1] = value
    with pytest.raises(UnstableTimeStep, match=r"diverged|torn apart"):
        packed.advance(50, straining())


def test_a_step_far_beyond_the_limit_is_caught(packed, straining):
    """A time step forced to four times the usual one diverges and is told."""
    packed.time_step *= 4
    with pytest.raises(UnstableTimeStep):
        packed.advance(5000, straining((0.1, 0.0, 0.0)))


def test_walls_that_are_not_numbers_are_caught(packed, straining):
    """A strain rate that is not a number must not end in a specimen without walls."""
    with pytest.raises((UnstableTimeStep, InvalidInput)):
        packed.advance(50, straining((np.nan, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("stiffness_rule", "harmonc", "unknown stiffness rule 'harmonc': did you mean 'harmonic'"),
        ("modulus", -1.0, "modulus must be a positive number, got -1.0"),
        ("tangential_ratio", np.inf, "tangential_ratio must be a positive number"),
        ("friction", -0.1, "friction must be zero or a positive number"),
        ("friction", np.nan, "friction must be zero or a positive number"),
    ],
)
def test_law_refuses(field, value, words):
    """Numbers without meaning and unknown rules, the nearest valid one named."""
    with pytest.raises(InvalidInput, match=words):
        rd.dem.LinearFrictional(**{field: value})


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"n_grains": 5}, InvalidInput, "at least 20, got 5"),
        ({"n_grains": 30.5}, InvalidInput, "whole number"),
        ({"n_grains": None}, InvalidInput, "give n_grains, or at least 20 radii; got 2 radii"),
        ({"radius": (-1.0, 1.0)}, InvalidInput, "radii must be positive, got -1 m"),
        ({"radius": (0.012, 0.008)}, InvalidInput, r"radius must be \(smallest, largest\)"),
        ({"radius": (0.01, np.nan)}, InvalidInput, "radius must be finite"),
        ({"pressure": -1.0}, InvalidInput, "pressure must be a positive number in Pa, got -1.0"),
        ({"pressure": np.nan}, InvalidInput, "pressure must be a positive number"),
        ({"porosity": 0.1}, InvalidInput, "between 0.2 and 0.6, got 0.1"),
        ({"porosity": np.nan}, InvalidInput, "between 0.2 and 0.6"),
        ({"growth_friction": -1.0}, InvalidInput, "friction must be zero or a positive"),
        ({"density": -5.0}, InvalidInput, "density must be a positive"),
        ({"porosity": 0.3}, DidNotConverge, "without friction the packing has porosity .* 0.3 is denser than spheres"),
        ({"porosity": 0.58}, DidNotConverge, "denser than the 0.58 asked for: use more friction"),
        ({"pressure": 1e8}, InvalidInput, "a pressure of 1e\\+08 Pa is unreachable with these contacts"),
        ({"pressure": 1e-3}, InvalidInput, "a pressure of 0.001 Pa is unreachable with these contacts"),
        ({"seed": -1}, InvalidInput, "seed must be a whole number of at least 0, got -1"),
        ({"density": "x"}, InvalidInput, "density must be a positive number in kg/m3, got 'x'"),
    ],
)
def test_pack_refuses_or_says_how_far_it_came(change, error, words, fast):
    """Numbers that make no packing, and targets that spheres do not reach."""
    with pytest.raises(error, match=words):
        rd.dem.pack(**{"n_grains": 40, "radius": (8e-3, 12e-3), "speed": fast} | change)


def test_rest_that_is_not_reached_is_an_error(packed, straining):
    """With too few steps `bring_to_rest` raises, or returns the verdict if not strict."""
    packed.advance(50, straining((30.0, -20.0, 0.0)))
    impatient = rd.dem.QuasiStatic(max_rest_steps=100)
    twin = packed.clone()
    with pytest.raises(NotEquilibrated, match=r"no equilibrium \(constant strain\) after 100 steps"):
        rd.dem.bring_to_rest(packed, "strain", impatient)
    rest = rd.dem.bring_to_rest(twin, "strain", impatient, strict=False)
    assert not rest.equilibrium.reached
    assert "NOT at rest" in str(rest.equilibrium)


def test_rest_is_at_rest(sheared, straining, fast):
    """After `bring_to_rest` the verdict holds, the stress is held, and the true masses are back."""
    before = np.diag(sheared.stress)
    mass = sheared.grains.mass.copy()
    sheared.advance(20, straining((5.0, -5.0, 0.0)))
    rest = rd.dem.bring_to_rest(sheared, "stress", fast, tuple(before))
    assert rest.equilibrium.reached
    assert sheared.equilibrium().unbalanced_force <= 1e-6
    # the servo holds it as well as forces are in balance
    np.testing.assert_allclose(np.diag(sheared.stress), before, rtol=1e-5)
    np.testing.assert_array_equal(sheared.grains.mass, mass)
    with pytest.raises(InvalidInput, match="did you mean 'stress'"):
        rd.dem.bring_to_rest(sheared, "stres", fast)


@pytest.mark.parametrize(
    "change",
    [
        {"inertial_number": 0.0},
        {"inertial_number": np.nan},
        {"damping": 1.0},
        {"mass_scaling": -1.0},
        {"tolerance": -1.0},
    ],
)
def test_quasi_static_settings_are_checked(change):
    """Rates and tolerances must be positive, damping below one."""
    with pytest.raises(InvalidInput, match=next(iter(change))):
        rd.dem.QuasiStatic(**change)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"norm": -1.0}, "probe norms must be positive and increasing, got -1.0"),
        ({"norm": np.nan}, "norm must be finite"),
        ({"norm": [2e-5, 1e-5]}, "probe norms must be positive and increasing"),
        ({"norm": [1e-5, 1e-5]}, "probe norms must be positive and increasing"),
        ({"norm": []}, "probe norms"),
        ({"norm": "a"}, "norm must be an array of numbers"),
        ({"rate": 0.0}, "rate must be a positive number in strain per step, got 0.0"),
        ({"rate": np.nan}, "rate must be a positive number"),
        ({"n_steps": 10}, "give the rate or n_steps, not both"),
        ({"rate": None, "n_steps": 10.5}, "n_steps must be a whole number of at least 1"),
        ({"norm": None, "kind": "stress"}, "stress probes have no default size"),
        ({"norm": 1e-2, "rate": 1e-10}, "takes 1e\\+08 steps, more than"),
        ({"kind": "strian"}, "unknown kind of probe 'strian': did you mean 'strain'"),
        ({"workers": 0}, "workers must be a whole number of at least 1, got 0"),
    ],
)
def test_probe_refuses(packed, change, words):
    """Bad norms, counts and kinds, before anything is computed."""
    with pytest.raises(InvalidInput, match=words):
        rd.probe(packed, rd.directions.rendulic(step=180), **{"norm": 1e-5, "rate": 2e-6, "settle": False} | change)


@pytest.mark.parametrize(
    ("arguments", "options", "words"),
    [
        (([0.0, 0.0], 10), {}, r"increment must have shape \(3\), got \(2,\)"),
        (([0.0, np.nan, 0.0], 10), {}, "increment must be finite"),
        (([0.0, 0.0, 0.0], 10), {"kind": "force"}, "unknown kind of probe 'force'"),
        (([1e-5, 0.0, 0.0], 0), {}, "n_steps"),
        (([1e-5, 0.0, 0.0], 10), {"marks": (1.5,)}, "marks"),
        (([1e-5, 0.0, 0.0], 10), {"marks": (0.5,)}, "marks"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
def test_assembly_probe_refuses(packed, arguments, options, words):
    """The increment itself is checked where it is imposed."""
    with pytest.raises(InvalidInput, match=words):
        packed.probe(*arguments, **options)


def test_inputs_are_not_modified(straining):
    """Arrays handed over stay as they were, whatever the assembly does afterwards."""
    given = {
        "position": np.array([[0.5, 0.5, 0.5], [0.5195, 0.5, 0.5]]),
        "radius": np.array([0.01, 0.01]),
        "walls": np.array(BOX),
        "velocity": np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]),
        "angular_velocity": np.array([[1.0, 0.0, 0.0], [0.0, 5.0, 0.0]]),
    }
    kept = {name: array.copy() for name, array in given.items()}
    sample = rd.dem.Assembly(**given)
    sample.advance(20, straining((1.0, 1.0, 1.0)))
    assert sample.walls.position[0] != 0.0
    sample.scale_radii(1.01)
    for name, array in given.items():
        np.testing.assert_array_equal(array, kept[name], err_msg=name)


def test_analysis_does_not_modify_snapshots(sheared, straining):
    """Second-order work and stress only read their snapshots, and a snapshot is a copy."""
    before = sheared.snapshot()
    kept = {name: np.array(value) for name, value in vars(before).items()}
    sheared.advance(20, straining((5.0, -5.0, 0.0)))
    work = rd.second_order_work(before, sheared.snapshot())
    rd.micro.love_weber_stress(before), rd.micro.coordination(before), before.branch, before.resultant
    assert work.contacts != 0.0
    for name, value in kept.items():
        np.testing.assert_array_equal(getattr(before, name), value, err_msg=name)


def test_snapshots_of_different_packings_are_refused(packed):
    """Work between different numbers of grains has no meaning; a pair listed twice neither."""
    from dataclasses import replace

    snapshot = packed.snapshot()
    fewer = rd.dem.Assembly(**TWO).snapshot()
    with pytest.raises(InvalidInput, match="200 grains before, 2 after"):
        rd.second_order_work(snapshot, fewer)
    twice = np.concatenate((np.arange(len(snapshot.first)), [0]))
    names = ("first", "second", "normal", "force_n", "force_t")
    double = replace(snapshot, **{name: getattr(snapshot, name)[twice] for name in names})
    with pytest.raises(InvalidInput, match="twice"):
        rd.second_order_work(snapshot, double)


def test_coordination_of_a_known_arrangement():
    """Three grains in a row, the last touching a wall, and one alone: counted by hand."""
    position = [[0.5, 0.5, 0.9905], [0.5, 0.5, 0.971], [0.5, 0.5, 0.9515], [0.1, 0.1, 0.1]]
    numbers = rd.micro.coordination(rd.dem.Assembly(position, [0.01] * 4, BOX).snapshot())
    assert numbers.mean == pytest.approx(4 / 4)
    assert numbers.mechanical == pytest.approx(3 / 2)  # first: one grain and the wall; second: two grains
    assert numbers.rattlers == pytest.approx(2 / 4)


def test_probe_data_are_labelled(packed):
    """Every variable has units or is a verdict, dimensions have names, and a sweep has the norms."""
    probes = rd.probe(packed, rd.directions.rendulic(step=90), norm=[1e-5, 2e-5], rate=5e-07, settle=False)
    assert dict(probes.sizes) == {"norm": 2, "alpha": 4, "component": 3, "contact_class": 5}
    for name, variable in probes.data_vars.items():
        assert "long_name" in variable.attrs, name
        assert "units" in variable.attrs or variable.dtype == bool, name
    assert probes.attrs["rate"] == 5e-7
    np.testing.assert_allclose(
        probes.d_eps.sel(norm=2e-5), rd.directions.rendulic(90).increments(2e-5), rtol=0, atol=1e-15
    )
    product = (probes.d_sigma * probes.d_eps).sum("component")
    np.testing.assert_allclose(probes.w2_macro, product, rtol=1e-12)
    np.testing.assert_allclose(probes.w2_lagrangian, probes.w2_boundary, rtol=1e-10)


def test_signatures_show_every_option():
    """Nothing hides behind `**`, and what users see of `rd.dem` is what is meant for them."""
    methods = [function for name, function in inspect.getmembers(rd.dem.Assembly, callable) if not name.startswith("_")]
    assert len(methods) >= 20
    for function in (*methods, rd.dem.Assembly, rd.dem.pack, rd.dem.bring_to_rest):
        for parameter in inspect.signature(function).parameters.values():
            assert parameter.kind not in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL), (function, parameter)
    assert dir(rd.dem) == sorted(rd.dem.__all__)


def test_natural_calls_are_understood(packed):
    """Specimens of grains where snapshots are meant, angles where directions are meant; else a sentence says what is."""
    moved = packed.clone()
    moved.probe([1e-5, 0.0, 0.0], 20)
    expected = rd.second_order_work(packed.snapshot(), moved.snapshot())
    assert rd.second_order_work(packed, moved).boundary == expected.boundary
    assert float(rd.anatomy(packed, moved).negative_contacts) >= 0.0
    assert rd.micro.contact_work(packed, moved).work.sum() == expected.per_contact.work.sum()
    assert rd.micro.coordination(packed) == rd.micro.coordination(packed.snapshot())
    np.testing.assert_array_equal(rd.micro.love_weber_stress(packed), rd.micro.love_weber_stress(packed.snapshot()))
    probes = rd.probe(packed, [90.0, 270.0], 1e-5, rate=1e-6, settle=False)
    np.testing.assert_allclose(probes.alpha, [90.0, 270.0])
    for call in (lambda: rd.second_order_work(packed, 3.0), lambda: rd.micro.coordination("a")):
        with pytest.raises(InvalidInput, match=r"expected a Snapshot .* or a specimen of grains, got"):
            call()
    for wrong in (None, "around", object(), []):
        with pytest.raises(InvalidInput, match="directions"):
            rd.probe(packed, wrong, 1e-5)
