"""Goals and paths from other nodes, over DDS: followed without a jump, or refused with a reason."""

import math
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, WrenchStamped
from nav_msgs.msg import Path
from rclpy.duration import Duration
from rosgraph_msgs.msg import Clock
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode

RATE_HZ, STEP = 20.0, 50_000_000
DEADLINE = 20.0
START = [0.0, 0.0, math.radians(170.0)]


class Follower:
    """A reference-ship node in lockstep with a clock that the test controls, and publishers of goals and paths."""

    def __init__(self, bench: Any) -> None:
        self.bench = bench
        self.clock = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK)
        self.goals = bench.probe.create_publisher(PoseStamped, "goal_pose", 10)
        self.paths = bench.probe.create_publisher(Path, "path", 10)
        self.steering = bench.publisher(WrenchStamped, "cmd_wrench")  # the node waits for a controller
        self.references = bench.collect(ReferenceState, "reference")
        self.statuses = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)

    def start(self, mode: Any, **more: Any) -> Any:
        node = self.bench.start(ReferenceShipNode, mode=mode, initial_pose=START, rate_hz=RATE_HZ, **more)
        publisher = self.goals if mode == "goal" else self.paths
        self.bench.until(lambda: publisher.get_subscription_count() and self.references)
        return node

    def advance(self, seconds: float) -> Any:
        """Advance the clock; returns the states and accelerations published so far, (n, 6) and (n, 3)."""
        for _ in range(round(seconds * RATE_HZ)):
            count = len(self.references) + 1
            self.clock.publish(Clock(clock=conv.time_message((count - 2) * STEP)))
            self.bench.until(lambda count=count: len(self.references) == count)
        read = [conv.read_reference(message) for message in self.references]
        return np.array([state for state, _ in read]), np.array([acceleration for _, acceleration in read])

    def problems(self) -> Any:
        return [s.message for array in self.statuses for s in array.status if s.level == DiagnosticStatus.WARN]

    def send(self, message: PoseStamped | Path) -> None:
        """Publish a goal or a path; returns when it is in the node's queue, where the next spin finds it."""
        publisher = self.goals if isinstance(message, PoseStamped) else self.paths
        publisher.publish(message)
        assert publisher.wait_for_all_acked(Duration(seconds=DEADLINE))

    def until_refused(self, node: Any, reason: str) -> None:
        """Wait until the node's diagnostics report a refusal."""

        def refused() -> bool:
            node.publish_diagnostics()
            return any(reason in problem for problem in self.problems())

        self.bench.until(refused)


@pytest.fixture
def follower(bench: Any) -> Any:
    return Follower(bench)


def pose(x: float, y: float, psi: float, frame: str = "odom", stamp: int = 0) -> Any:
    message = PoseStamped()
    message.header.frame_id, message.header.stamp = frame, conv.time_message(stamp)
    conv.write_pose(message.pose, np.array([x, y, psi]))
    return message


def path(*points: Any, frame: str = "odom") -> Any:
    message = Path()
    message.header.frame_id = frame
    message.poses = [pose(x, y, 0.0, frame="") for x, y in points]
    return message


def assert_continuous(states: Any, accelerations: Any) -> Any:
    steps = np.abs(np.diff(states, axis=0))
    turned = np.minimum(steps[:, 2], 2.0 * math.pi - steps[:, 2])
    assert np.hypot(steps[:, 0], steps[:, 1]).max() < 1.05 * 1.5 * 0.05
    assert turned.max() < 1.05 * 0.1 * 0.05
    assert steps[:, 3:].max() < 1.05 * 0.2 * 0.05
    assert np.abs(np.diff(accelerations, axis=0)).max() < 0.06  # 0.2 m/s² in 0.4 s, and back


def test_a_goal_is_approached_through_half_a_turn_without_a_jump(bench: Any, follower: Any) -> None:
    follower.start("goal")
    follower.send(pose(-15.0, -3.0, math.radians(-170.0)))
    states, accelerations = follower.advance(60.0)
    assert_continuous(states, accelerations)
    assert math.dist(states[-1, :2], (-15.0, -3.0)) < 0.06
    assert states[:, 2].min() < -3.0 < 3.0 < states[:, 2].max()  # it went through 180 degrees
    assert np.abs(states[:, 2]).min() > 1.5  # and not the long way round


def test_a_stream_of_stamped_poses_is_followed(bench: Any, follower: Any) -> None:
    follower.start("goal")
    for k in range(40):  # a goal that moves at 1 m/s
        follower.send(pose(-0.5 * k, 0.0, math.pi, stamp=1 + k * 500_000_000))
        states, accelerations = follower.advance(0.5)
    assert_continuous(states, accelerations)
    assert states[-1, 3] == pytest.approx(1.0, rel=0.05)
    assert abs(states[-1, 0] - -20.0) < 1.5


