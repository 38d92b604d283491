"""The report in a real browser: it loads, moves, turns, answers the keyboard, and asks nobody for anything."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from rendulic.report import write_report
from rendulic.report.live import LiveView
from rendulic.study.execution.campaign import results_in
from rendulic.views.anatomy import most_negative

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
if CHROMIUM is None:
    pytest.skip("there is no Chromium here: install Debian's package chromium", allow_module_level=True)
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed here")

# software rendering: three dimensions without a graphics card
OPTIONS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
WIDTHS = (1280, 768, 390)
DIAGRAM, BESIDE, WORK, LOADING, SPHERE, SPECIMEN, PLANES = (
    f"#figure-{name}" for name in ("fig3", "side_by_side", "fig4", "fig1", "sphere", "specimen", "fig9")
)


@pytest.fixture(scope="module")
def browser():
    """One for all tests."""
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield started
        started.close()


@pytest.fixture(scope="module")
def report(reported_study, tmp_path_factory):
    """The page of a study as a file."""
    return write_report(reported_study, tmp_path_factory.mktemp("page") / "report.html")


@pytest.fixture(scope="module")
def circle(reported_study):
    """Probes at the first and the last state of the packing, by the name of the state."""
    results = results_in(reported_study)
    states = [state for state in results.states if results.plan.has_grains(state)]
    return {str(state): results.of("probes")["circle", state].sel(norm=2e-4) for state in (states[0], states[-1])}


@pytest.fixture(scope="module")
def opened(browser, report):
    """Open the page; what it asked for and complained of is in `asked` and `complaints`."""
    pages = []

    def do(address=None, **options):
        page = browser.new_page(**{"viewport": {"width": 1280, "height": 900}} | options)
        page.asked, page.complaints = [], []
        page.on("request", lambda request: page.asked.append(request.url))
        page.on("console", lambda note: page.complaints.append(note.text) if note.type == "error" else None)
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.goto(address or report.as_uri())
        pages.append(page)
        return page

    yield do
    for page in pages:
        page.close()


@pytest.fixture(scope="module")
def page(opened):
    """One page for all tests that leave it usable."""
    return opened()


def show(page, figure):
    """Bring a figure into sight, and wait until it is drawn."""
    page.locator(figure).scroll_into_view_if_needed()
    page.wait_for_selector(f"{figure} .js-plotly-plot .main-svg")
    return page.locator(f"{figure} .plot")


def drawn(page, figure, what):
    """A value of a figure's plot, in the page's own words."""
    return page.evaluate(f"document.querySelector('{figure} .plot').{what}")


def until(page, condition):
    """Wait until something of the page is true; its policy keeps playwright's own waiting out."""
    for _ in range(200):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    pytest.fail(f"not within 10 s: {condition}")


def show_all(page):
    """Go through the page from end to end."""
    for figure in page.locator("figure").all():
        figure.scroll_into_view_if_needed()
    until(page, "figures.every(each => each.isDrawn && each.plot.classList.contains('js-plotly-plot'))")


def test_it_loads_alone(page, report, say):
    """No complaint, no request but for the file itself, every figure drawn."""
    show_all(page)
    assert page.complaints == []
    assert [url for url in page.asked if not url.startswith(("data:", "blob:"))] == [report.as_uri()]
    milliseconds = page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd")
    say(f"report of {report.stat().st_size / 1e6:.1f} MB: open after {milliseconds / 1000:.1f} s")


def test_it_may_ask_nobody(opened):
    """The page's own policy stops a request that somebody put into it."""
    page = opened()
    assert page.evaluate("fetch('https://example.org').then(() => 'answered', () => 'refused')") == "refused"
    assert any("Content Security Policy" in complaint for complaint in page.complaints)


def test_the_slider_changes_the_diagram(page, circle):
    """By the keyboard: another state's values are drawn, here and in the figure that is linked."""
    show(page, WORK)
    show(page, DIAGRAM)

    def shown():
        return np.array(drawn(page, DIAGRAM, "data.at(-1).r"))[:-1], np.array(drawn(page, WORK, "data[0].y"))

    slider = page.locator(f"{DIAGRAM} input[type=range]")
    for key, (state, probes) in zip(("Home", "End"), circle.items(), strict=True):
        slider.press(key)
        page.wait_for_timeout(300)
        assert slider.get_attribute("aria-valuetext") == state
        assert page.locator(f"{WORK} output").inner_text() == state
        radii, works = shown()
        np.testing.assert_allclose(radii, probes.w2_normalised.values, rtol=1e-4)
        np.testing.assert_allclose(works, probes.w2_boundary.values, rtol=1e-4)


