"""Views of cones, maps and bursts: what they hold and say, and that both libraries draw all of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.figures.draw import draw
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.bifurcation import first_negative
from rendulic.probing.edges import UNKNOWN
from rendulic.report import bifurcation as map_of_page
from rendulic.report import bursts as bursts_of_page
from rendulic.report import cones as cones_of_page
from rendulic.views.amplitude import amplitude
from rendulic.views.bifurcation import bifurcation_map
from rendulic.views.burst_curves import burst_curves, equation_1
from rendulic.views.bursts import predicted_observed
from rendulic.views.cones import cones
from rendulic.views.sectors import Sector, Track, direction_range


@pytest.fixture(scope="module")
def sand():
    """Loose Hostun sand, drained, inside its unstable range."""
    point = rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9)
    point.load(rd.paths.drained_triaxial(0.5, until_eta=1.0))
    return point


@pytest.fixture(scope="module")
def virgin():
    """The same sand as made: stable in all directions."""
    return rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9)


@pytest.fixture(scope="module")
def found(sand, virgin):
    """A cone, and none."""
    return {name: rd.instability_cone(state, norm=1e-7) for name, state in (("eta = 1", sand), ("made", virgin))}


def table_of_cones(smallest, edges, uncertainty=0.5):
    """A map as `rd.bifurcation_map` gives it: smallest W2n of (eta, specimen), NaN if missing; edges of each or None."""
    smallest = np.array(smallest, dtype=float)
    etas = 0.1 * np.arange(1, len(smallest) + 1)
    first = [first_negative(etas, column, np.isfinite(column)) for column in smallest.T]
    ends = np.array([[one or (np.nan, np.nan) for one in row] for row in edges])[:, :, None, :]
    axes = ("eta", "specimen")
    return xr.Dataset(
        {
            "smallest_w2n": (axes, smallest), "is_significant": (axes, np.isfinite(smallest)),
            "is_unstable": (axes, smallest < 0.0), "drift_share": (axes, np.full(smallest.shape, 1e-3)),
            "edge_from": ((*axes, "sector"), ends[..., 0]), "edge_to": ((*axes, "sector"), ends[..., 1]),
            "edge_from_uncertainty": ((*axes, "sector"), np.full(ends.shape[:3], uncertainty)),
            "edge_to_uncertainty": ((*axes, "sector"), np.full(ends.shape[:3], uncertainty)),
            "first_eta": ("specimen", [one[0] for one in first]),
            "first_eta_from": ("specimen", [one[1] for one in first]),
            "first_eta_to": ("specimen", [one[2] for one in first]),
            "first_eta_reason": ("specimen", [one[3] for one in first]),
        },
        {"eta": etas, "specimen": [f"seed {k + 1}" for k in range(smallest.shape[1])]},
    )  # fmt: skip


@pytest.fixture(scope="module")
def two_seeds():
    """One seed turns unstable at the third ratio; the other is so from the second on, where it begins, and has a gap."""
    return table_of_cones(
        [[0.4, np.nan], [0.2, -0.1], [-0.2, np.nan], [-0.3, -0.4]],
        [[None, None], [None, (120.0, 130.0)], [(116.0, 126.0), None], [(110.0, 130.0), (115.0, 140.0)]],
    )


def bursts_of(w2n, predicted, verdict, **others):
    count = len(w2n)
    columns = {
        "w2_normalised": w2n, "predicted": predicted, "observed": np.equal(verdict, 1), "verdict": verdict,
        "to_edge": np.full(count, 90.0), "ratio": np.linspace(0.0, 1.0, count),
        "w2_normalised_opposite": np.full(count, 0.9), "w2_normalised_lasting": w2n, "is_sure": np.full(count, True),
    } | others  # fmt: skip
    return xr.Dataset(
        {name: ("alpha", values) for name, values in columns.items()},
        {"alpha": np.linspace(0.0, 160.0, count)},
        {"norm": 1e-4},
    )


def test_edges_are_said_with_their_uncertainty():
    """A question mark is for those that the drift alone could make, however wide the others are."""
    assert str(Sector(116.04, 145.0, 0.25, 14.0)) == "116 ± 0.25 to 145 ± 14°"
    assert str(Sector(350.0, 385.0, 120.0, UNKNOWN)) == "350 ± 120 to 25 ± ?°"
    assert str(Sector(0.0, 360.0, np.nan, np.nan)) == "all directions"
    assert direction_range([]) == (0.0, 360.0)


def test_sectors_go_on_where_they_overlap():
    """Across 0 degrees, too; a sector elsewhere is another one, and a state without any breaks the band."""
    one, turned, other = Sector(350.0, 370.0, 1, 1), Sector(5.0, 20.0, 1, 1), Sector(120.0, 130.0, 1, 1)
    flat = np.zeros(5)
    track = Track("", np.arange(5.0), ((one,), (turned, other), (), (other,), (one, other)), flat, flat > -1, flat)
    bands = [(at, here.first, beyond, there.first) for at, here, beyond, there in track.bands()]
    assert bands == [(0.0, 350.0, 1.0, 365.0), (3.0, 120.0, 4.0, 120.0)]


def test_cones_say_which_states_are_unstable(found):
    view = cones(found, "sand")
    worst = found["eta = 1"]
    assert view.verdict == (
        f"1 of 2 states has unstable directions; the smallest W2n is {worst.smallest_w2n:.3g}, of eta = 1 at "
        f"{worst.smallest_alpha:.4g} degrees."
    )
    (table,) = view.tables
    ((first, last),) = worst.sectors
    assert table.rows[0][1].startswith(f"{first:.4g} ± ")
    assert f" to {last % 360.0:.4g} ± " in table.rows[0][1]
    assert (table.rows[1][1], table.marks) == ("none", ["bad", ""])


def test_each_sample_of_a_map_has_its_own_answer(two_seeds):
    """Found in one; in the other negative from its first ratio on, which is said and not left out."""
    view = bifurcation_map({"loose": two_seeds}, "a map")
    one, other = view.panels[0].samples
    assert_allclose(one.first, (0.25, 0.2, 0.3))
    assert one.words == "W2 = 0 first at eta = 0.25 (0.2 to 0.3)"
    assert other.first is None
    assert other.words == "W2 is negative from eta = 0.2 on, the first that was probed"
    assert view.verdict == f"loose: seed 1: {one.words}; seed 2: {other.words}."
    assert [row[3] for row in view.tables[0].rows] == [one.words, other.words]
    assert [row[1:3] for row in view.tables[0].rows] == [("4", "2"), ("2", "2")]


def test_samples_of_a_map_are_not_joined(two_seeds):
    """Edges of each stay its own, and nothing is drawn across the state that is missing."""
    view = bifurcation_map({"loose": two_seeds})
    one, other = view.panels[0].samples
    assert [(at, beyond) for at, _, beyond, _ in one.track.bands()] == [pytest.approx((0.3, 0.4))]
    assert other.track.bands() == []
    assert [len(here) for here in other.track.sectors] == [0, 1, 0, 1]
    assert np.isnan(other.track.smallest[[0, 2]]).all()
    lower = draw(view).axes[1]
    lines = [line for line in lower.lines if line.get_label().startswith("seed 2")]
    assert np.isnan(lines[0].get_ydata()[2])


def test_a_ratio_before_which_no_sign_is_sure_is_not_the_first_probed():
    reason = first_negative(np.array([0.1, 0.2]), np.array([0.01, -0.3]), np.array([False, True]))[3]
    assert reason == "W2 is negative from eta = 0.2 on, before it no sign is sure"


def test_disagreements_are_listed():
    """One settles against its prediction; what proves nothing, at an edge, undecided, too fast or unsure, is neither for nor against."""
    table = bursts_of(
        [0.9, -0.4, -0.5, 0.1, 0.8, 0.7, -0.3], [False, True, True, False, False, False, True], [0, 1, 0, 0, 3, 4, 0],
        to_edge=[90.0, 20.0, 20.0, 4.0, 90.0, 90.0, 90.0], w2_normalised_opposite=[-0.1, *[0.9] * 6],
        w2_normalised_lasting=[0.9, -0.3, -0.2, 0.1, 0.8, 0.7, -0.1], kinetic_share=[1e-6, 0.3, 2e-6, 1e-6, 1e-6, 1e-3, 1e-6],
        is_sure=[True] * 6 + [False],
    )  # fmt: skip
    view = predicted_observed({"a state": table})
    summary, worth, disagreements, every = view.tables
    assert summary.rows == [("a state", "2", "1", "0", "0", "0", "0", "1", "1", "1 of 2", "")]
    assert [row[1] for row in worth.rows] == ["1 of 2", "50%", "1 of 2", "0 of 0"]
    assert [(row[0], row[6], row[7], row[9]) for row in disagreements.rows] == [
        ("a state", "settles", "2e-06", "disagrees"),
        ("a state", "settles", "1e-06", "not counted: sign within its error"),
    ]
    assert [row[-1] for row in every.rows] == [
        "not counted: opposite is unstable", "agrees", "disagrees", "not counted: edge", "not counted: undecided",
        "not counted: too fast", "not counted: sign within its error",
    ]  # fmt: skip
    assert [row[5] for row in every.rows][-1] == "unsure"
    assert every.marks == ["", "good", "bad", "", "", "", ""]
    assert view.verdict == (
        "Grains: 1 of 2 directions agree with the prediction (95 % interval 9 to 91 %; 50% would by chance); 1 undecided and 1 pushed "
        "too fast are not counted."
    )
    assert "| fails | settles | disagrees |" in every.markdown()


def test_models_are_kept_apart_from_grains(sand):
    """Their rows test the code, which is said beside the numbers, and no statistics are made of them."""
    grains = bursts_of([0.9, 0.8], [False, False], [0, 0], kinetic_share=[1e-6, 1e-6], balance_error=[1e-6, 2e-6])
    view = predicted_observed({"sand": rd.bursts(sand, rd.directions.rendulic(step=30), 1e-9), "grains": grains})
    assert [one.is_watched for one in view.panels] == [False, True]
    of_grains, of_models, worth, *_ = view.tables
    assert [row[0] for row in of_grains.rows] == ["grains"]
    assert of_grains.rows[0][-1] == "2e-06"
    assert [row[0] for row in of_models.rows] == ["sand"]
    assert "a test of the code and no evidence" in of_models.caption
    assert worth.rows[0][1] == "2 of 2"
    assert [table.caption for table in view.tables if "worth" in table.caption and "model" in table.caption] == []
    assert "Grains: 2 of 2 directions" in view.verdict
    assert "Models, a test of the code only: 11 of 11 directions" in view.verdict
    assert view.data.sizes == {"burst": 14}
    assert np.isnan(view.data.kinetic_share.values[:12]).all()
    assert view.data.norm.values[[0, -1]].tolist() == [1e-9, 1e-4]


@pytest.fixture(scope="module")
def motion(sheared_state):
    """Curves of two bursts of grains, and their table."""
    sample, curves = rd.dem.Assembly.from_state(sheared_state), {}
    table = rd.bursts(sample, rd.directions.axisymmetric([60.0, 130.0]), 1e-5, rate=5e-8, on_burst=curves.__setitem__)
    return table, {f"{alpha:.1f}": curve for alpha, curve in curves.items()}


def plotted(figure):
    """All frames of a figure of the page, checked by plotly itself; names of colours replaced as its script does it."""
    import plotly.graph_objects as go

    def coloured(value):
        if isinstance(value, str):
            return "#123456" if value.startswith("--") else value
        if isinstance(value, dict):
            return {key: coloured(inner) for key, inner in value.items()}
        return [coloured(inner) for inner in value] if isinstance(value, list) else value

    return [
        go.Figure(coloured([*figure.fixed, *frame["data"]]), coloured(dict(figure.layout)))
        for family in figure.data()["families"]
        for frame in family["frames"]
    ]


def test_both_libraries_draw_every_view(found, two_seeds, sand, motion):
    """A view has the same rows, samples and curves in both."""
    table, curves = motion
    sweep = amplitude({"sand": rd.cones_by_amplitude(sand, [1e-7, 3e-7, 1e-6], rd.directions.rendulic(30), 1)})
    for view, render, panels, frames, traces in (
        (cones(found), cones_of_page.cones, 2, 1, 5),
        (sweep, cones_of_page.amplitude, 2, 1, 6),
        (bifurcation_map({"loose": two_seeds, "other": two_seeds}), map_of_page.bifurcation_map, 4, 1, 14),
        (predicted_observed({"a": table, "b": table}), bursts_of_page.predicted_observed, 2, 2, 2),
        (burst_curves(curves), bursts_of_page.burst_curves, 3, 1, 11),
        (equation_1(curves), bursts_of_page.equation_1, 1, 1, 3),
    ):
        figure = draw(view)
        assert len(figure.axes) == panels
        assert figure._repr_png_().startswith(b"\x89PNG")
        page = render("a-name", {"a label": view})
        assert page.name == "a-name"
        assert view.caption in page.caption
        drawn = plotted(page)
        assert len(drawn) == frames
        assert all(len(frame.data) >= traces for frame in drawn)


def test_an_unknown_edge_has_a_question_mark_and_no_bar():
    """In both libraries, however it is drawn."""
    table = table_of_cones([[-0.2], [-0.3]], [[(116.0, 126.0)], [(110.0, 130.0)]], UNKNOWN)
    view = bifurcation_map({"loose": table})
    bars = [each for each in draw(view).axes[0].containers if each.has_yerr]
    assert not bars
    (frame,) = plotted(map_of_page.bifurcation_map("map", {"": view}))
    assert [trace.text for trace in frame.data if trace.mode == "text"] == [("?",) * 4]


def test_the_page_draws_sectors_from_edge_to_edge(found):
    """One across 0 degrees at both ends, as far as it is in sight."""
    view = cones(found)
    (first, last), row = found["eta = 1"].sectors[0], view.rows[0]
    across = replace(row, label="across", sectors=(Sector(350.0, 385.0, 0.5, 0.5),))
    page = cones_of_page.cones("cones", {"": replace(view, rows=(*view.rows, across), low=0.0, high=360.0)})
    (frame,) = plotted(page)
    (bars,) = [trace for trace in frame.data if trace.type == "bar"]
    drawn = [(at, at + width) for at, width in zip(bars.base, bars.x, strict=True)]
    assert_allclose(drawn, [(first, last), (-10.0, 25.0), (350.0, 385.0)], rtol=1e-4)
    assert bars.y == ("eta = 1", "across", "across")


def test_what_cannot_be_shown_is_refused(sand):
    with pytest.raises(InvalidInput, match="bifurcation maps needs the table of one specimen at least"):
        bifurcation_map({})
    with pytest.raises(InvalidInput, match="bursts needs the table of one state at least"):
        predicted_observed({})
    with pytest.raises(InvalidInput, match="one direction at least"):
        burst_curves({})
    with pytest.raises(InvalidInput, match=r"those of rd\.burst of grains, '130' is none"):
        equation_1({"130": rd.burst(sand, 130.0, 1e-9)})
    sweeps = {kind: rd.cones_by_amplitude(sand, norms, rd.directions.rendulic(30), 1, kind=kind) for kind, norms in (
        ("strain", [1e-7, 2e-7]), ("stress", [1.0, 2.0]))}  # fmt: skip
    with pytest.raises(InvalidInput, match="tables of one kind of probes, got strain and stress"):
        amplitude(sweeps)
