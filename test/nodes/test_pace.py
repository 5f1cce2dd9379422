"""The pace of a node in real time, on a clock that the tests set."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from driving import STEP
from rclpy.clock import Clock, ClockType
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.pace import CATCH_UP, Pace
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode

HOUR = 3600 * 10**9
BEGAN = 5 * 10**9


@pytest.fixture
def node() -> Any:
    """A node whose clock the test sets by `time`, ns."""
    made = SimpleNamespace(time=BEGAN, wall=Clock(clock_type=ClockType.STEADY_TIME), timers=[])
    made.now = lambda: made.time
    made.get_parameter = lambda _: SimpleNamespace(value=False)
    made.create_timer = lambda *arguments, **options: made.timers.append((arguments, options))
    return made


def paced(node: Any) -> Pace:
    pace = Pace(node, RateGrid(100.0))
    pace.run(lambda: None)
    return pace


def test_periods_are_due_at_their_instants_since_the_start(node: Any) -> None:
    pace = paced(node)
    node.time += 3 * STEP
    assert pace.due(0) == (3, "")
    assert pace.stamp(3) == node.time


def test_the_timer_is_not_stopped_by_a_system_clock_that_is_set_back(node: Any) -> None:
    paced(node)
    ((_, options),) = node.timers
    assert options["clock"].clock_type == ClockType.STEADY_TIME


@pytest.mark.parametrize("leap", [-HOUR, -STEP, HOUR, CATCH_UP + 1])
def test_after_a_step_of_the_clock_the_present_period_is_due_and_no_other(node: Any, leap: int) -> None:
    pace = paced(node)
    node.time += 7 * STEP
    pace.due(6)
    node.time += leap
    due, reason = pace.due(7)
    assert due == 7
    assert ("set back" in reason) == (leap < 0)
    assert pace.stamp(7) == node.time
    assert pace.moves == 1
    node.time += STEP
    assert pace.due(7) == (8, "")


def test_a_delay_that_is_short_is_caught_up_with(node: Any) -> None:
    pace = paced(node)
    node.time += CATCH_UP
    assert pace.due(0) == (100, "")


def test_a_pause_shifts_the_start_without_a_reason(node: Any) -> None:
    pace = paced(node)
    node.time += 10 * CATCH_UP
    pace.hold(3)
    assert pace.due(3) == (3, "")
    assert pace.moves == 0


@pytest.mark.parametrize("leap", [-HOUR, HOUR])
def test_the_reference_goes_on_where_it_was_after_a_step_of_the_clock(bench: Any, simulated_time: Any, leap: int) -> None:
    references = bench.collect(ReferenceState, "reference", qos.STREAM)
    node = bench.start(ReferenceShipNode, lockstep=False, use_sim_time=True)
    bench.until(lambda: node.connected and bench.probe.count_publishers("/reference"))
    bench.until(lambda: next(p for p in node.publishers if p.topic_name == "/reference").get_subscription_count())
    simulated_time.jump(2 * HOUR)
    simulated_time.run(0.1)
    count = len(references)
    simulated_time.jump(leap)
    simulated_time.run(0.1)
    later = references[count:]
    assert 8 <= len(later) <= 11
    assert conv.nanoseconds(later[-1].header.stamp) == pytest.approx(simulated_time.now, abs=2 * STEP)
    states = np.array([conv.read_reference(message)[0] for message in references])
    assert np.abs(np.diff(states[:, :2], axis=0)).max() < 0.1
