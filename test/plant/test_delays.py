"""Dead time of the actuators and delay of the odometry: known answers."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.plant.devices import ActuatorParameters, SensorParameters
from vessel_hsmc_ros.plant.simulator import PlantParameters, Simulator

GRID = RateGrid(50.0)
PERIOD = GRID.period


def applied(commands, **actuators):
    """Applied surge force and yaw moment for commands, (n, 2)."""
    plant = Simulator(PlantParameters(actuators=ActuatorParameters(**actuators)), PERIOD)
    return np.array([plant.applied(command) for command in commands])[:, [0, 2]]


@pytest.mark.parametrize(("surge", "yaw"), [(20, 5), (5, 20), (20, 0), (0, 20), (5, 5)])
def test_a_command_begins_to_act_exactly_its_dead_time_later(surge: int, yaw: int) -> None:
    commands = [(float(k), -10.0 * k) for k in range(1, 61)]
    found = applied(commands, surge_dead_time=surge * PERIOD, yaw_dead_time=yaw * PERIOD)
    np.testing.assert_array_equal(found[:, 0], [0.0] * surge + [float(k) for k in range(1, 61 - surge)])
    np.testing.assert_array_equal(found[:, 1], [0.0] * yaw + [-10.0 * k for k in range(1, 61 - yaw)])


def test_a_dead_time_is_rounded_to_whole_periods() -> None:
    found = applied([(1.0, 1.0)] * 9, surge_dead_time=0.069, yaw_dead_time=0.009)
    np.testing.assert_array_equal(found, [(0.0, 1.0)] * 3 + [(1.0, 1.0)] * 6)


def test_limit_lag_and_rate_act_on_the_command_after_its_dead_time() -> None:
    commands = [(3e5, 1e6)] * 200
    shape = {"surge_force_limit": 2e5, "surge_lag": 0.5, "yaw_moment_rate": 4e5}
    late = applied(commands, surge_dead_time=0.5, yaw_dead_time=0.5, **shape)
    np.testing.assert_array_equal(late[:25], 0.0)
    np.testing.assert_array_equal(late[25:], applied(commands, **shape)[:-25])
    assert late[25 + 24, 0] == pytest.approx(2e5 * (1.0 - math.exp(-1.0)))


@pytest.mark.parametrize(("axis", "column"), [("surge", 0), ("yaw", 2)])
def test_each_reset_discards_the_commands_on_their_way(axis: str, column: int) -> None:
    plant = Simulator(PlantParameters(actuators=ActuatorParameters(**{f"{axis}_dead_time": 0.04})), PERIOD)  # type: ignore[arg-type]
    for _ in range(2):
        for _ in range(5):
            plant.applied((7.0, 7.0))
        plant.reset()
        assert [plant.applied((1.0, 1.0))[column] for _ in range(4)] == [0.0, 0.0, 1.0, 1.0]


def odometry(sensors, steps=40):
    """True motions and those that odometry shows of a turning ship, and its age in periods."""
    plant, true, found, ages = Simulator(PlantParameters(sensors=sensors), PERIOD), [], [], []
    for k in range(steps):
        true.append(plant.state)
        found.append(plant.measured(GRID.stamp(k)))
        ages.append(plant.periods_late)
        plant.advance(plant.applied((9e4, 6e5)), plant.disturbance(k * PERIOD))
    return np.array(true), np.array(found), ages


def test_odometry_shows_the_motion_of_its_delay_ago_and_at_the_start_the_first_one() -> None:
    true, found, ages = odometry(SensorParameters(delay=0.2))
    np.testing.assert_array_equal(found[:10], [true[0]] * 10)
    np.testing.assert_array_equal(found[10:], true[:-10])
    assert ages == [*range(10), *[10] * 30]


def test_a_delay_changes_no_measurement() -> None:
    """Noise and sampling belong to the time of the measurement."""
    noisy: dict[str, Any] = {"position_noise": 0.3, "heading_noise": 0.01, "velocity_noise": 0.1, "position_rate_hz": 5.0}
    _, prompt, _ = odometry(SensorParameters(**noisy))
    _, late, _ = odometry(SensorParameters(**noisy, delay=0.2))
    np.testing.assert_array_equal(late[10:], prompt[:-10])


def test_after_a_reset_odometry_is_of_the_new_start() -> None:
    plant = Simulator(PlantParameters(sensors=SensorParameters(delay=0.2)), PERIOD)
    first = plant.measured(0)
    for k in range(1, 30):
        plant.advance(plant.applied((9e4, 6e5)), plant.disturbance(k * PERIOD))
        plant.measured(GRID.stamp(k))
    plant.reset()
    assert (plant.measured(GRID.stamp(30)), plant.periods_late) == (first, 0)
