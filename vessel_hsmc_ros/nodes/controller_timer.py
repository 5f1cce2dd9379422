"""The controller in real time: a timer on the node's clock runs the law on the latest inputs."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.nodes.base import WARNING_PERIOD
from vessel_hsmc_ros.nodes.controller_inputs import Desired, Measured
from vessel_hsmc_ros.safety.reasons import Reason

if TYPE_CHECKING:
    from rclpy.timer import Timer

    from vessel_hsmc_ros.nodes.controller import ControllerNode

CHECK_PERIOD = 0.1
"""Time between two checks of the clock and of the graph, s."""

CLOCK_STEP = 0.5
"""Difference between the progress of the node's clock and that of the steady clock that is a step of the former, s."""


class RealTime:
    """Runs the law half a period after the odometry, with the reference extrapolated to the stamp of the odometry.

    Args:
        node: The controller.
    """

    waiting = 0

    def __init__(self, node: "ControllerNode") -> None:
        self._node = node
        self._simulated = bool(node.get_parameter("use_sim_time").value)
        self._origin = 0
        self._locked = False
        self._timer: Timer | None = None
        self._last = 0
        self._alone = True
        self._offset: int | None = None

    @property
    def pending(self) -> int | None:
        """None: in real time the law waits for no reference."""
        return None

    def start(self) -> None:
        """Begin the control periods: the state is published and requests are answered before the first odometry."""
        self._origin = self._last = self._node.now()
        self._timer = self._node.create_timer(self._node.loop.grid.period, self._on_timer)
        self._node.create_timer(CHECK_PERIOD, self._check, clock=self._node._wall)

    def received(self) -> int:
        """The clock of receipts, ns: steady, or the node's own on simulated time, where ages are simulated too."""
        return self._node.now() if self._simulated else time.monotonic_ns()

    def take_odometry(self, measured: Measured) -> None:
        """Take odometry; the first fixes the phase of the control periods."""
        node = self._node
        if node.inputs.take_odometry(measured, node.now(), self.received()) and node.connected and not self._locked:
            self._lock_phase(measured.sample.stamp)

    def take_reference(self, desired: Desired) -> None:
        """Take a reference."""
        self._node.inputs.take_reference(desired, self._node.now(), self.received())

    def ready(self) -> Reason:
        """What is missing before the law may command; NONE if nothing is."""
        node = self._node
        if missing := node.inputs.monitor.overdue(node.now(), self.received()):
            return missing[1]
        if min(node.inputs.monitor.fresh.values()) < node.parameters.safety.fresh_samples:
            return Reason.NOT_READY
        if not self._alone:
            return Reason.SECOND_PUBLISHER
        return Reason.NONE if node.has_consumer() else Reason.NO_CONSUMER

    # -- control periods ----------------------------------------------------------------------------------------------

    def _lock_phase(self, stamp: int) -> None:
        """Start the timer anew so that it fires half a period away from the odometry.

        If both occurred at the same instant, the law would use the new odometry in one period and the previous one in the next,
        and a gain that is stable without delay may be unstable with a delay of a full period.
        """
        self._locked = True
        period = self._node.loop.grid.stamp(1)
        now = self._node.now()
        wait = (stamp + period // 2 - now) % period
        self._origin = now + wait
        self._node.loop.begin()
        self._restart(max(wait, 1) * 1e-9, self._first)  # rclpy rejects a period of 0

    def _first(self) -> None:
        self._restart(self._node.loop.grid.period, self._on_timer)

    def _restart(self, period: float, callback: Callable[[], None]) -> None:
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
        self._timer = self._node.create_timer(period, callback)

    def _on_timer(self) -> None:
        node, now = self._node, self._node.now()
        if now < self._last:
            self._set_back(now)
        self._last = now
        if not node.loop.due(now - self._origin):
            return
        reason = Reason.NONE if self._alone else Reason.SECOND_PUBLISHER
        if node.computes:
            with node.timed():
                terms = node.inputs.serve(now, self.received(), now - self._origin, reason)
        else:
            terms = None
            node.loop.skip(now - self._origin, Reason.IN_STANDBY)
        node.publish_period(now, terms)

    # -- clock and graph ----------------------------------------------------------------------------------------------

    def _check(self) -> None:
        """Look for a clock that has not begun or was stepped, and for a second publisher of the command."""
        node, now = self._node, self._node.now()
        self._alone = not node.second_publisher()
        if self._simulated:
            node.clock_problem = "" if now else "waiting for /clock: the node is on simulated time, and nothing publishes it"
            if node.clock_problem:
                node.get_logger().warning(node.clock_problem, throttle_duration_sec=WARNING_PERIOD)
            return
        offset, known = now - time.monotonic_ns(), self._offset
        self._offset = offset
        # The timers of rclpy wait for the time at which they would have fired, on a clock that was set back perhaps for hours.
        if known is not None and abs(offset - known) > CLOCK_STEP * NANOSECONDS:
            if offset < known:
                self._set_back(now)
            else:
                node.report_clock(f"the clock was set ahead by {seconds(offset - known):.3g} s")
            self._origin = self._last = now
            node.loop.begin()
            self._restart(node.loop.grid.period, self._on_timer)

    def _set_back(self, now: int) -> None:
        """The clock was set back: what was learnt and received belongs to another time."""
        node = self._node
        node.report_clock(f"the clock was set back by {seconds(self._last - now):.3g} s: law and inputs are reset")
        node.inputs.reset()
        node.loop.forget()
        self._last = self._origin = now
        node.loop.begin()
