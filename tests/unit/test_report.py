"""The report: it says what the results say, judges them by their limits, and needs nothing but itself."""

from __future__ import annotations

import itertools
import json
import re
import shutil
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

import rendulic as rd
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.report import write_report
from rendulic.report.draw import drawn
from rendulic.report.figure import Figure, embedded, numbers
from rendulic.report.page import render, sections
from rendulic.study.execution.campaign import results_in
from rendulic.study.execution.status import status_of
from rendulic.views import specimen as specimen_view
from rendulic.views import trust as trust_view
from rendulic.views.anatomy import most_negative
from rendulic.views.catalogue import catalogue
from rendulic.views.cones import cones
from rendulic.views.trust import checks, energy_error

ALL = ["cones", "directions", "bursts", "trust", "loading", "tests", "anatomy", "run"]
STYLE = resources.files("rendulic.report").joinpath("templates", "style.css").read_text(encoding="utf-8")
PALETTES = {
    name: dict(re.findall(r"(--[\w-]+): (#[0-9a-f]{6}|rgba\([^)]*\))", block))
    for name, block in re.findall(r':root(?:\[data-theme="(\w+)"\])? \{(.*?)\n\}', STYLE, re.DOTALL)
}
# what red-blind, green-blind and blue-blind eyes see of linear RGB (Machado, Oliveira and Fernandes 2009, Table 1)
EYES = {
    "all": np.eye(3),
    "red-blind": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "green-blind": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "blue-blind": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}


@pytest.fixture(scope="module")
def results(reported_study):
    """Of the finished study."""
    return results_in(reported_study)


@pytest.fixture(scope="module")
def page(results):
    """The text of the page, without the library in it."""
    from plotly.offline import get_plotlyjs

    return render(results).replace(get_plotlyjs(), "")


@pytest.fixture
def own_copy(reported_study, tmp_path):
    """A folder to take results out of."""
    return shutil.copytree(reported_study, tmp_path / "own")


def figures_of(results):
    return [part for section in sections(results) for part in section.parts if isinstance(part, Figure)]


def test_every_part_of_a_study_has_its_section(results, page):
    """In order, each with its anchor, and each figure with its data."""
    assert re.findall(r'<section id="(\w+)"', page) == ALL
    names = [figure.name for figure in figures_of(results)]
    assert len(set(names)) == len(names) >= 12
    for name in names:
        assert json.loads(re.search(rf'id="data-{name}">(.*?)</script>', page).group(1))["families"]


def test_the_file_is_one_and_small(results, tmp_path):
    """It is written where asked, and below the 15 MB allowed."""
    path = write_report(results.store.folder, tmp_path / "deep" / "page.html")
    assert 1e6 < path.stat().st_size < 15e6
    assert [each.name for each in path.parent.iterdir()] == ["page.html"]


def test_nothing_is_fetched(page):
    """No address of anything else, and a policy by which a browser would refuse it."""
    assert set(re.findall(r'(?:src|href|action)="([^"]*)"', page)) == {f"#{name}" for name in ALL} | {"data:,"}
    assert "default-src 'none'" in page
    assert "connect-src" not in page
    assert not re.search(r"@import|url\(", STYLE)


def test_what_people_wrote_is_text(page):
    """A title is not markup, nor does JSON end its script."""
    assert "<h1>A &lt;b&gt;little&lt;/b&gt; of everything &amp; more</h1>" in page
    assert embedded({"a": "</script>&"}) == '{"a":"\\u003c/script\\u003e\\u0026"}'
    with pytest.raises(ValueError, match="not JSON compliant"):
        embedded(float("nan"))


def coloured(value, palette):
    """The value with names of colours replaced, as the page's script does it."""
    if isinstance(value, str) and value.startswith("--"):
        return palette[value]
    if isinstance(value, dict):
        return {key: coloured(inner, palette) for key, inner in value.items()}
    return [coloured(inner, palette) for inner in value] if isinstance(value, list) else value


