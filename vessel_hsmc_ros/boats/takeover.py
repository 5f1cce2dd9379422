"""Nodes that pass commands on, and what ends these: a ramp, a stop by a person, an autopilot or its pilot that takes over."""

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

from geometry_msgs.msg import WrenchStamped
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats.autopilot import BootClock, Handover
from vessel_hsmc_ros.core.kernel import between
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WARN, DiagnosticTask, VesselNode
from vessel_hsmc_ros.nodes.commands import CommandInput
from vessel_hsmc_ros.nodes.odometry_output import OdometryOutput


class StopLatch:
    """The share goes to 1 in `ramp_time` while there are commands, to 0 in the same time without, and is 0 after `~/stop`.

    It stays 0 until `~/rearm`; the latch offers both services. `node`: offers the services; its parameter `ramp_time` is the
    time between 0 and 1; 0: at once. `output`: what is zero after a stop, such as "the wrench". `act`: sends the zero of a stop,
    so that it does not wait for the next period. `text`: what a stopped node reports.
    """

    def __init__(self, node: VesselNode, output: str, act: Callable[[], None], share: float = 0.0) -> None:
        self._node, self._act = node, act
        self.share, self.stopped = share, False
        self.text = f"stopped: {output} is zero until ~/rearm"
        self._at = time.monotonic()
        node.create_service(Trigger, "~/stop", self._stop)
        node.create_service(Trigger, "~/rearm", self._rearm)

    def update(self, fresh: bool, allowed: bool = True) -> float:
        """The share at present."""
        now, ramp_time = time.monotonic(), self._node.parameters.ramp_time
        change = (now - self._at) / ramp_time if ramp_time else 1.0
        self._at = now
        ends = self.stopped or not allowed
        self.share = 0.0 if ends else between(self.share + (change if fresh else -change), 0.0, 1.0)
        return self.share

    def _stop(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.stopped, self.share = True, 0.0  # also where it is rearmed before the next update
        self._act()
        response.success, response.message = True, self.text
        self._node.get_logger().warning(self.text)
        return response

    def _rearm(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.stopped = False
        response.success, response.message = True, "rearmed: fresh commands are passed on"
        self._node.get_logger().info(response.message)
        return response


REPEAT = 0.2  # time after which a controller that is not in standby yet is sent there again, s


class Takeover:
    """Reports the standby of the controller to the handover, and after a takeover puts the controller there, again until it is.

    `node`: subscribes to the state of the controller, and calls its service. `handover`: knows whether there has been a
    takeover. `rest`: called while the controller is in standby.
    """

    def __init__(self, node: VesselNode, handover: Handover, end: Callable[[], None], rest: Callable[[], None]) -> None:
        self._node, self._handover, self._end, self._rest = node, handover, end, rest
        self._reported, self._called_at = "", -math.inf
        self._enable = node.create_client(SetBool, "controller/enable")
        node.listen(ControlState, "controller/state", self._on_state, qos.NEWEST)

    def _on_state(self, message: ControlState) -> None:
        standby = message.operation in (ControlState.STANDBY, ControlState.STOPPED)
        if standby:
            self._rest()
            self._reported = ""
        self._handover.controller(standby, time.monotonic())
        self.act()

    def act(self) -> None:
        """Do what follows from a takeover, if there has been one."""
        if not (reason := self._handover.taken):
            return
        if reason != self._reported:
            self._reported = reason
            self._end()
            text = f"{reason}: commands end, and the controller goes to standby until a person enables it"
            self._node.get_logger().error(text)
            self._node.reporter.event("handover", reason)
        now = time.monotonic()
        if now - self._called_at > REPEAT:
            self._called_at = now
            if self._enable.service_is_ready():
                self._enable.call_async(SetBool.Request(data=False))


class PassingNode(VesselNode):
    """A node that passes commands on: how it reports that, and its command, and takes a changed time-out."""

    _latch: StopLatch
    _input: Any = None  # the command where it has a report of its own

    def values(self) -> dict[str, Any]:
        """What the status tells besides."""
        return {}

    def awaited(self) -> str:
        """What is waited for; empty if nothing is."""
        return ""

    def take_wrench(self) -> Any:
        """Listen to cmd_wrench."""
        taken: Any = CommandInput(self, "cmd_wrench", self.parameters.command_timeout)
        self.listen(WrenchStamped, "cmd_wrench", taken.take, qos.NEWEST)
        return taken

    def retune(self, parameters: Any) -> None:
        """Take a changed time-out."""
        if self._input is not None:
            self._input.retune(parameters.command_timeout)

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Whether commands are passed on, and what is awaited."""
        latch = self._latch
        values = {"share": latch.share, "stopped": latch.stopped, **self.values()}
        if latch.stopped:
            return WARN, latch.text, values
        if self.problem.current:
            return *self.problem.current, values
        if awaited := self.awaited():
            return WARN, awaited, values
        return OK, "passing commands on" if latch.share == 1.0 else "the output is zero or on its way", values

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """The status, and that of the commands."""
        tasks = super().diagnostic_tasks()
        if self._input is not None:
            level, text = self._input.problem() or (OK, "fresh")
            tasks.append(DiagnosticTask("command", level, text, self._input.values()))
        return tasks


class AutopilotNode(PassingNode):
    """A node that passes commands on to an autopilot while that is ready for them, and makes odometry of its messages."""

    def connect(self, mode: int, modes: Mapping[int, str], rate: float) -> None:
        """Offer the odometry at a rate, Hz, and wait for the autopilot to be in the mode of commands, a number of `modes`."""
        self._boot = BootClock()
        self._handover = Handover(mode, self.parameters.heartbeat_timeout, modes)
        self._odometry = OdometryOutput(self, rate)
        self._takeover = Takeover(self, self._handover, self.end, self.rest)
        self._latch = StopLatch(self, "the output", self.end)

    def end(self) -> None:
        """End the commands at once."""
        raise NotImplementedError

    def rest(self) -> None:
        """Called while the controller is in standby."""

    def restarted(self) -> None:
        """Called when the autopilot has been restarted."""

    def sampled(self, stamp: float) -> int:
        """The time here, ns, of a message that the autopilot stamped at a time of its own, s; its restart is a takeover."""
        reboots = self._boot.reboots
        age = self._boot.age(stamp, time.monotonic())
        if self._boot.reboots > reboots:
            self.restarted()
            self._handover.take_over("the autopilot has been restarted, or has set its clock back")
            self._takeover.act()
        return self.now() - round(age * NANOSECONDS)

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """The status, what the autopilot lacks, and that of the commands."""
        own, *others = super().diagnostic_tasks()
        waits = self._handover.taken or self._handover.waits(time.monotonic())
        return [own, DiagnosticTask("autopilot", WARN if waits else OK, waits or "ready", {}), *others]
