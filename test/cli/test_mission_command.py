"""`vessel-hsmc mission` shows, refuses, writes and sends missions."""

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from boat_bags import write_boat
from click.testing import CliRunner, Result
from mission_writing import HOME, feature, geojson, line, of_table, plan, positions, simple_item, waypoint_item, wpl
from reaching import Reach, exit_code_of

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError, ScenarioError
from vessel_hsmc_ros.scenario.scenario import load_scenario, read_changes

PLACES = [(63.4401, 10.3901), (63.4410, 10.3920), (63.4420, 10.3880)]
LAWN = [(100.0, 0.0), (100.0, 12.0), (0.0, 12.0), (0.0, 24.0), (100.0, 24.0), (100.0, 36.0), (0.0, 36.0)]
METRES = "\n".join(["x,y", *(f"{x},{y}" for x, y in LAWN)])


@pytest.fixture(autouse=True)
def _folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")


def call(text: str, *options: str) -> Result:
    Path("way").write_text(text, encoding="utf-8")
    return CliRunner().invoke(cli, ["mission", "way", *options], standalone_mode=False)


def test_a_mission_is_shown_leg_by_leg_with_its_datum() -> None:
    done = call(of_table(PLACES))
    assert done.exception is None
    rows = [row.split() for row in done.output.splitlines() if row.startswith((" 1", " 2", " 3"))]
    assert [row[:3] for row in rows] == [["1", "p0", "through"], ["2", "p1", "through"], ["3", "p2", "through"]]
    assert rows[1][3:7] == ["94.82", "100.32", "138.04", "43.4"]
    assert "datum: 63.4401000,10.3901000 (line 2); navsat_odom.datum has to be the same" in done.output


def test_nothing_is_written_while_an_item_is_refused_unless_that_is_asked_for() -> None:
    text = plan([simple_item(1, 22, (0, 0, 0, None, *HOME, 5)), *(waypoint_item(k, place) for k, place in enumerate(PLACES, 2))])
    refused = call(text, "--into", "out.yaml")
    assert isinstance(refused.exception, GoalError)
    assert "1 item is refused: --skip-refused sails the mission without" in str(refused.exception)
    assert "refused: item 1: command 22 NAV_TAKEOFF: " in refused.output
    assert not Path("out.yaml").exists()
    assert call(text, "--into", "out.yaml", "--skip-refused").exception is None
    assert len(read_changes(Path("out.yaml"))["reference_ship.path.waypoints"]) == 6  # type: ignore[arg-type]


def test_what_is_written_is_what_a_scenario_sails() -> None:
    text = wpl([line(k, 3, 16, (10 * (k == 2), 0, 0, 0), place) for k, place in enumerate(PLACES, 1)])
    assert call(text, "--datum", "63.4401,10.3901", "--into", "out.yaml", "--speed", "0.9").exception is None
    reference = load_scenario("survey", read_changes(Path("out.yaml"))).reference_ship
    path = reference.path
    assert reference.actions.datum == (63.4401, 10.3901)
    assert path.waypoints[2:4] == pytest.approx((94.823, 100.323), abs=1e-3)
    assert (path.speeds, path.corners, path.holds) == ((0.9,) * 3, ("through", "stop", "through"), (0.0, 10.0, 0.0))
    again = call(text, "--into", "out.yaml")
    assert isinstance(again.exception, ScenarioError)
    assert "out.yaml exists and is not overwritten" in str(again.exception)


def test_a_mission_is_planned_with_the_vessel_of_a_scenario() -> None:
    done = call(METRES, "--scenario", "survey", "--into", "out.yaml", "--legs", "1-3")
    assert done.exception is None
    assert "planned with survey: " in done.output
    assert "simulate survey --set @out.yaml --set vessel_sim.duration=" in done.output
    tight = call("x,y\n30,0\n30,0.05\n0,0.05\n0,30\n", "--scenario", "survey", "--speed", "50")
    assert isinstance(tight.exception, ParameterError)
    assert "reference_ship.path" in str(tight.exception)


