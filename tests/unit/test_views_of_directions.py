"""Views of probes by direction: what they hold and say, and that both libraries draw all of it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.figures.draw import draw
from rendulic.foundation.errors import InvalidInput
from rendulic.report.draw import drawn
from rendulic.report.figure import Figure
from rendulic.views.circular import CENTRE, circular_diagram, circular_panels
from rendulic.views.macro_micro import macro_micro
from rendulic.views.sphere import on_sphere
from rendulic.views.stress_probes import stress_probes

ALPHA = np.array([270.0, 0.0, 90.0, 180.0])  # not in order


def around(work, sure=True, **coords):
    """Probes in four directions with these W2n."""
    work = np.array(work, dtype=float)
    return xr.Dataset(
        {"w2_normalised": ("alpha", work), "is_significant": ("alpha", np.full(len(work), sure))},
        coords={"alpha": ALPHA} | coords,
    )


@pytest.fixture
def probes():
    """A stable state, one of negative work at 180 degrees, and one whose negative work is not sure."""
    return {
        "low": around([0.9, 0.8, 0.7, 0.6]),
        "high": around([0.9, 0.8, 0.7, -0.4]),
        "doubtful": around([0.9, 0.8, -0.1, 0.6], sure=False),
    }


def on_page(view):
    """The figure of a view in the page."""
    (figure,) = (part for part in drawn("name", {"one": view}) if isinstance(part, Figure))
    return figure


def test_a_circular_diagram_says_which_states_have_negative_work(probes):
    """Only where the sign is sure; directions in order, smallest values in the table."""
    view = circular_diagram(probes, "sand")
    assert view.verdict == "Second-order work is negative in some directions at high."
    assert_allclose(view.curves[1].alpha, [0.0, 90.0, 180.0, 270.0])
    assert_allclose(view.curves[1].w2_normalised, [0.8, 0.7, -0.4, 0.9])
    assert [row[1:] for row in view.tables[0].rows] == [
        ("+0.600", "180", "0", "yes"), ("-0.400", "180", "1", "yes"), ("-0.100", "90", "1", "no"),
    ]  # fmt: skip
    assert view.tables[0].marks == ["", "bad", "doubtful"]
    stable = circular_diagram({"low": probes["low"]})
    assert stable.verdict == "Second-order work is not surely negative in any direction that was probed."


def test_a_circular_diagram_is_the_same_in_both_libraries(probes):
    """From -1 at the centre to 1 at the rim, all curves, closed."""
    view = circular_diagram(probes)
    (axes,) = draw(view).axes
    lines = {line.get_label(): line for line in axes.get_lines()}
    drawn_there = np.hypot(*lines["high"].get_data()) + CENTRE
    figure = on_page(view)
    chosen = figure.families["one"]["high"][-1]
    assert_allclose(drawn_there, chosen["r"])
    assert_allclose(chosen["r"], [0.8, 0.7, -0.4, 0.9, 0.8])
    assert figure.layout["polar"]["radialaxis"]["range"] == [CENTRE, 1.0]
    assert list(figure.families["one"]) == list(probes)


def test_circular_panels_stand_side_by_side(probes):
    """As many columns as there are panels, one colour for a label, a verdict that names panel and state."""
    view = circular_panels({"loose\n100 grains": probes, "sand": {"high": probes["low"]}}, "both", columns=3)
    assert view.columns == 2
    assert view.labels == ["low", "high", "doubtful"]
    assert view.verdict == "Second-order work is negative in some directions at loose, 100 grains, high."
    assert [row[0] for row in view.tables[0].rows][-1] == "sand, high"
    assert len(draw(view).axes) == 2
    figure = on_page(view)
    traces = [trace for trace in figure.families["one"][""] if trace["name"] == "high"]
    assert [trace["subplot"] for trace in traces] == ["polar", "polar2"]
    assert [trace["showlegend"] for trace in traces] == [True, False]
    assert traces[0]["line"]["color"] == traces[1]["line"]["color"]
    assert [note["text"] for note in figure.layout["annotations"]] == ["loose, 100 grains", "sand"]


def test_probes_that_are_no_circle_are_refused(probes):
    """None, several norms, or no panels."""
    with pytest.raises(InvalidInput, match="needs the probes of at least one state, got none"):
        circular_diagram({})
    with pytest.raises(InvalidInput, match=r"select a norm with probes\.sel"):
        circular_diagram({"low": xr.concat([probes["low"]] * 2, "norm")})
    with pytest.raises(InvalidInput, match="need at least one panel, got none"):
        circular_panels({})


def test_macro_and_micro_are_compared_for_grains(probes):
    """The sum over contacts and grains beside the boundary's; a model has none."""
    with pytest.raises(InvalidInput, match="these probes have no contacts"):
        macro_micro({"low": probes["low"]})
    parts = {
        name: ("alpha", value * np.ones(4))
        for name, value in (("w2_boundary", 3.0), ("w2_contacts", 2.0), ("w2_grains", 1.0), ("w2_paper", 1.5))
    }
    data = probes["low"].assign(parts | {"identity_residual": ("alpha", [1e-12, 2e-15, 0.0, 0.0])})
    view = macro_micro({"low": data}, "grains")
    assert_allclose(view.states[0].micro, view.states[0].boundary)
    assert "to 1e-12 of its largest term" in view.verdict
    assert len(draw(view).axes) == 2
    macro, micro, *_ = on_page(view).families["one"]["low"]
    assert macro["y"] == micro["y"] == [3.0] * 4


