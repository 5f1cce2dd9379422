"""The comparison of velocities and positions, as part of the control loop."""

import math
from typing import Any

import pytest

from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.parameters import ControllerParameters

PERIOD = 50_000_000


def sail(seconds: float, velocity: tuple[float, float], **parameters: Any) -> tuple[Any, list[Reason]]:
    """A loop fed with a ship that sails to the north-east at 2 m/s, with a velocity as measured."""
    loop = make_control_loop(ControllerParameters(law="guided", rate_hz=20.0, **parameters))
    along, reasons = 2.0 * math.sqrt(0.5), []
    for k in range(round(seconds * 20)):
        x = along * k / 20.0
        desired = Motion(x, x, 0.25 * math.pi, 2.0, 0.0, 0.0)
        loop.step(k * PERIOD, desired._replace(u=velocity[0], v=velocity[1]), desired, Acceleration(0.0, 0.0, 0.0))
        reasons.append(loop.supervision.reason)
    return loop, reasons


@pytest.mark.parametrize("velocity", [(math.sqrt(2.0), math.sqrt(2.0)), (0.0, 0.0)])
def test_velocities_in_the_frame_of_the_pose_lead_to_the_safe_action(velocity: tuple[float, float]) -> None:
    loop, reasons = sail(12.0, velocity)
    assert (loop.supervision.operation, reasons[-1]) == (Operation.SAFE, Reason.VELOCITY)
    assert reasons.index(Reason.VELOCITY) / 20.0 <= 10.5
    loop.forget()
    assert not any(monitor.detail for monitor in loop.watch.monitors)


def test_velocities_along_the_hull_lead_to_none() -> None:
    _, reasons = sail(12.0, (2.0, 0.0))
    assert Reason.VELOCITY not in reasons


def test_velocities_that_an_observer_does_not_take_are_not_compared() -> None:
    _, reasons = sail(12.0, (0.0, 0.0), observer=ObserverParameters(enabled=True))
    assert Reason.VELOCITY not in reasons
