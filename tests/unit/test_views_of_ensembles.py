"""Packings that differ in their seeds, taken together in views: what they hold and say, in both libraries."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.stats import t as students_t

import rendulic as rd
from rendulic.figures.draw import draw
from rendulic.report.draw import drawn
from rendulic.report.figure import Figure
from rendulic.study.ids import StateId
from rendulic.study.language.study import Study
from rendulic.study.plan import plan_of
from rendulic.study.results import Results
from rendulic.study.store.store import Store
from rendulic.views.catalogue import catalogue, units_for
from rendulic.views.circular import circular_diagram, circular_panels
from rendulic.views.ensemble_map import ensemble_map
from rendulic.views.ensembles import ensembles, said
from rendulic.views.finite_size import exponent_of_share, finite_size
from rendulic.views.loading import mean_of_curves
from rendulic.views.macro_micro import mean_works
from synthetic import ALPHA, Gaussian, probes_of, specimens

QUICK = {"n_resamples": 500}


@pytest.fixture(scope="module")
def stable():
    """The mean of twelve specimens that are surely stable."""
    return rd.ensemble_response(specimens(Gaussian(0.5), 12, 0), **QUICK)


@pytest.fixture(scope="module")
def unstable():
    """The mean of twelve specimens with a sure cone."""
    return rd.ensemble_response(specimens(Gaussian(-0.3), 12, 1), **QUICK)


def on_page(view):
    """The figure of a view in the page."""
    (figure,) = (part for part in drawn("name", {"one": view}) if isinstance(part, Figure))
    return figure


def test_what_a_mean_says(stable, unstable):
    """Sure, not sure, too few, one: in plain words."""
    assert said(stable) == "surely stable"
    assert said(unstable).startswith("surely unstable from ")
    own = specimens(Gaussian(-0.3), 12, 1)
    assert said(rd.ensemble_response(own[:1], **QUICK)) == "one packing: chance"
    few = said(rd.ensemble_response(own[:5], **QUICK))
    assert few.startswith("mean unstable from ")
    assert few.endswith("but 5 packings are too few to be sure")
    barely = rd.ensemble_response(specimens(Gaussian(-0.01), 8, 1), **QUICK)
    assert said(barely).endswith(", but not surely")


def test_a_diagram_of_means_has_their_bands_and_the_single_packings(stable, unstable):
    """The same arrays in both libraries; the verdict and the table say what is sure and for how many."""
    view = circular_diagram({"low": stable, "high": unstable}, "sand")
    assert view.verdict == f"low: surely stable; high: {said(unstable)}."
    (table,) = view.tables
    assert [row[1] for row in table.rows] == ["12", "12"]
    assert table.marks == ["", "bad"]
    assert table.rows[0][4] == "nowhere"
    band = view.curves[1].band
    assert_allclose(band[1], unstable.w2_normalised_upper)
    assert view.curves[1].single.shape == (12, len(ALPHA))
    traces = on_page(view).families["one"]["high"]
    faint, filled = traces[1], traces[2]
    assert len(faint["theta"]) == 12 * (len(ALPHA) + 2)
    assert_allclose(filled["r"][: len(ALPHA)], unstable.w2_normalised_upper, rtol=1e-4)
    panels = circular_panels({"η = 0.1": {"mean": stable}, "η = 0.48": {"mean": unstable}}, "", 3)
    axes, *_ = draw(panels).axes
    assert sum(line.get_linewidth() == 0.5 and line.get_color() == "#777777" for line in axes.get_lines()) == 12
    assert panels.verdict == f"η = 0.1: surely stable; η = 0.48: {said(unstable)}."


def test_the_map_of_means_says_from_where_on_a_cone_is_sure(stable, unstable):
    """Sure within mean within possible; shares with their intervals; none, all, and gaps in words."""
    view = ensemble_map({0.1: stable, 0.48: unstable}, "sand")
    assert view.verdict == "The mean of the packings has a sure cone from η = 0.48 on (none up to η = 0.1)."
    assert [len(each) for each in view.sure] == [0, 2]
    for sure, mean, possible in zip(view.sure[1], view.mean[1], view.possible[1], strict=True):
        assert possible[0] < mean[0] < sure[0] < sure[1] < mean[1] < possible[1]
    assert_allclose(view.somewhere[0], [0.0, 1.0])
    assert ensemble_map({0.1: stable, 0.2: stable}).verdict.endswith("has no sure cone up to η = 0.2.")
    assert ensemble_map({0.1: unstable, 0.2: stable}).verdict.endswith("(the first that was probed), but not at 0.2.")
    few = rd.ensemble_response(specimens(Gaussian(-0.3), 3, 1), **QUICK)
    assert ensemble_map({0.1: few}).verdict == "Fewer than 8 packings: no cone can be called sure."
    assert len(draw(view).axes) == 2
    names = [trace.get("name") for trace in on_page(view).families["one"][""]]
    assert "surely unstable" in names
    assert "in some direction" in names


def test_the_mean_of_curves_is_at_equal_strain_with_students_interval():
    """As far as the shortest goes; readings at which the strain goes back are no part of it."""
    curves = {}
    for k in range(5):
        eps = np.linspace(0.0, 0.02 + 0.01 * k, 60)
        eps = np.insert(eps, 30, eps[29] - 1e-4)  # drawn back for one reading
        q = (1.0 + k) * 1e7 * np.maximum.accumulate(eps)
        q[30] = -1.0
        curves[f"seed {k}"] = xr.Dataset({"eps_1": ("record", eps), "q": ("record", q), "eps_v": ("record", 0.5 * eps)})
    *each, mean = mean_of_curves(curves, "mean")
    assert [one.is_faint for one in each] == [True] * 5
    assert not mean.is_faint
    assert_allclose(mean.eps_1[-1], 0.02)
    assert_allclose(mean.q, 3e7 * mean.eps_1, atol=1e-3)
    half = students_t.ppf(0.975, 4) * np.std(np.arange(1.0, 6.0), ddof=1) / np.sqrt(5) * 1e7 * mean.eps_1
    assert_allclose(mean.bands[0][1] - mean.q, half, atol=1e-3)
    assert_allclose(mean.bands[1][1] - mean.bands[1][0], 0.0, atol=1e-12)


def with_grains(one, factor):
    """Probes as of grains, their work that of the boundary times a factor."""
    parts = {"w2_boundary": factor, "w2_contacts": 0.75 * factor, "w2_grains": 0.25 * factor, "w2_paper": 0.5 * factor}
    return one.assign(
        {name: one.w2_macro * value for name, value in parts.items()} | {"identity_residual": one.w2_macro * 0.0}
    )


def test_means_of_works_keep_the_identity():
    """The mean over packings of contacts and grains is that of the boundary, as it is for each."""
    own = [with_grains(one, 1.0) for one in specimens(Gaussian(0.5), 9, 0)]
    works = mean_works("state", own)
    assert_allclose(works.micro, works.boundary, rtol=1e-12)
    assert_allclose(works.boundary, np.mean([one.w2_macro.values for one in own], axis=0), rtol=1e-12)
    assert len(works.single) == 9
    assert bool(((works.band[0] < works.boundary) & (works.boundary < works.band[1])).all())


# -- of a study ----------------------------------------------------------------------------------


class SomeResults(Results):
    """Results of a study whose probes are given; what is not given has failed."""

    given: dict

    def of(self, table):
        return self.given if table == "probes" else {}

    @property
    def failed(self):
        units = self.plan.of("probes")
        return {units[where][0]: "the packing fell apart" for where in units if where not in self.given}


@pytest.fixture
def study(tmp_path):
    """Nine packings of one specimen, of which the last has failed, and one packing of another."""
    grains = {"kind": "grains", "n_grains": 100, "eta": (0.1, 0.48)}
    plan = plan_of(Study.model_validate({
        "specimen": [{"name": "loose", "seeds": list(range(1, 10)), **grains}, {"name": "alone", "seeds": [1], **grains}],
        "probes": [{"name": "circle", "norms": (1e-4, 2e-4)}],
    }))  # fmt: skip
    results = SomeResults(plan, Store(tmp_path))
    norms = xr.DataArray([1e-4, 2e-4], dims="norm", name="norm")
    results.given = {
        (name, state): xr.concat([with_grains(probes_of(Gaussian(1.0 - 3.0 * state.eta).responses(np.random.default_rng(int(state.value)))), 1.0).drop_vars("norm")] * 2, norms)
        for name, state in plan.of("probes")
        if state.value < 9
    }  # fmt: skip
    return results


def test_packings_that_differ_in_their_seeds_are_an_ensemble_by_default(study):
    """One figure for them, with the failed one told; a packing alone is called chance."""
    (one,) = ensembles(study)
    assert (one.name, one.specimen, one.size) == ("circle", "loose", 9)
    assert list(one.probes[0.1]) == [f"seed {k}" for k in range(1, 10)]
    data = one.responses[0.48]
    assert data.attrs["n_specimens"] == 8
    assert "seed 9: failed: the packing fell apart." in data.attrs["told_of_all"]
    figures = catalogue()["fig3"].views(study)
    assert list(figures) == ["fig3_loose", "fig3_amplitudes_loose", "fig3_alone_seed_1", "fig3_amplitudes_alone_seed_1"]
    assert list(figures["fig3_loose"].panels) == ["η = 0.1", "η = 0.48"]
    assert "mean of 9 packings" in figures["fig3_loose"].title
    assert "surely unstable from" in figures["fig3_loose"].verdict
    assert "one packing: chance" in figures["fig3_alone_seed_1"].title
    families = catalogue()["fig3"].shown(study)
    assert [label.partition(",")[0] for label in families] == ["loose", "loose", "alone", "alone"]
    assert not any("seed 2" in label for label in families)
    assert list(catalogue()["fig4"].views(study)) == ["fig4_loose", "fig4_alone_seed_1"]
    assert list(catalogue()["ensemble"].views(study)) == ["ensemble"]


def test_the_map_of_ensembles_needs_several_packings(study):
    """Units of the ensemble's probes and states; none of a packing alone."""
    labels = [unit.label for unit in units_for(study.plan, ["ensemble"])]
    assert any("loose, seed 9" in label for label in labels)
    assert not any("alone" in label for label in labels)
    alone = Study.model_validate(
        {"specimen": [{"name": "a", "kind": "grains", "n_grains": 100, "eta": (0.1,)}], "probes": [{"name": "c"}]}
    )
    assert units_for(plan_of(alone), ["ensemble"]) == []
    assert StateId("a", "seed", 1, 0.1) in plan_of(alone).states


