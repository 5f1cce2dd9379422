"""What the controller commands, and the reason that it gives, when its clock is stepped."""

import math
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from driving import REFERENCE, STATE, RealTimePlant
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.nodes import controller_timing
from vessel_hsmc_ros.nodes.controller import ControllerNode

SECOND = 1_000_000_000
BACK, AHEAD = ControlState.CLOCK_BACKWARD, ControlState.CLOCK_AHEAD
STEPS = [(-5 * SECOND, BACK), (5 * SECOND, AHEAD), (3600 * SECOND, AHEAD)]


@pytest.fixture
def sea(bench: Any, simulated_time: Any) -> RealTimePlant:
    return RealTimePlant(bench, simulated_time)


def reasons(states: list[Any]) -> list[int]:
    """The reasons of the safe action, each once, in their order."""
    return list(dict.fromkeys(state.reason for state in states if state.operation == ControlState.SAFE))


@pytest.mark.parametrize(("step", "reason"), STEPS)
def test_a_step_of_the_simulated_clock_is_the_reason_of_the_safe_action(
    sea: RealTimePlant, simulated_time: Any, step: int, reason: int
) -> None:
    simulated_time.now = 10 * SECOND
    sea.start(ControllerNode, law="guided", input_timeout=0.1)
    sea.run(0.3)
    sea.states.clear()
    simulated_time.jump(step)
    sea.run(0.3)
    assert reasons(sea.states) == [reason, ControlState.NOT_READY]
    assert sea.states[-1].operation == ControlState.ACTIVE
    assert sea.states[-1].missed_periods == 0


@pytest.mark.parametrize(("step", "reason"), STEPS[:2])
def test_after_a_step_of_the_clock_odometry_of_another_place_is_taken_at_once(
    sea: RealTimePlant, simulated_time: Any, step: int, reason: int
) -> None:
    """As of a simulation that begins anew: between the two places lies no motion of a ship."""
    simulated_time.now = 10 * SECOND
    node = sea.start(ControllerNode, law="guided", input_timeout=0.1)
    sea.run(0.3)
    assert sea.state is not None
    sea.state = sea.state + np.array([500.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    sea.states.clear()
    simulated_time.jump(step)
    sea.run(0.1)
    first = next(state for state in sea.states if math.isfinite(state.surge_error))
    assert abs(first.surge_error) > 400.0
    assert "jumped" not in node.inputs.diagnostic_tasks()[0].message


@pytest.mark.parametrize(("step", "forgets"), [(-5 * SECOND, True), (5 * SECOND, False)])
def test_a_clock_that_is_set_back_clears_what_the_law_has_learned(
    sea: RealTimePlant, simulated_time: Any, step: int, forgets: bool
) -> None:
    simulated_time.now = 10 * SECOND
    sea.start(ControllerNode, law="guided", input_timeout=0.1)
    sea.run(0.5)
    learned = abs(sea.states[-1].yaw_estimate)
    sea.states.clear()
    simulated_time.jump(step)
    sea.run(0.05)
    first = next(state for state in sea.states if math.isfinite(state.yaw_surface))
    assert learned > 0.0
    assert (abs(first.yaw_estimate) < 0.2 * learned) == forgets


def test_after_a_clock_that_is_set_back_the_observer_estimates_from_the_new_samples(
    sea: RealTimePlant, simulated_time: Any
) -> None:
    simulated_time.now = 10 * SECOND
    node = sea.start(ControllerNode, law="guided", input_timeout=0.1, observer__enabled=True)
    sea.run(0.3)
    assert sea.state is not None
    sea.state = sea.state + np.array([500.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    simulated_time.jump(-5 * SECOND)
    sea.run(0.2)
    assert node.loop.estimate.x == pytest.approx(sea.state[0], abs=1.0)


def test_the_reason_of_a_clock_that_jumped_is_given_until_there_are_new_inputs(sea: RealTimePlant, simulated_time: Any) -> None:
    simulated_time.now = 10 * SECOND
    sea.start(ControllerNode, law="guided", input_timeout=0.1)
    sea.run(0.3)
    sea.states.clear()
    sea.reference_age = sea.odometry_age = 5 * SECOND  # the other nodes keep their time
    simulated_time.jump(5 * SECOND)
    sea.run(0.5)
    assert reasons(sea.states) == [AHEAD]


def test_a_simulated_clock_that_stands_still_is_reported_until_it_goes_on(
    bench: Any, sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(controller_timing, "STANDSTILL", 0.5)
    node = sea.start(ControllerNode, law="guided")
    sea.run(0.3)
    bench.until(lambda: node.status()[:2] == (DiagnosticStatus.WARN, controller_timing.STANDING))

    def goes_on() -> bool:
        sea.run(0.01)
        return not node.clock_problem

    bench.until(goes_on)
    assert sea.states[-1].operation == ControlState.ACTIVE


@pytest.mark.parametrize(("step", "reason"), STEPS)
def test_a_step_of_the_system_clock_is_the_reason_of_the_safe_action(
    bench: Any, monkeypatch: pytest.MonkeyPatch, step: int, reason: int
) -> None:
    sea = RealTimePlant(bench, None)
    node = bench.start(ControllerNode, lockstep=False, law="guided", input_timeout=5.0)
    system, offset = node.now, [0]
    monkeypatch.setattr(node, "now", lambda: system() + offset[0])

    def publish() -> None:
        sea.send_reference(node.now(), REFERENCE)
        sea.send_odometry(node.now(), STATE)

    timer = bench.probe.create_timer(0.02, publish)
    bench.until(lambda: sea.states and sea.states[-1].operation == ControlState.ACTIVE)
    timer.cancel()  # new inputs would end the safe action, on a busy machine before the first period
    sea.states.clear()
    offset[0] = step
    bench.until(lambda: reasons(sea.states))
    assert reasons(sea.states)[0] == reason
    assert node.status()[0] == (DiagnosticStatus.WARN if reason == BACK else DiagnosticStatus.ERROR)
    timer.reset()
    bench.until(lambda: sea.states[-1].operation == ControlState.ACTIVE)


def test_a_later_fault_has_its_own_reason_and_not_that_of_the_step_of_the_clock(sea: RealTimePlant, simulated_time: Any) -> None:
    simulated_time.now = 10 * SECOND
    sea.start(ControllerNode, law="guided", input_timeout=0.1)
    sea.run(0.3)
    simulated_time.jump(-5 * SECOND)
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.ACTIVE
    sea.state = None
    sea.states.clear()
    sea.run(0.3)
    assert reasons(sea.states) == [ControlState.OVERDUE]
