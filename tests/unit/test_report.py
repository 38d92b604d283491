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
from rendulic.report.circles import circles
from rendulic.report.findings import Findings

import rendulic as rd
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.report import trust as trust_table
from rendulic.report import write_report
from rendulic.report.cones import cones
from rendulic.report.figure import Figure, embedded, numbers
from rendulic.report.page import render, sections
from rendulic.report.specimen import specimen
from rendulic.report.trust import checks, energy_error
from rendulic.study.execution.status import status_of

ALL = ["run", "trust", "loading", "directions", "cones", "bursts", "anatomy", "specimen", "model"]
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
def findings(reported_study):
    """Of the finished study."""
    return Findings(reported_study)


@pytest.fixture(scope="module")
def page(findings):
    """The text of the page, without the library in it."""
    from plotly.offline import get_plotlyjs

    return render(findings).replace(get_plotlyjs(), "")


@pytest.fixture
def own_copy(reported_study, tmp_path):
    """A folder to take results out of."""
    return shutil.copytree(reported_study, tmp_path / "own")


def figures_of(findings):
    return [part for section in sections(findings) for part in section.parts if isinstance(part, Figure)]


def test_every_part_of_a_study_has_its_section(findings, page):
    """In order, each with its anchor, and each figure with its data."""
    assert re.findall(r'<section id="(\w+)"', page) == ALL
    names = [figure.name for figure in figures_of(findings)]
    assert len(set(names)) == len(names) == 10
    for name in names:
        assert json.loads(re.search(rf'id="data-{name}">(.*?)</script>', page).group(1))["families"]


def test_the_file_is_one_and_small(findings, tmp_path):
    """It is written where asked, and below the 15 MB allowed."""
    path = write_report(findings.store.folder, tmp_path / "deep" / "page.html")
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
def test_figures_are_what_plotly_draws(findings, palette):
    """Every frame of every figure passes plotly's own checks, with colours that the style sheet has."""
    import plotly.graph_objects as go

    drawn = 0
    for figure in figures_of(findings):
        for frames in figure.data()["families"] if figure.drawn_by == "plot" else []:
            for frame in frames["frames"]:
                go.Figure(coloured([*figure.fixed, *frame["data"]], palette), coloured(dict(figure.layout), palette))
                drawn += 1
    assert drawn > 20
    with pytest.raises(ValueError, match="Invalid property"):
        go.Figure([{"type": "scatter", "colour": "red"}])


def test_circles_are_the_probes(findings):
    """The curve of each frame is W2n over alpha, closed, to the digits written; the table has its smallest."""
    diagram, table = circles(findings).parts[:2]
    chosen = findings.study.probes[0]
    label = "loose, seed 2, strain probes 'circle' of 0.0002"
    assert next(iter(diagram.families)) == label
    for place, probes in findings.probes(chosen).items():
        data = probes.sel(norm=2e-4)
        trace = diagram.families[label][str(place)][-1]
        np.testing.assert_allclose(trace["r"][:-1], data.w2_normalised.values, rtol=1e-4)
        np.testing.assert_allclose(trace["theta"][:-1], data.alpha.values)
        assert (trace["r"][-1], trace["theta"][-1]) == (trace["r"][0], trace["theta"][0])
        row = next(row for row in table.rows if row[0] == str(place) and "'circle' of 0.0002" in row[1])
        assert float(row[2]) == pytest.approx(float(data.w2_normalised.min()), abs=5e-4)
        assert float(row[3]) == float(data.alpha[int(np.argmin(data.w2_normalised.values))])


def test_the_sum_over_grains_lies_on_the_boundary(findings):
    """Circles on the line, as the identity has it, in every frame."""
    macro_micro = circles(findings).parts[2]
    for frames in macro_micro.families.values():
        for macro, micro, *_ in frames.values():
            np.testing.assert_allclose(micro["y"], macro["y"], rtol=2e-5)


def test_cones_are_drawn_from_edge_to_edge(reported_study):
    """A bar for each sector, and a turn lower too where it goes beyond 360 degrees; the table says them."""
    findings = Findings(reported_study)
    (name, first), (_, last) = findings.cones
    sand = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
    sand.load(rd.paths.drained_triaxial(0.3, until_eta=1.0))
    found = rd.instability_cone(sand, rd.directions.rendulic(10), 1e-7, 1)
    ((low, high),) = found.strain_sectors
    turned = replace(found, strain_sectors=((350.0, 385.0),))
    findings.__dict__["cones"] = {(name, first): found, (name, last): turned}
    figure, table = cones(findings).parts
    traces = figure.families[f"strain probes '{name}'"][""]
    bars = [(trace["y"][0], trace["y"][-1]) for trace in traces if trace.get("line", {}).get("width") == 9]
    np.testing.assert_allclose(bars, [(low, high), (350.0, 385.0), (-10.0, 25.0)], rtol=1e-4)
    assert high - low > 5.0
    assert [row[2].split()[0] for row in table.rows] == [f"{low:.4g}", "350"]


def verdicts(findings):
    return {check.question: check for check in checks(findings)}


