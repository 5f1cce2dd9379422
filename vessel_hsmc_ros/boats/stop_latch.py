"""The share of its commands that a node passes on: a ramp, and a stop that holds until a person rearms the node."""

import time
from collections.abc import Callable

from std_srvs.srv import Trigger

from vessel_hsmc_ros.core.kernel import between
from vessel_hsmc_ros.nodes.base import VesselNode


class StopLatch:
    """The share goes to 1 in `ramp_time` while there are commands, to 0 in the same time without, and is 0 after `~/stop`.

    It stays 0 until `~/rearm`; the latch offers both services. `node`: offers the services; its parameter `ramp_time` is the
    time between 0 and 1; 0: at once. `output`: what is zero after a stop, such as "the wrench". `act`: sends the zero of a
    stop, so that it does not wait for the next period.

    Attributes:
        text: What a stopped node reports.
    """

    def __init__(self, node: VesselNode, output: str, act: Callable[[], None], share: float = 0.0) -> None:
        self._node, self._act = node, act
        self.share, self.stopped = share, False
        self.text = f"stopped: {output} is zero until ~/rearm"
        self._at = time.monotonic()
        node.create_service(Trigger, "~/stop", self._stop)
        node.create_service(Trigger, "~/rearm", self._rearm)

    def update(self, fresh: bool, allowed: bool = True) -> float:
        """The share at present.

        `fresh`: whether there is a command that counts. `allowed`: whether any may be passed on: without it the share is 0 at
        once.
        """
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
