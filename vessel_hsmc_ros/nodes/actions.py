"""The actions of the reference ship: goals with feedback, cancel and result, over the pure `guidance.tasks`.

The servers accept every goal at the level of the protocol, because a rejection has no words: one that is refused is aborted at
once, with its reason. The types are those of nav2_msgs where it is installed, else the package's own of the same names. Only
fields that a type has are filled in, because the versions of nav2_msgs differ, and the package's own have further ones.
"""

import math
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
import vessel_hsmc_msgs.action
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.duration import Duration
from rclpy.task import Future
from std_srvs.srv import Trigger

from vessel_hsmc_ros.control.safety.parameters import Operation
from vessel_hsmc_ros.core.exceptions import GoalError
from vessel_hsmc_ros.core.kinematics import FARTHEST, Motion, Plane, exchanged
from vessel_hsmc_ros.guidance.factory import half_length
from vessel_hsmc_ros.guidance.tasks import Code, Done, Goal, Limits, Order, Output, Progress, Report, Sail, Sight, Tasks
from vessel_hsmc_ros.guidance.waypoints import NONE, Point
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.conversions import path_event, read_goal, read_path
from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.nodes.base import WARNING_PERIOD
from vessel_hsmc_ros.nodes.rclpy_parts import RCLError
from vessel_hsmc_ros.nodes.vessel_sight import VesselSight, other_datum
from vessel_hsmc_ros.scenario.parameter_groups import OWNER

MAX_WAYPOINTS = 20_000  # of one goal, with its loops


class Way(NamedTuple):
    """What a goal asks for."""

    points: list[Point]  # x, y, m
    frame: str
    heading: float | None = None  # at the end, rad
    first: int = 0  # index of the first of the points among those of the goal
    total: int = 1  # number of the poses of the goal, which loops repeat
    poses: Any = ()  # of the goal, for the waypoints that are missed


class Frames(NamedTuple):
    """Where goals are read: the frames they may be in, the reference's place, m, and the datum, declared and stated."""

    allowed: Collection[str]
    here: Point
    datum: tuple[float, ...]
    stated: tuple[float, float] | None

    def plane(self) -> Plane:
        """The plane of places by latitude and longitude. Raises GoalError without a datum, or with two."""
        declared = None if self.datum == NONE else self.datum
        datum = self.stated or declared
        if datum is None:
            raise GoalError(f"{OWNER}.datum must be given for places by latitude and longitude, as no node states it on {DATUM}")
        if wrong := other_datum(self.datum, self.stated):
            raise GoalError(wrong)
        return Plane(*datum)


def _read_pose(goal: Any, f: Frames) -> Way:
    x, y, psi, _ = read_goal(goal.pose, f.allowed, f.here)
    return Way([(x, y)], goal.pose.header.frame_id, psi)


def _read_path(goal: Any, f: Frames) -> Way:
    return Way(read_path(goal.path, f.allowed, f.here), goal.path.header.frame_id)


def _read_waypoints(goal: Any, f: Frames) -> Way:
    path = Path(poses=goal.poses)
    path.header.frame_id = goal.poses[0].header.frame_id if goal.poses else next(iter(f.allowed), "")
    return _looped(goal, Way(read_path(path, f.allowed, f.here), path.header.frame_id, poses=goal.poses))


def _read_places(goal: Any, f: Frames) -> Way:
    plane, points = f.plane(), []
    for number, pose in enumerate(goal.gps_poses):
        place = pose.position.latitude, pose.position.longitude
        if not (abs(place[0]) <= 90.0 and abs(place[1]) <= 360.0):  # NaN too
            raise GoalError(f"pose {number} must be a latitude and a longitude, degrees (got {place[0]}, {place[1]})")
        if (distance := plane.distance(*place)) > FARTHEST:
            swapped = "; are latitude and longitude exchanged?" if exchanged(plane, *place) else ""
            where = f"{place[0]:.6f}, {place[1]:.6f}, {distance / 1e3:.0f} km away{swapped}"
            raise GoalError(f"pose {number} must be within {FARTHEST / 1e3:g} km of the datum (got {where})")
        points.append(plane.place(*place)[:2])
    if not points:
        raise GoalError("a goal must have at least one pose (got none)")
    return _looped(goal, Way(points, next(iter(f.allowed), "")))


