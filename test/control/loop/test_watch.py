"""The monitors as the control loop feeds them, with the observer whose rejections they count."""

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop, Watch
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.control.safety.monitors import Alarm
from vessel_hsmc_ros.control.safety.parameters import MonitorParameters, Operation, Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.supervision import Authority, Supervision
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.timing import RateGrid

PERIOD = 100_000_000
STILL, NONE = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0)
LIMITS = (2e5, 3e6)


@pytest.fixture
def loop() -> ControlLoop:
    watch = Watch(MonitorParameters(innovation_warning=0.5, innovation_safe=1.0), LIMITS, 32.0)
    supervision = Supervision(SafetyParameters(), Authority(LIMITS, (1.2e5, 6.36e7)))
    observer = Observer(ObserverParameters(), KnownVessel())
    return ControlLoop(make_controller("pd", 0.1), RateGrid(10.0), observer, supervision=supervision, watch=watch)


def sail(loop: ControlLoop, periods: range, spread: float) -> list[Reason]:
    """The reasons of the periods in which the measured position has a deviation, m, from the ship's, which lies still."""
    random, reasons = np.random.default_rng(7), []
    for k in periods:
        x, y = spread * random.normal(size=2)
        loop.step(k * PERIOD, Motion(x, y, 0.0, 0.0, 0.0, 0.0), STILL, NONE)
        reasons.append(loop.supervision.reason)
    return reasons


def test_an_observer_that_takes_its_measurements_gives_no_alarm(loop: ControlLoop) -> None:
    assert loop.watch is not None
    assert set(sail(loop, range(100), 0.5)) == {Reason.NONE}
    assert {monitor.alarm for monitor in loop.watch.monitors} == {Alarm.OK}


def test_an_observer_that_rejects_its_measurements_leads_to_the_safe_action_after_the_time(loop: ControlLoop) -> None:
    sail(loop, range(50), 0.5)
    reasons = sail(loop, range(50, 65), 1e4)
    assert reasons.index(Reason.INNOVATION) == pytest.approx(10, abs=1)
    assert loop.supervision.operation is Operation.SAFE
    loop.forget()
    assert Reason.INNOVATION not in sail(loop, range(65, 72), 0.5), "what was forgotten gives no alarm"


@pytest.mark.parametrize(
    ("u", "v", "r", "stuck"), [(0.0, 0.5, 0.0, True), (0.0, 0.0, 0.1, True), (0.5, 0.0, 0.1, False), (0.5, 0.5, 0.0, True)]
)
def test_a_ship_moves_by_its_surge_speed_and_its_yaw_rate(u: float, v: float, r: float, stuck: bool) -> None:
    """Both actuators are at their limits; a drift sideways is no sign that either of them works."""
    watch = Watch(MonitorParameters(not_moving_warning=0.5, not_moving_safe=1.0), LIMITS, 32.0)
    motion = Motion(0.0, 0.0, 0.0, u, v, r)
    reasons = [watch.step(LIMITS, motion, None, 0.1, (k * PERIOD, motion)) for k in range(20)]
    assert (reasons[-1] is Reason.NOT_MOVING) is stuck


def test_of_several_reasons_the_most_important_is_given() -> None:
    watch = Watch(MonitorParameters(not_moving_safe=1.0, saturation_warning=0.5, saturation_safe=0.5), LIMITS, 32.0)
    reasons = [watch.step((LIMITS[0], 0.0), STILL, None, 0.1, (k * PERIOD, STILL)) for k in range(15)]
    assert [reason for reason in dict.fromkeys(reasons) if reason] == [Reason.SATURATED, Reason.NOT_MOVING]
