"""The actions of the reference ship: goals with feedback, cancel and result, over the pure `guidance.tasks`.

The servers accept every goal at the level of the protocol, because a rejection has no words: one that is refused is aborted at
once, with its reason.
"""

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.task import Future
from std_srvs.srv import Trigger

from vessel_hsmc_ros.control.safety.parameters import Operation
from vessel_hsmc_ros.core.exceptions import GoalError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.guidance.factory import half_length
from vessel_hsmc_ros.guidance.tasks import Code, Done, Goal, Limits, Order, Output, Progress, Report, Sail, Sight, Tasks
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes.action_messages import ACTIONS, Action, Frames, Way, action_type, duration, filled, missed
from vessel_hsmc_ros.nodes.vessel_sight import VesselSight

RCLError = rclpy_implementation.RCLError
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

    `node`: the node, which sails and holds the reference for them.

    Attributes:
        tasks: What decides about the goals.
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
        watches = bool(self._names) and not node.parameters.lockstep
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
            self._node.reporter.event("goal" if len(points) == 1 else "path", f"{accepted.action.kind}: {_place_of(way)}")
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
        }
        for name, seconds in (
            ("estimated_time_remaining", self._node.helm.time_left),
            ("navigation_time", time.monotonic() - accepted.begun),
        ):
            if hasattr(feedback, name):
                duration(getattr(feedback, name), seconds)
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
        for name, why in (("battery", sight.battery()), ("operator", sight.operator())):
            if why:
                self.apply(self.tasks.block(name, why, self._p.at_end))
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
        self.tasks.unblock("battery")
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


def _place_of(way: Way) -> str:
    x, y = way.points[-1]
    return f"{len(way.points)} waypoints, the last at x = {x:g}, y = {y:g}" if len(way.points) > 1 else f"x = {x:g}, y = {y:g}"
