"""The verb `forecast` as a process: from a boat's main data and a mission to the page, and to what cannot be done."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from harness import Command, run_folder

from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text

Start = Callable[..., Command]


@pytest.mark.long
def test_a_boat_and_a_mission_give_an_answer_a_page_and_an_exit_code(start: Start, tmp_path: Path) -> None:
    boat, way = tmp_path / "boat.yaml", tmp_path / "way.csv"
    boat.write_text(scenario_text("boat", MainData(length=4.0, power=900.0, battery=500.0)), encoding="utf-8")
    way.write_text("x,y,speed\n30,0,1\n30,20,1\n", encoding="utf-8")
    of_today = way, "--scenario", boat, "--runs", 20, "--workers", 1, "--wind", 4, "--wind-from", 200
    done = start("vessel-hsmc", "forecast", *of_today)
    assert done.wait(300.0) == 0, done.text
    assert "Yes: 20 of 20 runs do the mission in a wind of 4 m/s from 200° and no current." in done.text
    folder = run_folder(done.output.parent / "runs")
    assert folder is not None
    assert "left in the battery" in (folder / "forecast.html").read_text(encoding="utf-8")
    left = json.loads((folder / "forecast.json").read_text(encoding="utf-8"))["bands"]["battery_left_wh"]
    assert 400.0 < left[0] < left[1] < left[2] < 500.0
    strong = start("vessel-hsmc", "forecast", *of_today, "--current", 3, "--current-to", 0)
    assert strong.wait(120.0) == 1
    assert "error: infeasible on leg 1: 3 m/s of cross current, the boat has " in strong.text
