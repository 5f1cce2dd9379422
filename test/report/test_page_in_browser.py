"""The page in a browser: slider, mouse, themes, and no network."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import browser as chromium
import numpy as np
import pytest
from browser import Browser
from durations import rest_long

from vessel_hsmc_ros import report
from vessel_hsmc_ros.core.hull import BEAM, LENGTH
from vessel_hsmc_ros.core.metrics import Run, evaluate, position_error
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import simulate

ActionChains: Any = pytest.importorskip("selenium.webdriver").ActionChains

Recorded = tuple[report.Record, Run]

pytestmark = chromium.NEEDED


def record(name: str, duration: float, **changes: object) -> Recorded:
    scenario = load_scenario("case2_tracking", {"vessel_sim.duration": duration, **changes})
    run = simulate(scenario)
    metrics = evaluate(run.time, run.state, run.reference, run.wrench)
    return report.Record(name, run, metrics, {}, scenario, {"version": "1.2.3"}), run


@pytest.fixture(scope="module")
def runs() -> list[Recorded]:
    return [record("circle", 20.0), record("straight", 15.0, **{"reference_ship.yaw_moment": 0.0})]


@pytest.fixture(scope="module")
def pages(runs: list[Recorded], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pages")
    records = [each for each, _ in runs]
    report.write(folder / "one.html", records[:1], "One run")
    report.write(folder / "two.html", records, "Two runs")
    return folder


@pytest.fixture(scope="module")
def window() -> Iterator[Browser]:
    with chromium.browser() as opened:
        yield opened


@pytest.fixture
def page(window: Browser, pages: Path) -> Iterator[Browser]:
    window.open(pages / "one.html")
    window.until("return report.charts.some((chart) => chart.drawn)")
    yield window
    assert window.console() == []


def slide(window: Browser, time: float) -> None:
    """Move the slider as a user does."""
    window.run(
        "const slider = document.getElementById('slider'); slider.value = arguments[0];"
        "slider.dispatchEvent(new Event('input', { bubbles: true }));",
        time,
    )


def hull(window: Browser) -> str:
    return str(window.run("return document.querySelector('.hull.ship').getAttribute('transform')"))


def test_the_page_requests_nothing_but_its_own_file(page: Browser, pages: Path) -> None:
    assert [address for address in page.requests() if not address.startswith(("data:", "blob:"))] == [
        (pages / "one.html").as_uri()
    ]


def test_the_slider_moves_the_ship_to_its_pose_at_that_time(page: Browser, runs: list[Recorded]) -> None:
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


@pytest.mark.long
def test_the_hull_is_drawn_to_scale(page: Browser) -> None:
    box = page.run("const box = document.querySelector('.hull.ship').getBBox(); return [box.width, box.height]")
    assert box == pytest.approx([LENGTH, BEAM], rel=1e-3)
    scale = re.search(r"scale\((.*)\)", hull(page))
    assert scale is not None
    assert float(scale[1]) == pytest.approx(page.run("return report.map.view.scale"))


@pytest.mark.long
def test_every_diagram_shows_time_and_value_at_the_slider(page: Browser, runs: list[Recorded]) -> None:
    _, run = runs[0]
    slide(page, 5.0)
    cursors = page.run(
        "return report.charts.filter((chart) => chart.onScreen).map((chart) => {"
        " const axis = chart.plot._fullLayout.xaxis;"
        " return new DOMMatrix(chart.cursor.style.transform).m41 - axis._offset - axis.l2p(5.0); })"
    )
    assert len(cursors) > 1
    assert cursors == pytest.approx([0.0] * len(cursors), abs=1.0)
    shown, unit = page.run("return report.charts[0].outputs[0].textContent").split()
    distance = position_error(run.state, run.reference)[run.time <= 5.0][-3:]
    assert unit == "m"
    assert distance.min() * 0.995 <= float(shown) <= distance.max() * 1.005  # three significant digits


@pytest.mark.long
def test_dragging_over_one_diagram_zooms_all_and_a_double_click_zooms_out(page: Browser) -> None:
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
    assert y == pytest.approx((found[0][1] - found[0][0]) * 100, abs=4)  # every sample of the visible window
    ActionChains(page.driver).double_click(plot).perform()
    page.until(f"return !report.clock.zoomed && {settled}")
    assert page.run(windows)[0] == [0.0, 20.0]


@pytest.mark.long
def test_drawn_lines_keep_their_minimum_and_maximum(page: Browser, runs: list[Recorded]) -> None:
    _, run = runs[0]
    index = page.run("return report.charts.findIndex((chart) => chart.panel.title === 'surge force')")
    page.show_diagram(index)
    drawn = page.run("return Array.from(report.charts[arguments[0]].plot.data[0].y)", index)
    assert [min(drawn), max(drawn)] == pytest.approx([run.wrench[:, 0].min(), run.wrench[:, 0].max()], rel=1e-6)
    assert "beyond the scale" in page.run("return report.charts[arguments[0]].note.textContent", index)


@pytest.mark.long
def test_playback_starts_and_stops(page: Browser) -> None:
    button = page.driver.find_element("id", "play")
    button.click()
    page.until("return report.clock.time > 0.5")
    button.click()
    assert page.run("return report.player.playing") is False


@pytest.mark.long
def test_parameters_are_found_by_name(page: Browser) -> None:
    page.driver.find_element("id", "search").send_keys("hierarchical_printed.heading_weight")
    names = "[...document.querySelectorAll('#parameters tr:not([hidden]) code')].filter((name) => name.offsetParent)"
    assert page.run(f"return {names}.map((name) => name.textContent)") == ["hierarchical_printed.heading_weight"]


@pytest.mark.long
def test_several_runs_are_overlaid(window: Browser, pages: Path, tmp_path: Path) -> None:
    window.open(pages / "two.html")
    window.show_diagram(0)
    assert window.run("return document.querySelectorAll('.hull.ship').length") == 2
    assert window.run("return report.charts[0].plot.data.map((line) => line.name)") == ["circle", "straight"]
    window.run("report.clock.setTime(18)")
    assert window.run("return report.charts[0].outputs[1].textContent") != ""
    assert window.screenshot(tmp_path / "two.png").stat().st_size > 20_000
    assert window.console() == []


@pytest.mark.long
def test_tables_of_several_runs_fit_a_page_of_1280_pixels(window: Browser, runs: list[Recorded], tmp_path: Path) -> None:
    circle, straight = (made for made, _ in runs)
    laws = ("hierarchical_printed", "guided", "los_pid", "a law with a long name")
    for count in (2, 4):
        report.write(tmp_path / "laws.html", [replace((circle, straight)[i % 2], name=laws[i]) for i in range(count)], "Laws")
        window.open(tmp_path / "laws.html", width=1280)
        window.run("document.querySelectorAll('details').forEach((node) => (node.open = true))")
        widths = window.run(
            "return [...document.querySelectorAll('.table')].map((table) => [table.scrollWidth, table.clientWidth])"
        )
        assert len(widths) > 2
        assert all(content <= room for content, room in widths)


def test_the_metrics_of_two_runs_are_above_the_diagrams_beside_the_map(window: Browser, pages: Path) -> None:
    window.open(pages / "two.html", width=1280)
    left, top, right = window.run(
        "const [map, table] = ['map', 'metrics'].map((id) => document.getElementById(id).getBoundingClientRect());"
        "return [table.left - map.right, table.top - map.top, table.right]"
    )
    assert left > 0
    assert abs(top) < 60
    assert right <= 1280


@pytest.mark.parametrize("dark", rest_long([False, True]))
@pytest.mark.parametrize("width", rest_long([390, 1280]))
def test_light_and_dark_theme_have_high_contrast_at_any_width(
    window: Browser, pages: Path, tmp_path: Path, width: int, dark: bool
) -> None:
    window.open(pages / "one.html", width=width, dark=dark)
    window.show_diagram(0)
    assert window.run("return document.documentElement.scrollWidth") <= width
    style = "return getComputedStyle(document.body)[arguments[0]].match(/[\\d.]+/g).slice(0, 3).map(Number)"
    page, ink = (luminance(window.run(style, name)) for name in ("backgroundColor", "color"))
    assert (page < ink) is dark
    assert (max(page, ink) + 0.05) / (min(page, ink) + 0.05) > 7.0
    assert window.screenshot(tmp_path / "page.png").stat().st_size > 20_000
    assert window.console() == []


def luminance(colour: Sequence[float]) -> float:
    """Relative luminance of an sRGB colour as defined by WCAG 2."""
    parts = np.asarray(colour) / 255.0
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))