# -- sizes ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("true", [0.0, -1.0])
def test_the_exponent_of_a_share_is_within_its_interval(true):
    """Shares that fall as N^k, drawn 200 times: the interval holds k in at least 92 of 100."""
    generator = np.random.default_rng(0)
    sizes, total = np.array([1000, 3000, 10000]), np.array([64, 48, 32])
    shares = 0.5 * (sizes / 1000.0) ** true
    hits = 0
    for trial in range(200):
        _, low, high = exponent_of_share(sizes, generator.binomial(total, shares), total, trial)
        hits += low <= true <= high
    assert hits >= 184


def test_sizes_say_whether_instability_falls_as_one_over_n(stable, unstable):
    """Of each stress ratio; both libraries have three rows and the 1/N line."""
    some = rd.ensemble_response(specimens(Gaussian(-0.02), 12, 3), **QUICK)
    view = finite_size(
        {0.48: {1000: unstable, 10000: unstable}, 0.1: {1000: some, 100000: stable}, 0.3: {1000: stable}}, "sizes"
    )
    assert [one.label for one in view.series] == ["η = 0.1", "η = 0.48"]
    assert "η = 0.48: the share of unstable packings goes as N^" in view.verdict
    assert view.verdict.endswith("as no change would.")
    assert_allclose(view.series[1].opening[:, 0], [unstable.opening, unstable.sure_opening, unstable.possible_opening])
    assert len(view.tables[0].rows) == 5
    assert len(draw(view).axes) == 3
    assert [trace["name"] for trace in on_page(view).families["one"][""]].count("1/N") == 2
