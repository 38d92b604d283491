"""Reports of large studies are thinned out, say so, and lose no figure."""

from __future__ import annotations

import numpy as np
import pytest

from rendulic.report import size
from rendulic.report.figure import Figure, PageSection, embedded, numbers
from rendulic.report.size import fitted
from rendulic.views.view import Table


def figure(name, families=1, frames=1, traces=1, points=10, linked=""):
    x = numbers(np.linspace(0.0, 1.0, points) ** 2)

    def trace(k):
        return {"type": "scatter", "name": f"trace {k}", "x": x, "y": x, "marker": {"color": x, "size": 4}}

    own = {
        f"family {j}": {f"frame {i}": [trace(k) for k in range(traces)] for i in range(frames)} for j in range(families)
    }
    return Figure(name, "What is shown.", own, {}, linked=linked)


def bytes_of(sections):
    return sum(len(embedded(part.data())) for each in sections for part in each.parts if isinstance(part, Figure))


KINDS = {
    "long curves": {"points": 30_000},
    "many curves": {"traces": 2000},
    "many frames": {"frames": 2000},
    "many sets": {"families": 2000},
    "all of it": {"families": 10, "frames": 10, "traces": 10, "points": 200},
}


@pytest.mark.parametrize("kind", KINDS)
def test_any_kind_of_figure_finds_room(kind):
    small = figure("small")
    large = figure("large", **KINDS[kind])
    shown = fitted(
        [PageSection("a", "A", parts=[small, large]), PageSection("b", "B", parts=[figure("other")])], 100_000
    )
    assert bytes_of(shown) <= 100_000
    assert bytes_of(shown) > 20_000
    assert [[part.name for part in each.parts] for each in shown] == [["small", "large"], ["other"]]
    assert shown[0].parts[0] == small
    caption = shown[0].parts[1].caption
    assert caption.startswith("What is shown. To keep the page small it shows ")
    assert caption.endswith("; the study's folder has all.")


def test_a_thinned_curve_keeps_its_ends_and_its_rows_together():
    (section,) = fitted([PageSection("a", "A", parts=[figure("large", points=30_000)])], 100_000)
    (trace,) = section.parts[0].families["family 0"]["frame 0"]
    assert (trace["x"][0], trace["x"][-1]) == (0.0, 1.0)
    assert trace["x"] == trace["y"] == trace["marker"]["color"] == sorted(trace["x"])
    assert trace["marker"]["size"] == 4
    assert "every" in section.parts[0].caption


def test_lines_with_gaps_keep_all_their_points():
    """What stands between gaps belongs together."""
    gaps = figure("gaps", points=3000)
    (trace,) = gaps.families["family 0"]["frame 0"]
    trace["x"] = trace["y"] = [0.0, 1.0, None] * 1000
    (section,) = fitted([PageSection("a", "A", parts=[gaps])], bytes_of([PageSection("a", "A", parts=[gaps])]) // 2)
    assert section.parts[0].families["family 0"]["frame 0"][0]["x"] == trace["x"]


def test_a_small_figure_that_moves_with_a_large_one_keeps_all():
    """They find each other's states by their words; one that is not there is passed over."""
    parts = [figure("large", families=300, points=50, linked="state"), figure("small", families=9, linked="state")]
    (section,) = fitted([PageSection("a", "A", parts=parts)], 150_000)
    assert 1 < len(section.parts[0].families) < 300
    assert section.parts[1] == parts[1]


def test_long_tables_say_how_much_they_show():
    long = Table("Rows", ("a", "b"), [(str(k), "x") for k in range(9000)], marks=["good"] * 9000)
    short = Table("Few", ("a", "b"), [("1", "2")] * 3)
    (section,) = fitted([PageSection("a", "A", parts=[long, short, long])], most_rows=1003)
    assert [len(part.rows) for part in section.parts] == [500, 3, 500]
    assert section.parts[0].caption == "Rows (the first 500 of 9000 rows; the study's folder has all)"
    assert len(section.parts[0].marks) == 500
    assert section.parts[1] == short


def test_what_fits_is_left_alone():
    sections = [PageSection("a", "A", parts=[figure("one"), Table("", ("a",), [("1",)])])]
    assert fitted(sections) == sections
    assert size.LARGEST + 5e6 < 15e6
