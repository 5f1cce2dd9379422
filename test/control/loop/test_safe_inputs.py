"""The safe action has the same inputs whatever began it: a law that is undefined, or a reason from outside."""

import math
from typing import Any

import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import Law, Terms
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop, Fallback
from vessel_hsmc_ros.control.safety.parameters import Operation, Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.supervision import BRAKING_TIME, Authority, Supervision
from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.timing import RateGrid

LIMITS, INERTIA, PERIOD = (2e5, 3e6), (1.2e5, 6.36e7), 0.1
SHIP, DESIRED = Motion(0.0, 1.0, 0.1, 0.8, -0.5, 0.01), Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
STILL = Acceleration(0.0, 0.0, 0.0)


class Sometimes(Law[None]):
    """A law that is defined only while `defined` is true."""

    name = "sometimes"
    defined = True

    def step(self, *_: object) -> tuple[tuple[float, float], Terms]:
        """Nothing, or the error."""
        if not self.defined:
            raise ControlError("undefined here")
        return (0.0, 0.0), Terms()


def commands(action: str, cause: str, periods: int = 12) -> list[tuple[float, float]]:
    law: Any = Sometimes(None, KnownVessel(), PERIOD)
    supervision = Supervision(SafetyParameters(action=action, ramp_time=0.1), Authority(LIMITS, INERTIA))
    loop = ControlLoop(law, RateGrid(10.0), supervision=supervision, fallback=Fallback(make_controller("los_pid", PERIOD)))
    loop.step(0, SHIP, DESIRED, STILL)
    law.defined, found = cause != "undefined", []
    for k in range(1, periods + 1):
        try:
            loop.step(k * 100_000_000, SHIP, DESIRED, STILL, reason=Reason.JUMP if cause == "reason" else Reason.NONE)
        except ControlError:
            assert cause == "undefined"
        assert supervision.operation is Operation.SAFE
        found.append(loop.wrench)
    return found


@pytest.mark.parametrize("cause", ["undefined", "reason"])
def test_the_brake_acts_against_surge_speed_and_yaw_rate(cause: str) -> None:
    expected = (-INERTIA[0] * SHIP.u / BRAKING_TIME, -INERTIA[1] * SHIP.r / BRAKING_TIME)
    assert commands("brake", cause)[-1] == pytest.approx(expected)


@pytest.mark.parametrize("cause", ["undefined", "reason"])
def test_the_fallback_law_steers_with_the_inputs_of_the_law_from_the_second_period_on(cause: str) -> None:
    first, *others = commands("fallback", cause)
    twin = make_controller("los_pid", PERIOD)
    assert first == (0.0, 0.0)
    wanted = [twin.step(SHIP, DESIRED, STILL)[0] for _ in others]
    assert others == [pytest.approx(each) for each in wanted]
    assert math.hypot(*wanted[-1]) > 1.0