def _looped(goal: Any, way: Way) -> Way:
    """The way from the first waypoint to sail on, with its loops."""
    count, first, loops = len(way.points), int(goal.goal_index), int(goal.number_of_loops)
    if first >= count:
        raise GoalError(f"goal_index must be below the number of poses, {count} (got {first})")
    if count * (loops + 1) > MAX_WAYPOINTS:
        raise GoalError(f"poses times loops must be at most {MAX_WAYPOINTS} (got {count} poses, number_of_loops {loops})")
    return way._replace(points=way.points[first:] + way.points * loops, first=first, total=count)


class Action(NamedTuple):
    """An action: its type, what reads its goals, and the modes of the reference that take it."""

    kind: str
    read: Callable[[Any, Frames], Way]
    modes: tuple[str, ...] = ("path",)


ACTIONS = {
    "navigate_to_pose": Action("NavigateToPose", _read_pose, ("goal", "path")),
    "follow_path": Action("FollowPath", _read_path),
    "follow_waypoints": Action("FollowWaypoints", _read_waypoints),
    "follow_gps_waypoints": Action("FollowGPSWaypoints", _read_places),
}
"""The actions by their names, which are those of Nav2."""


def action_type(kind: str) -> Any:
    """The type of an action, of nav2_msgs where it is installed and has it."""
    try:
        return getattr(import_module("nav2_msgs.action"), kind)
    except (ImportError, AttributeError):
        return getattr(vessel_hsmc_msgs.action, kind)


def filled(message: Any, values: dict[str, Any]) -> Any:
    """A message with those of the values for which it has fields."""
    for name in values.keys() & message.get_fields_and_field_types().keys():
        setattr(message, name, values[name])
    return message


def duration(seconds: float) -> Any:
    """A builtin_interfaces/Duration with a time, s; as long as it can be where the time is infinite."""
    return Duration(seconds=0.0 if math.isnan(seconds) else max(0.0, min(seconds, 2e9))).to_msg()


def missed(result: Any, way: Way, passed: int, code: int) -> None:
    """Note the waypoints of a result that were not passed, each once."""
    if not hasattr(result, "missed_waypoints"):
        return
    kind = import_module(f"{type(result).__module__.split('.')[0]}.msg").MissedWaypoint
    indices = {(way.first + k) % way.total for k in range(passed, len(way.points))}
    for index in sorted(indices):
        one = filled(kind(), {"index": index, "error_code": code})
        if way.poses:
            one.goal = way.poses[index]
        result.missed_waypoints.append(one)


TICK = 0.5  # period of feedback, and of looking at the vessel, s
ANSWER_LIMIT = 0.5  # longest time for the last results at the end of the node, s


class PatientServer(ActionServer):  # type: ignore[misc]
    """An action server that a request of broken bytes does not end."""

    def take_data(self) -> dict[str, Any]:
        """As that of rclpy; without what cannot be read."""
        try:
            return dict(super().take_data())
        except RCLError as error:
            self._node.get_logger().error(f"a request to an action cannot be read: {str(error).splitlines()[0]}")
            return {}


@dataclass
class Accepted:
    """A goal of a client, with what it is sailed by.

    `begun`: when it was accepted, on the steady clock, s.
    """

    goal: Goal
    handle: Any
    action: Action
    way: Way
    result: Any  # a future
    begun: float
    progress: Progress | None = None


