"""The inputs of the control law: which samples count, how old they are, and the law's step on the latest of them."""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import QoSProfile
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop
from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, Reason
from vessel_hsmc_ros.control.safety.samples import (
    LARGEST,
    LENGTHS,
    REPEATED,
    DeadReckoning,
    Freshness,
    Jumps,
    Sample,
    Verdict,
    distance_problem,
    fence_problem,
)
from vessel_hsmc_ros.core.exceptions import ControlError, LawError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate, in_body_frame
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.state_columns import POSITION_VARIANCES
from vessel_hsmc_ros.nodes.base import VesselNode
from vessel_hsmc_ros.nodes.reporting import DiagnosticTask, RecentProblem, ages

WARNING_PERIOD = 5.0  # least time between two warnings of an input that was never received, s


class Expected(NamedTuple):
    """An input as it must be."""

    topic: str  # its topic
    # frames, child_frames: its frames, of which it has one; empty for any
    frames: str | tuple[str, ...] = ()
    child_frames: str | tuple[str, ...] = ()


class InputMonitor:
    """Detects refused, missing, overdue and mismatched inputs of a node, and reports them on its log and in its diagnostics.

    Times are in ns; those of receipt are of one clock: steady in real time, the node's own on simulated time, where ages are
    simulated too. `node`: whose inputs they are; its logger and its view of the ROS graph are used. `expected`: the inputs by
    their names, in the order in which they are reported. `timeout`: age above which an input is overdue, s. `fresh`: number of
    samples in a row that were taken, by input.
    """

    def __init__(
        self, node: Node, expected: Mapping[str, Expected], timeout: float, parameters: FreshnessParameters | None = None
    ) -> None:
        self._node, self._timeout, self._expected = node, timeout, expected
        self._parameters = parameters = parameters or FreshnessParameters()
        self._topics = {name: node.resolve_topic_name(each.topic) for name, each in expected.items()}
        self._freshness = {n: Freshness(timeout, parameters, e.frames, e.child_frames, LARGEST) for n, e in expected.items()}
        self._stamps: dict[str, int] = {}
        self._checked: tuple[str, int | None] = "", None
        self._waiting = ""
        self._problem, self._refusal = RecentProblem(), RecentProblem()
        self.fresh = dict.fromkeys(expected, 0)

    def reset(self) -> None:
        """Forget the samples, as after the clock was set back; the counts of refused ones go on."""
        for freshness in self._freshness.values():
            freshness.reset()
        self.fresh = dict.fromkeys(self._expected, 0)

    def receive(self, name: str, stamp: int) -> None:
        """Record the stamp of a message that is taken without a check of its age, ns, as in lockstep."""
        self._stamps[name] = stamp

    def take(self, name: str, sample: Sample, now: int, received: int, wrong: str = "") -> str:
        """Take a sample, or report and count why it is refused."""
        reason = self._freshness[name].accept(sample, now, received)
        if not reason:
            if not self.fresh[name]:
                self._assume_frame(name, sample)
            self._stamps[name] = sample.stamp
            self.fresh[name] += 1
            return ""
        text = wrong if reason is Reason.NOT_FINITE and wrong else self._refused(name, sample, reason, now)
        if reason not in REPEATED:
            self.fresh[name] = 0
            self._refusal.report(DiagnosticStatus.ERROR, text)
            self.report(f"{text}; ignored")
        return text

    def report(self, problem: str) -> None:
        """Report an error."""
        self._problem.report(DiagnosticStatus.ERROR, problem)
        self._node.get_logger().error(problem, throttle_duration_sec=1.0)

    def overdue(self, now: int, received_now: int) -> tuple[str, Reason] | None:
        """The first input whose latest sample no longer counts, and why; None when all count."""
        for name, freshness in self._freshness.items():
            if reason := freshness.overdue(now, received_now):
                return name, reason
        return None

    def named(self, name: str, reason: Reason) -> str:
        """The text of a reason, with its input and the input's topic."""
        return f"{name} on {self._node.resolve_topic_name(self._topics[name])}: {reason.text}"

    def report_overdue(self, name: str, reason: Reason, now: int, consequence: str) -> None:
        """Report an overdue input: a warning if its publisher has left, as at the end of a run, else an error."""
        self.fresh[name] = 0
        topic = self._topics[name]
        if reason in (Reason.NOT_RECEIVED, Reason.JUMP):
            return  # `check` names the former, and each sample that is held out is reported
        if not self._node.count_publishers(topic):
            text = f"no {name}: {topic} no longer has a publisher; {consequence}"
            self._problem.report(DiagnosticStatus.WARN, text)
            self._node.get_logger().warning(text, throttle_duration_sec=WARNING_PERIOD)
        elif not self._refusal.current:
            why = "" if reason is Reason.OVERDUE else f", {reason.text}"
            if reason in (Reason.STAMP_OLD, Reason.STAMP_FUTURE) and name in self._stamps:
                why = f" by its stamp, of {seconds(self._stamps[name] - now):+.3g} s"
            self.report(f"no {name} for {self._timeout:g} s{why}: {consequence}")

    def check(self, pending: int | None = None) -> None:
        """Warn if the law could not run, for the same reason as at the last call.

        Call it periodically, with a period in which every input is received in normal operation. `pending`: stamp of the first
        odometry since the last command that waits for the reference of its own stamp, ns.
        """
        missing = [f"{name} on {topic}" for name, topic in self._topics.items() if name not in self._stamps]
        reason = f"waiting for {' and '.join(missing)}" if missing else ""
        # Seen twice, since messages in transit explain a single time.
        persists = self._checked == (reason, pending) and bool(reason or pending is not None)
        self._checked = reason, pending
        self._waiting = (reason or self._mismatch()) if persists else ""
        if self._waiting:
            self._node.get_logger().warning(self._waiting, throttle_duration_sec=WARNING_PERIOD)

    def status(self) -> tuple[bytes, str] | None:
        """Diagnostics level and message of the present problem; None when there is none."""
        return self._problem.current or ((DiagnosticStatus.WARN, self._waiting) if self._waiting else None)

    def ages(self, now: int) -> dict[str, float | None]:
        """Age of the last sample taken of each input by its stamp, s, at a time, ns; None before the first."""
        return {name: None if f.last is None else seconds(now - f.last) for name, f in self._freshness.items()}

    def diagnostic_task(self) -> DiagnosticTask:
        """How many samples were refused, by input and reason."""
        counts = {
            f"{name}: {reason.name.lower()}": count
            for name, freshness in self._freshness.items()
            for reason, count in freshness.refused.items()
        }
        level, message = self.status() or (DiagnosticStatus.OK, "inputs are fresh")
        return DiagnosticTask("inputs", level, message, {"refused": sum(counts.values()), **counts})

    def _refused(self, name: str, sample: Sample, reason: Reason, now: int) -> str:
        """Why a sample is refused, with its value and what is allowed."""
        if reason is Reason.WRONG_FRAME:
            return f"{name} {self._wrong_frame(name, sample)}"
        off = seconds(sample.stamp - now)
        p = self._parameters
        texts = {
            Reason.NOT_FINITE: f"must have numbers of at most {LARGEST:g} (got {max(sample.values, key=abs):g})",
            Reason.UNCERTAIN: f"must have a variance of at most {p.covariance_limit:g} m² (got {sample.covariance:g} m²)",
            Reason.STAMP_OLD: f"must be stamped at most {self._timeout:g} s ago (got {-off:.3g} s)",
            Reason.STAMP_FUTURE: f"must be stamped at most {p.future_tolerance:g} s ahead (got {off:.3g} s)",
        }
        return f"{name} {texts.get(reason, f'must be stamped after the last one (got {seconds(sample.stamp):.9f} s)')}"

    def _wrong_frame(self, name: str, sample: Sample) -> str:
        """The frames of a sample, and those that it may have."""
        freshness = self._freshness[name]
        pairs = zip((sample.frame, sample.child_frame), freshness.frames, strict=True)
        given, needed = zip(*((repr(frame), " or ".join(map(repr, allowed))) for frame, allowed in pairs if allowed), strict=True)
        before = " as before" if freshness.narrowed else ""
        remedy = "safety.freshness.frames_checked: false accepts any"
        return f"must be in frame {' and '.join(needed)}{before} (got {' and '.join(given)}); {remedy}"

    def narrow(self, name: str, frames: tuple[str, ...]) -> None:
        """Take samples of an input in some of its frames only."""
        self._freshness[name].narrow(frames)

    def _assume_frame(self, name: str, sample: Sample) -> None:
        """Warn of samples that name no frame, at the first one and after each interruption."""
        if (frames := self._freshness[name].frames[0]) and not sample.frame:
            text = f"{name} names no frame: it is taken to be in {frames[0]!r}"
            self._node.get_logger().warning(text, throttle_duration_sec=WARNING_PERIOD)

    def _mismatch(self) -> str:
        latest = " and ".join(f"{name} of {seconds(self._stamps[name]):.9f} s" for name in self._topics)
        return f"no command: in lockstep it needs inputs of one stamp, the latest are {latest}"


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
    """The motion in an odometry message, and what its checks take."""
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