@pytest.mark.parametrize(("legs", "first", "count"), [("7", 6, 2), ("5-", 4, 4), ("1-2", 1, 2)])
def test_a_part_of_a_mission_keeps_the_numbers_of_its_legs(legs: str, first: int, count: int) -> None:
    done = call(METRES, "--legs", legs)
    rows = [row.split() for row in done.output.splitlines() if "through" in row or "over" in row]
    assert [int(row[0]) for row in rows] == [*range(first, first + count)]


def bag_of(places: list[tuple[float, float]], share: float) -> str:
    """A bag of a boat that has sailed a share of a way."""
    line = np.array([0j, *(complex(*place) for place in places)])
    ways = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(line)))))
    s = np.linspace(0.0, share * ways[-1], 2000)
    p = np.interp(s, ways, line)
    return str(write_boat(Path("boat.mcap"), np.column_stack((s, p.real, p.imag, *np.zeros((6, len(s)))))))


def test_a_mission_is_resumed_with_the_first_leg_that_a_bag_has_not_completed() -> None:
    share = (100.0 + 12.0 + 100.0 + 12.0 + 30.0) / 436.0
    done = call(METRES, "--resume", bag_of(LAWN, share), "--into", "out.yaml")
    assert done.exception is None
    assert "has completed 4 of 7 legs: leg 5 is the next" in done.output
    values = read_changes(Path("out.yaml"))
    assert values["reference_ship.path.waypoints"] == [value for place in LAWN[3:] for value in place]
    assert values["reference_ship.path.corners"][0] == "over"  # type: ignore[index]


def test_a_mission_that_is_completed_or_a_bag_that_there_is_not_ends_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = call(METRES, "--resume", bag_of(LAWN, 1.0))
    assert isinstance(whole.exception, ScenarioError)
    assert "has completed all 7 legs: --legs sails some of them again" in str(whole.exception)
    assert exit_code_of(monkeypatch, "mission", "way", "--resume", "none") == 2


def test_a_mission_that_leaves_its_fence_is_refused() -> None:
    square = [(63.4399, 10.3895), (63.4399, 10.3925), (63.4415, 10.3925), (63.4415, 10.3895)]
    fence = {
        "circles": [],
        "polygons": [{"inclusion": True, "polygon": [list(corner) for corner in square], "version": 1}],
        "version": 2,
    }
    text = plan([waypoint_item(k, place) for k, place in enumerate(PLACES, 1)], geoFence=fence)
    for options in ((), ("--skip-refused", "--into", "out.yaml")):
        done = call(text, *options)
        assert isinstance(done.exception, GoalError)
        assert "refused: item 3: its leg: it leaves the area to stay in, fence polygon 1" in done.output
    assert not Path("out.yaml").exists()


@pytest.mark.long
def test_the_fence_of_a_mission_is_written_for_controller_and_reference() -> None:
    square = [(63.4390, 10.3870), (63.4390, 10.3930), (63.4430, 10.3930), (63.4430, 10.3870)]
    circle = {"circle": {"center": [63.4400, 10.3880], "radius": 20.0}, "inclusion": False, "version": 1}
    polygon = {"inclusion": True, "polygon": [list(corner) for corner in square], "version": 1}
    fence = {"circles": [circle], "polygons": [polygon], "version": 2}
    text = plan([waypoint_item(k, place) for k, place in enumerate(PLACES, 1)], geoFence=fence)
    assert call(text, "--datum", "63.4401,10.3901", "--into", "out.yaml").exception is None
    changes = read_changes(Path("out.yaml"))
    begin = {f"{node}.initial_pose": [1.0, 1.0, 0.0] for node in ("vessel_sim", "reference_ship")}
    scenario = load_scenario("survey", {**changes, **begin})
    own, planned = scenario.controller.safety.fence, scenario.reference_ship.fence
    assert (own.inside, own.outside) == (planned.inside, planned.outside)
    assert len(own.inside) == 10
    corners = np.array(own.outside).reshape(-1, 2)
    center = corners[:-1].mean(axis=0)
    assert np.hypot(*(corners - center).T) == pytest.approx(20.0 / np.cos(np.pi / 64), rel=1e-6)
    with pytest.raises(ParameterError, match="must be inside of the fence"):
        load_scenario("survey", {**changes, "vessel_sim.initial_pose": [500.0, 0.0, 0.0]})


