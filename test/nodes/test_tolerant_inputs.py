"""Inputs as other programs publish them: best effort, in `map`, with the twist in the frame of the pose, without covariance."""

import math
from typing import Any

import numpy as np
import pytest
from driving import REFERENCE, RealTimePlant
from durations import rest_long
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from std_srvs.srv import SetBool
from vessel_hsmc_msgs.msg import ControlState, ReferenceState

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import as_motion, in_body_frame
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.base import WARN
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.controller_inputs import read_odometry
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.scenario.parameter_groups import OdometryParameters
from vessel_hsmc_ros.scenario.parameters import ControllerParameters


@pytest.fixture
def sea(bench: Any, simulated_time: Any) -> RealTimePlant:
    return RealTimePlant(bench, simulated_time)


def in_frame(publisher: Any, monkeypatch: pytest.MonkeyPatch, frame: str) -> None:
    send = type(publisher).publish

    def publish(message: Any) -> None:
        message.header.frame_id = frame
        send(publisher, message)

    monkeypatch.setattr(publisher, "publish", publish)


def test_a_law_commands_on_best_effort_odometry_in_map_without_covariance(
    bench: Any, sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.probe.destroy_publisher(sea.odometry)
    sea.odometry = bench.probe.create_publisher(Odometry, "odom", qos_profile_sensor_data)
    in_frame(sea.odometry, monkeypatch, "map")
    sea.start(ControllerNode, law="guided", safety__freshness__covariance_limit=1.0)
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.ACTIVE
    assert any(sea.wrenches()[-1])


def test_odometry_that_changes_between_accepted_frames_is_refused(sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch) -> None:
    node = sea.start(ControllerNode, law="guided", input_timeout=0.1)
    sea.run(0.2)
    in_frame(sea.odometry, monkeypatch, "map")
    sea.run(0.3)
    assert (sea.states[-1].operation, sea.states[-1].reason) == (ControlState.SAFE, ControlState.WRONG_FRAME)
    assert "must be in frame 'odom' and 'base_link' as before (got 'map' and 'base_link')" in node.status()[1]
    assert "frames_checked: false" in node.status()[1]


@pytest.mark.parametrize(("odometry", "reference", "operation"), [("odom", "map", "STANDBY"), ("map", "map", "ACTIVE")])
def test_a_reference_to_a_goal_in_another_frame_than_the_odometry_is_refused(
    sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch, odometry: str, reference: str, operation: str
) -> None:
    in_frame(sea.odometry, monkeypatch, odometry)
    in_frame(sea.reference, monkeypatch, reference)
    node = sea.start(ControllerNode, law="guided")
    sea.run(0.3)
    assert sea.states[-1].operation == getattr(ControlState, operation)
    assert ("(got 'map')" in node.status()[1]) == (operation == "STANDBY")


@pytest.mark.parametrize("psi", [0.0, 0.5, -2.0, math.pi])
def test_velocities_in_the_frame_of_the_pose_are_resolved_along_the_hull(psi: float) -> None:
    message, velocity = conv.new_odometry(), np.array([math.cos(psi), math.sin(psi)])
    conv.write_odometry(message, conv.time_message(0), np.array([1.0, 2.0, psi, *(0.7 * velocity), 0.1]))
    motion = read_odometry(message, "parent").motion
    assert motion == pytest.approx((1.0, 2.0, psi, 0.7, 0.0, 0.1), abs=1e-12)
    assert in_body_frame(as_motion((0.0, 0.0, 0.5 * math.pi, -1.0, 0.0, 0.0))) == pytest.approx((0, 0, 0.5 * math.pi, 0, 1, 0))


def test_an_incompatible_publisher_is_named_until_it_has_left(bench: Any) -> None:
    reliable = {"qos_overrides./odom.subscription.reliability": "reliable"}
    node = bench.start(ControllerNode, lockstep=False, law="guided", **reliable)
    publisher = bench.probe.create_publisher(Odometry, "odom", qos_profile_sensor_data)
    level, text = bench.until(lambda: (w := node._overall(node.diagnostic_tasks()[0])).message.count("/odom: nothing") and w[1:3])
    assert level == WARN
    assert "publisher of probe, because their reliability is not compatible" in text
    assert "qos_overrides./odom.subscription.reliability" in text
    refused = bench.call(SetBool, "controller/enable", SetBool.Request(data=True))
    assert "odometry on /odom: never received; /odom: nothing passes" in refused.message
    bench.probe.destroy_publisher(publisher)
    bench.until(lambda: not node.compatibility.problem())


def test_a_reader_that_requests_what_the_controller_does_not_offer_is_named(bench: Any) -> None:
    node = bench.start(ControllerNode, lockstep=False, law="guided")
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    bench.probe.create_subscription(ControlState, "controller/state", print, latched)
    text = bench.until(node.compatibility.problem)
    assert text.startswith("/controller/state: nothing passes between this publisher and the subscription of probe")


@pytest.mark.parametrize(
    ("policy", "value", "allowed"),
    [
        ("reliability", "fast", "one of reliable, best_effort"),
        ("depth", 0, "an integer of at least 1"),
        ("speed", 1, "a policy"),
    ],
)
def test_an_override_that_no_policy_has_is_an_error_with_the_allowed_values(
    bench: Any, policy: str, value: object, allowed: str
) -> None:
    with pytest.raises(ParameterError, match=allowed):
        bench.start(ControllerNode, lockstep=False, **{f"qos_overrides./odom.subscription.{policy}": value})


def test_a_goal_in_map_is_taken_and_its_frame_is_that_of_the_reference(bench: Any) -> None:
    references = bench.collect(ReferenceState, "reference")
    goals = bench.publisher(PoseStamped, "goal_pose", lockstep=False)
    bench.start(ReferenceShipNode, lockstep=False, mode="goal")
    bench.until(lambda: references and goals.get_subscription_count())
    assert references[-1].header.frame_id == "odom"
    goal = conv.new_pose()
    goal.header.frame_id = "map"
    conv.write_pose(goal.pose, as_motion(REFERENCE))
    goals.publish(goal)
    bench.until(lambda: references[-1].header.frame_id == "map")


@pytest.mark.long
def test_a_twist_that_is_not_filled_in_is_named_on_the_log_and_ends_in_the_safe_action(
    sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    node = sea.start(ControllerNode, law="pd", safety__monitors__velocity_warning=0.1, safety__monitors__velocity_safe=0.2)
    monkeypatch.setattr(sea, "send_odometry", at_two_metres_per_second(sea))
    sea.run(6.5)
    assert (sea.states[-1].operation, sea.states[-1].reason) == (ControlState.SAFE, ControlState.VELOCITY)
    assert "is the twist not filled in? observer.enabled" in capfd.readouterr().err
    assert any("not filled in" in task.message for task in node.diagnostic_tasks() if task.name == "monitors")


def at_two_metres_per_second(sea: RealTimePlant) -> Any:
    """Odometry of a ship that moves, with a twist of zeros."""
    send = sea.send_odometry
    return lambda stamp, _: send(stamp, [2e-9 * stamp, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("form", "kind"), rest_long([("pose_twist", PoseStamped), ("pose_covariance_twist", PoseWithCovarianceStamped)])
)
@pytest.mark.parametrize("pose_first", rest_long([True, False]))
def test_a_pose_and_a_twist_of_one_stamp_make_a_measurement_in_either_order(
    bench: Any, sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch, form: str, kind: Any, pose_first: bool
) -> None:
    poses = bench.probe.create_publisher(kind, "pose", qos_profile_sensor_data)
    twists = bench.probe.create_publisher(TwistStamped, "twist", qos_profile_sensor_data)

    def send(stamp: int, state: Any) -> None:
        pose, twist = kind(), TwistStamped()
        pose.header.stamp = twist.header.stamp = conv.time_message(stamp)
        pose.header.frame_id = "map"
        conv.write_pose(pose.pose if form == "pose_twist" else pose.pose.pose, state)
        twist.twist.linear.x, twist.twist.linear.y, twist.twist.angular.z = 1e-9 * stamp, *map(float, state[4:])
        for publisher, message in ((poses, pose), (twists, twist))[:: 1 if pose_first else -1]:
            publisher.publish(message)

    monkeypatch.setattr(sea, "send_odometry", send)
    node = bench.start(ControllerNode, lockstep=False, use_sim_time=True, law="guided", odometry__form=form)
    bench.until(lambda: poses.get_subscription_count() and twists.get_subscription_count() and node.connected)
    bench.until(lambda: sea.reference.get_subscription_count())
    sea.run(0.5)
    stamp, motion = node.inputs._measured
    assert sea.states[-1].operation == ControlState.ACTIVE
    assert motion.u == pytest.approx(1e-9 * stamp, abs=1e-9), "the twist of the same stamp"


def test_a_pose_without_a_twist_is_named_and_no_measurement(
    bench: Any, sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    poses = bench.probe.create_publisher(PoseStamped, "pose", 10)

    def send(stamp: int, state: Any) -> None:
        pose = conv.new_pose()
        conv.write_pose_stamped(pose, conv.time_message(stamp), state)
        poses.publish(pose)

    monkeypatch.setattr(sea, "send_odometry", send)
    bench.start(ControllerNode, lockstep=False, use_sim_time=True, law="guided", odometry__form="pose_twist")
    bench.until(lambda: poses.get_subscription_count() and sea.reference.get_subscription_count())
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.STANDBY
    assert "pose without a twist of its time on /twist, within 0.5 s, is ignored" in capfd.readouterr().err


def test_a_pose_and_a_twist_are_for_real_time(bench: Any) -> None:
    with pytest.raises(ParameterError, match="must be odometry in lockstep"):
        ControllerParameters(lockstep=True, odometry=OdometryParameters(form="pose_twist"))
