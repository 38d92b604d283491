"""What cones of sweeps, ensembles and maps refuse, with which words, and what their figures show."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import rendulic as rd
from fakes import single
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.cone_table import with_spread

QUICK = {"norm": 1.0, "workers": 1}


@pytest.mark.parametrize(
    ("directions", "words"),
    [
        (
            rd.directions.axisymmetric([0.0, 90.0, 180.0, 270.0]),
            "at most 60 degrees apart; the widest gap is 90 degrees",
        ),
        (rd.directions.axisymmetric(np.arange(100.0, 170.0)), "the widest gap is 291 degrees"),
        (rd.directions.axisymmetric([10.0]), "the widest gap is 360 degrees"),
        (rd.directions.sphere(20), "edges in the Rendulic plane"),
        ([0.0, 60.0, 120.0], "the widest gap is 240 degrees"),
        ("around", "expected directions|list of finite angles"),
    ],
)
def test_directions_that_leave_something_out(directions, words):
    """A cone must be looked for all around; nothing is probed before that is known."""
    made = single()
    with pytest.raises(InvalidInput, match=words):
        rd.instability_cone(made, directions, **QUICK)
    with pytest.raises(InvalidInput, match=words):
        rd.cones_by_amplitude(made, [1.0, 2.0], directions)
    assert made.count == [0]


@pytest.mark.parametrize(
    ("norms", "options", "words"),
    [
        ([2.0, 1.0], {}, "probe norms must be positive and increasing"),
        ([1.0, 1.0], {}, "probe norms must be positive and increasing"),
        ([-1.0, 1.0], {}, "probe norms must be positive and increasing"),
        ([1.0], {}, r"needs two norms or more, got \[1.0\]"),
        (1.0, {}, r"norms must have shape \(n\)"),
        ([1.0, 2.0], {"change": 0.0}, "change of the smallest W2n within a plateau must be a positive number"),
        ([1.0, 2.0], {"tolerance": -1.0}, "tolerance of a cone's edges"),
    ],
)
def test_sweeps_refuse(norms, options, words):
    """Norms that are no sweep, and a plateau or edges without tolerance."""
    with pytest.raises(InvalidInput, match=words):
        rd.cones_by_amplitude(single(), norms, **options)


def test_cones_of_probes_refuse():
    """Probes of several norms, on the sphere, or not all around have no one cone; at one norm they have."""
    probes = rd.probe(single(), rd.directions.rendulic(step=30), norm=[1.0, 2.0])
    with pytest.raises(InvalidInput, match=r"got dimensions .*norm.*probes\.sel\(norm=\.\.\.\)"):
        rd.cone_of(probes)
    assert len(rd.cone_of(probes.sel(norm=2.0)).sectors) == 1
    with pytest.raises(InvalidInput, match="Rendulic plane at one norm, got dimensions direction"):
        rd.cone_of(rd.probe(single(), rd.directions.sphere(20), norm=1.0))
    with pytest.raises(InvalidInput, match="the widest gap is 300 degrees"):
        rd.cone_of(probes.sel(norm=1.0, alpha=[0.0, 30.0, 60.0]))


def test_ensembles_refuse():
    """No specimens, or labels that do not match; a table has its own dimensions."""
    with pytest.raises(InvalidInput, match="needs specimens, and one label for each: got 0 and 0 labels"):
        rd.cone_ensemble([], **QUICK)
    with pytest.raises(InvalidInput, match="got 1 and 2 labels"):
        rd.cone_ensemble([single()], labels=["a", "b"], **QUICK)
    table = rd.cone_ensemble([single()], **QUICK)
    with pytest.raises(InvalidInput, match="not 'seed'"):
        with_spread(table, "seed")


@pytest.mark.parametrize(
    ("rows", "options", "words", "probed"),
    [
        ([(0.5, "one"), (0.5, "one")], {}, "eta = 0.5 comes twice", True),
        ([(0.5, "one"), (0.6, "two")], {}, r"the same number of specimens.*got \[1, 2\]", True),
        ([(0.5, "two")], {"labels": ["a"]}, "there are 2 specimens at each stress ratio and 1 labels", False),
        ([(0.5, "none")], {}, r"one at least .*got \[0\]", False),
        ([], {}, "got no stress ratio", False),
        ([(float("nan"), "one")], {}, "eta of a bifurcation map must be finite", False),
    ],
)
def test_maps_refuse(rows, options, words, probed):
    """Rows that do not match, with an error before the row that does not is probed."""
    made = single()
    states = {"one": made, "two": [made, made], "none": []}
    with pytest.raises(InvalidInput, match=words):
        rd.bifurcation_map([(eta, states[name]) for eta, name in rows], **QUICK, **options)
    once = single()
    rd.instability_cone(once, **QUICK, refine_smallest=True)
    assert made.count == [once.count[0] * probed]


def test_a_state_that_is_missing_leaves_a_gap():
    """None for a specimen without this state: NaN in its place, and the summary is of those that there are."""
    table = rd.bifurcation_map({0.5: [single(), single(140.0)], 0.6: [single(), None]}, **QUICK, labels=["a", "b"])
    assert table.n_present.values.tolist() == [2, 1]
    assert np.isnan(table.edge_from.sel(eta=0.6, specimen="b")).all()
    assert np.isnan(table.measured_eta.sel(eta=0.6, specimen="b"))
    assert_allclose(table.edge_from_summary.sel(statistic="median"), [105.0, 100.0], rtol=0, atol=0.5)
    assert_allclose(table.unstable_share, 1.0)
    assert (
        table.first_eta_reason.values.tolist()
        == [
            "at or below eta = 0.5, the first that was probed",
        ]
        * 2
    )


def test_figures_refuse_other_tables():
    """Each figure of cones says which table it needs."""
    other = xr.Dataset({"w2_normalised": ("alpha", [1.0])})
    with pytest.raises(InvalidInput, match=r"tables of rd\.cones_by_amplitude, 'grains' is none"):
        rd.figures.amplitude({"grains": other})
    with pytest.raises(InvalidInput, match=r"tables of rd\.bifurcation_map, 'grains' is none"):
        rd.figures.bifurcation_map({"grains": other})


def test_a_figure_of_cones_shows_every_sector():
    """A bar for each sector, those across 0 degrees at both ends of the axis; states without a cone say so."""
    found = {"a": rd.instability_cone(single(5.0), **QUICK), "b": rd.instability_cone(single(), **QUICK)}
    figure = rd.figures.cones(found | {"c": rd.instability_cone(single(133.0, 0.0), **QUICK)}, "sand")
    left = figure.axes[0]
    assert left.get_xlim() == (0.0, 360.0)
    low, high = np.clip([(bar.get_x(), bar.get_x() + bar.get_width()) for bar in left.patches], 0.0, 360.0).T
    seen = sorted((x, y) for x, y in zip(low, high, strict=True) if y > x)
    assert_allclose(seen, [(0.0, 35.0), (100.0, 160.0), (335.0, 360.0)], rtol=0, atol=0.3)
    assert [label.get_text() for label in left.get_yticklabels()] == ["a", "b", "c"]
    assert "none" in [text.get_text() for text in left.texts]
    assert figure.get_suptitle() == "sand"


def test_figures_of_sweeps_and_maps_show_directions_and_first_ratio():
    """About the cone where it is in one piece, all around where it lies across 0; the first ratio in words."""
    sweep = rd.cones_by_amplitude(single(132.0), [1.0, 2.0, 4.0], workers=1)
    figure = rd.figures.amplitude({"sand": sweep})
    assert figure.axes[1].get_ylim() == (90.0, 180.0)
    assert "plateau from 1 to 4" in [text.get_text() for text in figure.axes[0].texts]
    rows = {0.5: [single(5.0, 0.0)], 0.6: [single(5.0, 20.0)], 0.7: [single(5.0, 30.0)]}
    table = rd.bifurcation_map(rows, **QUICK)
    table["first_eta"][:], table["first_eta_from"][:], table["first_eta_to"][:] = 0.55, 0.5, 0.6
    figure = rd.figures.bifurcation_map({"sand": table})
    assert figure.axes[0].get_ylim() == (0.0, 360.0)
    assert r"$W_2 = 0$ first at $\eta$ = 0.55 (0.5 to 0.6)" in [text.get_text() for text in figure.axes[0].texts]