@pytest.mark.long
def test_the_area_of_a_file_is_surveyed_with_a_swath() -> None:
    ring = positions([*PLACES, PLACES[0]])
    text = geojson(feature("Polygon", [ring]))
    assert "--swath surveys its area" in str(call(text).exception)
    done = call(text, "--swath", "12.5", "--along", "0", "--speed", "0.8", "--into", "out.yaml")
    assert done.exception is None
    lawnmower = load_scenario("survey", read_changes(Path("out.yaml"))).reference_ship.lawnmower
    assert (lawnmower.spacing, lawnmower.speed, len(lawnmower.polygon)) == (12.5, 0.8, 6)
    assert lawnmower.heading == pytest.approx(0.5 * np.pi)
    assert "must be given with a file of one polygon" in str(call(METRES, "--swath", "5").exception)


def test_a_mission_of_positions_is_sent_to_the_vessel(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rclpy", reason="ROS is not installed")
    namespaces: list[str] = []

    def running(namespace: str) -> Any:
        namespaces.append(namespace)
        return nullcontext("remote")

    monkeypatch.setattr("vessel_hsmc_ros.cli.sailing.running_vessel", running)
    Path("way").write_text(METRES, encoding="utf-8")
    found = reach("vessel_hsmc_ros.nodes.remote.send_path", "mission", "way", "--send", "--detach", "--namespace", "one")
    assert [*found.values()] == ["remote", [(x, y, 0.0) for x, y in LAWN]]
    assert namespaces == ["one"]


def test_what_a_running_vessel_cannot_take_is_not_sent() -> None:
    with_speeds = METRES.replace("x,y", "x,y,speed").replace(".0\n", ".0,1\n") + ",1"
    assert "items are refused" in str(call(with_speeds, "--send").exception)


@pytest.mark.parametrize(
    "options",
    [
        ("--namespace", "a"),
        ("--along", "3"),
        ("--into", "a.yaml", "--send"),
        ("--resume", "a", "--legs", "3"),
        ("--swath", "3", "--legs", "3"),
        ("--swath", "3", "--send"),
        ("--send", "--speed", "1"),
        ("--speed", "-1"),
        ("--datum", "91,3"),
        ("--datum", "63.44,10.39"),
        ("--route", "a"),
        ("--legs", "9"),
        ("--scenario", "none"),
    ],
)
def test_options_that_do_not_fit_each_other_or_the_file_are_wrong_use(
    monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]
) -> None:
    Path("way").write_text(METRES, encoding="utf-8")
    assert exit_code_of(monkeypatch, "mission", "way", *options) == 2


@pytest.mark.parametrize(
    ("own", "given", "refusal"),
    [
        ((63.44, 10.39), (63.44, 10.39), ""),
        ((63.44, 10.39), (), ""),
        (None, (63.44, 10.39), ""),
        (None, (), "--datum must be given with --send"),
        ((63.45, 10.39), (63.44, 10.39), "--datum must be that of /odom/datum, 63.45,10.39 (got 63.44,10.39)"),
    ],
)
def test_a_mission_is_sent_only_with_the_datum_of_the_odometry(
    monkeypatch: pytest.MonkeyPatch, own: tuple[float, ...] | None, given: tuple[float, ...], refusal: str
) -> None:
    pytest.importorskip("rclpy", reason="ROS is not installed")
    remote = SimpleNamespace(name=lambda name: f"/{name}")
    monkeypatch.setattr("vessel_hsmc_ros.cli.mission.running_vessel", lambda _: nullcontext(remote))
    monkeypatch.setattr("vessel_hsmc_ros.nodes.remote.stated_datum", lambda _: own)
    found: list[Any] = []

    def send(_: object, poses: list[Any]) -> str:
        found.extend(poses)
        return "path: 3 waypoints"

    monkeypatch.setattr("vessel_hsmc_ros.nodes.remote.send_path", send)
    done = call(of_table(PLACES), "--send", "--detach", *(["--datum", ",".join(map(str, given))] if given else []))
    assert (len(found) == 3) == (not refusal)
    assert refusal in str(done.exception or "")
    if not refusal:
        assert f"datum: {(own or given)[0]:.7f}" in done.output
