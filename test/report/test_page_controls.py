"""Verdict, events, limits, help, exports and keyboard of the page, in a browser, also at the width of a telephone."""

import csv
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import browser as chromium
import numpy as np
import pytest
from browser import Browser
from durations import rest_long
from records import record

from vessel_hsmc_ros import report
from vessel_hsmc_ros.report.panels import Panel, panels
from vessel_hsmc_ros.report.record import Limit, Mark

ActionChains: Any = pytest.importorskip("selenium.webdriver").ActionChains

pytestmark = chromium.NEEDED

TELEPHONE = 400
GAIN = "controller.guided.position_gain: 0.3 -> 0.5"
MARKS = (Mark(1.0, "parameter", GAIN), Mark(3.0, "pause", "vessel_sim"), Mark(3.01, "resume", "<b>vessel_sim</b>"))


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of one run and of three, with everything that a page may show."""

    def extended(*arguments: Any) -> list[Panel]:
        limits = {"surge force": (Limit(2e5, "actuator"), Limit(1.5e5, "law"))}
        return [replace(each, help=f"What {each.title} shows.", limits=limits.get(each.title, ())) for each in panels(*arguments)]

    folder = tmp_path_factory.mktemp("pages")
    one = replace(record("one", 3.0), marks=MARKS, verdict="It tracks the reference.")
    two = replace(record("a law with a long name", 4.0), marks=MARKS[:1], verdict="It drifts <away>.")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vessel_hsmc_ros.report.panels.panels", extended)
        report.write(folder / "one.html", [one], "One run")
        report.write(folder / "three.html", [one, two, record("third", 5.0)], "Three runs")
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


@pytest.fixture
def downloaded(window: Browser, tmp_path: Path) -> Callable[[str], Path]:
    """Waits for the only download with an ending."""
    window.driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})

    def wait(ending: str) -> Path:
        end = time.monotonic() + 30.0
        while not (found := list(tmp_path.glob(f"*{ending}"))):
            assert time.monotonic() < end, f"no {ending} in {list(tmp_path.iterdir())}"
            time.sleep(0.02)
        return found[0]

    return wait


def index_of(window: Browser, title: str) -> int:
    return int(window.run("return report.charts.findIndex((chart) => chart.panel.title === arguments[0])", title))


def text(window: Browser, selector: str) -> list[str]:
    return list(
        window.run("return [...document.querySelectorAll(arguments[0])].map((each) => each.textContent.trim())", selector)
    )


@pytest.mark.long
def test_the_verdict_is_at_the_top_and_names_the_runs_if_there_are_several(window: Browser, pages: Path) -> None:
    window.open(pages / "one.html")
    assert text(window, "#verdict p") == ["It tracks the reference."]
    window.open(pages / "three.html")
    assert text(window, "#verdict p") == ["one: It tracks the reference.", "a law with a long name: It drifts <away>."]


@pytest.mark.long
def test_an_event_in_the_list_moves_the_slider_and_shows_its_label_on_the_diagrams(page: Browser) -> None:
    assert text(page, "#events time") == ["1.0 s", "3.0 s", "3.0 s"]
    entry = page.driver.find_elements("css selector", "#events button")[1]
    page.run("report.clock.setWindow(0, 2)")
    entry.send_keys("\n")
    assert page.run("return report.clock.time") == 3.0
    assert page.run("return report.clock.zoomed") is False
    page.show_diagram(0)
    label = page.run("return getComputedStyle(document.querySelector('#panel-0 .flag.active + .label')).display")
    assert label == "block"
    assert text(page, "#panel-0 .flag.active + .label") == ["3.0 s · pause: vessel_sim\n3.0 s · resume: <b>vessel_sim</b>"]


@pytest.mark.long
def test_events_are_at_their_times_and_close_ones_share_a_flag(page: Browser) -> None:
    page.show_diagram(0)
    assert text(page, "#panel-0 .flag") == ["", "2"]
    lines = page.run(
        "return [...document.querySelectorAll('#panel-0 .marks i')].map((line) => line.getBoundingClientRect().left)"
    )
    axis = "const plot = report.charts[0].plot; const axis = plot._fullLayout.xaxis;"
    places = page.run(f"{axis} return [1, 3, 3.01].map((t) => plot.getBoundingClientRect().left + axis._offset + axis.l2p(t))")
    assert lines == pytest.approx(places, abs=1.0)


@pytest.mark.long
def test_limits_are_drawn_and_named_with_their_values(page: Browser) -> None:
    index = index_of(page, "surge force")
    page.show_diagram(index)
    assert text(page, f"#panel-{index} .limit") == ["actuator limit ±200 kN", "law limit ±150 kN"]
    drawn = page.run("return report.charts[arguments[0]].plot.layout.shapes.map((line) => line.y0)", index)
    assert sorted(drawn) == [-2e5, -1.5e5, 1.5e5, 2e5]
    names = page.run("return report.charts[arguments[0]].plot.layout.annotations.map((each) => each.text)", index)
    assert names == ["actuator", "law"]


def test_axes_have_units_with_prefixes_and_time_is_in_minutes_where_the_run_is_long(page: Browser) -> None:
    index = index_of(page, "surge force")
    page.show_diagram(index)
    assert text(page, f"#panel-{index} .unit") == ["[kN]"]
    assert "100" in page.run("return report.charts[arguments[0]].plot.layout.yaxis.ticktext", index)
    title = "return report.charts[arguments[0]].plot.layout.xaxis.title.text"
    assert page.run(title, index) == "time [s]"
    page.run("Object.assign(report.clock, { end: 1200, window: [0, 1200] }); report.charts[arguments[0]].draw()", index)
    assert page.run(title, index) == "time [min]"
    page.run("report.clock.setTime(754.2)")
    assert text(page, "#time") == ["12 min 34.20 s"]


def test_numbers_are_written_as_people_write_them(page: Browser) -> None:
    expected = (
        (2e5, "N", "200 kN"),
        (-2.519e6, "N·m", "-2.52 MN·m"),
        (7.5e-4, "m", "0.75 mm"),
        (999.9996, "N", "1 kN"),
        (3.5e-5, "s", "35 µs"),
        (1250.0, "m", "1.25 km"),
        (1234.0, "m/s", "1234 m/s"),
        (-0.6515, "°", "-0.651°"),
        (0.0, "m", "0 m"),
        (1.5e7, "1/s", "1.5e+07 1/s"),
        (2.5e-5, "", "2.5e-05"),
        (None, "m", "–"),
    )
    for value, unit, written in expected:
        assert page.run("return report.quantity(arguments[0] ?? undefined, arguments[1])", value, unit) == written


def test_help_is_shown_on_request(page: Browser) -> None:
    page.show_diagram(0)
    help_text = page.driver.find_element("css selector", "#panel-0 .help")
    assert not help_text.is_displayed()
    page.driver.find_element("css selector", "#panel-0 .question").click()
    assert help_text.text == "What position error shows."


@pytest.mark.long
def test_the_shown_data_are_exported_as_csv(page: Browser, downloaded: Callable[[str], Path]) -> None:
    index = index_of(page, "surge velocity")
    page.show_diagram(index)
    page.run("report.clock.setWindow(1, 2)")
    page.driver.find_element("css selector", f"#panel-{index} .legend button:nth-child(2)").click()  # hides the reference
    page.driver.find_element("css selector", f"#panel-{index} .menu summary").click()
    page.driver.find_element("css selector", f"#panel-{index} [data-export=csv]").click()
    header, *rows = list(csv.reader(downloaded("surge_velocity.csv").read_text().splitlines()))
    assert header == ["time [s]", "ship [m/s]"]
    run = record("one", 3.0).run
    shown = (run.time >= 1.0) & (run.time <= 2.0)
    np.testing.assert_array_equal([float(row[0]) for row in rows], run.time[shown])
    np.testing.assert_array_equal(np.array([row[1] for row in rows]).astype(np.float32), run.state[shown, 3].astype(np.float32))


def test_lines_with_times_of_their_own_have_empty_cells_in_the_csv(window: Browser, pages: Path) -> None:
    window.open(pages / "three.html")
    rows = window.run(
        "const line = (time, values) => ({ label: 'a, b', time, values: Float32Array.from(values) });"
        "return report.csvOf({ unit: 'N' }, [line([0, 1, 2], [0.1, NaN, 3]), line([1, 1.5], [1e-7, 5])], [0.5, 1.6])"
    )
    assert rows.splitlines() == ['time [s],"a, b [N]","a, b [N]"', "1,,1e-7", "1.5,,5"]


@pytest.mark.long
def test_diagrams_and_map_are_exported_as_pictures(page: Browser, downloaded: Callable[[str], Path]) -> None:
    index = index_of(page, "surge force")
    page.show_diagram(index)
    page.run(
        "document.querySelectorAll(`#panel-${arguments[0]} [data-export]:not([data-export=csv])`).forEach((b) => b.click())",
        index,
    )
    page.driver.find_element("id", "picture").click()
    drawing = downloaded("surge_force.svg").read_text()
    assert drawing.startswith("<svg")
    assert all(f">{word}<" in drawing for word in ("surge force [kN]", "actuator", "pause, resume", "applied"))
    for name in ("surge_force.png", "map.png"):
        assert downloaded(name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_slider_and_map_are_moved_by_keys(page: Browser) -> None:
    actions = ActionChains(page.driver)
    page.run("document.activeElement.blur()")
    actions.send_keys("\ue014").perform()  # arrow to the right
    assert page.run("return report.clock.time") == pytest.approx(0.01 * page.run("return report.clock.end"))
    view = page.driver.find_element("css selector", "#map .view")
    scale, x = page.run("return [report.map.view.scale, report.map.view.x]")
    view.send_keys("+")
    assert page.run("return report.map.view.scale") == pytest.approx(1.5 * scale)
    view.send_keys("\ue014")
    assert page.run("return report.map.view.x") > x
    view.send_keys("0")
    assert page.run("return report.map.view.scale") == pytest.approx(scale)


@pytest.mark.parametrize("dark", rest_long([False, True]))
@pytest.mark.parametrize("name", rest_long(["one", "three"]))
def test_nothing_is_wider_than_a_telephone(window: Browser, pages: Path, name: str, dark: bool) -> None:
    window.open(pages / f"{name}.html", width=TELEPHONE, dark=dark)
    window.run(
        "document.querySelectorAll('details:not(.menu)').forEach((each) => (each.open = true));"
        "document.querySelectorAll('.question').forEach((each) => each.click());"
        "document.querySelectorAll('.flag').forEach((each) => each.classList.add('active'))"
    )
    window.show_diagram(0)
    assert window.run("const page = document.scrollingElement; return page.scrollWidth - page.clientWidth") <= 0
    tables = window.run("return [...document.querySelectorAll('.table')].map((each) => each.scrollWidth - each.clientWidth)")
    assert len(tables) > 2
    assert max(tables) <= 0
    small = window.run(
        "return [...document.querySelectorAll('button, summary, select, input')].filter((each) => each.offsetParent &&"
        " !each.matches('.flag')).map((each) => each.getBoundingClientRect())"
        ".filter((box) => box.height < 24 || box.width < 24).length"
    )
    assert small == 0
    assert window.console() == []


@pytest.mark.parametrize("width", rest_long([TELEPHONE, 1280]))
def test_names_and_controls_of_the_map_do_not_cover_it(window: Browser, pages: Path, width: int) -> None:
    window.open(pages / "three.html", width=width)
    boxes = window.run(
        "return ['.key', '.view', '.bar'].map((part) => document.querySelector(`#map ${part}`).getBoundingClientRect())"
        ".map((box) => [box.top, box.bottom])"
    )
    assert boxes[0][1] <= boxes[1][0] < boxes[1][1] - 200 <= boxes[2][0] - 200
