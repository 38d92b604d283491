"""Results in notebooks: tables of text, figures in one style, for every kind of result."""

from __future__ import annotations

import re

import matplotlib as mpl
import numpy as np
import pytest

import rendulic as rd
from rendulic.figures.style import INK, new_figure
from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.notebooks import Shown


@pytest.fixture(scope="module")
def sand():
    """A point of loose sand."""
    return rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)


@pytest.fixture(scope="module")
def work(sheared_state):
    """Of a small compression."""
    sample = rd.dem.Assembly.from_state(sheared_state)
    before = sample.snapshot()
    sample.probe(np.array([1e-4, 0.0, 0.0]), 200)
    return rd.second_order_work(before, sample.snapshot())


@pytest.fixture(scope="module")
def results(sand, sheared_state, work):
    """One of every kind."""
    sample = rd.dem.Assembly.from_state(sheared_state)
    probed = sample.clone()
    probed.probe(np.array([1e-4, 0.0, 0.0]), 200)
    other = sand.clone()
    return {
        "cone": rd.instability_cone(sand, rd.directions.rendulic(30), 1e-7),
        "work": work,
        "snapshot": sample.snapshot(),
        "probes": rd.probe(sand, rd.directions.rendulic(30), 1e-7),
        "sizes": rd.probe(sand, rd.directions.rendulic(30), [1e-7, 2e-7]),
        "sphere": rd.probe(sand, rd.directions.sphere(30), 1e-7),
        "bursts": rd.bursts(sand, rd.directions.rendulic(90), 1e-9),
        "map": rd.bifurcation_map({0.0: sand.clone()}, rd.directions.rendulic(30), 1e-7),
        "anatomy": rd.anatomy(sample.snapshot(), probed.snapshot()),
        "test": other.load(rd.paths.constant_volume(0.01)),
        "loading": sample.load(rd.paths.drained_triaxial(until_strain=0.0111), speed=rd.dem.QuasiStatic(1e-3)),
    }


KINDS = ("cone", "work", "snapshot", "probes", "sizes", "sphere", "bursts", "map", "anatomy", "test", "loading")


@pytest.mark.parametrize("kind", KINDS)
def test_every_result_has_its_figure(results, kind):
    """Drawn in the house style, with something in it, and as a picture that notebooks take."""
    result = results[kind]
    figure = result.plot("a title") if isinstance(result, Shown) else rd.plot(result, "a title")
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert any(axes.has_data() for axes in figure.axes)
    for axes in figure.axes:
        for side in ("left", "bottom"):
            if side in axes.spines:
                assert mpl.colors.to_hex(axes.spines[side].get_edgecolor()) in (INK, "#000000")


def test_what_has_no_figure_says_so(results):
    """By its type, or by what is in it."""
    with pytest.raises(InvalidInput, match="no figure belongs to int"):
        rd.plot(3)
    with pytest.raises(InvalidInput, match="no figure belongs to a dataset of w2_drift"):
        rd.plot(results["probes"][["w2_drift"]])


def test_tables_say_what_the_result_says(results, work, sheared_state):
    """Each number in it is that of the result."""
    cells = dict(re.findall(r"<th[^>]*>([^<]*)</th><td[^>]*>([^<]*)</td>", work._repr_html_()))
    total = sum(float(cells[f"contacts, {name}"].split()[0]) for name in work.by_class)
    assert total + float(cells["inertial term"].split()[0]) == pytest.approx(float(cells["walls"].split()[0]), rel=1e-4)
    assert f'<td style="text-align:left">{results["snapshot"].n_grains}</td>' in results["snapshot"]._repr_html_()
    assert sheared_state.checksum in sheared_state._repr_html_()
    assert f"{results['cone'].smallest_w2n:.3g}" in results["cone"]._repr_html_()


def test_whatever_is_in_a_result_is_text():
    """A kind of specimen from a file of somebody else is not markup."""
    state = rd.State("<script>alert(1)</script>", {}, {})
    assert "&lt;script&gt;" in state._repr_html_()
    assert "<script" not in state._repr_html_()


def test_figures_without_a_display_are_pictures():
    """Empty ones, too."""
    assert new_figure()._repr_png_().startswith(b"\x89PNG")
