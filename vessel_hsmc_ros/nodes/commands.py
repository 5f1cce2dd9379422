"""Commands at the ends of a node: fresh ones of one publisher come in, and none once they are stale; finite numbers leave."""

import math
import time
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import WrenchStamped

from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.control.safety.samples import Freshness, Sample
from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ERROR, WARN, VesselNode
from vessel_hsmc_ros.nodes.reporting import RecentProblem

LARGEST = 3.4e38  # the largest magnitude that counts as finite: autopilots take commands in single precision


def is_finite(command: Sequence[float]) -> bool:
    """Whether all numbers of a command are finite, in single precision too."""
    return all(abs(value) <= LARGEST for value in command)  # False for NaN


def finite(command: tuple[float, ...], report: Callable[[str], None]) -> tuple[float, ...]:
    """A command of finite numbers as it is; any other is reported, and zero takes its place."""
    if is_finite(command):
        return command
    report(f"the output must be finite numbers (got {', '.join(map(str, command))}): zero is sent")
    return (0.0,) * len(command)


Command = tuple[float, float]

NO_COMMAND = "no recent command on"  # how the problem of a node begins to which nothing is commanded


class CommandInput:
    """The latest command that a node may carry out.

    A command counts if it was received within the time-out and is stamped within it, later than the last one taken, in the
    frame of the body, and finite; and while its topic has one publisher. All others are refused, counted and logged. Messages
    are aged by the steady clock, on simulated time by the clock of the node, and in lockstep by the stamps of the steps.
    `node`: the node that carries out the commands; its `stamp` is the present time in lockstep. `timeout`: age from which on a
    command does not count, s.
    """

    def __init__(self, node: VesselNode, topic: str, timeout: float) -> None:
        p: Any = node.parameters
        self._node, self._topic = node, topic
        self._publishers = node.sources(WrenchStamped, topic)
        self._frame = p.frame_prefix + conversions.BODY
        self._future = p.freshness.future_tolerance
        self._freshness = Freshness(timeout, p.freshness, self._frame, "")
        self._simulated = p.lockstep or node.get_parameter("use_sim_time").value
        self._strict = p.lockstep and not p.ride_through
        self._wrench: Command = (0.0, 0.0)
        self._taken = self._shared = self._now = 0
        self._problem = RecentProblem()

    def take(self, message: WrenchStamped) -> bool:
        """Take a command, or refuse it with a reason in the log."""
        now, received = self._times()
        wrench = conversions.read_wrench(message)
        stamp = conversions.nanoseconds(message.header.stamp)
        conflict = self._conflict()
        self._shared += bool(conflict)
        sample = Sample(stamp, message.header.frame_id, "", wrench)
        reason = Reason.SECOND_PUBLISHER if conflict else self._freshness.accept(sample, now, received)
        if reason is Reason.NONE:
            if not sample.frame:
                text = f"commanded wrench names no frame: it is taken to be in {self._frame}"
                self._node.get_logger().warning(text, once=True)
            self._wrench = wrench
            self._taken += 1
            return True
        self._refuse(conflict or self._explained(reason, sample, now))
        return False

    def present(self) -> Command | None:
        """The command that holds now; None if there is none."""
        if self._conflict() or self._freshness.overdue(*self._times()) is not Reason.NONE:
            return None
        return self._wrench

    def reset(self) -> None:
        """Forget the commands taken so far, as after a step of the clock."""
        self._freshness.reset()

    def retune(self, timeout: float) -> None:
        """Take a changed time-out, s."""
        self._freshness.timeout = round(timeout * NANOSECONDS)

    def problem(self) -> tuple[bytes, str] | None:
        """Level and text of what is wrong at present; None if nothing is."""
        if conflict := self._conflict():
            return ERROR, f"{conflict} No command of theirs is taken"
        if self._problem.current:
            return self._problem.current
        waits = self._node.parameters.lockstep and not self._taken  # for the first step
        if not waits and self._freshness.overdue(*self._times()) is not Reason.NONE:
            return WARN, f"{NO_COMMAND} {self._node.resolve_topic_name(self._topic)}"
        return None

    def values(self) -> dict[str, Any]:
        """Numbers of taken and refused commands and the age of the latest one, for the diagnostics."""
        last = self._freshness.last
        age = math.inf if last is None else seconds(self._times()[0] - last)
        refused = self._freshness.refused + Counter({Reason.SECOND_PUBLISHER: self._shared})
        return {
            "taken": self._taken,
            "refused": sum(refused.values()),
            "age": age,
            **{f"refused_{why.name.lower()}": count for why, count in refused.items()},
        }

    def _times(self) -> tuple[int, int]:
        """The present time by the clock of the stamps and by that of the receipts, ns."""
        now = self._node.stamp if self._node.parameters.lockstep else self._node.now()
        if now < self._now:  # the clock was set back: all stamps so far are by another time
            self._freshness.reset()
        self._now = now
        return now, now if self._simulated else time.monotonic_ns()

    def _conflict(self) -> str:
        """Which topic has several publishers, in real time; rclpy does not show which one sent a message."""
        return "" if self._node.parameters.lockstep else self._publishers.conflict()

    def _refuse(self, text: str) -> None:
        if self._strict:
            raise SimulationError(text)
        self._problem.report(WARN, f"{text}; ignored")
        self._node.get_logger().error(f"{text}; ignored", throttle_duration_sec=1.0)

    def _explained(self, reason: Reason, sample: Sample, now: int) -> str:
        """What is wrong with a command, and what is allowed."""
        age = seconds(now - sample.stamp)
        last, timeout = seconds(self._freshness.last or 0), seconds(self._freshness.timeout)
        what = {
            Reason.STAMP_OLD: f"must be stamped at most {timeout:g} s ago (got {age:.3f} s)",
            Reason.STAMP_FUTURE: f"must be stamped at most {self._future:g} s ahead (got {-age:.3f} s)",
            Reason.WRONG_FRAME: f"must be in frame {self._frame} (got '{sample.frame}')",
            Reason.NOT_FINITE: f"must be finite numbers (got {sample.values[0]} N, {sample.values[1]} N·m)",
        }
        order = f"must be stamped after the last one, {last:.9f} s (got {seconds(sample.stamp):.9f} s)"
        return f"commanded wrench {what.get(reason, order)}"


