"""A client of the actions of a reference ship, by default in lockstep, whose vessel follows the reference, or with an offset."""

import math
from typing import Any

from geometry_msgs.msg import PoseStamped, WrenchStamped
from nav_msgs.msg import Odometry, Path
from rclpy.action import ActionClient
from rosgraph_msgs.msg import Clock
from vessel_hsmc_msgs.action import FollowGPSWaypoints, FollowPath, FollowWaypoints, NavigateToPose
from vessel_hsmc_msgs.msg import ControlState, ReferenceState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode

RATE_HZ = 5.0
KINDS = {
    "navigate_to_pose": NavigateToPose,
    "follow_path": FollowPath,
    "follow_waypoints": FollowWaypoints,
    "follow_gps_waypoints": FollowGPSWaypoints,
}


def pose(x: float, y: float, psi: float = 0.0, frame: str = "odom") -> Any:
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y = x, y
    message.pose.orientation.z, message.pose.orientation.w = math.sin(0.5 * psi), math.cos(0.5 * psi)
    return message


def path(*points: tuple[float, float], frame: str = "odom") -> Any:
    message = Path(poses=[pose(x, y, frame="") for x, y in points])
    message.header.frame_id = frame
    return message


class Sent:
    """A goal that was sent, its feedback and its result."""

    def __init__(self, bench: Any, client: Any, goal: Any) -> None:
        self._bench, self.feedback = bench, []  # type: ignore[var-annotated]
        bench.until(client.server_is_ready)
        sending = client.send_goal_async(goal, lambda message: self.feedback.append(message.feedback))
        bench.until(sending.done)
        self.handle = sending.result()
        assert self.handle.accepted
        self._result = self.handle.get_result_async()

    @property
    def done(self) -> bool:
        return bool(self._result.done())

    def result(self) -> tuple[int, int, str]:
        """Status, code and text, once they are there."""
        self._bench.until(self._result.done)
        response = self._result.result()
        return response.status, response.result.error_code, response.result.error_msg

    @property
    def message(self) -> Any:
        """The result as it was received."""
        return self._result.result().result

    def cancel(self) -> int:
        """Cancel it; returns how many goals are cancelled."""
        cancelling = self.handle.cancel_goal_async()
        self._bench.until(cancelling.done)
        return len(cancelling.result().goals_canceling)


class Vessel:
    """A reference-ship node, in lockstep with a clock of the test, a vessel that follows it, and clients of its actions."""

    def __init__(self, bench: Any, lockstep: bool = True, **parameters: Any) -> None:
        self._lockstep = lockstep
        self.bench, self.offset, self.lost = bench, 0.0, False
        self.clock = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK)
        self.odometry = bench.probe.create_publisher(Odometry, "odom", 10)
        self.controller = bench.probe.create_publisher(ControlState, "controller/state", 10)
        if lockstep:
            bench.publisher(WrenchStamped, "cmd_wrench")  # the node waits for a controller
        self.states: list[Any] = []
        bench.probe.create_subscription(ReferenceState, "reference", self._follow, qos.LOSSLESS)
        self.node = bench.start(ReferenceShipNode, lockstep=lockstep, rate_hz=RATE_HZ, **parameters)
        self._clients: dict[str, Any] = {}
        bench.until(lambda: self.states)

    def _follow(self, message: Any) -> None:
        self.states.append(conv.read_reference(message)[0])
        if not self.lost:
            odometry = Odometry(header=message.header, child_frame_id="base_link")
            odometry.pose.pose, odometry.twist.twist = message.pose, message.twist
            odometry.pose.pose.position.x += self.offset
            self.odometry.publish(odometry)

    def send(self, name: str, **fields: Any) -> Sent:
        """Send a goal, which is accepted by the protocol also where it is then refused."""
        if name not in self._clients:
            self._clients[name] = ActionClient(self.bench.probe, KINDS[name], name)
        return Sent(self.bench, self._clients[name], KINDS[name].Goal(**fields))

    def advance(self, seconds: float) -> None:
        """Advance the clock; in real time, wait."""
        if not self._lockstep:
            self.bench.spin(seconds)
            return
        for _ in range(round(seconds * RATE_HZ)):
            count = len(self.states) + 1
            self.clock.publish(Clock(clock=conv.time_message(round((count - 2) * 1e9 / RATE_HZ))))
            self.bench.until(lambda count=count: len(self.states) == count)

    def until(self, condition: Any, seconds: float = 600.0) -> None:
        """Advance the clock until a condition holds; the test fails after a time on it, s."""
        if not self._lockstep:
            self.bench.until(condition)
            return
        for _ in range(round(seconds)):
            if condition():
                return
            self.advance(1.0)
        raise AssertionError(f"the condition did not hold within {seconds:g} s")

    def state_of(self, operation: int, reason: int = ControlState.NONE) -> None:
        """Publish the state of a controller until the node has seen it."""
        sight = self.node.actions._sight
        self.bench.until(lambda: self.controller.get_subscription_count())
        self.controller.publish(ControlState(operation=operation, reason=reason))
        self.bench.until(lambda: sight.operation() == operation)

    @property
    def speed(self) -> float:
        """Speed of the reference, m/s."""
        return math.hypot(*map(float, self.states[-1][3:5]))

    def destroy(self) -> None:
        for client in self._clients.values():
            client.destroy()
