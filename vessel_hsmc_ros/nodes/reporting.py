"""What a node reports about itself: its diagnostics, one status a task, and an event for each thing that happens to it.

The tasks that several nodes have in common are made here.
"""

import math
import shutil
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import RefusalError
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.nodes import qos

if TYPE_CHECKING:
    from rclpy.publisher import Publisher


OK, WARN, ERROR, STALE = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE


class DiagnosticTask(NamedTuple):
    """The state of one diagnostic task of a node, such as the age of its inputs: a status of /diagnostics."""

    name: str  # what it is about; empty for the node as a whole
    level: bytes  # OK, WARN, ERROR, or STALE where its values are not updated
    message: str  # the state in a few words
    values: dict[str, Any]  # measured values by name


def summarised(own: DiagnosticTask, others: Sequence[DiagnosticTask]) -> DiagnosticTask:
    """The status of a node as a whole: that of its own work or, where that is OK, of all tasks that are not."""
    raised = [task for task in others if task.level != OK]
    if own.level != OK or not raised:
        return own
    level = ERROR if any(task.level == ERROR for task in raised) else WARN
    return own._replace(level=level, message="; ".join(f"{task.name}: {task.message}" for task in raised))


class Reporter:
    """Publishes the diagnostics and the events of a node, and offers the services that cause events.

    `stamp`: returns the time of a report, ns. `parameters`: the dataclass of its parameters. A node without parameters that may
    change while it runs, such as an observer of a run, has no events. `keep`: called with the topic and the message of each
    diagnostics and event: the black box, where the node has one.
    """

    def __init__(self, node: Node, stamp: Callable[[], int], parameters: type) -> None:
        self._node, self._stamp = node, stamp
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self.keep: Callable[[str, Any], None] = lambda _topic, _message: None
        self._levels: list[bytes] = []
        self._events: Publisher | None = None
        if any(entry.tunable for entry in schema.entries(parameters).values()):
            self._events = node.create_publisher(Event, EVENTS, qos.EVENTS)

    def diagnose(self, tasks: Sequence[DiagnosticTask], only_changes: bool = False) -> None:
        """Publish a status for each task, the first of them that of the node as a whole."""
        levels = [task.level for task in tasks]
        if only_changes and levels == self._levels:
            return
        self._levels = levels
        array = DiagnosticArray()
        array.header.stamp = conversions.time_message(self._stamp())
        array.status = [self._status(task) for task in tasks]
        self._diagnostics.publish(array)
        self.keep(self._diagnostics.topic_name, array)

    def _status(self, task: DiagnosticTask) -> DiagnosticStatus:
        node = self._node.get_fully_qualified_name().lstrip("/")
        name = f"{node}: {task.name}" if task.name else node
        pairs = [KeyValue(key=key, value=str(value)) for key, value in task.values.items()]
        return DiagnosticStatus(level=task.level, name=name, message=task.message, hardware_id="", values=pairs)

    def event(self, kind: str, text: str) -> None:
        """Publish and log an event."""
        self._node.get_logger().info(f"{kind}: {text}")
        if self._events is not None:
            message = Event(node=self._node.get_name(), kind=kind, text=text)
            message.header.stamp = conversions.time_message(self._stamp())
            self._events.publish(message)
            self.keep(self._events.topic_name, message)

    def changes(self, before: object, after: object) -> None:
        """Publish an event for each parameter whose value differs between two instances of a node's parameters."""
        old, new = schema.flatten(before), schema.flatten(after)
        for name in (name for name in new if new[name] != old[name]):
            self.event("parameter", f"{self._node.get_name()}.{name}: {schema.shown(old[name])} -> {schema.shown(new[name])}")

    def offer(self, kind: str, work: Callable[[], str]) -> None:
        """Offer a service that triggers `work`, whose result is the response's message and the event's text.

        `kind`: name of the service below the node's, and kind of the event. `work`: what the service does. A RefusalError of it
        is the response's message: the request then has no effect.
        """

        def serve(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            response.success, response.message = self._done(kind, work)
            return response

        self._node.create_service(Trigger, f"~/{kind}", serve)

    def offer_switch(self, kind: str, opposite: str, work: Callable[[bool], str]) -> None:
        """Offer a service that switches something on and off by `work`, as `offer` does."""

        def serve(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
            response.success, response.message = self._done(kind if request.data else opposite, lambda: work(request.data))
            return response

        self._node.create_service(SetBool, f"~/{kind}", serve)

    def _done(self, kind: str, work: Callable[[], str]) -> tuple[bool, str]:
        """Do what a service was called for: whether it was done, and the message about it."""
        try:
            text = work()
        except RefusalError as error:
            self._node.get_logger().warning(f"{kind} is refused: {error}")
            return False, str(error)
        self.event(kind, text)
        return True, text


REPORT_SECONDS = 1.5
"""Time for which a problem is current, s: longer than the period of diagnostics, 1 s, so that each problem appears there."""


class RecentProblem:
    """A problem with its diagnostics level, current for REPORT_SECONDS after each report."""

    def __init__(self) -> None:
        self._level, self._text = b"", ""
        self._met_at = -REPORT_SECONDS

    def report(self, level: bytes, text: str) -> None:
        """Record a problem that occurs now."""
        self._level, self._text, self._met_at = level, text, time.monotonic()

    @property
    def current(self) -> tuple[bytes, str] | None:
        """Level and text of the problem; None if it was reported more than REPORT_SECONDS ago."""
        return (self._level, self._text) if time.monotonic() - self._met_at < REPORT_SECONDS else None


MINUTE = 60.0  # time over which events are counted, s
TOLERATED = 5  # events a minute that are not worth a warning, such as periods that a busy machine missed
LOW_SPACE, NO_SPACE = 1e9, 1e8  # free disk space below which a recording is in danger, and will end soon, bytes
LONGEST_WAIT = 5.0
"""Longest time for which a message may wait for the recorder, s; on a busy machine a second or two are normal, and harmless."""


class Recent:
    """The increase of a counter in the last minute of wall time."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque()

    def increase(self, count: int) -> int:
        """Note the present count; returns by how much it has grown since a minute ago, or since the first call."""
        now = time.monotonic()
        self._seen.append((now, count))
        while now - self._seen[0][0] > MINUTE:
            self._seen.popleft()
        return max(0, count - self._seen[0][1])


def ages(name: str, seconds: Mapping[str, float | None], limit: float) -> DiagnosticTask:
    """The ages of the messages on which a node depends.

    `seconds`: age of the latest message by its name, s; None where none has been received. `limit`: age above which a message
    no longer counts, s; infinite in lockstep.
    """
    old = [key for key, age in seconds.items() if (math.inf if age is None else age) > limit]
    shown = {key: math.nan if age is None else round(age, 6) for key, age in seconds.items()}
    message = f"no recent {' and '.join(old)}" if old else "all recent"
    return DiagnosticTask(name, STALE if old else OK, message, {**shown, "limit": limit})


def counted(name: str, count: int, recent: int, of: float, what: str) -> DiagnosticTask:
    """Events that should not occur: a warning from TOLERATED a minute on, an error where they are one of twenty."""
    level = ERROR if recent > max(TOLERATED, 0.05 * of) else WARN if recent > TOLERATED else OK
    return DiagnosticTask(name, level, f"{recent} {what} in the last minute", {"total": count, "last_minute": recent})


def saturation(share: float, lasting: bool) -> DiagnosticTask:
    """How much of the time a command is limited."""
    message = "at a limit for too long" if lasting else f"{share:.0%} of the last minute at a limit"
    return DiagnosticTask("saturation", WARN if lasting else OK, message, {"share": round(share, 4)})


def bounded(name: str, values: Mapping[str, float], limit: float) -> DiagnosticTask:
    """Magnitudes that should stay below a limit; NaN stands for a value that does not exist."""
    present = {key: abs(value) for key, value in values.items() if not math.isnan(value)}
    above = [key for key, value in present.items() if value > limit]
    message = f"{' and '.join(above)} above {limit:g}" if above else "within its limit" if present else "the law has none"
    return DiagnosticTask(name, WARN if above else OK, message, {**present, "limit": limit})


def motion(values: Mapping[str, float], refused: str) -> DiagnosticTask:
    """Whether a reference can be followed."""
    wrong = [key for key, value in values.items() if not math.isfinite(value)]
    if wrong:
        return DiagnosticTask("feasibility", ERROR, f"not finite: {', '.join(wrong)}", dict(values))
    return DiagnosticTask("feasibility", WARN if refused else OK, refused or "feasible", dict(values))


def recording(directory: Path, waited: float, dropped: int) -> list[DiagnosticTask]:
    """The diagnostic tasks of a recorder: its queue, the space left on its disk, gaps in its topics."""
    slow = waited > LONGEST_WAIT
    gaps = f"{dropped} messages are missing" if dropped else "no message is missing"
    return [
        DiagnosticTask("queue", WARN if slow else OK, f"messages wait for {waited:.2f} s", {"longest_wait": round(waited, 4)}),
        _space(directory),
        DiagnosticTask("gaps", WARN if dropped else OK, gaps, {"dropped": dropped}),
    ]


def _space(directory: Path) -> DiagnosticTask:
    try:
        free = shutil.disk_usage(directory).free
    except OSError as error:
        return DiagnosticTask("disk space", STALE, f"unknown: {error.strerror}", {})
    level = ERROR if free < NO_SPACE else WARN if free < LOW_SPACE else OK
    return DiagnosticTask("disk space", level, f"{free / 1e9:.1f} GB left", {"free": free})