def test_a_path_is_followed_without_a_jump(bench: Any, follower: Any) -> None:
    follower.start("path")
    follower.send(path((-20.0, 3.0), (-20.0, 30.0)))
    states, accelerations = follower.advance(80.0)
    assert_continuous(states, accelerations)
    assert math.dist(states[-1, :2], (-20.0, 30.0)) < 0.06
    assert np.hypot(states[:, 0] + 20.0, states[:, 1] - 3.0).min() < 6.0


def test_a_goal_or_path_outside_of_the_fence_is_refused_with_its_leg(bench: Any, follower: Any) -> None:
    square = [-30.0, -30.0, 30.0, -30.0, 30.0, 30.0, -30.0, 30.0, -30.0, -30.0]
    for mode, message in (("goal", pose(-40.0, 0.0, 0.0)), ("path", path((-20.0, 0.0), (-20.0, 45.0)))):
        node = follower.start(mode, fence__inside=square)
        follower.send(message)
        follower.until_refused(
            node, f"{mode} must stay within reference_ship.fence (got one whose leg {1 + (mode == 'path')} leaves"
        )
        bench.stop(node)
        follower.references.clear()


def broken(message: Any, **numbers: Any) -> Any:
    for name, value in numbers.items():
        *parts, last = name.split("__")
        target = message
        for part in parts:
            target = getattr(target, part)
        setattr(target, last, value)
    return message


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (broken(pose(1.0, 1.0, 0.0), pose__position__x=math.nan), "goal must be finite numbers (got x = nan)"),
        (broken(pose(1.0, 1.0, 0.0), pose__orientation__w=math.inf), "goal must be finite numbers (got orientation.w = inf)"),
        (
            broken(pose(1.0, 1.0, 0.0), pose__orientation__w=0.0),
            "orientation of the goal must be a quaternion of length 1 (got length 0)",
        ),
        (pose(1.0, 1.0, 0.0, frame="earth"), "goal must be in frame odom or map (got 'earth')"),
        (path(), "a path must have at least one pose"),
        (path((1.0, 1.0), frame="base_link"), "path must be in frame odom or map (got 'base_link')"),
        (path((1.0, 1.0), (math.nan, 2.0)), "pose 1 of the path must be finite numbers (got x = nan)"),
    ],
)
def test_a_goal_or_path_that_cannot_be_followed_is_refused_with_the_reason(
    bench: Any, follower: Any, message: Any, reason: str
) -> None:
    node = follower.start("goal" if isinstance(message, PoseStamped) else "path")
    follower.send(message)
    follower.until_refused(node, reason)
    states, _ = follower.advance(0.5)
    np.testing.assert_allclose(states, np.tile([*START, 0.0, 0.0, 0.0], (len(states), 1)), atol=1e-12)


def test_with_a_frame_prefix_a_goal_is_taken_in_the_frame_of_the_vessel(bench: Any, follower: Any) -> None:
    bench.start(ReferenceShipNode, mode="goal", initial_pose=START, rate_hz=RATE_HZ, frame_prefix="alpha/")
    bench.until(lambda: follower.goals.get_subscription_count() and follower.references)
    assert follower.references[0].header.frame_id == "alpha/odom"
    follower.goals.publish(pose(1.0, 1.0, 0.0))
    word = "goal must be in frame alpha/odom or alpha/map (got 'odom'); ignored"
    bench.until(lambda: word in follower.problems())
    follower.goals.publish(pose(1.0, 1.0, 0.0, frame="alpha/odom"))
    bench.until(lambda: follower.statuses[-1].status[0].message == "running")


@pytest.mark.parametrize(
    ("mode", "message", "reason"),
    [
        (
            "circle",
            pose(1.0, 1.0, 0.0),
            "goal_pose ignored in mode circle: start it with --set reference_ship.mode=goal",
        ),
        ("virtual_ship", path((1.0, 1.0)), "path ignored in mode virtual_ship: start it with --set reference_ship.mode=path"),
        ("goal", path((1.0, 1.0)), "path ignored in mode goal: start it with --set reference_ship.mode=path"),
    ],
)
def test_a_mode_without_goals_or_paths_rejects_them_with_the_mode_that_takes_them(
    bench: Any, follower: Any, mode: str, message: Any, reason: str
) -> None:
    node = bench.start(ReferenceShipNode, mode=mode, rate_hz=RATE_HZ)
    publisher = follower.goals if isinstance(message, PoseStamped) else follower.paths
    bench.until(lambda: publisher.get_subscription_count() and follower.references)
    follower.send(message)
    follower.until_refused(node, reason)


def test_a_path_under_another_name_is_rejected_in_mode_goal_too(bench: Any, follower: Any) -> None:
    bench.probe.destroy_publisher(follower.paths)
    follower.paths = bench.probe.create_publisher(Path, "plan", 10)
    node = bench.start(ReferenceShipNode, remaps={"path": "plan"}, mode="goal", rate_hz=RATE_HZ)
    bench.until(lambda: follower.paths.get_subscription_count() and follower.references)
    follower.send(path((1.0, 1.0)))
    follower.until_refused(node, "path ignored in mode goal")