def is_nothing(message: WrenchStamped) -> bool:
    """Whether a message of a lockstep run states that no command of its step has come."""
    return not message.header.frame_id and math.isnan(message.wrench.force.x)


def nothing(stamp: int) -> WrenchStamped:
    """The message that no command of a step has come, with the stamp of the step, ns."""
    message = conversions.new_wrench()
    message.header.frame_id = ""
    conversions.write_wrench(message, conversions.time_message(stamp), (math.nan, math.nan))
    return message


class UnstampedInput:
    """The latest numbers on some topics, such as the thrust of each thruster, whose age counts from their receipt.

    The clock is the steady one. `topics`: of messages of one kind. `timeout`: age from which on a message does not count, s.
    `read`: the numbers of a message.
    """

    def __init__(
        self,
        node: VesselNode,
        kind: Any,
        topics: Sequence[str],
        timeout: float,
        read: Callable[[Any], tuple[float, ...]] = lambda message: (message.data,),
    ) -> None:
        self._node, self._timeout, self._read = node, timeout, read
        self._latest: dict[str, tuple[tuple[float, ...], float]] = dict.fromkeys(topics, ((), -math.inf))
        self._problem = RecentProblem()
        self._taken = self._refused = 0
        for topic in topics:
            node.listen(kind, topic, partial(self.take, topic), qos.NEWEST)

    def take(self, topic: str, message: Any) -> None:
        """Take the numbers of a message, if they are finite and of the one publisher."""
        numbers, wrong = self._read(message), self._conflict()
        if not all(map(math.isfinite, numbers)):
            wrong = f"{self._node.resolve_topic_name(topic)} must be finite (got {', '.join(map(str, numbers))})"
        if wrong:
            self._refused += 1
            self._problem.report(WARN, f"{wrong}; ignored")
            self._node.get_logger().error(f"{wrong}; ignored", throttle_duration_sec=1.0)
            return
        self._taken += 1
        self._latest[topic] = numbers, time.monotonic()

    def present(self) -> tuple[float, ...] | None:
        """The numbers that hold now, in the order of the topics; None if a topic is silent, or has two publishers."""
        if self._conflict() or self._overdue():
            return None
        return tuple(number for numbers, _ in self._latest.values() for number in numbers)

    def retune(self, timeout: float) -> None:
        """Take a changed time-out, s."""
        self._timeout = timeout

    def problem(self) -> tuple[bytes, str] | None:
        """Level and text of what is wrong at present; None if nothing is."""
        if conflict := self._conflict():
            return ERROR, f"{conflict}. No command of theirs is taken"
        if self._problem.current:
            return self._problem.current
        if topic := self._overdue():
            return WARN, f"{NO_COMMAND} {self._node.resolve_topic_name(topic)}"
        return None

    def values(self) -> dict[str, Any]:
        """Numbers of taken and refused messages, for the diagnostics."""
        return {"taken": self._taken, "refused": self._refused}

    def _overdue(self) -> str:
        oldest = time.monotonic() - self._timeout
        return next((topic for topic, (_, received) in self._latest.items() if received < oldest), "")

    def _conflict(self) -> str:
        return self._node.connections.shared(*self._latest)
