"""Nodes that pass commands on, and what ends these: a ramp, a stop by a person, an autopilot or its pilot that takes over."""

import math
import time
from collections.abc import Callable
from typing import Any

from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats.autopilot import Handover
from vessel_hsmc_ros.core.kernel import between
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WARN, DiagnosticTask, VesselNode


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
    _handover: Handover | None = None  # that of an autopilot

    def values(self) -> dict[str, Any]:
        """What the status tells besides."""
        return {}

    def awaited(self) -> str:
        """What is waited for; empty if nothing is."""
        return ""

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
        """The status, that of the autopilot, and that of the commands."""
        tasks = super().diagnostic_tasks()
        if self._handover is not None:
            waits = self._handover.taken or self._handover.waits(time.monotonic())
            tasks.append(DiagnosticTask("autopilot", WARN if waits else OK, waits or "ready", {}))
        if self._input is not None:
            level, text = self._input.problem() or (OK, "fresh")
            tasks.append(DiagnosticTask("command", level, text, self._input.values()))
        return tasks
