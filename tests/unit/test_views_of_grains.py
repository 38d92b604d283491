"""Views of grains, of contact planes and of what was done: what is drawn and said is what was found."""

from __future__ import annotations

import numpy as np
import pytest

import rendulic as rd
from rendulic.study.execution.campaign import results_in
from rendulic.views import planes as planes_view
from rendulic.views.run import done
from rendulic.views.work_by_class import work_by_class


@pytest.fixture(scope="module")
def loose(sheared_state):
    """A packing, before and after a small compression."""
    sample = rd.dem.Assembly.from_state(sheared_state)
    before = sample.snapshot()
    sample.probe(np.array([1e-4, 0.0, 0.0]), 200)
    return before, sample.snapshot()


def test_all_forces_are_drawn_as_wide_as_they_are(loose):
    """Every grain is a circle, every contact a line."""
    before, _ = loose
    circles, lines, *_ = rd.figures.forces(before).axes[0].collections
    assert len(circles.get_paths()) == before.n_grains
    widths = np.sort(lines.get_linewidths())
    np.testing.assert_allclose(widths / widths[-1], np.sort(before.force_n) / before.force_n.max(), rtol=1e-12)


def test_classes_and_the_inertial_term_are_the_work_of_the_walls(loose):
    """The last bar is the sum of the others."""
    *parts, walls = work_by_class(rd.second_order_work(*loose)).works.values()
    assert walls == pytest.approx(sum(parts), rel=1e-9)


def test_only_what_is_finished_was_done(reported_study):
    """Sets without a finished state have no row."""
    results = results_in(reported_study)
    assert any("path" in row[0] for table in done(results).tables for row in table.rows)
    results = results_in(reported_study)
    results.plan.of("path").clear()
    assert not any("path" in row[0] for table in done(results).tables for row in table.rows)


@pytest.mark.parametrize(
    ("axial_strain", "told"),
    [
        (0.02, "W2 turns negative on planes (angle to axis 1, axial strain): 54.7° at 1.06 %"),
        (0.001, "W2 does not turn negative, neither on a plane nor in the assembly."),
    ],
)
def test_when_planes_lose_work_is_said(axial_strain, told):
    """Of loose sand, undrained: the plane at 54.7 degrees first; at the start none."""
    curve = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9).load(rd.paths.constant_volume(axial_strain))
    assert planes_view.plane_work(curve).verdict.startswith(told)


def test_a_loading_has_its_title():
    """As every other result that `rd.plot` draws."""
    curve = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9).load(rd.paths.constant_volume(0.001))
    figure = rd.plot(curve[["q", "eps_1", "eps_v"]], "loose sand")
    assert figure.axes[0].get_title(loc="left") == "loose sand"
