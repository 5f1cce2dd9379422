from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, WrenchStamped
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.core.kinematics import as_published
from vessel_hsmc_ros.guidance.programs import ReferenceShip, VirtualShipParameters
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode

STEP = 10_000_000


@pytest.fixture
def clock(bench: Any) -> Any:
    """Publishes /clock, and advertises the command topic, so that the node starts: it waits for a controller."""
    bench.publisher(WrenchStamped, "cmd_wrench")
    publisher = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK)
    return lambda stamp: publisher.publish(Clock(clock=conv.time_message(stamp)))


def stamps(messages: Any) -> Any:
    return [conv.nanoseconds(m.header.stamp) for m in messages]


def test_the_reference_is_published_one_period_ahead_of_the_clock(bench: Any, clock: Any) -> None:
    references, poses = bench.collect(ReferenceState, "reference"), bench.collect(PoseStamped, "reference/pose")
    bench.start(ReferenceShipNode)
    bench.until(lambda: stamps(references) == [0])
    clock(0)
    bench.until(lambda: stamps(references) == [0, STEP])
    clock(STEP)
    bench.until(lambda: stamps(poses) == [0, STEP, 2 * STEP])


def test_a_late_start_catches_up_with_every_period(bench: Any, clock: Any) -> None:
    references = bench.collect(ReferenceState, "reference")
    clock(5 * STEP)
    bench.start(ReferenceShipNode)
    bench.until(lambda: stamps(references) == [k * STEP for k in range(7)])


def test_the_published_reference_is_the_motion_of_the_virtual_ship(bench: Any, clock: Any) -> None:
    references, poses = bench.collect(ReferenceState, "reference"), bench.collect(PoseStamped, "reference/pose")
    bench.start(ReferenceShipNode)
    clock(300 * STEP)
    bench.until(lambda: len(references) == len(poses) == 302)
    ship = ReferenceShip(VirtualShipParameters(), 0.01)
    for reference, pose in zip(references, poses, strict=True):
        state, acceleration = conv.read_reference(reference)
        np.testing.assert_array_equal(state, as_published(ship.state))
        np.testing.assert_array_equal(acceleration, ship.acceleration())
        assert pose.pose == reference.pose
        ship.advance()


def test_in_real_time_the_reference_is_published_at_its_own_rate(bench: Any, simulated_time: Any) -> None:
    references = bench.collect(ReferenceState, "reference", qos.STREAM)
    node = bench.start(ReferenceShipNode, lockstep=False, use_sim_time=True, rate_hz=50.0)
    bench.until(lambda: node.connected and bench.probe.count_publishers("/reference"))
    bench.until(lambda: next(p for p in node.publishers if p.topic_name == "/reference").get_subscription_count())
    simulated_time.run(0.5)
    assert set(np.diff(stamps(references))) == {2 * STEP}
    assert len(references) in (24, 25, 26)


def test_a_changed_input_drives_the_virtual_ship_from_the_next_period_on(bench: Any, clock: Any) -> None:
    references = bench.collect(ReferenceState, "reference")
    bench.start(ReferenceShipNode, yaw_moment=0.0)
    bench.until(lambda: len(references) == 1)
    assert bench.set_parameters("reference_ship", surge_force=2e5, yaw_moment=1e6).successful
    clock(STEP)
    bench.until(lambda: len(references) == 3)
    surge = [m.acceleration.linear.x for m in references]
    yaw = [m.acceleration.angular.z for m in references]
    assert surge[1] == pytest.approx(2.0 * surge[0], rel=0.01)
    assert yaw[0] == 0.0 < yaw[1]
    assert references[1].twist.linear.x == pytest.approx(0.01 * surge[0], rel=0.01)


def test_inputs_cannot_be_changed_in_modes_without_a_virtual_ship(bench: Any, clock: Any) -> None:
    bench.start(ReferenceShipNode, mode="goal")
    result = bench.set_parameters("reference_ship", surge_force=2e5)
    assert not result.successful
    assert result.reason == "surge_force is not in use: mode is not virtual_ship"


def test_reset_returns_the_virtual_ship_to_its_start_without_resetting_time(bench: Any, clock: Any) -> None:
    references = bench.collect(ReferenceState, "reference")
    bench.start(ReferenceShipNode)
    clock(100 * STEP)
    bench.until(lambda: len(references) == 102)
    assert bench.call(Trigger, "/reference_ship/reset", Trigger.Request()).success
    clock(101 * STEP)
    bench.until(lambda: len(references) == 103)
    assert stamps(references)[-1] == 102 * STEP
    assert references[-1].pose.position.x == pytest.approx(15.0, abs=1e-3)
