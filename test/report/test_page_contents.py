"""What the page of several unlike runs holds: spans, tracks, plans, legs, verdicts, hull, resolution, files of its options."""

import base64
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from records import make_run, record

from vessel_hsmc_ros.core.hull import DrawnHull, Hull
from vessel_hsmc_ros.core.metrics import TrackErrors
from vessel_hsmc_ros.report import Record, figures, page
from vessel_hsmc_ros.report.page import Options
from vessel_hsmc_ros.report.page_kit import TRACK_POINTS, Payload
from vessel_hsmc_ros.report.panels import Line, Panel, Plan, fences, overlays, plans, stops
from vessel_hsmc_ros.report.record import Limit, planned
from vessel_hsmc_ros.scenario.scenario import load_scenario

Array = NDArray[Any]


def unpacked(text: str, where: dict[str, Any]) -> Array:
    """An array of a payload."""
    size = int(where["kind"][1])
    data = zlib.decompress(base64.b64decode(text))
    raw = np.frombuffer(data, np.uint8, where["count"] * size, where["at"]).reshape(size, where["count"])
    found: Array = np.ascontiguousarray(raw.T).view("<" + where["kind"]).ravel()
    return found


def spiral(name: str, begin: float, end: float, side: float, **known: Any) -> Record:
    """A ship that turns more than once, far from the origin, from a time to another."""
    time = np.arange(begin, end, 0.5)
    psi = np.angle(np.exp(1j * 0.2 * time))
    state = np.column_stack([5000.0 + side + 3.0 * time, -700.0 + 0.1 * time**2, psi, *np.zeros((3, len(time)))])
    return Record(name, make_run(time, state, reference=state + side + 1.0, wrench=np.zeros((len(time), 2))), **known)


def test_the_page_spans_all_runs_and_has_every_pose_to_the_last() -> None:
    runs = [spiral("one", 2.0, 50.0, 0.0), spiral("two", 1.0, 30.0, 4.0), spiral("three", 3.0, 40.0, 9.0)]
    content, numbers = page._content(runs, overlays(runs), Hull(length=7.5, beam=2.25))
    assert (content["begin"], content["end"], content["hull"]) == (1.0, 49.5, {"length": 7.5, "beam": 2.25})
    assert [(each["label"], each["role"], each["run"], each["colour"]) for each in content["tracks"]][:3] == [
        (name, "ship", run, f"--run-{run}") for run, name in enumerate(("one", "two", "three"))
    ]
    for run, track in zip(runs, content["tracks"], strict=False):
        np.testing.assert_array_equal(unpacked(numbers, track["time"]), run.run.time)
        for name, column, offset in (("x", 0, track["middle"][0]), ("y", 1, track["middle"][1])):
            np.testing.assert_allclose(unpacked(numbers, track[name]) + offset, run.run.state[:, column], atol=1e-4)
        heading = unpacked(numbers, track["heading"])
        np.testing.assert_allclose(np.exp(1j * heading), np.exp(1j * run.run.state[:, 2]), atol=1e-5)
        assert np.ptp(heading) == pytest.approx(0.2 * np.ptp(run.run.time), rel=1e-5)  # without a jump where it wraps


def test_a_track_of_many_poses_is_thinned_and_keeps_the_first_and_the_last() -> None:
    count = 3 * TRACK_POINTS
    time: Array = 1e6 + 0.01 * np.arange(count)  # times need more digits than 32 bits have
    payload = Payload(1000)
    where = payload.poses(time, np.column_stack([time, 2.0 * time, 0.01 * (time - time[0])]))
    found = unpacked(payload.text(), where["time"])
    assert len(found) == TRACK_POINTS
    assert (found[0], found[-1]) == (time[0], time[-1])
    for name, expected in (("x", found - where["middle"][0]), ("y", 2.0 * found - where["middle"][1])):
        np.testing.assert_allclose(unpacked(payload.text(), where[name]), expected, atol=1e-4)  # each pose at its own time
    np.testing.assert_allclose(unpacked(payload.text(), where["heading"]), 0.01 * (found - time[0]), atol=1e-5)
    line = payload.line(Line("x", time, time))
    assert line["time"]["kind"] == "f8"
    assert np.diff(unpacked(payload.text(), line["time"])).min() > 0.0


def test_planned_legs_are_drawn_where_they_are() -> None:
    points = np.array([100.0 - 40.0j, 300.0 - 50.0j, 320.0 + 10.0j])
    payload = Payload(1000)
    made = page._plan(payload, Plan((points,), (100.0 - 40.0j, 320.0 + 10.0j)))
    (outline,) = made["outlines"]
    np.testing.assert_allclose(unpacked(payload.text(), outline["x"]) + outline["middle"][0], points.real)
    np.testing.assert_allclose(unpacked(payload.text(), outline["y"]) + outline["middle"][1], points.imag)
    assert made["waypoints"] == [[100.0, -40.0], [320.0, 10.0]]