class Actions:
    """The action servers of a reference ship, and what follows from battery, operator and the state of the controller.

    `node`: the node, which sails and holds the reference for them. `tasks`: what decides about the goals.
    """

    def __init__(self, node: Any) -> None:
        self._node, self._p = node, node.parameters.actions
        self._room = half_length(node.parameters)
        p = self._p
        self.tasks = Tasks(Limits(p.reach or self._room, p.patience, p.tolerance, p.at_end))
        self._accepted: dict[Any, Accepted] = {}
        self._planned: Any = None  # key of the goal whose way the node plans
        self._unanswered, self._ends_at, self._due = 0, math.inf, 0.0
        self._stop = node.create_client(Trigger, "controller/stop") if p.at_end == "stop" else None
        self._stopping = False
        self._names = [name for name, action in ACTIONS.items() if node.parameters.mode in action.modes]
        watches = bool(self._names or p.datum != NONE) and not node.parameters.lockstep
        self._sight: VesselSight | None = VesselSight(node, p) if watches or p.battery or p.operator_timeout else None
        self._servers = [self._serve(name, ACTIONS[name]) for name in self._names]
        if self._servers or self._sight:
            node.create_timer(TICK, self.tick, clock=node.wall)

    def _serve(self, name: str, action: Action) -> ActionServer:
        return PatientServer(
            self._node,
            action_type(action.kind),
            name,
            self._answer,
            goal_callback=lambda _request: GoalResponse.ACCEPT,
            handle_accepted_callback=lambda handle: self._take(action, handle),
            cancel_callback=self._cancel,
        )

    # -- clients --------------------------------------------------------------------------------------------------------

    def _take(self, action: Action, handle: Any) -> None:
        if self._sight is None:  # in lockstep a run without goals has no further subscriptions
            self._sight = VesselSight(self._node, self._p)
        goal = Goal(bytes(handle.goal_id.uuid), action.kind != "NavigateToPose")
        refusal, way = "" if self._node.connected else "the reference ship has not begun: it waits for other nodes", Way([], "")
        try:
            way = action.read(handle.request, Frames(self._node.frames, self._node.here, self._p.datum, self._sight.datum()))
        except GoalError as error:
            refusal = str(error)
        self._accepted[goal.key] = Accepted(goal, handle, action, way, Future(), time.monotonic())
        self._unanswered += 1
        handle.execute()
        self.apply(self.tasks.controller(*self._sight.controller()))
        self.apply(self.tasks.offer(goal, refusal))

    async def _answer(self, handle: Any) -> Any:
        """Wait for the result of a goal; the executor calls it once the goal is accepted."""
        result = await self._accepted[bytes(handle.goal_id.uuid)].result
        del self._accepted[bytes(handle.goal_id.uuid)]
        self._unanswered -= 1
        return result

    def _cancel(self, handle: Any) -> CancelResponse:
        accepted = self._accepted.get(bytes(handle.goal_id.uuid))
        if accepted is None or accepted.result.done():
            return CancelResponse.REJECT
        # Afterwards: the goal is not cancelling before this has returned.
        self._node.executor.create_task(lambda: self.apply(self.tasks.cancel(accepted.goal)))
        return CancelResponse.ACCEPT

    # -- what the tasks decide ------------------------------------------------------------------------------------------

    def apply(self, outputs: list[Output]) -> None:
        """Carry out what the tasks have decided."""
        for output in outputs:
            if isinstance(output, Done):
                self._finish(output)
            elif isinstance(output, Sail):
                self._sail(self._accepted[output.goal.key])
            elif isinstance(output, Report):
                self._report(self._accepted[output.goal.key])
            elif output is Order.GO_ON:
                self._node.helm.go_on()
            else:
                self._node.helm.hold()
                self._stopping = output is Order.STOP
                if output is Order.RETURN:
                    self._node.helm.sail_home(self._p.home, next(iter(self._node.frames), ""))

    def _sail(self, accepted: Accepted) -> None:
        self._planned = accepted.goal.key

        def taken() -> None:
            self._planned = None
            way = accepted.way
            points = [complex(*point) for point in way.points]
            accepted.progress = Progress(complex(*self._node.here), points, self._room)
            x, y = way.points[-1]
            place = f"x = {x:g}, y = {y:g}" if len(points) == 1 else path_event(way.points)
            self._node.reporter.event("goal" if len(points) == 1 else "path", f"{accepted.action.kind}: {place}")
            self.apply(self.tasks.sailed(accepted.goal))

        def refused(why: str) -> None:
            self._planned = None
            self.apply(self.tasks.failed(accepted.goal, why))

        self._node.helm.sail(accepted.way, taken, refused)

    def _finish(self, done: Done) -> None:
        """Give a client its result."""
        if done.goal.key == self._planned:
            self._planned = None
            self._node.helm.planning.cancel()
        accepted = self._accepted[done.goal.key]
        handle, kind = accepted.handle, action_type(accepted.action.kind)
        result = filled(kind.Result(), {"error_code": int(done.code), "error_msg": done.text})
        if done.code is not Code.REACHED:
            missed(result, accepted.way, accepted.progress.leg - 1 if accepted.progress else 0, done.code)
        end = {Code.REACHED: handle.succeed, Code.CANCELLED: handle.canceled}.get(done.code, handle.abort)
        end()
        # In two lines: rclpy's logger takes one severity from each.
        if done.code in (Code.REACHED, Code.CANCELLED):
            self._node.get_logger().info(f"{accepted.action.kind}: {done.text}")
        else:
            self._node.get_logger().warning(f"{accepted.action.kind}: {done.text}")
        accepted.result.set_result(result)
        self._node.executor.wake()  # it serves the task that waits for the result

    def _report(self, accepted: Accepted) -> None:
        """Send a client the progress of its goal."""
        motion, progress = self._sight.motion() if self._sight else None, accepted.progress
        if progress is None or motion is None:
            return
        place = complex(motion.x, motion.y)
        kind, left = action_type(accepted.action.kind), progress.distance_left(place)
        feedback, pose = kind.Feedback(), PoseStamped()
        conversions.write_pose_stamped(pose, conversions.time_message(self._node.stamp), np.array(motion))
        pose.header.frame_id = accepted.way.frame
        values: dict[str, Any] = {
            "distance_remaining": left,
            "distance_to_goal": left,
            "speed": math.hypot(motion.u, motion.v),
            "leg": progress.leg,
            "legs": progress.legs,
            "current_waypoint": (accepted.way.first + progress.leg - 1) % accepted.way.total,
            "current_pose": pose,
            "number_of_recoveries": min(self.tasks.recoveries, 32767),
            "estimated_time_remaining": duration(self._node.helm.time_left),
            "navigation_time": duration(time.monotonic() - accepted.begun),
        }
        accepted.handle.publish_feedback(filled(feedback, values))

    # -- time -----------------------------------------------------------------------------------------------------------

    def advance(self) -> None:
        """In lockstep, which may be many times faster than the clock: tick by the time of the reference too."""
        if self._node.parameters.lockstep and self._node.reference_time >= self._due:
            self._due = self._node.reference_time + TICK
            self.tick()

    def tick(self) -> None:
        """Look at the vessel, judge the goals, report progress."""
        if (sight := self._sight) is None:
            return
        self.apply(self.tasks.controller(*sight.controller()))
        end = self._p.at_end
        causes = ("datum", sight.other_datum(), "hold"), ("battery", sight.battery(), end), ("operator", sight.operator(), end)
        for name, why, action in causes:
            if why:
                self._node.get_logger().error(why, throttle_duration_sec=WARNING_PERIOD)
                self.apply(self.tasks.block(name, why, action))
            elif name == "operator":  # a battery does not recover: the reset of the node ends it
                self.tasks.unblock(name)
        self._stop_controller(sight)
        active = self._accepted.get(self.tasks.active.key) if self.tasks.active else None
        if active is not None:
            self.apply(self.tasks.tick(self._seen(active, sight.motion())))

    def _seen(self, active: Accepted, motion: Motion | None) -> Sight:
        distance, progress = None, active.progress
        if motion is not None and progress is not None:
            place = complex(motion.x, motion.y)
            progress.advance(place)
            distance = progress.distance_to_end(place)
        return Sight(self._node.reference_time, distance, self._node.helm.arrived)

    def _stop_controller(self, sight: VesselSight) -> None:
        """Stop the controller, again until it is stopped: a request may be lost."""
        self._stopping = self._stopping and sight.operation() is not Operation.STOPPED
        if self._stopping and self._stop is not None and self._stop.service_is_ready():
            self._stop.call_async(Trigger.Request())

    def reset(self) -> None:
        """End all goals, because the reference returns to its start."""
        self._stopping = False
        for name in ("battery", "datum"):  # the next look blocks again
            self.tasks.unblock(name)
        self.apply(self.tasks.reset("the reference was reset"))

    def ending(self) -> bool:
        """At the end of the node: end all goals, and return whether the clients still have to be answered."""
        if math.isinf(self._ends_at):
            self._ends_at = time.monotonic() + ANSWER_LIMIT
            self.apply(self.tasks.reset("the reference ship has ended"))
        return bool(self._unanswered) and time.monotonic() < self._ends_at

    def destroy(self) -> None:
        """Take the servers out of the ROS graph."""
        for server in self._servers:
            server.destroy()
        self._servers.clear()

    @property
    def remark(self) -> str:
        """What a person should know; empty if there is nothing."""
        return self.tasks.blocked or (self._sight.problem() if self._sight else "")
