"""What follows when an autopilot or its pilot takes over: the commands end, and the controller goes to standby."""

import math
import time
from collections.abc import Callable

from std_srvs.srv import SetBool
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats.handover import Handover
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import VesselNode

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