def test_the_share_of_the_sphere_is_that_of_the_weights(probes):
    """Directions count by their weight; probes in the plane are refused."""
    unit = rd.directions.sphere(60)
    along = {f"along_{k + 1}": ("direction", unit.unit[:, k]) for k in range(3)}
    weight = (1.0 + unit.unit[:, 0] ** 2) / (1.0 + unit.unit[:, 0] ** 2).sum()
    work = np.where(unit.unit[:, 0] < -0.5, -0.2, 0.7)
    data = xr.Dataset(
        {"w2_normalised": ("direction", work)}, coords=along | {"weight": ("direction", weight)}
    )  # fmt: skip
    view = on_sphere(data, "sand")
    share = float(weight[work < 0.0].sum())
    assert 0.0 < share < 1.0
    assert view.negative_share == pytest.approx(share)
    assert f"{100 * share:.1f} % of all directions" in view.verdict
    assert f"{share:.1%}" in draw(view).get_suptitle()
    (trace,) = on_page(view).families["one"]["sand"]
    assert_allclose(trace["z"], unit.unit[:, 0], atol=1e-3)
    assert_allclose(trace["marker"]["color"], work)
    with pytest.raises(InvalidInput, match=r"rd\.directions\.sphere"):
        on_sphere(probes["low"])


def test_stress_probes_name_the_worst_state():
    """By the root mean square of the difference; a state that could not be compared is not the worst."""

    def table(difference, compared):
        found = np.array([0.5, 0.4, 0.9])
        expected = np.where(np.arange(3) < compared, found - difference, np.nan)
        return xr.Dataset(
            {
                "strain_alpha": ("alpha", [200.0, 10.0, 90.0]),
                "w2_normalised": ("alpha", found),
                "expected": ("alpha", expected),
            },
            attrs={"rms": difference if compared else np.nan, "n_compared": compared},
        )

    view = stress_probes({"low": table(0.01, 3), "high": table(0.1, 2), "none": table(0.0, 0)}, "probes")
    assert view.verdict == "The largest root mean square difference of W2n is 0.1, at high."
    assert view.tables[0].rows[1] == ("high", "0.1", "2", "3")
    assert_allclose(view.panels[0].strain_alpha, [10.0, 90.0, 200.0])
    titles = [axes.get_title(loc="left") for axes in draw(view).axes]
    assert "rms 0.1, 2 of 3 compared" in titles[1]
    assert list(on_page(view).families["one"]) == ["low", "high", "none"]
