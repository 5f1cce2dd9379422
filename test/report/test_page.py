"""The page of simulated runs, as a file: its numbers, texts and panels."""

import base64
import json
import re
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from durations import rest_long
from numpy.typing import NDArray
from records import circle, make_run, record
from unrendered import leave_unrendered

from vessel_hsmc_ros import report
from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.install_paths import __version__
from vessel_hsmc_ros.report import Record, diagrams, figures
from vessel_hsmc_ros.report.page_kit import Payload
from vessel_hsmc_ros.report.panels import overlays, panels
from vessel_hsmc_ros.report.record import Mark
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import simulate

Array = NDArray[Any]


def text_of(path: Path) -> str:
    """The text of a page without its numbers and its library."""
    return re.sub(r'<script type="text/plain".*?</script>', "", path.read_text(), flags=re.DOTALL)


def numbers_of(path: Path) -> tuple[Any, Callable[[dict[str, Any]], Array]]:
    """The content of a page, and a function that unpacks its arrays as the page does."""
    page = path.read_text()

    def element(name: str) -> str:
        found = re.search(rf'id="{name}">(.*?)</script>', page, re.DOTALL)
        assert found is not None
        return found[1]

    data = zlib.decompress(base64.b64decode(element("numbers")))

    def array(where: dict[str, Any]) -> Array:
        size = int(where["kind"][1])
        raw = np.frombuffer(data, np.uint8, where["count"] * size, where["at"]).reshape(size, where["count"])
        unpacked: Array = np.ascontiguousarray(raw.T).view("<" + where["kind"]).ravel()
        return unpacked

    return json.loads(element("content")), array


def test_the_page_contains_the_numbers_of_the_run(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    report.write(path, [record("one", 3.0)], "One")
    content, array = numbers_of(path)
    assert [panel["title"] for panel in content["panels"]][:2] == ["position error", "position error in the body frame"]
    distance = content["panels"][0]["lines"][0]
    np.testing.assert_array_equal(array(distance["time"]), circle(3.0).time)
    np.testing.assert_allclose(array(distance["values"]), 3.0, rtol=1e-6)
    track = content["tracks"][0]
    np.testing.assert_allclose(array(track["x"]) + track["middle"][0], circle(3.0).state[:, 0], atol=1e-5)


def test_events_of_all_runs_are_listed_by_their_times_with_the_names_of_the_runs(tmp_path: Path) -> None:
    near = replace(record("near", 1.0), marks=(Mark(1.0, "pause", "<i>"), Mark(3.0, "goal", "x 1")), verdict="It <b>drifts</b>.")
    far = replace(record("far", 4.0), marks=(Mark(2.0, "resume", ""),))
    report.write(tmp_path / "two.html", [near, far], "Two")
    content, _ = numbers_of(tmp_path / "two.html")
    found = [(mark["t"], mark["label"], mark["run"]) for mark in content["marks"]]
    assert found == [(1.0, "near, pause: <i>", 0), (2.0, "far, resume", 1), (3.0, "near, goal: x 1", 0)]
    assert "near, pause: &lt;i&gt;" in text_of(tmp_path / "two.html")
    assert "It &lt;b&gt;drifts&lt;/b&gt;." in text_of(tmp_path / "two.html")


def test_a_page_without_verdict_and_events_has_no_room_for_them(tmp_path: Path) -> None:
    report.write(tmp_path / "plain.html", [record("plain", 3.0)], "Plain")
    assert not re.search('id="(verdict|events)"', text_of(tmp_path / "plain.html"))


def test_the_page_needs_no_other_resource(tmp_path: Path) -> None:
    report.write(tmp_path / "report.html", [record("one", 3.0)], "One")
    text = text_of(tmp_path / "report.html")
    assert not re.search(r"(?:src|href)=\"(?!data:)", text)
    assert "default-src 'none'" in text


def test_titles_and_notes_are_escaped(tmp_path: Path) -> None:
    report.write(tmp_path / "report.html", [record("one", 3.0)], "One <b>run</b>", notes=["it <i>converges</i>"])
    text = text_of(tmp_path / "report.html")
    assert "One &lt;b&gt;run&lt;/b&gt;" in text
    assert "it &lt;i&gt;converges&lt;/i&gt;" in text


def test_the_page_names_version_commit_date_and_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["/anywhere/bin/vessel-hsmc", "report", "a bag"])
    report.write(tmp_path / "report.html", [record("one", 3.0)], "One")
    origin = re.search(r'class="soft origin">(.*?)</p>', text_of(tmp_path / "report.html"))
    assert origin is not None
    version, commit, date, command = origin[1].split(" · ")
    assert version == f"vessel_hsmc_ros {__version__}"
    assert re.fullmatch(r"commit [0-9a-f]{40}\+?|no git checkout", commit)
    assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC", date)
    assert command == "made by vessel-hsmc report &#39;a bag&#39;"