@pytest.mark.parametrize("palette", PALETTES.values(), ids=["light", "dark"])
def test_figures_are_what_plotly_draws(results, palette):
    """Every frame of every figure passes plotly's own checks, with colours that the style sheet has."""
    import plotly.graph_objects as go

    drawn = 0
    for figure in figures_of(results):
        for frames in figure.data()["families"] if figure.drawn_by == "plot" else []:
            for frame in frames["frames"]:
                go.Figure(coloured([*figure.fixed, *frame["data"]], palette), coloured(dict(figure.layout), palette))
                drawn += 1
    assert drawn > 20
    with pytest.raises(ValueError, match="Invalid property"):
        go.Figure([{"type": "scatter", "colour": "red"}])


def part(results, name, kind=Figure):
    """The first figure, or table, of a study figure in the page."""
    return next(each for each in drawn(name, catalogue()[name].shown(results)) if isinstance(each, kind))


def test_circles_are_the_probes(results):
    """The curve of each frame is W2n over alpha, closed, to the digits written; the table has its smallest."""
    diagram, table = drawn("fig3", catalogue()["fig3"].shown(results))[:2]
    label = "loose, seed 2, probes 'circle' of 0.0002"
    assert next(iter(diagram.families)) == label
    found = {state: data for (name, state), data in results.of("probes").items() if name == "circle"}
    assert len(found) == 4  # of grains and of a sand
    for state, probes in found.items():
        data = probes.sel(norm=2e-4)
        own = label if state.specimen == "loose" else "hostun, e = 0.9, probes 'circle' of 0.0002"
        trace = diagram.families[own][str(state)][-1]
        np.testing.assert_allclose(trace["r"][:-1], data.w2_normalised.values, rtol=1e-4)
        np.testing.assert_allclose(trace["theta"][:-1], data.alpha.values)
        assert (trace["r"][-1], trace["theta"][-1]) == (trace["r"][0], trace["theta"][0])
        row = next(row for row in table.rows if row[0] == str(state) and "'circle' of 0.0002" in row[1])
        assert float(row[2]) == pytest.approx(float(data.w2_normalised.min()), abs=5e-4)
        assert float(row[3]) == float(data.alpha[int(np.argmin(data.w2_normalised.values))])


def test_the_sum_over_grains_lies_on_the_boundary(results):
    """Circles on the line, as the identity has it, in every frame."""
    for frames in part(results, "fig4").families.values():
        for macro, micro, *_ in frames.values():
            np.testing.assert_allclose(micro["y"], macro["y"], rtol=2e-5)


def test_cones_are_drawn_from_edge_to_edge():
    """A bar for each sector, and a turn lower too where it goes beyond 360 degrees; the table says them."""
    sand = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
    sand.load(rd.paths.drained_triaxial(0.3, until_eta=1.0))
    found = rd.instability_cone(sand, rd.directions.rendulic(10), 1e-7)
    ((low, high),) = found.strain_sectors
    turned = replace(found, strain_sectors=((350.0, 385.0),))
    figure, table = drawn("cones", {"": cones({"a": found, "b": turned})})
    bars = next(trace for trace in figure.families[""][""] if trace["type"] == "bar")
    ends = [(base, base + width) for base, width in zip(bars["base"], bars["x"], strict=True)]
    np.testing.assert_allclose(sorted(ends), sorted([(low, high), (350.0, 385.0), (-10.0, 25.0)]), rtol=1e-4)
    assert high - low > 5.0
    assert [row[2].split()[0] for row in table.rows] == [f"{low:.4g}", "350"]


def verdicts(results):
    return {check.question: check for check in checks(results)}


def test_verdicts_are_those_of_the_limits(results, monkeypatch):
    """The identity holds to rounding; against a limit of nothing it does not, and the worst is named."""
    question = "A test of the code's sums: is W2 of contacts and grains equal to W2 of the boundary?"
    assert verdicts(results)[question].verdict == "good"
    every = [*results.of("probes").values(), *(cone.probes for cone in results.cones.values())]
    residuals = [float(probes.identity_residual.max()) for probes in every if "identity_residual" in probes]
    monkeypatch.setitem(trust_view.LIMITS, "identity", 0.5 * max(residuals))
    part = verdicts(results)[question]
    assert part.verdict == "doubtful"
    assert part.measured == f"residual {max(residuals):.2g}"
    monkeypatch.setitem(trust_view.LIMITS, "identity", 0.0)
    assert verdicts(results)[question].verdict == "bad"


