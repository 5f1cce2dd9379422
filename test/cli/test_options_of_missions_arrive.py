"""As `test_options_arrive`, for the verbs that read a mission."""

from pathlib import Path

import pytest
from mission_writing import GPX, gpx_route
from reaching import Reach

from vessel_hsmc_ros.studies.forecast.forecast import Conditions


def test_mission_takes_route_datum_legs_speed_and_where_it_goes(reach: Reach, tmp_path: Path) -> None:
    places = [(63.44 + 1e-3 * k, 10.39) for k in range(1, 5)]
    (tmp_path / "way.gpx").write_text(GPX.format(gpx_route(places, "out") + gpx_route(places[::-1], "back")))
    chosen = "--route", "back", "--datum", "63.44,10.39", "--legs", "3-", "--speed", 0.75, "--skip-refused"
    found = reach("vessel_hsmc_ros.cli.mission._write", "mission", "way.gpx", *chosen, "--into", "there.yaml")
    assert found["into"] == Path("there.yaml")
    assert found["values"]["path.waypoints"][1::2] == pytest.approx([334.4, 222.9, 111.5], abs=0.1)
    assert found["values"]["path.speeds"] == [0.75] * 3
    found = reach("vessel_hsmc_ros.cli.mission._plan", "mission", "way.gpx", "--route", "out", "--scenario", "survey")
    assert found["name"] == "survey"
    assert reach("vessel_hsmc_ros.cli.mission._completed", "mission", "way.gpx", "--route", "out", "--resume", "bag")[
        "bag"
    ] == Path("bag")
    sent = "--send", "--namespace", "boat", "--route", "out", "--datum", "63.44,10.39"
    asked = reach("vessel_hsmc_ros.cli.mission._datum_of_vessel", "mission", "way.gpx", *sent)
    assert (asked["namespace"], asked["datum"]) == ("boat", (63.44, 10.39))
    (tmp_path / "way.csv").write_text("x,y\n40,0\n40,30\n", encoding="utf-8")
    found = reach("vessel_hsmc_ros.cli.mission.sail", "mission", "way.csv", "--send", "--detach", "--namespace", "boat")
    assert (found["namespace"], found["detach"]) == ("boat", True)
    survey = "--swath", 12.5, "--along", 60
    found = reach("vessel_hsmc_ros.cli.mission.survey_of", "mission", "way.gpx", "--route", "out", *survey)
    assert (found["swath"], found["along"], found["speed"]) == (12.5, pytest.approx(0.5236, abs=1e-4), None)


def test_forecast_takes_the_boat_the_conditions_the_corridor_and_the_runs(reach: Reach, tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("x,y\n40,0\n40,30\n", encoding="utf-8")
    wind = "--wind", 6, "--wind-from", 240, "--current", 0.3, "--current-to", 90
    boat = "--scenario", "survey", "--set", "vessel_sim.seed=7", "--output", "there"
    target = "vessel_hsmc_ros.studies.forecast.forecast.forecast"
    found = reach(target, "forecast", "way.csv", *boat, *wind, "--corridor", 3, "--runs", 25, "--seed", 9, "--workers", 2)
    plan = found["plan"]
    assert plan.conditions == Conditions(6.0, 240.0, 0.3, 90.0)
    assert (plan.corridor, plan.scenario.name, plan.scenario.vessel_sim.seed) == (3.0, "way", 7)
    assert plan.scenario.reference_ship.path.waypoints == (40.0, 0.0, 40.0, 30.0)
    assert (found["runs"], found["seed"], found["workers"]) == (25, 9, 2)
