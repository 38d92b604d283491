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
from rendulic.probing.amplitude import amplitude_table
from rendulic.probing.bifurcation import censored_median, first_negative
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


def table_of_cones(smallest, edges, uncertainty=0.5, unknown=()):
    """A map as `rd.bifurcation_map` gives it: smallest W2n of (eta, specimen), NaN if missing; edges of each or None.

    `unknown` are the places (eta, specimen) of states without an unstable direction that are unknown from 100 to 120 degrees.
    """
    smallest = np.array(smallest, dtype=float)
    etas = 0.1 * np.arange(1, len(smallest) + 1)
    ends = np.array([[one or (np.nan, np.nan) for one in row] for row in edges])[:, :, None, :]
    is_unknown = np.zeros(smallest.shape, dtype=bool)
    is_unknown[tuple(np.array(unknown, dtype=int).reshape(-1, 2).T)] = True
    is_unstable, is_present = np.isfinite(ends[:, :, 0, 0]), np.isfinite(smallest)
    is_stable = is_present & ~is_unstable & ~is_unknown
    columns = zip(smallest.T, is_unstable.T, is_stable.T, is_present.T, strict=True)
    first = [first_negative(etas, *column) for column in columns]
    low, high = censored_median(*np.array([one[1:3] for one in first], dtype=float).T)
    axes = ("eta", "specimen")
    return xr.Dataset(
        {
            "smallest_w2n": (axes, smallest), "is_significant": (axes, is_stable | is_unstable),
            "is_unstable": (axes, is_unstable), "is_stable": (axes, is_stable), "is_present": (axes, is_present),
            "smallest_error": (axes, np.full(smallest.shape, 1e-3)),
            "edge_from": ((*axes, "sector"), ends[..., 0]), "edge_to": ((*axes, "sector"), ends[..., 1]),
            "edge_from_uncertainty": ((*axes, "sector"), np.full(ends.shape[:3], uncertainty)),
            "edge_to_uncertainty": ((*axes, "sector"), np.full(ends.shape[:3], uncertainty)),
            "unknown_from": ((*axes, "unknown_sector"), np.where(is_unknown, 100.0, np.nan)[..., None]),
            "unknown_to": ((*axes, "unknown_sector"), np.where(is_unknown, 120.0, np.nan)[..., None]),
            "first_eta": ("specimen", [one[0] for one in first]),
            "first_eta_from": ("specimen", [one[1] for one in first]),
            "first_eta_to": ("specimen", [one[2] for one in first]),
            "first_eta_reason": ("specimen", [one[3] for one in first]),
            "first_eta_median_from": low, "first_eta_median_to": high,
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
    sectors = ((one,), (turned, other), (), (other,), (one, other))
    track = Track("", np.arange(5.0), sectors, ((),) * 5, flat, flat > -1, flat)
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
    assert table.rows[0][2].startswith(f"{first:.4g} ± ")
    assert f" to {last % 360.0:.4g} ± " in table.rows[0][2]
    assert [row[1] for row in table.rows] == ["unstable", "stable"]
    assert (table.rows[1][2], table.marks) == ("none", ["bad", ""])


def test_each_sample_of_a_map_has_its_own_answer(two_seeds):
    """Found in one; in the other unstable at its first ratio, which is said and not left out."""
    view = bifurcation_map({"loose": two_seeds}, "a map")
    (panel,) = view.panels
    one, other = panel.samples
    assert_allclose(one.first, (0.25, 0.2, 0.3))
    assert one.words == "W2 = 0 first at eta = 0.25 (0.2 to 0.3)"
    assert other.first is None
    assert other.words == "W2 = 0 first at or below eta = 0.2, the first that was probed"
    assert view.verdict == f"loose: seed 1: {one.words}; seed 2: {other.words}."
    assert [row[4] for row in view.tables[0].rows] == [one.words, other.words]
    assert [row[1:4] for row in view.tables[0].rows] == [("4", "2", "0"), ("2", "2", "0")]
    # the median of one between 0.2 and 0.3 and of one at or below 0.2 is not known from below
    assert panel.median == "W2 = 0 first at or below eta = 0.3"
    assert [row[2:] for row in view.tables[1].rows] == [
        ("0 of 1", "0 of 1", "1 of 1"), ("1 of 2", "0 of 2", "1 of 2"),
        ("1 of 1", "0 of 1", "0 of 1"), ("2 of 2", "0 of 2", "0 of 2"),
    ]  # fmt: skip


def test_many_samples_of_a_map_have_a_median_of_all():
    """Also of those that were not found: of five, one is so at the first ratio already, and one never."""
    smallest = [[-0.1, 0.2, 0.3, 0.2, 0.3], [-0.1, -0.1, 0.1, 0.2, 0.3], [-0.1, -0.1, -0.1, 0.1, 0.2]]
    edges = [[(120.0, 130.0) if one < 0.0 else None for one in row] for row in smallest]
    table = table_of_cones(smallest, edges, unknown=[(2, 3)])
    view = bifurcation_map({"loose": table})
    assert [one.words for one in view.panels[0].samples] == [
        "W2 = 0 first at or below eta = 0.1, the first that was probed",
        "W2 = 0 first at eta = 0.167 (0.1 to 0.2)",
        "W2 = 0 first at eta = 0.25 (0.2 to 0.3)",
        "W2 = 0 not by eta = 0.2, unknown at eta = 0.3",
        "W2 = 0 not by eta = 0.3",
    ]
    assert view.verdict == "loose: median of 5 samples: W2 = 0 first between eta = 0.2 and 0.3 (2 of them found)."
    shares = view.panels[0].shares
    assert shares.count.tolist() == [5, 5, 5]
    assert shares.unstable.tolist() == [1, 2, 3]
    assert shares.unknown.tolist() == [0, 0, 1]
    assert "seed 4" not in view.verdict
    assert [row[3] for row in view.tables[0].rows] == ["0", "0", "0", "1", "0"]
    figure = draw(view)
    assert len(figure.axes) == 3
    heights = [bar.get_height() for bar in figure.axes[2].patches]
    assert_allclose(heights, [1.0] * 3 + [0.2, 0.4, 0.6] + [0.0, 0.0, 0.2], atol=1e-12)


def test_an_unknown_state_bounds_the_first_ratio_on_neither_side():
    """It may have been the first: the lower bound is the last ratio before it, and none if it comes first."""
    eta, work = np.array([0.1, 0.2, 0.3, 0.4]), np.array([0.3, 0.1, 0.1, -0.1])
    unstable, there = work < 0.0, np.ones(4, dtype=bool)
    for unknown, low, words in (
        ([False, True, False, False], 0.1, "found"),
        ([True, False, False, False], None, "at or below eta = 0.4, unknown at 0.1"),
    ):
        stable = ~unstable & ~np.array(unknown)
        first, *bounds, reason = first_negative(eta, work, unstable, stable, there)
        assert reason == words
        assert_allclose(bounds, [np.nan if low is None else low, 0.4])
        assert_allclose(first, np.nan if low is None else 0.35)
    none = np.zeros(4, dtype=bool)
    assert first_negative(eta, work, none, none, there)[3] == "unknown at eta = 0.1, 0.2, 0.3, ..."
    assert first_negative(eta, work, none, none, none)[3] == "no state"
    assert first_negative(eta, work, none, work > 0.0, work > 0.0)[1:] == pytest.approx(
        (0.3, np.nan, "not by eta = 0.3"), nan_ok=True
    )


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


def test_what_is_unknown_is_said_counted_and_drawn(virgin):
    """A state of which nothing is known, and one with a hole: neither is stable, in words, table and both figures."""
    around = rd.directions.rendulic(step=10)
    probes = rd.probe(virgin, around, norm=1e-7)
    hole, nothing = probes.copy(deep=True), probes.copy(deep=True)
    hole["w2_normalised"][20:22] = np.nan
    nothing["w2_normalised"][:] = np.nan
    view = cones({name: rd.cone_of(one) for name, one in (("all", probes), ("hole", hole), ("nothing", nothing))})
    assert [row.verdict for row in view.rows] == ["stable", "unknown", "unknown"]
    assert view.verdict == (
        "0 of 3 states have unstable directions; of 2 it is not known, as the sign is not sure in some directions."
    )
    (table,) = view.tables
    assert [row[1] for row in table.rows] == ["stable", "unknown", "unknown"]
    assert [row[3] for row in table.rows] == ["none", "190 to 220°", "all directions"]
    assert table.marks == ["", "doubtful", "doubtful"]
    left = draw(view).axes[0]
    hatched = [bar for bar in left.patches if bar.get_hatch()]
    assert [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in hatched if bar.get_width() < 360] == [
        (190.0, 220.0)
    ]
    assert [text.get_text() for text in left.texts if text.get_text() in ("none", "unknown")] == ["none", "unknown"]
    (frame,) = plotted(cones_of_page.cones("cones", {"": view}))
    (bars,) = [trace for trace in frame.data if trace.type == "bar" and trace.name == "unknown"]
    assert set(bars.y) == {"hole", "nothing"}
    said = [trace for trace in frame.data if trace.type == "scatter" and trace.mode == "text"]
    assert [trace.y for trace in said if "none" in trace.text] == [("all",)]
    assert (table.rows[2][5], table.rows[2][6]) == ("none", "")


def test_unknown_states_of_maps_and_sweeps_are_drawn(virgin):
    """Dotted from one end to the other, and no smallest value is drawn as sure."""
    table = table_of_cones([[0.2], [0.1]], [[None], [None]], unknown=[(1, 0)])
    view = bifurcation_map({"loose": table})
    assert view.panels[0].samples[0].words == "W2 = 0 not by eta = 0.1, unknown at eta = 0.2"
    probes = rd.probe(virgin, rd.directions.rendulic(10), [1e-7, 2e-7])
    probes["w2_normalised"][1, 10:13] = np.nan
    sweep = amplitude({"sand": amplitude_table(probes)})
    assert [row[2] for row in sweep.tables[1].rows] == ["stable", "unknown"]
    assert [row[5] for row in sweep.tables[1].rows] == ["none", "90 to 130°"]
    for shown, at, ends, render in (
        (view, 0.2, [100.0, 120.0], map_of_page.bifurcation_map),
        (sweep, 2e-7, [90.0, 130.0], cones_of_page.amplitude),
    ):
        axes = draw(shown).axes[0 if shown is view else 1]
        dotted = [line for line in axes.lines if np.array_equal(line.get_xdata(), [at, at])]
        assert_allclose(dotted[0].get_ydata(), ends)
        (frame,) = plotted(render("a-name", {"": shown}))
        drawn = [
            trace
            for trace in frame.data
            if trace.type == "scatter" and trace.line.dash == "dot" and trace.line.width == 6
        ]
        assert len(drawn) == 1
        assert_allclose([each for each in drawn[0].y if each is not None], [ends[0], np.mean(ends), ends[1]])


def test_disagreements_are_listed():
    """One settles against its prediction; what proves nothing, at an edge, undecided, too fast or unsure, is neither for nor against."""
    table = bursts_of(
        [0.9, -0.4, -0.5, 0.1, 0.8, 0.7, -0.3], [False, True, True, False, False, False, True], [0, 1, 0, 0, 3, 4, 0],
        to_edge=[90.0, 20.0, 20.0, 4.0, 90.0, 90.0, 90.0], w2_normalised_opposite=[-0.1, *[0.9] * 6],
        w2_normalised_lasting=[0.9, -0.3, -0.2, 0.1, 0.8, 0.7, -0.1], kinetic_share=[1e-6, 0.3, 2e-6, 1e-6, 1e-6, 1e-3, 1e-6],
        is_sure=[True] * 6 + [False], pushes=[1, 4, 4, 1, 2, 1, 1], pushes_failed=[0, 4, 0, 0, 1, 0, 0],
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
        "not counted: opposite is unstable", "agrees", "disagrees", "not counted: edge",
        "not counted: undecided, 1 of 2 pushes fail",
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
        (bifurcation_map({"loose": two_seeds, "other": two_seeds}), map_of_page.bifurcation_map, 6, 1, 18),
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
    bars, unknown = [trace for trace in frame.data if trace.type == "bar"]
    assert not unknown.y
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