def test_a_long_series_is_decimated_and_keeps_its_peak() -> None:
    payload = Payload(limit=1000)
    time: Array = np.arange(100_000) * 0.01
    state = np.zeros((100_000, 6))
    state[77_777, 3] = 5.0
    where = payload.line(overlays([Record("x", make_run(time, state))])[0].lines[0].line)
    assert where["bucket"] == 200
    assert where["values"]["count"] == where["time"]["count"] == 1000
    data = zlib.decompress(base64.b64decode(payload.text()))
    raw = np.frombuffer(data, np.uint8, 4000, where["values"]["at"]).reshape(4, 1000)
    assert np.ascontiguousarray(raw.T).view("<f4").max() == 5.0


def test_lines_of_several_runs_are_labelled_and_a_common_reference_appears_once(tmp_path: Path) -> None:
    report.write(tmp_path / "two.html", [record("near", 1.0), record("far", 4.0)], "Two")
    content, _ = numbers_of(tmp_path / "two.html")
    velocity = next(panel for panel in content["panels"] if panel["title"] == "surge velocity")
    assert [line["label"] for line in velocity["lines"]] == ["near", "reference", "far"]
    assert [track["label"] for track in content["tracks"]] == ["near", "far", "reference"]


def test_limits_of_every_run_are_drawn_once() -> None:
    changes: list[dict[str, Any]] = [{"controller.law": law} for law in ("hierarchical_printed", "guided", "los_pid")]
    runs = [record(str(i), 1.0, **changes[i]) for i in range(3)]
    force = next(overlay for overlay in overlays(runs) if overlay.panel.title == "surge force")
    assert force.panel.limits == ((2e5, "law"),)


def test_several_lines_of_a_run_in_one_panel_are_labelled_apart() -> None:
    records = [record("near", 1.0), record("far", 4.0)]
    for each in records:
        each.run.control.update(surge_surface=np.ones(250), sway_surface=np.zeros(250))
    errors = next(overlay for overlay in overlays(records) if overlay.panel.title == "surge and sway surfaces")
    labels = [owned.label for owned in errors.lines]
    assert labels == ["near: S₂ surge", "near: σ₁ sway", "far: S₂ surge", "far: σ₁ sway"]


def test_a_page_that_cannot_be_written_is_an_error_with_its_path(tmp_path: Path) -> None:
    with pytest.raises(ReportError, match=r"report .*nowhere/page.html cannot be written: No such file or directory"):
        report.write(tmp_path / "nowhere" / "page.html", [record("one", 1.0)], "One")


def test_deviations_of_sensors_and_observer_from_the_truth_are_shown() -> None:
    def lines(**changes: object) -> dict[str, list[str]]:
        run = simulate(load_scenario("realistic", {"vessel_sim.duration": 2.0, **changes}))
        return {panel.title: [line.name for line in panel.lines] for panel in panels(Record("run", run))}

    shown = lines()
    assert shown["position, deviation from the truth"] == ["measured", "estimate"]
    assert shown["heading, deviation from the truth"] == ["measured", "estimate"]
    assert shown["surge velocity"] == ["ship", "reference", "estimate"]  # the sensors do not measure it
    assert lines(**{"controller.observer.enabled": False})["position, deviation from the truth"] == ["measured"]


@pytest.mark.parametrize("jitter", rest_long([0.0, 1e-3]))
def test_a_histogram_of_the_control_intervals_is_shown_where_they_vary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jitter: float
) -> None:
    leave_unrendered(monkeypatch)
    made = record("run", 1.0)
    count = len(made.run.control["time"])
    made.run.control["time"] = 0.02 * np.arange(count) + jitter * np.random.default_rng(1).random(count)
    made.run.control["compute_time"] = np.full(count, 4e-5)
    report.write(tmp_path / "report.html", [made], "Run")
    files = {file.stem for file in figures.draw([made], tmp_path / "figures")}
    assert ('id="jitter"' in text_of(tmp_path / "report.html")) == ("jitter" in files) == (jitter > 0.0)


def test_page_and_figures_use_one_palette() -> None:
    variables = diagrams.css_variables()
    for i, colour in enumerate(diagrams.SERIES):
        assert f"--run-{i}: {colour};" in variables
    assert f"--ship: {diagrams.SHIP};" in variables
    assert f"--reference: {diagrams.REFERENCE};" in variables
