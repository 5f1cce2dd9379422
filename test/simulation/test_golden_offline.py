"""Every scenario compared with its golden run; `make golden` shows the differences and records them."""

from typing import Any

import numpy as np
import pytest
from durations import rest_long
from golden.record import FOLDER, TIMES, changed_metrics, deviations, load, metrics, rows, settled

from vessel_hsmc_ros.scenario.scenario import scenario_names
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate


def test_every_scenario_has_a_golden_run_and_there_are_no_others() -> None:
    assert sorted(path.stem for path in FOLDER.glob("*.json")) == scenario_names(), "run `make golden`"


@pytest.mark.parametrize("name", rest_long(scenario_names(), 2))
def test_a_scenario_reproduces_its_golden_run(name: str) -> None:
    recorded, run = load(name), simulate(load_scenario(name))
    now = rows(run)
    assert len(now) == len(recorded["rows"])
    ratios = dict(zip(recorded["columns"], deviations(recorded["rows"], now), strict=True))
    assert {column: ratio for column, ratio in ratios.items() if ratio > 1.0} == {}, "run `make golden` if this is meant"
    found = metrics(run)
    assert changed_metrics(recorded["figures"], {name: found.get(name) for name in recorded["figures"]}) == []


@pytest.mark.parametrize(
    ("parameter", "value"),
    [
        ("controller.hierarchical_printed.heading_surface_slope", 0.3 * (1 + 1e-6)),
        ("controller.hierarchical_printed.surge_surface_slope", 0.3 * (1 + 1e-6)),
        ("controller.hierarchical_printed.sway_surface_slope", 0.3 * (1 + 1e-4)),  # its weight is small
        ("controller.hierarchical_printed.yaw_adaptation_gain", 0.001 * (1 + 1e-4)),
        ("controller.hierarchical_printed.surge_switching_gain", 0.001 * (1 + 1e-2)),  # k2 = 100 stands beside it
        ("vessel_sim.vessel.sway_inertia", 177.9e3 * (1 + 1e-6)),
        ("vessel_sim.disturbance.periodic.frequency", 0.01 * (1 + 1e-4)),
        ("reference_ship.yaw_moment", 1e6 * (1 + 1e-6)),
        ("vessel_sim.substeps", 2),
    ],
)
def test_the_tolerances_detect_a_small_change_of_a_parameter(parameter: str, value: Any) -> None:
    run = simulate(load_scenario("case2_tracking", {"vessel_sim.duration": 20.0, parameter: value}))
    assert np.max(deviations(load("case2_tracking")["rows"], rows(run))) > 1.0


def test_headings_of_pi_and_minus_pi_are_equal() -> None:
    recorded = np.zeros((1, 15))
    now = recorded.copy()
    recorded[0, 3], now[0, 3] = np.pi, -np.pi
    assert np.max(deviations(recorded, now)) == 0.0


def test_settling_is_the_last_crossing_of_a_limit() -> None:
    time = np.arange(5.0)
    assert settled(time, np.array([5.0, 0.5, -2.0, 0.1, 0.1]), 1.0) == 3.0
    assert settled(time, np.array([0.5, 0.5, 0.5, 0.5, 0.5]), 1.0) == 0.0
    assert settled(time, np.array([0.5, 0.5, 0.5, 0.5, 5.0]), 1.0) is None
    assert tuple(sorted(TIMES)) == TIMES
