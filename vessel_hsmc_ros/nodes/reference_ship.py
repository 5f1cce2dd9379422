"""The reference-ship node: publishes the reference trajectory as poses, and as states with their accelerations.

Paths are planned in a thread of its own, while the reference goes on.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rosgraph_msgs.msg import Clock
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.core.exceptions import GoalError, InstallationError
from vessel_hsmc_ros.core.timing import RateGrid, seconds
from vessel_hsmc_ros.guidance.factory import make_held_reference
from vessel_hsmc_ros.guidance.waypoints import Point
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.conversions import Outgoing, path_event, read_goal, read_path
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.actions import Actions
from vessel_hsmc_ros.nodes.base import OK, WARN, DiagnosticTask, VesselNode
from vessel_hsmc_ros.nodes.helm import Helm
from vessel_hsmc_ros.nodes.pace import Pace
from vessel_hsmc_ros.nodes.reporting import motion
from vessel_hsmc_ros.nodes.vessel_sight import ObservedVessel
from vessel_hsmc_ros.scenario.parameters import ReferenceParameters

UNUSED_INPUT_SEARCH = 0.5  # time between two searches for publishers of goals and paths that the mode does not use, s
REORDERED = 5.0  # goals stamped up to so long before the last one, s, are out of order; earlier ones are by another clock


class ReferenceShipNode(VesselNode):
    """Publishes the reference trajectory: of a virtual ship, a course, goals, a path or a curve at constant speed.

    In lockstep it is one period ahead of the plant's clock, so that the controller does not wait for it. In real time it is
    driven by a timer; after a stop of its process or a step of its clock it goes on where it was.
    """

    NAME = "reference_ship"
    INTERFACE = """
        subscribes to  goal_pose, path (in these modes), odom, odom/datum, controller/state, battery_state,
                       operator_heartbeat (for actions), /clock (in lockstep)
        publishes      reference, reference/pose, events
        services       ~/pause, ~/hold, ~/reset
        calls          controller/stop
        actions        navigate_to_pose, follow_path, follow_waypoints, follow_gps_waypoints (the last three in mode path)
    """
    PARAMETERS = ReferenceParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._grid = RateGrid(p.rate_hz)
        self._ship: Any = make_held_reference(p, self._grid.period)
        self._refused = self._goal = ""
        self._goal_stamp: float | None = None
        self._index = 0
        self._pace = Pace(self, self._grid)
        profile, offered = qos.data(p.lockstep), qos.offered(p.lockstep, p.rate_hz)
        self._reference_out = self.advertise(ReferenceState, "reference", offered, partner="cmd_wrench")
        self._pose_out = self.advertise(PoseStamped, "reference/pose", profile)
        self.frames = tuple(p.frame_prefix + frame for frame in p.frames)
        self.name_frame(self.frames[0] if self.frames else "")
        self._vessel = ObservedVessel(self, self._ship) if p.follow == "vessel" else None
        if p.lockstep:
            self.connections.allow_one_publisher("reference")
            self.listen(Clock, "/clock", self._on_clock, qos.CLOCK)
        if p.mode == "goal":
            self.create_subscription(PoseStamped, "goal_pose", self._on_goal, qos.STREAM)
        elif p.mode == "path":
            self.create_subscription(Path, "path", self._on_path, qos.STREAM)
        self._path: Path | None = None
        self._paused = False
        self.helm = Helm(self, self._ship, self._grid.period)
        self.actions = Actions(self)
        self.reporter.offer("reset", self._reset)
        self.reporter.offer_switch("hold", "release", self.helm.hold_or_go_on)
        self.reporter.offer_switch("pause", "resume", self._pause)

    def describe(self) -> str:
        """The kind of reference and its rate."""
        return f"{self.parameters.mode} at {self.parameters.rate_hz:g} Hz"

    def on_connected(self) -> None:
        """Publish the first state; in real time, start the timer."""
        if not self.parameters.lockstep:
            self._pace.run(self._on_timer)
        self._unused = {"goal": (PoseStamped, "goal_pose"), "path": (Path, "path")}
        self._unused.pop(self.parameters.mode, None)
        self._warn_of_slow()
        self.create_timer(UNUSED_INPUT_SEARCH, self._find_unused_inputs, clock=self.wall)
        self._publish()
        self.take_ticks()

    def _on_clock(self, message: Clock) -> None:
        stamp = conversions.nanoseconds(message.clock)
        if self._vessel:
            self._vessel.ticks.append(stamp)
            self.take_ticks()
        elif self.connected:
            self._advance_to(self._grid.index(stamp) + 1)  # one period ahead

    def take_ticks(self) -> None:
        """Lockstep: take each step for which the odometry of the step before has come."""
        while self.connected and self._vessel and self._vessel.ready:
            self._advance_to(self._grid.index(self._vessel.take()) + 1)

    def _on_timer(self) -> None:
        if self._path is not None and not self.helm.planning.busy:
            self._plan_path()
        if self._paused:  # a pause shifts the start, so that no periods are overdue after it
            self._pace.hold(self._index)
        due, moved = self._pace.due(self._index)
        if moved:
            self.get_logger().warning(f"{moved}: the reference goes on from where it is")
        if self._vessel:
            self._vessel.show()
        self._advance_to(due)

    def _advance_to(self, index: int) -> None:
        # Every period is computed and published, also after a delay: the controller needs the reference of each stamp.
        while self._index < index:
            self._ship.advance()
            self._index += 1
            self._publish()
            self.helm.advance()
            self.actions.advance()

    def _publish(self) -> None:
        self.stamp = self._pace.stamp(self._index)
        state = self._ship.state
        self.send(self._reference_out, self._reference(self.stamp, state, self._ship.acceleration()))
        self.send(self._pose_out, self._pose(self.stamp, state))

    def _on_goal(self, message: PoseStamped) -> None:
        def work() -> None:
            x, y, psi, stamp = read_goal(message, self.frames, self.here)
            self.helm.require_free([(x, y)])
            self._check_order(stamp)
            self._ship.set_goal(x, y, psi, stamp)
            self.actions.apply(self.actions.tasks.displaced("a goal on goal_pose"))
            self.name_frame(message.header.frame_id)
            # A stream of poses is one event, its first goal, and so is a goal that is published repeatedly.
            goal = f"x = {x:g}, y = {y:g}, heading = {psi:g}"
            if goal != self._goal and self._ship.target().speed == 0.0:
                self.reporter.event("goal", goal)
            self._goal = goal

        self.take(work)

    @property
    def here(self) -> Point:
        """Where the reference is, m."""
        x, y = self._ship.state[:2]
        return float(x), float(y)

    def name_frame(self, frame: str) -> None:
        """Name the frame of the reference: that of its goal or path, which the controller compares with its odometry's."""
        reference, pose = conversions.new_reference(), conversions.new_pose()
        reference.header.frame_id = pose.header.frame_id = frame
        self._reference, self._pose = Outgoing(reference, conversions.REFERENCE), Outgoing(pose, conversions.POSE)

    def _check_order(self, stamp: float | None) -> None:
        """Note the stamp of a goal, s; the velocity of a moving goal is estimated from the stamps."""
        last = self._goal_stamp
        if stamp is not None and last is not None and 0.0 < last - stamp <= REORDERED:
            raise GoalError(f"goal must be stamped after the last one, {last:.3f} s (got {stamp:.3f} s)")
        self._goal_stamp = stamp

    def _on_path(self, message: Path) -> None:
        """Take a path; in real time the newest one is planned while the reference goes on."""
        if not self.parameters.lockstep:
            self._path = message
            return

        def work() -> None:
            points = read_path(message, self.frames, self.here)
            self.helm.require_free(points)
            self.helm.set_path(points)
            self._follow(message, points)

        self.take(work)

    def _plan_path(self) -> None:
        message, self._path = self._path, None

        def work() -> None:
            points = read_path(message, self.frames, self.here)
            self.helm.require_free(points)
            self.helm.plan(points, partial(self._follow, message))

        self.take(work)

    def _follow(self, message: Any, points: Sequence[Point]) -> None:
        self.name_frame(message.header.frame_id)
        self.reporter.event("path", path_event(points))
        self.actions.apply(self.actions.tasks.displaced("a path on the topic path"))
        self._warn_of_slow()

    @property
    def _slow(self) -> str:
        """A remark on the present path."""
        return str(getattr(self._ship, "slow", ""))

    def _warn_of_slow(self) -> None:
        if self._slow:
            self.get_logger().warning(self._slow)

    def begin_way(self, frame: str) -> None:
        """Note that the reference sails a way in a frame, that of an action."""
        self.name_frame(frame)
        self._goal = ""
        self._warn_of_slow()

    def forget_path(self) -> None:
        """Forget the path of a message that waits for its planning."""
        self._path = None

    @property
    def reference_time(self) -> float:
        """Time of the reference, which stands while it is paused, s."""
        return self._index * self._grid.period

    def take(self, work: Callable[[], None], refused: Callable[[str], None] = lambda _why: None) -> None:
        """Apply a goal or a path; one that cannot be followed is logged and ignored, and the present one is kept."""
        try:
            work()
        except (GoalError, InstallationError) as error:
            self._refused = f"{error}; ignored"
            self.get_logger().error(self._refused)
            refused(str(error))
        else:
            self._refused = ""

    def _find_unused_inputs(self) -> None:
        """Subscribe to goals or paths that the mode does not use once they have a publisher, to reject them with a reason."""
        # A subscription from the start would add empty topics to the graph and to every bag.
        for mode, (kind, topic) in list(self._unused.items()):
            if self.count_publishers(self.resolve_topic_name(topic)):
                del self._unused[mode]
                self.create_subscription(kind, topic, partial(self._reject, mode, topic), qos.STREAM)

    def _reject(self, mode: str, topic: str, _message: Any) -> None:
        start = f"start it with --set reference_ship.mode={mode}"
        self._refused = f"message on {topic} ignored in mode {self.parameters.mode}: {start}"
        self.get_logger().error(self._refused, throttle_duration_sec=5.0)

    def retune(self, parameters: ReferenceParameters) -> None:
        """Apply changed inputs of the virtual ship from the next period on; another mode has nothing that may change."""
        self._ship.retune(parameters)

    def _reset(self) -> str:
        self.helm.reset()
        self._goal = ""
        self.actions.reset()
        self._ship.reset()
        self.name_frame(self.frames[0] if self.frames else "")
        return "the virtual ship is back at its start; time goes on"

    def _pause(self, paused: bool) -> str:
        self._paused = paused
        if self.parameters.lockstep:
            return "in lockstep the reference pauses with the plant"
        return "paused" if paused else "running"

    def spin(self, running: Callable[[], bool]) -> None:
        """As that of every node; at the end the clients of actions have their results."""
        super().spin(lambda: running() or self.actions.ending())

    def destroy_node(self) -> None:
        """As that of rclpy, which leaves the action servers and with them the node in the graph."""
        if actions := getattr(self, "actions", None):
            actions.destroy()
        super().destroy_node()

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Number of messages and time of the latest reference; warnings of ignored goals and paths, slow paths, lost odometry."""
        values: dict[str, Any] = {"messages": self._index + 1, "reference_time": seconds(self._grid.stamp(self._index))}
        remark = self.actions.remark or self._refused or self._slow
        if self._vessel:
            values["pace"] = self._ship.pace
            remark = remark or self._vessel.problem
        return (WARN, remark, values) if remark else (OK, "running", values)

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """Feasibility of the reference besides the status."""
        u, v, r = self._ship.state[3:]
        acceleration = dict(
            zip(("surge_acceleration", "sway_acceleration", "yaw_acceleration"), self._ship.acceleration(), strict=True)
        )
        return [*super().diagnostic_tasks(), motion({"surge": u, "sway": v, "yaw_rate": r, **acceleration}, self._refused)]