def test_hovering_tells_direction_and_work(page, circle):
    """At a point of the curve its alpha and its W2n are said."""
    show(page, DIAGRAM)
    data = list(circle.values())[-1].sel(alpha=90.0)
    # where the last curve has its point at 90 degrees
    point = page.locator(f"{DIAGRAM} .scatterlayer .trace").last.locator("path.point").nth(3)
    box = point.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=3)
    page.wait_for_selector(f"{DIAGRAM} .hoverlayer .hovertext")
    told = page.locator(f"{DIAGRAM} .hoverlayer .hovertext").first.text_content()
    assert "α = 90°" in told  # noqa: RUF001
    assert f"W2n = {float(data.w2_normalised):.3f}" in told


def test_a_state_of_the_curve_can_be_chosen(page, circle):
    """By a click on its mark, and by the keyboard in the table."""
    first, last = circle
    show(page, LOADING)
    mark = (
        page.locator(f"{LOADING} .scatterlayer .trace", has=page.locator("path.point"))
        .first.locator("path.point")
        .first
    )
    box = mark.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=3)
    page.wait_for_timeout(200)
    page.mouse.down()
    page.mouse.up()
    playwright.expect(page.locator(f"{DIAGRAM} output")).to_have_text(first)
    page.locator(f"#loading button[data-state='{last}']").press("Enter")
    playwright.expect(page.locator(f"{DIAGRAM} output")).to_have_text(last)
    assert page.locator("#said").text_content() == f"Shown: {last}"


def test_the_specimen_turns(page):
    """By the mouse and by the keyboard: the camera moves, and so does the picture."""
    plot = show(page, SPECIMEN)
    page.wait_for_timeout(1000)

    def eye():
        return np.array([drawn(page, SPECIMEN, f"_fullLayout.scene.camera.eye.{axis}") for axis in "xyz"])

    before, picture = eye(), plot.screenshot()
    box = plot.bounding_box()
    x, y = box["x"] + 0.4 * box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 150, y + 20, steps=6)
    page.mouse.up()
    page.wait_for_timeout(500)
    after = eye()
    assert np.linalg.norm(after - before) > 0.3
    assert np.linalg.norm(after) == pytest.approx(np.linalg.norm(before), rel=1e-3)
    assert plot.screenshot() != picture
    page.get_by_role("button", name="Turn left").press("Enter")
    page.wait_for_timeout(500)
    turned = eye()
    angle = np.arctan2(turned[1], turned[0]) - np.arctan2(after[1], after[0])
    assert (angle + np.pi) % (2 * np.pi) - np.pi == pytest.approx(-0.3, abs=1e-3)


def test_the_specimen_is_filtered_and_coloured(page, reported_study):
    """Only negative contacts when asked, as many as there are; a colour for each class."""
    _, found = most_negative(results_in(reported_study))
    show(page, SPECIMEN)
    colour, what, work = page.locator(f"{SPECIMEN} select").all()
    what.select_option("contacts")
    for sign, count in (("-", int((found.w2 < 0).sum())), ("+", int((found.w2 > 0).sum()))):
        work.select_option(sign)
        page.wait_for_timeout(300)
        assert len(drawn(page, SPECIMEN, "data[0].x")) == 3 * count
    work.select_option("all")
    colour.select_option("kind")
    page.wait_for_timeout(300)
    counts = np.bincount(found.class_of_pair.values, minlength=5)
    told = [
        int(re.search(r"\((\d+)\)", name).group(1)) for name in drawn(page, SPECIMEN, "data.map(each => each.name)")
    ]
    assert told == [count for count in counts.tolist() if count]
    colour.select_option("w2")


def test_planes_move_with_the_strain(page):
    """On the sphere of the model, by the keyboard."""
    show(page, PLANES)
    end = drawn(page, PLANES, "data[1].marker.color")
    page.locator(f"{PLANES} input[type=range]").press("Home")
    page.wait_for_timeout(300)
    assert len(end) == 2 * 295
    assert drawn(page, PLANES, "data[1].marker.color") != end
    assert page.locator(f"{PLANES} output").inner_text().startswith("ε₁ = 0")


