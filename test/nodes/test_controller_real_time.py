"""The controller in real time. The tests own the clock, so that every time-out and phase is exact to a tick of 2.5 ms."""

import math
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from driving import ACCELERATION, REFERENCE, STATE, STEP, RealTimePlant
from std_srvs.srv import SetBool
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.kinematics import extrapolate
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode

TICK = 2_500_000
TIMEOUT = 0.1
ORIGIN = np.zeros(6)


@pytest.fixture
def sea(bench: Any, simulated_time: Any) -> RealTimePlant:
    return RealTimePlant(bench, simulated_time)


@pytest.fixture
def status(bench: Any, simulated_time: Any) -> Any:
    """Makes a node publish its diagnostics, and returns them, where no clock stands still on a busy machine."""
    arrays = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)

    def latest(node: ControllerNode) -> DiagnosticStatus:
        if node.clock_problem:
            simulated_time.jump(simulated_time.TICK)
            bench.until(lambda: not node.clock_problem)
        count = len(arrays)
        node.publish_diagnostics()
        bench.until(lambda: len(arrays) > count)
        return arrays[-1].status[0]

    return latest


def test_the_law_runs_at_its_rate_half_a_period_after_the_odometry(sea: RealTimePlant) -> None:
    """A law that runs at the instant of the odometry would use the new message in one period and the old one in the next."""
    sea.start(ControllerNode)
    sea.run(0.3)
    stamps = np.array(sea.stamps())
    assert len(stamps) >= 25
    assert set(stamps % STEP) <= {STEP // 2, STEP // 2 + TICK}
    assert set(np.diff(stamps)) <= {STEP - TICK, STEP, STEP + TICK}
    assert all(any(wrench) for wrench in sea.wrenches())


@pytest.mark.parametrize("silent", ["odometry", "reference"])
def test_an_input_that_ends_makes_the_wrench_zero_after_the_timeout(sea: RealTimePlant, status: Any, silent: str) -> None:
    node = sea.start(ControllerNode, input_timeout=TIMEOUT, safety__action="zero")
    sea.run(0.1)
    if silent == "odometry":
        sea.state = None
    else:
        sea.desired = None
    sea.run(0.25)
    last = sea.last[silent]
    overdue = last + round(TIMEOUT * 1e9)
    assert overdue <= sea.first_zero_after(last) <= overdue + STEP + 2 * TICK
    assert not any(sea.wrenches()[-1])
    assert (status(node).level, status(node).message) == (
        DiagnosticStatus.ERROR,
        f"no {silent} for 0.1 s: the safe action is commanded",
    )
    sea.state, sea.desired = STATE, REFERENCE
    sea.run(0.1)
    assert any(sea.wrenches()[-1])


def test_an_input_whose_publisher_has_left_is_no_error(bench: Any, sea: RealTimePlant, status: Any) -> None:
    node = sea.start(ControllerNode, input_timeout=TIMEOUT, safety__action="zero")
    sea.run(0.2)
    sea.state = None
    bench.probe.destroy_publisher(sea.odometry)
    bench.until(lambda: not node.count_publishers("/odom"))
    sea.run(0.2)
    assert not any(sea.wrenches()[-1])
    assert status(node).level == DiagnosticStatus.WARN
    assert status(node).message == "no odometry: /odom no longer has a publisher; the safe action is commanded"


@pytest.mark.parametrize("number", [math.nan, math.inf])
@pytest.mark.parametrize("bad", ["odometry", "reference"])
def test_an_input_that_is_not_finite_is_reported_and_ignored(sea: RealTimePlant, status: Any, bad: str, number: float) -> None:
    node = sea.start(ControllerNode, input_timeout=TIMEOUT, safety__action="zero")
    sea.run(0.1)
    last = sea.last[bad]
    spoilt = np.array([number, *STATE[1:]])
    if bad == "odometry":
        sea.state = spoilt
    else:
        sea.desired = spoilt
    sea.run(0.05)
    assert f"{bad} must be finite numbers (got x = {number})" in status(node).message
    assert any(sea.wrenches()[-1]), "the law goes on with the last good input"
    sea.run(0.1)
    overdue = last + round(TIMEOUT * 1e9)
    assert overdue <= sea.first_zero_after(last) <= overdue + STEP + 2 * TICK
    assert all(np.isfinite(wrench).all() for wrench in sea.wrenches())
    assert "ignored" in status(node).message, "the reason is not hidden by the time-out that it leads to"
    sea.state, sea.desired = STATE, REFERENCE
    sea.run(0.1)
    assert any(sea.wrenches()[-1])


def test_where_the_law_has_no_value_the_safe_action_is_commanded(sea: RealTimePlant, status: Any) -> None:
    """The hierarchical law is singular at z1 = b/a, here 10 m, and refuses to step across."""
    sea.desired, sea.state = ORIGIN, np.array([50.0, *ORIGIN[1:]])
    node = sea.start(ControllerNode, law="hierarchical_printed", hierarchical_printed__sway_weight=10.0, safety__action="zero")
    sea.run(0.1)
    assert any(sea.wrenches()[-1])
    sea.state = np.array([9.0, *ORIGIN[1:]])
    sea.run(0.05)
    assert sea.wrenches()[-1] == (0.0, 0.0)
    assert (sea.states[-1].operation, sea.states[-1].reason) == (ControlState.SAFE, ControlState.LAW_UNDEFINED)
    assert status(node).level == DiagnosticStatus.ERROR
    assert status(node).message.endswith("the ship is at z1 = 9 m; the safe action is commanded")
    sea.state = np.array([50.0, *ORIGIN[1:]])
    sea.run(0.05)
    assert any(sea.wrenches()[-1])


def test_an_older_reference_is_extrapolated_to_the_time_of_the_odometry(sea: RealTimePlant) -> None:
    sea.reference_age = 20_000_000
    sea.start(ControllerNode, law="hierarchical_printed")
    sea.run(0.1)
    odometry, reference = conv.new_odometry(), conv.new_reference()
    conv.write_odometry(odometry, conv.time_message(0), STATE)
    conv.write_reference(reference, conv.time_message(0), REFERENCE, ACCELERATION)
    desired, acceleration = conv.read_reference(reference)
    law = make_controller("hierarchical_printed", 0.01)
    _, terms = law.update(0.0, conv.read_odometry(odometry), extrapolate(desired, acceleration, 0.02), acceleration)
    first = next(state for state in sea.states if math.isfinite(state.yaw_surface))
    np.testing.assert_allclose((first.yaw_surface, first.surge_error), (terms.yaw_surface, terms.surge_error), rtol=1e-9)


@pytest.mark.parametrize("late", [1, 3])
def test_the_law_learns_the_age_of_late_odometry_but_not_of_the_latest(
    sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch, late: int
) -> None:
    node, ages = sea.start(ControllerNode, law="guided"), []
    step = node.loop.step

    def noting(*inputs: Any) -> Any:
        ages.append(inputs[5])
        return step(*inputs)

    monkeypatch.setattr(node.loop, "step", noting)
    sea.run(0.1)
    assert {*ages} == {0.0}
    sea.odometry_age = late * STEP
    sea.run(0.05)
    ages.clear()
    sea.run(0.1)
    assert ages
    assert 0.01 * late < min(ages) <= max(ages) < 0.01 * (late + 2)


def test_missed_periods_are_counted_in_the_control_state(sea: RealTimePlant, simulated_time: Any) -> None:
    sea.start(ControllerNode)
    sea.run(0.3)
    assert sea.states[-1].missed_periods == 0
    simulated_time.jump(200_000_000)
    sea.run(0.02)
    assert sea.states[-1].missed_periods in (19, 20)


def test_periods_without_odometry_as_during_a_pause_are_not_missed(sea: RealTimePlant) -> None:
    sea.start(ControllerNode, input_timeout=TIMEOUT, safety__action="zero")
    sea.run(0.1)
    sea.state = None
    sea.run(0.4)
    assert not any(sea.wrenches()[-1])
    sea.state = STATE
    sea.run(0.1)
    assert any(sea.wrenches()[-1])
    assert sea.states[-1].missed_periods == 0


@pytest.mark.long
def test_a_controller_without_a_reference_warns_and_names_the_topic(bench: Any, sea: RealTimePlant, status: Any) -> None:
    node = sea.start(ControllerNode)
    sea.desired = None
    sea.run(0.05)
    bench.until(lambda: status(node).message == "waiting for reference on /reference")
    assert status(node).level == DiagnosticStatus.WARN
    assert sea.commands == []
    sea.desired = REFERENCE
    sea.run(0.05)
    bench.until(lambda: status(node).message == "running")


def test_the_wrench_is_zero_while_the_controller_is_disabled(bench: Any, sea: RealTimePlant) -> None:
    sea.start(ControllerNode)
    sea.run(0.1)
    for enabled in (False, True):
        assert bench.call(SetBool, "/controller/enable", SetBool.Request(data=enabled)).success
        sea.run(0.05)
        assert any(sea.wrenches()[-1]) is enabled


def test_on_the_wall_clock_commands_are_stamped_with_it(bench: Any) -> None:
    plant = RealTimePlant(bench, None)

    def now() -> int:
        return int(bench.probe.get_clock().now().nanoseconds)

    def send() -> None:
        plant.send_reference(now())
        plant.send_odometry(now())

    bench.probe.create_timer(0.01, send)
    began = now()
    bench.start(ControllerNode, lockstep=False)
    bench.until(lambda: len(plant.commands) > 10 and any(plant.wrenches()[-1]))
    assert all(began < stamp <= now() for stamp in plant.stamps())
