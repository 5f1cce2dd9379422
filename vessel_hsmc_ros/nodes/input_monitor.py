"""Supervision of a control law's inputs: which samples count, how old they are, whether their stamps match."""

from collections.abc import Mapping
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, Reason
from vessel_hsmc_ros.control.safety.samples import REPEATED, Freshness, Sample
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.nodes.reporting import DiagnosticTask, RecentProblem

WARNING_PERIOD = 5.0  # least time between two warnings of an input that was never received, s


class Expected(NamedTuple):
    """An input as it must be."""

    topic: str  # its topic
    # frames, child_frames: its frames, of which it has one; empty for any
    frames: str | tuple[str, ...] = ()
    child_frames: str | tuple[str, ...] = ()


class InputMonitor:
    """Detects refused, missing, overdue and mismatched inputs of a node, and reports them on its log and in its diagnostics.

    Times of receipt are of one clock: steady in real time, the node's own on simulated time, where ages are simulated too.
    `node`: whose inputs they are; its logger and its view of the ROS graph are used. `expected`: the inputs by their names, in
    the order in which they are reported. `timeout`: age above which an input is overdue, s.

    Attributes:
        fresh: Number of samples in a row that were taken, by input.
    """

    def __init__(
        self, node: Node, expected: Mapping[str, Expected], timeout: float, parameters: FreshnessParameters | None = None
    ) -> None:
        self._node, self._timeout, self._expected = node, timeout, expected
        self._parameters = parameters = parameters or FreshnessParameters()
        self._topics = {name: node.resolve_topic_name(each.topic) for name, each in expected.items()}
        self._freshness = {n: Freshness(timeout, parameters, e.frames, e.child_frames) for n, e in expected.items()}
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
        """Take a sample, or report and count why it is refused.

        `now`: ROS time, ns. `received`: time of its receipt, ns. `wrong`: which of its numbers are not finite, and what is
        allowed. Returns why it is refused; empty if it is taken.
        """
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
        """The first input whose latest sample no longer counts, and why; None when all count.

        `now`: ROS time, ns. `received_now`: present time on the clock of receipts, ns.
        """
        for name, freshness in self._freshness.items():
            if reason := freshness.overdue(now, received_now):
                return name, reason
        return None

    def named(self, name: str, reason: Reason) -> str:
        """The text of a reason, with its input and the input's topic."""
        return f"{name} on {self._node.resolve_topic_name(self._topics[name])}: {reason.text}"

    def report_overdue(self, name: str, reason: Reason, now: int, consequence: str) -> None:
        """Report an overdue input: a warning if its publisher has left, as at the end of a run, else an error.

        `now`: ROS time, ns. `consequence`: what is commanded without it.
        """
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
            Reason.NOT_FINITE: "must be finite numbers",
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
