"""The inputs of the control law, checked and aligned in time, and the law's step on the latest of them."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop
from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.control.safety.samples import DeadReckoning, Jumps, Sample, Verdict, distance_problem, fence_problem
from vessel_hsmc_ros.core.exceptions import ControlError, LawError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate, in_body_frame
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.state_columns import POSITION_VARIANCES
from vessel_hsmc_ros.nodes.base import DiagnosticTask, VesselNode
from vessel_hsmc_ros.nodes.input_monitor import Expected, InputMonitor
from vessel_hsmc_ros.nodes.reporting import ages


class Measured(NamedTuple):
    """An odometry message."""

    sample: Sample
    motion: Motion

    @property
    def wrong(self) -> str:
        """Which of its numbers are not finite; empty if all are."""
        found = conversions.not_finite(self.motion)
        return f"odometry must be finite numbers (got {found})" if found else ""


class Desired(NamedTuple):
    """A reference message."""

    sample: Sample
    motion: Motion
    acceleration: Acceleration

    @property
    def wrong(self) -> str:
        """Which of its numbers are not finite; empty if all are."""
        found = conversions.not_finite(self.motion, self.acceleration)
        return f"reference must be finite numbers (got {found})" if found else ""


def read_odometry(message: Odometry, twist_frame: str = "child") -> Measured:
    """The motion in an odometry message, and what its checks take.

    `twist_frame`: frame of its velocities: child, or parent.
    """
    motion, header, covariance = conversions.read_odometry(message), message.header, message.pose.covariance
    if twist_frame == "parent" and math.isfinite(motion.psi):
        motion = in_body_frame(motion)
    variance = max((float(covariance[i]) for i in POSITION_VARIANCES), key=lambda v: math.inf if math.isnan(v) else v)
    stamp = conversions.nanoseconds(header.stamp)
    return Measured(Sample(stamp, header.frame_id, message.child_frame_id, motion, variance), motion)


def read_reference(message: ReferenceState) -> Desired:
    """The motion in a reference message, and what its checks take."""
    motion, acceleration = conversions.read_reference(message)
    stamp = conversions.nanoseconds(message.header.stamp)
    return Desired(Sample(stamp, message.header.frame_id, "", (*motion, *acceleration)), motion, acceleration)


class ControllerInputs:
    """The latest odometry and reference that count.

    Attributes:
        monitor: What checks and reports the inputs.
    """

    def __init__(self, node: VesselNode, loop: ControlLoop) -> None:
        p = node.parameters
        worlds, bodies = (tuple(p.frame_prefix + f for f in frames) for frames in (p.odometry.frames, p.odometry.body_frames))
        expected = {
            "odometry": Expected("odom" if p.odometry.form == "odometry" else "pose", worlds, bodies),
            "reference": Expected("reference", worlds),
        }
        self.monitor = InputMonitor(node, expected, p.input_timeout, p.safety.freshness)
        self._node, self._loop = node, loop
        self._own_frame, self._frame = worlds[:1], ""
        self._jumps, self._reckoning = Jumps(p.safety, p.vessel.length), DeadReckoning(p.safety.dead_reckoning)
        self._measured: tuple[int, Motion] | None = None
        self._desired: Desired | None = None
        self._forgotten = Reason.NONE

    def reset(self, reason: Reason) -> None:
        """Forget the inputs, for a reason that is given until there are new ones."""
        self._forgotten, self._frame = reason, ""
        self.monitor.reset()
        self._jumps.reset()
        self._reckoning.reset()
        self._measured = self._desired = None

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """Refused samples, and the ages of the latest ones."""
        node = self._node
        lockstep, limit = node.parameters.lockstep, node.parameters.input_timeout
        # In lockstep the plant waits, for instance during a pause: no age is too large.
        now, limit = (node.stamp, math.inf) if lockstep else (node.now(), limit)
        return [self.monitor.diagnostic_task(), ages("input age", self.monitor.ages(now), limit)]

    def take_odometry(self, measured: Measured, now: int, received: int) -> bool:
        """Take odometry if it counts and its motion is that of a ship; returns whether it counts.

        `now`: ROS time, ns. `received`: time of its receipt, ns.
        """
        measured = self._with_position(measured)
        if self.monitor.take("odometry", measured.sample, now, received, measured.wrong):
            return False
        self._match_frames(measured.sample.frame)
        verdict = self._jumps.check(measured.sample.stamp, measured.motion)
        if verdict is Verdict.HOLD:
            self.monitor.report("odometry has jumped as no ship moves: it is held out until it persists")
            return True
        if verdict is Verdict.RELOCALISED:
            self._node.get_logger().warning("odometry is taken from its new place: the jump has persisted")
            self._loop.supervision.handover()
        self._measured = measured.sample.stamp, measured.motion
        return True

    def _with_position(self, measured: Measured) -> Measured:
        """The measurement, with a position by dead reckoning where it has none and that is allowed."""
        loop, before = self._loop, self._reckoning.elapsed
        filled = self._reckoning.fill(measured.sample.stamp, measured.motion, loop.estimate if loop.observer else None)
        if filled is measured.motion:
            if before and not self._reckoning.elapsed:
                self._node.get_logger().warning(f"the position is back after {before:.3g} s of dead reckoning")
                loop.supervision.handover()
            return measured
        elapsed, limit = self._reckoning.elapsed, self._node.parameters.safety.dead_reckoning
        text = f"the position is lost: dead reckoning for {elapsed:.2g} s of at most {limit:g} s"
        self._node.get_logger().warning(text, throttle_duration_sec=1.0)
        return Measured(measured.sample._replace(values=filled, covariance=0.0), filled)

    def _match_frames(self, frame: str) -> None:
        """Let the reference be in the frame of the odometry, or in the one that it has without a goal or path."""
        if frame and frame != self._frame:
            self._frame = frame
            self.monitor.narrow("reference", (*self._own_frame, frame))

    def take_reference(self, desired: Desired, now: int, received: int) -> None:
        """Take a reference if it counts; the arguments are those of `take_odometry`."""
        if not self.monitor.take("reference", desired.sample, now, received, desired.wrong):
            self._desired = desired

    def serve(self, now: int, received_now: int, elapsed: int, reason: Reason = Reason.NONE) -> Terms | None:
        """Serve a control period: run the law on the latest odometry and the reference of its time, or else the safe action.

        `now`: ROS time, ns. `received_now`: present time on the clock of receipts, ns. `elapsed`: time of the step as the
        control loop counts it, ns. `reason`: why the law must not command; NONE if it may. Returns the terms of the law; None
        if it has not run. Raises LawError if the code of the law failed.
        """
        missing = self.monitor.overdue(now, received_now) or self._held_out(now)
        if missing or self._measured is None or self._desired is None:
            name, why = missing or ("odometry", Reason.NOT_RECEIVED)
            self.monitor.report_overdue(name, why, now, self._loop.supervision.consequence)
            self._loop.skip(elapsed, reason or self._forgotten or why)
            return None
        self._forgotten = Reason.NONE
        (stamp, state), desired = self._measured, self._desired
        reference = extrapolate(desired.motion, desired.acceleration, seconds(stamp - desired.sample.stamp))
        late = now - stamp  # less than a control period is sampling, not a delay
        age = seconds(late) if late >= self._loop.grid.stamp(1) else 0.0
        try:
            return self._loop.step(elapsed, state, reference, desired.acceleration, stamp, age, reason)
        except LawError:  # an error in its code, after which its internal state cannot be trusted
            raise
        except ControlError as error:
            self.monitor.report(f"{error}; {self._loop.supervision.consequence}")
            return None

    def distance_problem(self) -> str:
        """That the vessel is outside of its fence, or the reference too far away; empty if neither is, or it is not known."""
        if self._measured is None or self._desired is None:
            return ""
        p, watch = self._node.parameters, self._loop.watch
        outside = fence_problem(self._measured[1], watch.fence.fence if watch and watch.fence else None)
        return outside or distance_problem(self._measured[1], self._desired.motion, p.vessel.length, p.safety.enable_distance)

    def _held_out(self, now: int) -> tuple[str, Reason] | None:
        """That all odometry for the time-out was held out as jumps, so that its last good sample is too old."""
        old = self._measured is not None and seconds(now - self._measured[0]) > self._node.parameters.input_timeout
        return ("odometry", Reason.JUMP) if old else None


POSES = {"pose_twist": PoseStamped, "pose_covariance_twist": PoseWithCovarianceStamped}


def listen_to_state(node: VesselNode, take: Callable[[Measured], None], profile: QoSProfile) -> "PoseAndTwist | None":
    """Subscribe to the measured motion in the form of the parameter `odometry.form`.

    `take`: called with each measurement. Returns what joins two topics; None with odometry, which is whole.
    """
    p = node.parameters.odometry
    if p.form == "odometry":
        node.listen(Odometry, "odom", lambda message: take(read_odometry(message, p.twist_frame)), profile)
        return None
    joined = PoseAndTwist(node, take)
    node.listen(POSES[p.form], "pose", joined.take_pose, profile)
    node.listen(TwistStamped, "twist", joined.take_twist, profile)
    return joined


class PoseAndTwist:
    """Joins a pose and a twist: those of one stamp, where the publisher stamps them alike, else each pose and the last twist.

    `take`: called with each measurement.
    """

    def __init__(self, node: VesselNode, take: Callable[[Measured], None]) -> None:
        self._node, self._take = node, take
        self._twist: Any = None
        self._waiting: Any = None
        self._last_pose = -1
        self._alike = False

    def take_twist(self, message: TwistStamped) -> None:
        """Take a twist; a pose that waits for it goes on."""
        self._twist = message
        self._alike = conversions.nanoseconds(message.header.stamp) == self._last_pose
        if self._waiting is not None:
            self._join(self._waiting)

    def take_pose(self, message: Any) -> None:
        """Take a pose, and wait for its twist if that comes after it."""
        if self._waiting is not None:  # its twist was lost
            self._join(self._waiting)
        self._last_pose = stamp = conversions.nanoseconds(message.header.stamp)
        if self._alike and self._twist_stamp() < stamp:
            self._waiting = message
        else:
            self._join(message)

    def _twist_stamp(self) -> int:
        return conversions.nanoseconds(self._twist.header.stamp) if self._twist is not None else -1

    def _join(self, pose: Any) -> None:
        self._waiting = None
        timeout = self._node.parameters.input_timeout
        topic = self._node.resolve_topic_name("twist")
        apart = abs(conversions.nanoseconds(pose.header.stamp) - self._twist_stamp())
        if self._twist is None or apart > timeout * NANOSECONDS:
            text = f"pose without a twist of its time on {topic}, within {timeout:g} s, is ignored"
            self._node.get_logger().error(text, throttle_duration_sec=1.0)
            return
        message = Odometry(header=pose.header)
        with_covariance = hasattr(pose.pose, "covariance")
        message.pose.pose = pose.pose.pose if with_covariance else pose.pose
        if with_covariance:
            message.pose.covariance = pose.pose.covariance
        message.twist.twist = self._twist.twist
        self._take(read_odometry(message, self._node.parameters.odometry.twist_frame))
