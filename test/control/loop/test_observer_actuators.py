"""The wrench on the hull as the observer computes it from the commands."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.actuators import dynamics
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters, actuated, actuators, no_commands

PERIOD = 50_000_000


def surge_forces(commands: list[float], **declared: Any) -> list[float]:
    """The surge force at the end of each period of 50 ms."""
    c = actuators(ObserverParameters(), KnownVessel(surge_force_limit=10.0, **declared))
    ring, applied, forces = no_commands(), (0.0, 0.0), []
    for k, command in enumerate(commands):
        applied = actuated(applied, k * PERIOD, (command, 0.0), 0.05, ring, c)
        forces.append(applied[0])
    return forces


def test_with_instant_actuators_the_limited_command_acts_at_once() -> None:
    assert surge_forces([4.0, 20.0, -20.0], **INSTANT) == [4.0, 10.0, -10.0]


def test_undeclared_actuators_have_the_lag_that_the_laws_assume() -> None:
    """A heading that follows commands at once would tell a law that identifies the actuators that they are instant."""
    lag = dynamics(KnownVessel(surge_force_limit=10.0)).surge.lag
    assert lag > 0.5
    assert surge_forces([4.0, 20.0]) == pytest.approx(surge_forces([4.0, 20.0], surge_lag=lag))


def test_a_command_takes_effect_after_the_dead_time() -> None:
    assert surge_forces([4.0, 4.0, 4.0, 5.0, 5.0], surge_dead_time=0.1) == [0.0, 0.0, 4.0, 4.0, 4.0]


def test_a_dead_time_longer_than_the_ring_takes_its_oldest_command() -> None:
    forces = surge_forces([float(k % 9) for k in range(1300)], surge_dead_time=1e3)
    assert forces[1023:] == pytest.approx([float((k - 1023) % 9) for k in range(1023, 1300)])


def test_the_rate_of_change_is_limited() -> None:
    assert surge_forces([10.0, 10.0, -10.0], surge_force_rate=20.0) == pytest.approx([1.0, 2.0, 1.0])


def test_a_lag_approaches_the_command_exponentially() -> None:
    assert surge_forces([5.0, 5.0], surge_lag=0.1) == pytest.approx([5.0 * (1.0 - math.exp(-0.5 * k)) for k in (1, 2)])


def test_each_input_has_its_own_dead_time_lag_and_rate() -> None:
    """The yaw moment of a ship is that of the surge force of one whose surge has the actuators of its yaw."""
    commands = [10.0, 10.0, 10.0, 10.0, -10.0, -10.0, -10.0, 3.0]
    surge: dict[str, Any] = {"surge_dead_time": 0.1, "surge_lag": 0.2, "surge_force_rate": 60.0}
    yaw: dict[str, Any] = {"surge_dead_time": 0.05, "surge_lag": 0.1, "surge_force_rate": 25.0}
    declared = surge | {"yaw_dead_time": 0.05, "yaw_lag": 0.1, "yaw_moment_rate": 25.0}
    c = actuators(ObserverParameters(), KnownVessel(surge_force_limit=10.0, yaw_moment_limit=10.0, **declared))
    ring, applied, found = no_commands(), (0.0, 0.0), []
    for k, command in enumerate(commands):
        applied = actuated(applied, k * PERIOD, (command, command), 0.05, ring, c)
        found.append(applied)
    for column, given in enumerate((surge, yaw)):
        assert [each[column] for each in found] == surge_forces(commands, **given)
    assert found[3][0] != found[3][1]


def test_the_lag_of_the_observer_overrides_those_of_the_vessel() -> None:
    c = actuators(ObserverParameters(actuator_lag=0.7), KnownVessel(surge_lag=0.1, yaw_lag=0.2))
    assert c.lag == (0.7, 0.7)


def test_a_known_dead_time_removes_the_error_that_it_causes() -> None:
    """A ship without damping whose surge force acts 0.5 s late, measured without noise."""
    errors = []
    for dead_time in (-1.0, 0.5):
        vessel = KnownVessel(surge_inertia=1e5, surge_dead_time=dead_time)
        observer = Observer(ObserverParameters(position_noise=0.3, surge_decay=0.0), vessel)
        forces = [1e5 * math.copysign(1.0, math.sin(0.5 * 0.05 * k)) for k in range(800)]
        x, u, error = 0.0, 0.0, []
        for k in range(800):
            estimate = observer.update(k * PERIOD, np.array([x, 0.0, 0.0]), (forces[k - 1], 0.0) if k else (0.0, 0.0))
            error.append(estimate.u - u)
            force = forces[k - 10] if k >= 10 else 0.0
            x, u = x + 0.05 * u + 0.5 * 0.0025 * force / 1e5, u + 0.05 * force / 1e5
        errors.append(float(np.std(error[200:])))
    assert errors[1] < 0.2 * errors[0]


def test_the_observer_follows_each_change_of_the_actuators_that_the_law_takes() -> None:
    declared, found = KnownVessel(), KnownVessel(yaw_lag=2.0, yaw_dead_time=1.0)
    observer = Observer(ObserverParameters(), declared)
    first = observer.constants.actuators
    for _ in range(2):
        observer.take_for(found)
        assert observer.constants.actuators == actuators(ObserverParameters(), found) != first
        observer.take_for(declared)
        assert observer.constants.actuators == first