def came_back_elsewhere(before: Desired, after: Desired, timeout: float, length: float) -> str:
    """That a reference was silent and goes on where it cannot have gone meanwhile, as of a node that was started again.

    `timeout`: silence from which on it counts, s. `length`: of the vessel, m. Returns an empty text if it is not so.
    """
    a, b, silent = before.motion, after.motion, seconds(after.sample.stamp - before.sample.stamp)
    moved = math.hypot(b.x - a.x, b.y - a.y)
    if silent <= timeout or moved <= LENGTHS * length + silent * max(math.hypot(m.u, m.v) for m in (a, b)):
        return ""
    return f"the reference was silent for {silent:.1f} s and is now {moved:.1f} m away, at ({b.x:.6g}, {b.y:.6g}) m"


class ControllerInputs:
    """The latest odometry and reference that count.

    `monitor`: what checks and reports the inputs.
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
        """Take odometry if it counts and its motion is that of a ship; returns whether it counts."""
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
        if self.monitor.take("reference", desired.sample, now, received, desired.wrong):
            return
        before, self._desired = self._desired, desired
        p = self._node.parameters
        if before and (text := came_back_elsewhere(before, desired, p.input_timeout, p.vessel.length)):
            self._node.stand_by(text)

    def serve(self, now: int, received_now: int, elapsed: int, reason: Reason = Reason.NONE) -> Terms | None:
        """Serve a control period: run the law on the latest odometry and the reference of its time, or else the safe action.

        `now`: ROS time, ns. `received_now`: present time on the clock of receipts, ns. `elapsed`: time of the step as the
        control loop counts it, ns. `reason`: why the law must not command; NONE if it may. Returns the terms of the law; None if
        it has not run.
        """
        missing = self.monitor.overdue(now, received_now) or self._held_out(now) or self._out_of_reach()
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

    def _out_of_reach(self) -> tuple[str, Reason] | None:
        """That the reference of a steered vessel is where it would not be enabled: of two places, one is in another frame."""
        p, measured, desired = self._node.parameters, self._measured, self._desired
        if p.lockstep or not self._loop.enabled or measured is None or desired is None:
            return None
        if text := distance_problem(measured[1], desired.motion, p.vessel.length, p.safety.enable_distance):
            self.monitor.report(f"{text} {self._loop.supervision.consequence}")
            return "reference", Reason.JUMP
        return None

    def _held_out(self, now: int) -> tuple[str, Reason] | None:
        """That all odometry for the time-out was held out as jumps, so that its last good sample is too old."""
        old = self._measured is not None and seconds(now - self._measured[0]) > self._node.parameters.input_timeout
        return ("odometry", Reason.JUMP) if old else None


POSES = {"pose_twist": PoseStamped, "pose_covariance_twist": PoseWithCovarianceStamped}


def state_topics(form: str) -> dict[str, Any]:
    """The topics of the measured motion in a form, with their types."""
    return {"odom": Odometry} if form == "odometry" else {"pose": POSES[form], "twist": TwistStamped}


def listen_to_state(node: VesselNode, take: Callable[[Measured], None], profile: QoSProfile) -> None:
    """Subscribe to the measured motion in the form of the parameter `odometry.form`; `take` is called with each measurement."""
    p, joined = node.parameters.odometry, PoseAndTwist(node, take)
    takers = {
        "odom": lambda message: take(read_odometry(message, p.twist_frame)),
        "pose": joined.take_pose,
        "twist": joined.take_twist,
    }
    for topic, kind in state_topics(p.form).items():
        node.listen(kind, topic, takers[topic], profile)


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
