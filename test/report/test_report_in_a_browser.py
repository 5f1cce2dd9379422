"""The page as people meet it: in a browser, with a slider, a mouse and no network."""

import re

import browser as chromium
import numpy as np
import pytest

from vessel_hsmc_ros import report
from vessel_hsmc_ros.core.metrics import evaluate, position_error
from vessel_hsmc_ros.runs.offline import load_scenario, simulate

ActionChains = pytest.importorskip("selenium.webdriver").ActionChains

pytestmark = chromium.NEEDED


def record(name, duration, **changes):
    scenario = load_scenario("case2_tracking", {"vessel_sim.duration": duration, **changes})
    run = simulate(scenario)
    metrics = evaluate(run.time, run.state, run.reference, run.wrench)
    return report.Record(name, report.of_run(run), metrics, {}, scenario, {"version": "1.2.3"}), run


@pytest.fixture(scope="module")
def runs():
    return [record("circle", 20.0), record("straight", 15.0, **{"reference_ship.yaw_moment": 0.0})]


@pytest.fixture(scope="module")
def pages(runs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    records = [each for each, _ in runs]
    report.write(folder / "one.html", records[:1], "One run")
    report.write(folder / "two.html", records, "Two runs")
    return folder


@pytest.fixture(scope="module")
def window():
    with chromium.browser() as opened:
        yield opened


@pytest.fixture
def page(window, pages):
    window.open(pages / "one.html")
    window.until("return report.charts.some((chart) => chart.drawn)")
    yield window
    assert window.console() == []


def slide(window, time):
    """Move the slider as a hand does."""
    window.run(
        "const slider = document.getElementById('slider'); slider.value = arguments[0];"
        "slider.dispatchEvent(new Event('input', { bubbles: true }));",
        time,
    )


def hull(window):
    return window.run("return document.querySelector('.hull.ship').getAttribute('transform')")


def test_nothing_leaves_the_file(page, pages):
    assert [address for address in page.requests() if not address.startswith(("data:", "blob:"))] == [
        (pages / "one.html").as_uri()
    ]


def test_the_slider_moves_the_ship_to_where_it_was(page, runs):
    _, run = runs[0]
    slide(page, 0.0)
    first = hull(page)
    slide(page, 10.0)
    assert hull(page) != first
    x, y, psi = run.state[np.flatnonzero(run.time == 10.0)[0], :3]
    words = page.run("return document.getElementById('pose').textContent").split()
    assert [float(words[1]), float(words[4])] == pytest.approx([x, y], abs=0.06)
    place = page.run("return report.map.view.place(arguments[0], arguments[1])", x, y)
    numbers = [float(number) for number in re.findall(r"-?[\d.]+", hull(page))]
    assert numbers[:2] == pytest.approx(place, abs=0.1)
    assert numbers[2] == pytest.approx(-np.degrees(psi), abs=0.01)


def test_the_hull_is_drawn_to_scale(page):
    box = page.run("const box = document.querySelector('.hull.ship').getBBox(); return [box.width, box.height]")
    assert box == pytest.approx([32.0, 8.0], rel=1e-3)
    scale = float(re.search(r"scale\((.*)\)", hull(page))[1])
    assert scale == pytest.approx(page.run("return report.map.view.scale"))


def test_every_diagram_shows_the_time_and_the_value_of_the_slider(page, runs):
    _, run = runs[0]
    slide(page, 5.0)
    cursors = page.run(
        "return report.charts.filter((chart) => chart.onScreen).map((chart) => {"
        " const axis = chart.plot._fullLayout.xaxis;"
        " return new DOMMatrix(chart.cursor.style.transform).m41 - axis._offset - axis.l2p(5.0); })"
    )
    assert len(cursors) > 1
    assert cursors == pytest.approx([0.0] * len(cursors), abs=1.0)
    shown = float(page.run("return report.charts[0].outputs[0].textContent"))
    distance = position_error(run.state, run.reference)
    assert distance[run.time <= 5.0][-3:].min() * 0.999 <= shown <= distance[run.time <= 5.0][-3:].max() * 1.001


def test_dragging_over_one_diagram_zooms_all_and_a_double_click_zooms_out(page):
    windows = "return report.charts.filter((chart) => chart.drawn && !chart.stale).map((chart) => chart.plot.layout.xaxis.range)"
    settled = "!report.charts.some((chart) => chart.onScreen && chart.stale)"
    plot = page.driver.find_element("css selector", "#panel-0 .plot")
    drag = ActionChains(page.driver, duration=50).move_to_element_with_offset(plot, -60, 0).click_and_hold()
    drag.move_by_offset(120, 0).release().perform()
    page.until(f"return report.clock.zoomed && {settled}")
    found = page.run(windows)
    assert len(found) > 1
    assert all(window == found[0] for window in found)
    assert 0.0 < found[0][0] < found[0][1] < 20.0
    y = page.run("return report.charts[0].plot.data[0].y.length")
    assert y == pytest.approx((found[0][1] - found[0][0]) * 100, abs=4)  # every sample of what is on show
    ActionChains(page.driver).double_click(plot).perform()
    page.until(f"return !report.clock.zoomed && {settled}")
    assert page.run(windows)[0] == [0.0, 20.0]


def test_what_is_on_the_screen_has_the_greatest_and_the_least_value(page, runs):
    _, run = runs[0]
    index = page.run("return report.charts.findIndex((chart) => chart.panel.title === 'surge force')")
    page.show_diagram(index)
    drawn = page.run("return Array.from(report.charts[arguments[0]].plot.data[0].y)", index)
    assert [min(drawn), max(drawn)] == pytest.approx([run.wrench[:, 0].min(), run.wrench[:, 0].max()], rel=1e-6)
    assert "beyond this scale" in page.run("return report.charts[arguments[0]].note.textContent", index)


def test_play_and_pause(page):
    button = page.driver.find_element("id", "play")
    button.click()
    page.until("return report.clock.time > 0.5")
    button.click()
    assert page.run("return report.player.playing") is False


def test_the_parameters_can_be_searched(page):
    page.driver.find_element("id", "search").send_keys("hierarchical.heading_weight")
    names = "[...document.querySelectorAll('#parameters tr:not([hidden]) code')].filter((name) => name.offsetParent)"
    assert page.run(f"return {names}.map((name) => name.textContent)") == ["hierarchical.heading_weight"]


def test_several_runs_lie_over_each_other(window, pages, tmp_path):
    window.open(pages / "two.html")
    window.show_diagram(0)
    assert window.run("return document.querySelectorAll('.hull.ship').length") == 2
    assert window.run("return report.charts[0].plot.data.map((line) => line.name)") == ["circle", "straight"]
    window.run("report.clock.setTime(18)")
    assert window.run("return report.charts[0].outputs[1].textContent") != ""
    assert window.screenshot(tmp_path / "two.png").stat().st_size > 20_000
    assert window.console() == []


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [390, 1280])
def test_legible_in_light_and_dark_wide_and_narrow(window, pages, tmp_path, width, dark):
    window.open(pages / "one.html", width=width, dark=dark)
    window.show_diagram(0)
    assert window.run("return document.documentElement.scrollWidth") <= width
    style = "return getComputedStyle(document.body)[arguments[0]].match(/[\\d.]+/g).slice(0, 3).map(Number)"
    page, ink = (luminance(window.run(style, name)) for name in ("backgroundColor", "color"))
    assert (page < ink) is dark
    assert (max(page, ink) + 0.05) / (min(page, ink) + 0.05) > 7.0
    assert window.screenshot(tmp_path / "page.png").stat().st_size > 20_000
    assert window.console() == []


def luminance(colour):
    """Relative luminance of an sRGB colour, as the contrast rule for the web defines it."""
    parts = np.asarray(colour) / 255.0
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))
