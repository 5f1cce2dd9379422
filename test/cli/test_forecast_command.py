"""`vessel-hsmc forecast`: where the mission and the boat come from, what is refused, exit codes."""

import json
from pathlib import Path

import pytest
from mission_writing import plan, waypoint_item
from reaching import Reach, exit_code_of

from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text

FORECAST = "vessel_hsmc_ros.studies.forecast.forecast.forecast"
PLACES = [(63.4401, 10.3901), (63.4405, 10.3905), (63.4408, 10.3901)]
WIND = "--wind", "6", "--wind-from", "240"


@pytest.fixture(autouse=True)
def _folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    boat = scenario_text("boat", MainData(length=4.0, wind=5.0, current=0.2))
    Path("boat.yaml").write_text(boat, encoding="utf-8")
    both = boat.replace("mode: circle", "path: {waypoints: [40.0, 0.0, 40.0, 20.0]}\n    mode: path")
    Path("both.yaml").write_text(both, encoding="utf-8")
    Path("way.csv").write_text("x,y,speed\n40,0,1\n40,20,1\n", encoding="utf-8")
    Path("way.yaml").write_text("reference_ship: {ros__parameters: {mode: path, path: {waypoints: [40.0, 0.0, 40.0, 20.0]}}}\n")


@pytest.mark.parametrize(
    "mission", [["way.csv", "--scenario", "boat.yaml"], ["way.yaml", "--scenario", "boat.yaml"], ["both.yaml"]]
)
def test_a_mission_comes_from_its_file_from_written_parameters_or_from_a_scenario(reach: Reach, mission: list[str]) -> None:
    found = reach(FORECAST, "forecast", *mission, *WIND)
    assert [leg.number for leg in found["plan"].legs] == [0, 1]
    assert found["plan"].scenario.name == Path(mission[0]).stem
    assert found["plan"].scenario.vessel_sim.vessel.length == 4.0


def test_what_is_not_given_of_wind_and_current_is_that_of_the_scenario(reach: Reach) -> None:
    conditions = reach(FORECAST, "forecast", "way.csv", "--scenario", "boat.yaml")["plan"].conditions
    assert (conditions.wind, conditions.wind_from) == pytest.approx((5.0, 270.0), abs=0.01)
    assert (conditions.current, conditions.current_to) == pytest.approx((0.2, 90.0))
    calm = reach(FORECAST, "forecast", "way.csv", "--scenario", "boat.yaml", "--wind", "0")["plan"].conditions
    assert (calm.wind, calm.current) == (0.0, pytest.approx(0.2))


REFUSED = {
    "a wind that is no number": (["--wind", "nan", "--wind-from", "3"], "--wind must be a finite number"),
    "a wind beyond all storms": (["--wind", "99", "--wind-from", "3"], "must be a finite number from 0 to 60 m/s"),
    "a direction beyond the compass": (["--wind", "5", "--wind-from", "400"], "--wind-from must be"),
    "a wind from nowhere": (["--wind", "5"], "--wind-from must be given with --wind"),
    "a direction without a current": (["--current-to", "5"], "--current-to goes with --current"),
    "no corridor": (["--corridor", "0"], "--corridor must be a distance above 0 m (got 0 m)"),
    "too few runs": (["--runs", "3"], "3 is not in the range"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_values_are_refused_in_a_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], case: str) -> None:
    options, message = REFUSED[case]
    assert exit_code_of(monkeypatch, "forecast", "way.csv", "--scenario", "boat.yaml", *options) == 2
    assert message in capsys.readouterr().err
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.csv", "--scenario", "boat.yaml"], "mission file none.csv cannot be read: No such file"),
        (["none.yaml"], "scenario file none.yaml does not exist"),
        (["way.csv"], "--scenario must name the boat that sails way.csv (got none): vessel-hsmc init writes it"),
        (["way.yaml"], "--scenario must name the boat that sails way.yaml (got none)"),
        (["boat.yaml"], "boat must have a mission: a path or a survey (got reference_ship.mode = circle)"),
    ],
)
def test_a_mission_or_a_boat_that_there_is_not_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert exit_code_of(monkeypatch, "forecast", *arguments, *WIND) == 2
    assert message in capsys.readouterr().err


def test_a_mission_that_leaves_its_own_fence_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    square = [(63.4400, 10.3899), (63.4400, 10.3903), (63.4409, 10.3903), (63.4409, 10.3899)]
    polygon = {"inclusion": True, "polygon": [list(each) for each in square], "version": 1}
    fence = {"circles": [], "polygons": [polygon], "version": 2}
    Path("way.plan").write_text(plan([waypoint_item(k, place) for k, place in enumerate(PLACES, 1)], geoFence=fence))
    assert exit_code_of(monkeypatch, "forecast", "way.plan", "--scenario", "boat.yaml", *WIND) == 1
    assert "it leaves the area to stay in" in capsys.readouterr().err


def test_an_infeasible_leg_is_named_without_a_run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    strong = "--current", "2.5", "--current-to", "90"
    assert exit_code_of(monkeypatch, "forecast", "way.csv", "--scenario", "boat.yaml", *strong) == 1
    shown = capsys.readouterr().err
    assert "error: infeasible on leg 2: 2.5 m/s of cross current, the boat has " in shown
    assert not Path("runs").exists()


@pytest.mark.long
def test_runs_that_fail_are_counted_with_the_reason_and_an_exit_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    narrow = "--corridor", "0.001", "--runs", "20"
    assert exit_code_of(monkeypatch, "forecast", "way.csv", "--scenario", "boat.yaml", *WIND, *narrow) == 1
    assert "20 of 20 runs: it strays more than 1 mm from leg 1" in capsys.readouterr().err
    (folder,) = Path("runs").iterdir()
    numbers = json.loads((folder / "forecast.json").read_text())
    assert (numbers["failed"], len(numbers["runs"]), set(numbers["legs"])) == (20, 20, {"1", "2"})


def test_a_plan_of_a_planner_is_forecast(reach: Reach) -> None:
    Path("way.plan").write_text(plan([waypoint_item(k, place) for k, place in enumerate(PLACES, 1)]))
    assert len(reach(FORECAST, "forecast", "way.plan", "--scenario", "boat.yaml", *WIND)["plan"].legs) == 2