def test_verdicts_are_those_of_the_limits(findings, monkeypatch):
    """The identity holds to rounding; against a limit of nothing it does not, and the worst is named."""
    question = "Is W2 of contacts and grains that of the boundary?"
    assert verdicts(findings)[question].verdict == "good"
    residuals = [
        float(findings.probes(chosen)[place].identity_residual.max())
        for chosen in findings.study.probes
        for place in findings.probes(chosen)
    ]
    residuals += [float(cone.probes.identity_residual.max()) for cone in findings.cones.values()]
    monkeypatch.setitem(trust_table.LIMITS, "identity", 0.5 * max(residuals))
    part = verdicts(findings)[question]
    assert part.verdict == "doubtful"
    assert part.measured == f"residual {max(residuals):.2g}"
    monkeypatch.setitem(trust_table.LIMITS, "identity", 0.0)
    assert verdicts(findings)[question].verdict == "bad"


def test_fast_loading_is_called_so(findings):
    """The study was sheared at 5e-4, beyond the limit of 1e-4."""
    check = verdicts(findings)["Was the loading quasi-static?"]
    largest = max(float(curve.inertial_number.max()) for curve in findings.curves.values())
    assert (check.verdict, check.measured) == ("bad", f"inertial number {largest:.2g}")


def test_a_moving_state_is_not_at_rest(reported_study):
    """One grain of one state is set in motion: this state is named."""
    findings = Findings(reported_study)
    question = "Were the states at rest when probed?"
    assert verdicts(findings)[question].verdict == "good"
    place = findings.places[0]
    findings.states[place].grains.velocity[0] = 1.0
    check = verdicts(findings)[question]
    assert (check.verdict, check.where) == ("doubtful", f"not in {place}")


def test_lost_energy_is_missed(findings):
    """Of work that friction took and nobody counted, the whole is missing."""
    from rendulic.dem.measure.energy import energies

    place = findings.places[-1]
    state, before = findings.states[place], energies(findings.results.specimen(*place[:2]))
    error = energy_error(before, state)
    friction = energies(state)["friction"] - before["friction"]
    largest = max(abs(energies(state)[name] - before[name]) for name in before)
    assert error < 1e-2
    forgotten = before | {"friction": before["friction"] + friction}
    assert energy_error(forgotten, state) == pytest.approx(friction / largest, abs=2 * error)


def test_what_is_missing_is_said(own_copy):
    """A section without data is not there, units taken away are named, and so is a failure with its reason."""
    full = Findings(own_copy)
    gone = [*full.plan.bursts.values(), *full.plan.dissections.values(), full.plan.probes["circle", full.places[0]][0]]
    for unit in gone:
        full.store.remove(unit.key)
    failed = gone[0]
    full.store.note_failure(failed.key, failed.label, "it fell <over>", True)
    part = Findings(own_copy)
    found = {section.name: section for section in sections(part)}
    assert set(found) == {*ALL, "missing"} - {"bursts"}
    assert {row[0]: row[1] for row in found["missing"].parts[0].rows} == {
        unit.label: "failed" if unit is failed else "missing" for unit in gone
    }
    assert "it fell &lt;over&gt;" in render(part)
    assert "circle" not in {chosen.name for chosen, places in part.circles() if full.places[0] in places}
    status = status_of(own_copy)
    assert (status.done, status.total) == (len(full.done) - len(gone), len(full.wanted))
    assert {unit.label for unit in status.missing} == {unit.label for unit in gone if unit is not failed}


def test_nothing_finished_is_a_report_too(own_copy):
    """Everything is missing, and said to be."""
    shutil.rmtree(own_copy / "units")
    assert [section.name for section in sections(Findings(own_copy))] == ["run", "missing"]
    assert f"0 of {len(Findings(own_copy).wanted)} units finished" in render(Findings(own_copy))


def test_large_specimens_are_reduced_to_the_work(findings, monkeypatch):
    """What is kept are the contacts of the largest work, and the caption says so."""
    from rendulic.report import specimen as module

    whole = findings.dissection
    monkeypatch.setattr(module, "MOST_CONTACTS", 20)
    monkeypatch.setattr(module, "MOST_GRAINS", 30)
    figure = specimen(findings).parts[0]
    data = figure.families[""][""][0]
    largest = np.sort(np.abs(whole.w2.values))[::-1][:20]
    np.testing.assert_allclose(np.abs(data["contacts"]["w2"]), largest, rtol=1e-2)
    assert len(data["grains"]["r"]) == 30
    assert "of which the 30 and 20 of the largest work are kept here" in figure.caption


def test_without_a_dissection_there_are_forces(own_copy):
    """The last state is shown, and why it has no work."""
    findings = Findings(own_copy)
    for unit in findings.plan.dissections.values():
        findings.store.remove(unit.key)
    findings = Findings(own_copy)
    figure = specimen(findings).parts[0]
    snapshot = findings.states[findings.places[-1]].snapshot()
    forces = figure.families[""][""][0]["contacts"]["force"]
    assert not figure.families[""][""][0]["hasWork"]
    np.testing.assert_allclose(sorted(forces), sorted(snapshot.force_n / snapshot.force_n.mean()), rtol=1e-2, atol=1e-9)


def test_errors_are_sentences(own_copy, tmp_path):
    """A folder that is no study; a damaged result."""
    with pytest.raises(InvalidInput, match="is not the folder of a study"):
        write_report(tmp_path)
    findings = Findings(own_copy)
    path = findings.store.file(next(iter(findings.plan.states.values())).key)
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