def test_fast_loading_is_called_so(results):
    """The study was sheared at 5e-4, beyond the limit of 1e-4."""
    check = verdicts(results)["Was the loading of the grains quasi-static?"]
    largest = float(results.whole_curve(results.samples[0]).inertial_number.max())
    assert (check.verdict, check.measured) == ("bad", f"inertial number {largest:.2g}")


def test_a_moving_state_is_not_at_rest(reported_study, monkeypatch):
    """One grain of one state is set in motion: this state is named."""
    results = results_in(reported_study)
    question = "Were the grains at rest when probed?"
    assert verdicts(results)[question].verdict == "good"
    first = results.states[0]
    read = results.state

    def moving(state):
        specimen = read(state)
        if state == first:
            specimen.grains.velocity[0] = 1.0
        return specimen

    monkeypatch.setattr(results, "state", moving)
    check = verdicts(results)[question]
    assert (check.verdict, check.where) == ("doubtful", f"not in {first}")


def test_a_state_that_contradicts_itself_is_named(reported_study, monkeypatch):
    """A wall of one state is moved after its forces were computed: the audits that this fails are named, and the state."""
    results = results_in(reported_study)
    question = "Do independent numbers of the states agree?"
    assert verdicts(results)[question].verdict == "good"
    first, read = results.states[0], results.state

    def spoilt(state):
        specimen = read(state)
        if state == first:
            specimen.walls.position[1] += 1e-4 * specimen.lengths[0]
        return specimen

    monkeypatch.setattr(results, "state", spoilt)
    check = verdicts(results)[question]
    assert (check.verdict, check.where) == ("doubtful", f"not in {first}")
    assert "law" in check.measured


def test_lost_energy_is_missed(results):
    """Of work that friction took and nobody counted, the whole is missing."""
    last = next(state for state in reversed(results.states) if state.specimen == "loose")
    now, before = results.state(last).energies(), results.sample(last.sample).energies()
    error = energy_error(before, now)
    friction = now["friction"] - before["friction"]
    largest = max(abs(now[name] - before[name]) for name in before)
    assert error < 1e-2
    forgotten = before | {"friction": before["friction"] + friction}
    assert energy_error(forgotten, now) == pytest.approx(friction / largest, abs=2 * error)


def test_what_is_missing_is_said(own_copy):
    """A section without data is not there, units taken away are named, and so is a failure with its reason."""
    full = results_in(own_copy)
    first = full.states[0]
    gone = [unit for table in ("bursts", "anatomy") for units in full.plan.of(table).values() for unit in units]
    gone.append(full.plan.of("probes")["circle", first][0])
    for unit in gone:
        full.store.remove(unit.key)
    failed = gone[0]
    full.store.note_failure(failed.key, failed.label, "it fell <over>", True)
    left = results_in(own_copy)
    found = {section.name: section for section in sections(left)}
    assert set(found) == {*ALL, "missing"} - {"bursts"}
    assert {row[0]: row[1] for row in found["missing"].parts[0].rows} == {
        unit.label: "failed" if unit is failed else "missing" for unit in gone
    }
    assert "it fell &lt;over&gt;" in render(left)
    assert ("circle", first) not in left.of("probes")
    status = status_of(own_copy)
    assert (status.done, status.total) == (len(full.done) - len(gone), len(full.wanted))
    assert {unit.label for unit in status.missing} == {unit.label for unit in gone if unit is not failed}


def test_nothing_finished_is_a_report_too(own_copy):
    """Everything is missing, and said to be."""
    shutil.rmtree(own_copy / "units")
    assert [section.name for section in sections(results_in(own_copy))] == ["run", "missing"]
    assert f"0 of {len(results_in(own_copy).wanted)} units finished" in render(results_in(own_copy))


