import math
from typing import Any

import numpy as np
import pytest
from compiling import only_compiled
from durations import rest_long
from numpy.typing import NDArray

from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.scenario.own_ship import scenario_for
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.margins import GAIN_MARGIN_DB, PHASE_MARGIN_DEG, study

pytestmark = only_compiled


def but(names: list[str], misses: dict[str, str]) -> list[Any]:
    """The names, with those that the guided law misses marked as such; what is found is the reason."""
    marks = {name: pytest.mark.xfail(strict=True, raises=AssertionError, reason=found) for name, found in misses.items()}
    return [pytest.param(name, marks=marks[name]) if name in marks else name for name in names]


def scenario_of(name: str) -> Scenario:
    return parse_scenario(scenario_for(read_vessel(name).values, name), name)


LONG = 1000.0
"""Runs that are longer, s, are settled long before their end: half of them is enough."""


def settled_error(scenario: Scenario) -> NDArray[np.float64]:
    """The position error of the last quarter, in lengths."""
    duration = scenario.vessel_sim.duration
    run = simulate(scenario.changed({"vessel_sim.duration": 0.5 * duration if duration > LONG else duration}))
    return position_error(run.state, run.reference)[run.time >= 0.75 * run.time[-1]] / scenario.vessel_sim.vessel.length


@pytest.mark.parametrize("name", rest_long(but([*vessel_names()], {"cybership_enterprise": "0.44 lengths"}), 6))
def test_every_vessel_of_the_library_keeps_its_circle_within_a_hundredth_of_its_length(name: str) -> None:
    assert settled_error(scenario_of(name)).max() < 0.01


@pytest.mark.parametrize(
    "name", rest_long(but([*vessel_names()], {"cybership2": "0.0089 lengths", "cybership_enterprise": "0.18 lengths"}), 3)
)
def test_every_vessel_of_the_library_keeps_a_straight_line_within_two_thousandths_of_its_length(name: str) -> None:
    scenario = scenario_of(name)
    length = scenario.vessel_sim.vessel.length
    start = {"vessel_sim.initial_pose": [-0.3 * length, -0.4 * length, math.pi / 4.0]}
    assert rms(settled_error(scenario.changed({"reference_ship.mode": "straight", **start}))) < 0.002


@pytest.mark.parametrize(
    "name", rest_long(but(["milliampere", "gunnerus", "heron"], {"gunnerus": "35 degrees", "heron": "32 degrees"}))
)
def test_a_hull_whose_drift_decays_slowly_has_the_margins_of_the_others(name: str) -> None:
    for loop in study(scenario_of(name)).loops.values():
        assert loop.stable
        assert loop.gain_db > GAIN_MARGIN_DB
        assert loop.phase_deg > PHASE_MARGIN_DEG - 0.5


@pytest.mark.parametrize("name", but(["cybership2", "gunnerus", "otter", "viknes_830"], {"cybership2": "0.19 lengths"}))
def test_vessels_follow_a_virtual_ship_of_their_own_hull(name: str) -> None:
    scenario = scenario_of(name)
    limits = scenario.controller.vessel
    inputs = {
        "vessel_sim.duration": min(scenario.vessel_sim.duration, 1200.0),
        "reference_ship.mode": "virtual_ship",
        "reference_ship.surge_force": 0.3 * limits.surge_force_limit,
        "reference_ship.yaw_moment": 0.1 * limits.yaw_moment_limit,
    }
    assert rms(settled_error(scenario.changed(inputs))) < 0.01