def test_runs_with_unlike_plans_show_both_and_runs_with_one_plan_show_it_once() -> None:
    def with_plan(last: float) -> Record:
        scenario = load_scenario("waypoints", {"reference_ship.path.waypoints": [0.0, 0.0, 300.0, 0.0, 300.0, last]})
        return replace(spiral("run", 0.0, 20.0, 0.0), track=planned(scenario))

    assert [plan.waypoints[-1] for plan in plans([with_plan(200.0), with_plan(350.0), with_plan(200.0)])] == [
        300.0 + 200.0j,
        300.0 + 350.0j,
    ]


@pytest.mark.long
def test_the_fence_of_runs_is_drawn_once_in_page_and_figure() -> None:
    square = [-400.0, -400.0, 400.0, -400.0, 400.0, 400.0, -400.0, 400.0, -400.0, -400.0]
    fenced = replace(
        spiral("one", 0.0, 20.0, 0.0), scenario=load_scenario("waypoints", {"controller.safety.fence.inside": square})
    )
    free = replace(fenced, scenario=load_scenario("waypoints"))
    records = [fenced, fenced]
    assert fences(records) == [(-400 - 400j, 400 - 400j, 400 + 400j, -400 + 400j)]
    assert page._content(records, overlays(records), page.hull_of(records))[0]["fences"] == [
        [[-400.0, -400.0], [400.0, -400.0], [400.0, 400.0], [-400.0, 400.0]]
    ]
    assert fences([free]) == []
    labels = [[trace["name"] for trace in figures.track([one])["traces"]] for one in (fenced, free)]
    assert ["fence" in each for each in labels] == [True, False]
    assert ['class="fence"' in page.render([one], "run", page.hull_of([one])) for one in (fenced, free)] == [True, False]


def test_the_stopping_set_is_that_of_the_recorded_speed_and_force() -> None:
    square = [-9e3, -9e3, 9e3, -9e3, 9e3, 9e3, -9e3, 9e3, -9e3, -9e3]
    scenario = load_scenario("waypoints", {"controller.safety.fence.inside": square})
    one = replace(spiral("one", 0.0, 20.0, 0.0), scenario=scenario)
    state = one.run.state.copy()
    state[:, 3] = np.linspace(2.0, -2.0, len(state))
    moving = replace(one, run=replace(one.run, state=state, wrench=np.zeros((len(state), 2))))
    (found,) = stops([moving, replace(one, scenario=None)])
    assert (found.run, len(found.time)) == (0, len(state))
    assert found.reach[0] == pytest.approx(-found.reach[-1])
    vessel = scenario.controller.vessel
    a = vessel.surge_force_limit / vessel.surge_inertia
    assert found.reach[0] > 2.0**2 / (2.0 * a)
    assert np.diff(found.reach).max() < 0.0


def test_every_run_has_the_errors_of_its_own_legs_and_its_own_verdict() -> None:
    errors = {
        name: TrackErrors(np.repeat([0, 1], 20), np.zeros(40, bool), np.repeat([size, -2.0 * size], 20), np.full(40, 3.0 * size))
        for name, size in (("one", 0.5), ("two", 0.07))
    }
    passed = {"two": {0: (3.0, 4.0), 1: (7.0, 7.0)}}
    runs = [
        spiral(
            *(name, 0.0, 20.0, side),
            verdict=f"{name} is judged.",
            track_errors=errors.get(name),
            passed=passed.get(name, {}),
        )
        for side, name in enumerate(("one", "none", "two"))
    ]
    assert page._legs(runs) == [
        {"name": "one", "rows": [("1", "0.5 m", "0.5 m", "1.5 m", "0 %"), ("2", "1 m", "1 m", "1.5 m", "0 %")]},
        {"name": "two", "rows": [("1", "70 mm", "70 mm", "0.21 m", "25 %"), ("2", "0.14 m", "0.14 m", "0.21 m", "0 %")]},
    ]
    assert page._verdicts([runs[0], replace(runs[1], verdict=""), runs[2]]) == [
        {"name": "one", "text": "one is judged.", "colour": "--run-0"},
        {"name": "two", "text": "two is judged.", "colour": "--run-2"},
    ]


def test_the_subtitle_names_all_durations_laws_and_ships() -> None:
    unlike = ({"controller.law": "guided"}, {"vessel_sim.vessel.length": 7.5}, {"controller.law": "guided"})
    scenarios = [load_scenario("case2_tracking", changes) for changes in unlike]
    runs = [spiral("run", 0.0, end, 0.0, scenario=each) for end, each in zip((10.5, 20.5, 10.5), scenarios, strict=True)]
    assert page._subtitle(runs) == (
        "3 runs · 10 s and 20 s · control law guided, hierarchical_printed · ship of 32 m × 6.4 m · ship of 7.5 m × 6.4 m"
    )
    assert page._subtitle(runs[:1]) == "10 s · control law guided · ship of 32 m × 6.4 m"


