"""The controller in real time: a timer on the node's clock runs the law on the latest inputs."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.nodes.base import WARNING_PERIOD
from vessel_hsmc_ros.nodes.controller_inputs import Desired, Measured
from vessel_hsmc_ros.nodes.controller_timing import TimedNode, Timing

if TYPE_CHECKING:
    from rclpy.timer import Timer

CHECK_PERIOD = 0.1  # time between two checks of the clock and of the graph, s
CLOCK_STEP = NANOSECONDS // 2
"""Difference between the progress of the node's clock and that of the steady clock that is a step of the former, ns."""

MAX_CLOCK_SPEED = 20
"""Highest speed of a simulated clock, as a multiple of the steady clock's: a node that could not run for a while sees no step."""


STANDSTILL = 3.0  # time after which a simulated clock that does not advance is reported, s
WAITING = "waiting for /clock: the node is on simulated time, and nothing publishes it"
STANDING = "/clock stands still: nothing is computed or commanded until it goes on"


class RealTime(Timing):
    """Runs the law half a period after the odometry, with the reference extrapolated to the stamp of the odometry."""

    def __init__(self, node: TimedNode) -> None:
        super().__init__(node)
        self._simulated = bool(node.get_parameter("use_sim_time").value)
        self._origin = 0
        self._locked = False
        self._timer: Timer | None = None
        self._alone = True
        self._seen: tuple[int, int] | None = None
        self._ticked = -1, 0

    def start(self) -> None:
        """Begin the control periods: the state is published and requests are answered before the first odometry."""
        self._origin = self._node.now()
        self._timer = self._node.create_timer(self._node.loop.grid.period, self._on_timer)
        self._node.create_timer(CHECK_PERIOD, self._check, clock=self._node.wall)

    def received(self) -> int:
        """The clock of receipts, ns: steady, or the node's own on simulated time, where ages are simulated too."""
        return self._node.now() if self._simulated else time.monotonic_ns()

    def take_odometry(self, measured: Measured) -> None:
        """Take odometry; the first fixes the phase of the control periods, also after silence or a step of the clock."""
        node, missing = self._node, self.overdue()
        if missing and missing[0] == "odometry":  # by another clock, or of a sensor that was started again: of another phase
            self._locked = False
        if node.inputs.take_odometry(measured, node.now(), self.received()) and node.connected and not self._locked:
            self._lock_phase(measured.sample.stamp)

    def take_reference(self, desired: Desired) -> None:
        """Take a reference."""
        self._node.inputs.take_reference(desired, self._node.now(), self.received())

    def overdue(self) -> tuple[str, Reason] | None:
        """The input that is overdue at this instant, and why."""
        return self._node.inputs.monitor.overdue(self._node.now(), self.received())

    def ready(self) -> Reason:
        """What is missing before the law may command; NONE if nothing is."""
        node = self._node
        if missing := self.overdue():
            return missing[1]
        if min(node.inputs.monitor.fresh.values()) < node.parameters.safety.fresh_samples:
            return Reason.NOT_READY
        if not self._alone:
            return Reason.SECOND_PUBLISHER
        return Reason.NONE if node.has_consumer() else Reason.NO_CONSUMER

    def renewed(self) -> None:
        """Let the next odometry fix the phase of the control periods."""
        self._locked = False

    def stopped(self) -> None:
        """Command zero at once."""
        if self._node.connected:
            self._node.publish_command(self._node.now())

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
        self._watch_clock(now)
        if not node.loop.due(now - self._origin):
            return
        node.health.served(now)
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
        if not self._alone:
            node.get_logger().error(node.refusal_text(Reason.SECOND_PUBLISHER), throttle_duration_sec=WARNING_PERIOD)
        if self._simulated:
            node.clock_problem = self._standstill(now)
            if node.clock_problem:
                node.get_logger().warning(node.clock_problem, throttle_duration_sec=WARNING_PERIOD)
            return
        self._watch_clock(now)  # here too: a timer waits for its time on a clock that was set back, perhaps for hours

    def _standstill(self, now: int) -> str:
        """That the simulated clock has not begun or does not advance; empty if it does."""
        steady = time.monotonic_ns()
        if now != self._ticked[0]:
            self._ticked = now, steady
        if not now:
            return WAITING
        return STANDING if seconds(steady - self._ticked[1]) > STANDSTILL else ""

    def _watch_clock(self, now: int) -> None:
        """Find a step of the clock by its progress since the last call, beside that of the steady clock."""
        seen, self._seen = self._seen, (now, time.monotonic_ns()) if now else None
        if seen is None or not now:
            return
        progress, steady = now - seen[0], self._seen[1] - seen[1] if self._seen else 0
        step = progress - steady
        if progress < 0 or (step < -CLOCK_STEP and not self._simulated):
            self._stepped(now, Reason.CLOCK_BACKWARD, progress)
            self._node.loop.forget()
        elif step > CLOCK_STEP and not (self._simulated and progress < MAX_CLOCK_SPEED * steady):
            self._stepped(now, Reason.CLOCK_AHEAD, step)

    def _stepped(self, now: int, reason: Reason, step: int) -> None:
        """The clock was stepped: inputs received by another time do not count, and the control periods begin anew."""
        node = self._node
        back, size = reason is Reason.CLOCK_BACKWARD, abs(seconds(step))
        direction, forgotten = ("back", "law and inputs") if back else ("ahead", "the inputs")
        node.report_clock(reason, f"the clock was set {direction} by {size:.3g} s: {forgotten} are reset")
        node.inputs.reset(reason)
        self._origin = now
        node.loop.begin()
        if not self._simulated:  # timers on simulated time follow it
            self._restart(node.loop.grid.period, self._on_timer)
