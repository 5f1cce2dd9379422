"""Supervision of a control law's inputs: which have been received, how old they are, whether their stamps match."""

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.nodes.recent_problem import RecentProblem

WARNING_PERIOD = 5.0
"""Least time between two warnings of an input that was never received, s."""


class InputMonitor:
    """Detects missing, overdue and mismatched inputs of a node, and reports them on its log and in its diagnostics.

    Times of receipt are on the node's clock: on simulated time, ages are simulated too.

    Args:
        node: Whose inputs they are; its logger and its view of the ROS graph are used.
        topics: Name of each input by its topic's, in the order in which they are reported.
        timeout: Age above which an input is overdue, s.
    """

    def __init__(self, node: Node, topics: Mapping[str, str], timeout: float) -> None:
        self._node = node
        self._topics = {name: node.resolve_topic_name(topic) for topic, name in topics.items()}
        self._timeout = timeout
        self._received: dict[str, int] = {}
        self._stamps: dict[str, int] = {}
        self._checked: tuple[str, int | None] = "", None
        self._waiting = ""
        self._problem, self._refusal = RecentProblem(), RecentProblem()

    def receive(self, name: str, stamp: int, now: int) -> None:
        """Record the receipt of a message.

        Args:
            name: The input.
            stamp: The message's stamp, ns.
            now: Time of its receipt, ns.
        """
        self._stamps[name], self._received[name] = stamp, now

    def refuse(self, reason: str) -> None:
        """Report a message that is ignored; `report_overdue` then omits the input that is overdue for the same reason."""
        self._refusal.report(DiagnosticStatus.ERROR, reason)
        self.report(f"{reason}; ignored")

    def report(self, problem: str) -> None:
        """Report an error."""
        self._problem.report(DiagnosticStatus.ERROR, problem)
        self._node.get_logger().error(problem, throttle_duration_sec=1.0)

    def overdue(self, now: int) -> str | None:
        """The first input whose latest message is older than the time-out at a time, ns; None when all are recent enough."""
        oldest = now - round(self._timeout * NANOSECONDS)
        return next((name for name in self._topics if self._received.get(name, oldest) < oldest), None)

    def report_overdue(self, name: str) -> None:
        """Report an overdue input: a warning if its publisher has left, as at the end of a run, else an error."""
        topic = self._topics[name]
        if not self._node.count_publishers(topic):
            text = f"no {name}: {topic} no longer has a publisher; the wrench is zero"
            self._problem.report(DiagnosticStatus.WARN, text)
            self._node.get_logger().warning(text, throttle_duration_sec=WARNING_PERIOD)
        elif not self._refusal.current:
            self.report(f"no {name} for {self._timeout:g} s: the wrench is zero")

    def check(self, pending: int | None = None) -> None:
        """Warn if the law could not run, for the same reason as at the last call.

        Call it periodically, with a period in which every input is received in normal operation.

        Args:
            pending: Stamp of an odometry message that still waits for the reference of its own stamp, ns.
        """
        missing = [f"{name} on {topic}" for name, topic in self._topics.items() if name not in self._received]
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

    def _mismatch(self) -> str:
        latest = " and ".join(f"{name} of {seconds(self._stamps[name]):.9f} s" for name in self._topics)
        return f"no command: in lockstep it takes inputs of one stamp, the latest are {latest}"