def test_large_specimens_are_reduced_to_the_work(results, monkeypatch):
    """What is kept are the contacts of the largest work, and the caption says so."""
    _, whole = most_negative(results)
    monkeypatch.setattr(specimen_view, "MOST_CONTACTS", 20)
    monkeypatch.setattr(specimen_view, "MOST_GRAINS", 30)
    figure = part(results, "specimen")
    data = figure.families[""][""][0]
    largest = np.sort(np.abs(whole.w2.values))[::-1][:20]
    np.testing.assert_allclose(np.abs(data["contacts"]["w2"]), largest, rtol=1e-2)
    assert len(data["grains"]["r"]) == 30
    assert "of which the 30 and 20 of the largest work are shown" in figure.caption


def test_without_an_anatomy_there_are_forces(own_copy):
    """The last state of grains is shown, and why it has no work."""
    results = results_in(own_copy)
    for units in results.plan.of("anatomy").values():
        results.store.remove(units[0].key)
    results = results_in(own_copy)
    figure = part(results, "specimen")
    last = next(state for state in reversed(results.states) if state.specimen == "loose")
    snapshot = results.state(last).snapshot()
    forces = figure.families[""][""][0]["contacts"]["force"]
    assert not figure.families[""][""][0]["hasWork"]
    of_pairs = snapshot.force_n[snapshot.second < snapshot.n_grains]
    np.testing.assert_allclose(sorted(forces), sorted(snapshot.force_n / of_pairs.mean()), rtol=1e-2, atol=1e-9)


def test_errors_are_sentences(own_copy, tmp_path):
    """A folder that is no study; a damaged result."""
    with pytest.raises(InvalidInput, match="is not the folder of a study"):
        write_report(tmp_path)
    results = results_in(own_copy)
    path = results.store.file(next(iter(results.plan.states.values())).key)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(CorruptFile):
        write_report(own_copy)
    assert not (own_copy / "report.html").exists()


def test_numbers_are_rounded_not_lost():
    """Any shape, kinds that JSON has, None where there is no number."""
    assert numbers(np.array([[1.0, 123456.0], [np.inf, -1.234567e-9]])) == [[1.0, 123460.0], [None, -1.2346e-09]]
    assert numbers(np.array([True, False])) == [True, False]
    assert numbers(np.arange(2)) == [0, 1]


def linear(colour):
    """sRGB as light."""
    values = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def contrast(first, second):
    """Of WCAG 2.2, 1 to 21."""
    low, high = sorted(float(linear(colour) @ [0.2126, 0.7152, 0.0722]) for colour in (first, second))
    return (high + 0.05) / (low + 0.05)


def lab(light):
    """CIE L*a*b* under D65."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = to_xyz @ np.clip(light, 0.0, 1.0) / [0.9505, 1.0, 1.089]
    root = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * root[1] - 16.0, 500.0 * (root[0] - root[1]), 200.0 * (root[1] - root[2])])


@pytest.mark.parametrize("palette", PALETTES.values(), ids=["light", "dark"])
def test_colours_can_be_told_apart(palette):
    """Words have WCAG's contrast of 4.5, lines 3; colours of curves differ for colour-blind eyes, too."""
    words = ("--ink", "--muted", "--link", "--good", "--doubtful", "--bad")
    lines = ("--negative", "--positive", *(f"--c{k}" for k in range(6)), *(f"--s{k}" for k in range(7)))
    assert min(contrast(palette[name], palette["--paper"]) for name in words) >= 4.5
    assert min(contrast(palette[name], palette["--paper"]) for name in lines) >= 3.0
    # a difference of 2.3 is just noticeable, 10 is seen at a glance
    for eye in EYES.values():
        seen = [lab(np.array(eye) @ linear(palette[f"--c{k}"])) for k in range(6)]
        assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) >= 10.0
        bad, good = (lab(np.array(eye) @ linear(palette[name])) for name in ("--negative", "--positive"))
        assert np.linalg.norm(bad - good) >= 30.0