def test_light_and_dark(opened):
    """As the system has it, until the button is pressed; figures follow."""
    page = opened(color_scheme="dark")
    show(page, LOADING)

    def colours():
        paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
        return paper, drawn(page, LOADING, "_fullLayout.font.color"), drawn(page, LOADING, "data[0].line.color")

    dark = colours()
    assert dark[0] == "rgb(22, 24, 27)"
    page.get_by_role("button", name="Light", exact=True).click()
    page.wait_for_timeout(300)
    light = colours()
    assert light[0] == "rgb(255, 255, 255)"
    assert all(one != other for one, other in zip(dark, light, strict=True))


@pytest.mark.parametrize("width", WIDTHS)
def test_it_fits_every_width(page, width, tmp_path):
    """Nothing sticks out; pictures of all sections are taken, into RENDULIC_SCREENSHOTS if it is given."""
    page.set_viewport_size({"width": width, "height": 900})
    show_all(page)
    until(page, "figures.every(each => each.isNarrow === each.drawnNarrow)")
    assert page.evaluate("document.documentElement.scrollWidth") == width
    for plot in page.locator(".plot").all():
        box = plot.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
    narrow = page.evaluate("figures.filter(each => each.isNarrow).length")
    assert narrow == (page.locator("figure").count() if width < 500 else 0)
    # circular diagrams of grains and sand: beside each other, or one below the other
    left, right = (drawn(page, BESIDE, f"_fullLayout.{name}.domain") for name in ("polar", "polar2"))
    assert (left["x"] == right["x"]) == (width < 500)
    assert (left["y"] == right["y"]) == (width > 500)
    # views in three dimensions keep the room, and one colour bar
    for figure in (SPHERE, SPECIMEN, PLANES):
        room, view = (
            page.locator(f"{figure} {part}").first.bounding_box() for part in (".plot", ".gl-container > div")
        )
        assert view["width"] > 0.7 * room["width"]
        assert view["height"] > 0.6 * room["height"]
        assert page.locator(f"{figure} .infolayer .colorbar").count() == 1
    folder = Path(os.environ.get("RENDULIC_SCREENSHOTS", tmp_path))
    for section in page.locator("section").all():
        section.screenshot(path=folder / f"{section.get_attribute('id')}_{width}.png")
    assert page.complaints == []


def test_everything_has_words(opened):
    """Figures have text, controls labels, tables captions and headings; the first key skips to the contents."""
    page = opened()
    for plot in page.locator(".plot").all():
        assert plot.get_attribute("role") == "img"
        described = page.locator(f"#{plot.get_attribute('aria-describedby')}")
        assert len(described.inner_text()) > 60
    unnamed = "[...document.querySelectorAll('input, select')].filter(each => !each.labels.length).length"
    assert page.evaluate(unnamed) == 0
    assert page.locator("table").count() == page.locator("table > caption").count() > 5
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Skip to the contents"


def test_it_prints_all_of_it(opened):
    """Also figures that were never in sight, dark on white, without controls."""
    page = opened(color_scheme="dark")
    assert not page.evaluate("figures.every(each => each.isDrawn)")
    page.emulate_media(media="print")
    assert len(page.pdf()) > 100_000
    assert page.evaluate("figures.every(each => each.isDrawn)")
    assert not page.locator("nav").is_visible()


def test_a_table_can_be_reduced(opened, report):
    """To the rows of one verdict; one of the model's bursts is made to disagree."""
    good = '<td class="good">agrees</td>'
    text = report.read_text(encoding="utf-8")
    assert text.count(good) > 1
    other = report.with_name("one_disagrees.html")
    other.write_text(text.replace(good, "<td>disagrees</td>", 1), encoding="utf-8")
    page = opened(other.as_uri())
    table = page.locator("table", has=page.locator("caption", has_text="Every direction: models"))
    page.get_by_label("Rows by judged").last.select_option("disagrees")
    shown = [row.inner_text() for row in table.locator("tbody tr").all() if row.is_visible()]
    assert [line.split()[-1] for line in shown] == ["disagrees"]


def test_a_running_study_is_seen(opened, reported_study, browser):
    """The live page says how far it is and draws what there is; only its own address is asked."""
    with LiveView(reported_study) as live:
        server = Thread(target=live.serve)
        server.start()
        try:
            page = opened(live.address)
            page.wait_for_selector("#figures figure .main-svg")
            total = len(results_in(reported_study).wanted)
            assert page.locator("#told").inner_text() == f"{total} of {total} units are done, 0 running, 0 failed"
            assert page.complaints == []
            assert {url[: len(live.address)] for url in page.asked if not url.startswith("data:")} == {live.address}
        finally:
            page.close()
            live.stop()
            server.join(10)
    assert not server.is_alive()