def test_the_resolution_is_that_of_the_coarsest_line() -> None:
    panels = [{"lines": [{"bucket": 1}, {"bucket": 40}]}, {"lines": [{"bucket": 8}]}]
    run = spiral("run", 0.0, 100.0, 0.0)
    assert page._resolution(panels, [run]).startswith(
        "The diagrams contain the minimum and the maximum of every 40 samples (20 s)"
    )
    assert page._resolution([{"lines": [{"bucket": 1}]}], [run]) == "The diagrams contain every sample."


@pytest.mark.parametrize("count", [1, 3, 4])
def test_the_table_of_more_than_three_runs_has_the_width_of_the_page(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    given: dict[str, Any] = {}
    monkeypatch.setattr("vessel_hsmc_ros.report.page_kit.render", lambda *_, **values: f"{given.update(values)}")
    page.render([spiral(str(k), 0.0, 20.0, k) for k in range(count)], "Title", Hull())
    assert given["wide"] is (count > 3)
    assert given["names"] == [str(k) for k in range(count)]


def test_panels_of_unlike_runs_are_merged_group_by_group_with_all_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    time, values = np.arange(3.0), np.ones(3)

    def panels(made: Record) -> list[Panel]:
        line = Line("x", time, values)
        first = Panel("Late", "p", "N", (line,), (Limit(float(len(made.name)), made.name),))
        last = Panel("Early", "q", "N", (line, Line("y", time, values)))
        return [first, last] if made.name == "one" else [last, Panel("Late", "r", "N", (line,)), first]

    monkeypatch.setattr("vessel_hsmc_ros.report.panels.panels", panels)
    found = overlays([spiral("one", 0.0, 5.0, 0.0), spiral("three", 0.0, 5.0, 1.0)])
    assert [(each.panel.group, each.panel.title) for each in found] == [("Late", "p"), ("Late", "r"), ("Early", "q")]
    assert found[0].panel.limits == (Limit(3.0, "one"), Limit(5.0, "three"))
    # Equal values of ships are still those of two ships.
    assert [(each.label, each.run) for each in found[0].lines] == [("one", 0), ("three", 1)]
    assert [(each.label, each.run) for each in found[2].lines] == [("one: x", 0), ("one: y", 0), ("three: x", 1), ("three: y", 1)]


def test_every_option_of_a_page_reaches_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[tuple[Any, ...]] = []
    monkeypatch.setattr(page, "write", lambda *given: written.append(given))
    monkeypatch.setattr("vessel_hsmc_ros.report.figures.draw", lambda *given: written.append(given))
    named: dict[str, Any] = {"vessel": "otter"}
    runs = [record("one", 1.0), spiral("two", 0.0, 20.0, 0.0, scenario=load_scenario("figure_eight", named))]
    path = tmp_path / "mine.html"
    options = Options(page=path, figures="svg", csv=True, hull=DrawnHull(beam=2.25), notes=("a note",))
    files = page.write_files(runs, options).files
    assert written[0] == (path, runs, "one · two · otter", Hull(32.0, 2.25), ("a note",))
    assert written[1] == (runs, tmp_path / "mine_figures", "svg")
    assert files == {"page": path, "figures": tmp_path / "mine_figures", "csv": tmp_path / "mine_csv"}
    page.write_files(runs, replace(options, title="My title", figures=None, csv=False))
    assert written[2][2] == "My title"
    chosen: list[tuple[str | None, str, str]] = []

    def read(_: object, namespace: str | None = None, odometry: str = "", wrench: str = "") -> list[Record]:
        chosen.append((namespace, odometry, wrench))
        return runs

    monkeypatch.setattr(page, "read", read)
    (tmp_path / "bag").mkdir()
    monkeypatch.setattr(page, "bag_path", Path)
    page.make([tmp_path / "bag"], Options(page=path, namespace="boat", odometry="/state", wrench="/thrust"))
    assert chosen == [("boat", "/state", "/thrust")]


def test_a_table_of_many_rows_is_written_to_its_last_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "ROWS", 7)
    run = spiral("run", 0.0, 20.0, 0.0).run
    read = np.genfromtxt(page.write_csv(run, tmp_path)[0], delimiter=",", names=True)
    np.testing.assert_array_equal(read["time"], run.time)


def test_of_three_runs_the_parameters_are_named_in_which_any_differs() -> None:
    changes: list[dict[str, Any]] = [{}, {"vessel_sim.seed": 5}, {"controller.hierarchical_printed.sway_weight": 0.002}]
    names = [each.name for each in page.distinguished([record("case2_tracking", 1.0, **each) for each in changes])]
    assert [set(name.split(", ")) for name in names] == [
        {"sway_weight = 0.001", "seed = 0"},
        {"sway_weight = 0.001", "seed = 5"},
        {"sway_weight = 0.002", "seed = 0"},
    ]
