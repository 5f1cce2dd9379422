"""When the control law runs, and on which inputs: by the steps of the plant in lockstep, by a timer in real time."""

import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.kinematics import extrapolate
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import WARNING_PERIOD, VesselNode
from vessel_hsmc_ros.nodes.controller_inputs import Desired, Measured

if TYPE_CHECKING:
    from rclpy.timer import Timer


class Timing(ABC):
    """When the law runs, and on which inputs. `node`: the controller, a `ControllerNode`."""

    def __init__(self, node: Any) -> None:
        self._node = node

    @abstractmethod
    def start(self) -> None:
        """Begin, once the node is connected."""

    @abstractmethod
    def take_odometry(self, measured: Measured) -> None:
        """Take an odometry message."""

    @abstractmethod
    def take_reference(self, desired: Desired) -> None:
        """Take a reference message."""

    @property
    def waiting(self) -> int:
        """Number of references that wait for odometry of their stamp."""
        return 0

    @property
    def pending(self) -> int | None:
        """Stamp of the first odometry since the last command that waits for the reference of its stamp, ns."""
        return None

    def overdue(self) -> tuple[str, Reason] | None:
        """The input that is overdue, and why; in lockstep inputs are awaited."""
        return None

    def ready(self) -> Reason:
        """What is missing before the law may command; NONE if nothing is."""
        return Reason.NONE

    def renewed(self) -> None:  # noqa: B027 - in lockstep the plant counts the steps
        """Begin the control periods of a new control loop."""

    def stopped(self) -> None:  # noqa: B027 - in lockstep there is nothing to do
        """Act on a stop; in lockstep, the command of the next step is zero."""


REFERENCES_KEPT = 2000
"""Limit of the references that wait, in lockstep, for the odometry of their stamp; a reference ship is far less ahead."""


class StepClock:
    """Finds the stamps of the plant's steps: those of its odometry, or the time of /clock where odometry is late by its stamp.

    The plant waits for the command of a step, so the last tick of /clock is of that step or of the one before. `on_tick`:
    called at each tick of /clock, which is only read once odometry has been late.
    """

    def __init__(self, node: VesselNode, on_tick: Callable[[], None]) -> None:
        self._node, self._on_tick = node, on_tick
        self._now: int | None = None

    def step_of(self, measured_at: int, last: int) -> int | None:
        """The stamp of the step that odometry belongs to, ns; None until the tick of that step has been received.

        `measured_at`: stamp of the odometry, ns. `last`: stamp of the last step, ns; late odometry is not after it.
        """
        return measured_at if measured_at > last else self.next_after(last)

    def next_after(self, last: int) -> int | None:
        """The stamp of the step after the last one, ns; None until its tick has been received."""
        if self._now is None:
            self._now = last
            # Latched: the tick of this step is received too, although it may have been published before.
            subscription = self._node.create_subscription(Clock, "/clock", self._tick, qos.CLOCK)
            self._node.direct_subscriptions.append(subscription)
        return self._now if self._now > last else None

    def _tick(self, message: Clock) -> None:
        self._now = conversions.nanoseconds(message.clock)
        self._on_tick()


class StepQueue:
    """The messages of one topic, taken step by step in their order, so that two runs with the same faults are alike.

    A step is complete with the message of its stamp. Those before it, with other stamps, were received during the step.
    """

    def __init__(self) -> None:
        self._waiting: deque[tuple[int, Any]] = deque()  # stamp, ns, and content

    def append(self, stamp: int, message: Any) -> None:
        """Queue a message, or None for the announcement that there is nothing of a step."""
        self._waiting.append((stamp, message))

    def complete(self, step: int) -> bool:
        """Whether the message, or the announcement, of a step has been received."""
        return any(stamp == step for stamp, _ in self._waiting)

    def take(self, step: int) -> list[Any]:
        """Take the messages up to and including that of a complete step, without announcements."""
        taken, stamp = [], None
        while stamp != step:
            stamp, message = self._waiting.popleft()
            taken += [] if message is None else [message]
        return taken


class Lockstep(Timing):
    """Runs the law on odometry and reference of one stamp; an input that is refused ends the run.

    The law runs at the start of each control period, and its wrench is held (zero-order hold) for the odometry in between.
    """

    def __init__(self, node: Any) -> None:
        super().__init__(node)
        self._odometry: Measured | None = None
        self._unanswered = 0
        self._references: dict[int, Desired] = {}
        self._steps = StepClock(node, self.start)

    @property
    def waiting(self) -> int:
        """Number of references that wait for odometry of their stamp."""
        return len(self._references)

    @property
    def pending(self) -> int | None:
        """Stamp of the first odometry since the last command that waits for the reference of its stamp, ns."""
        return self._unanswered if self._odometry else None

    def take_odometry(self, measured: Measured) -> None:
        """Answer odometry as soon as the inputs of the law are complete."""
        self._check(measured)
        if self._odometry is None:
            self._unanswered = measured.sample.stamp
        self._odometry = measured
        self._node.inputs.monitor.receive("odometry", measured.sample.stamp)
        self.start()

    def take_reference(self, desired: Desired) -> None:
        """Keep a reference for the odometry of its stamp."""
        self._check(desired)
        if len(self._references) >= REFERENCES_KEPT:  # of stamps that no odometry has: the oldest will not be needed
            del self._references[next(iter(self._references))]
        self._references[desired.sample.stamp] = desired
        self._node.inputs.monitor.receive("reference", desired.sample.stamp)
        self.start()

    def _check(self, message: Measured | Desired) -> None:
        if wrong := message.wrong:
            raise ControlError(wrong)

    def start(self) -> None:
        """Publish the command for the pending odometry, unless an input is still missing."""
        node, loop = self._node, self._node.loop
        if self._odometry is None or not node.connected:
            return
        measured_at = self._odometry.sample.stamp
        if (stamp := self._steps.step_of(measured_at, node.stamp)) is None:
            return
        if not loop.due(stamp):
            self._odometry = None
            node.publish_command(stamp)
            return
        if stamp not in self._references:  # odometry and reference may arrive in either order
            return
        measured, (_, reference, acceleration) = self._odometry, self._references[stamp]
        age, began = seconds(stamp - measured_at), time.monotonic_ns()
        desired = extrapolate(reference, acceleration, -age)
        terms = loop.step(stamp, measured.motion, desired, acceleration, measured_at, age)
        self._odometry = None  # each odometry message is answered once, whatever references follow
        node.publish_period(stamp, terms, began)
        self._references = {t: r for t, r in self._references.items() if t > stamp}


class RideThrough(Timing):
    """Lockstep in which an input that is refused or missing is bridged as in real time, by the age of its stamp.

    The step is that of /clock. A message without a frame announces that there is nothing of the step of its stamp.
    """

    def __init__(self, node: Any) -> None:
        super().__init__(node)
        self._odometry, self._references = StepQueue(), StepQueue()
        self._steps = StepClock(node, self.start)

    def take_odometry(self, measured: Measured) -> None:
        """Queue odometry for its step."""
        self._queue(self._odometry, measured)

    def take_reference(self, desired: Desired) -> None:
        """Queue a reference for its step."""
        self._queue(self._references, desired)

    def _queue(self, queue: StepQueue, message: Any) -> None:
        queue.append(message.sample.stamp, message if message.sample.frame else None)
        self.start()

    def start(self) -> None:
        """Publish the command of the present step, once it is complete."""
        node, loop, inputs = self._node, self._node.loop, self._node.inputs
        step = self._steps.next_after(node.stamp) if node.connected else None
        if step is None or not self._odometry.complete(step):
            return
        due = loop.due(step)
        if due and not self._references.complete(step):
            return
        for measured in self._odometry.take(step):
            inputs.take_odometry(measured, step, step)
        if not due:
            node.publish_command(step)
            return
        for desired in self._references.take(step):
            inputs.take_reference(desired, step, step)
        began = time.monotonic_ns()
        node.publish_period(step, inputs.serve(step, step, step), began)


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

    def __init__(self, node: Any) -> None:
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
        found: tuple[str, Reason] | None = self._node.inputs.monitor.overdue(self._node.now(), self.received())
        return found

    def ready(self) -> Reason:
        """What is missing before the law may command; NONE if nothing is."""
        node = self._node
        if missing := self.overdue():
            return missing[1]
        if min(node.inputs.monitor.fresh.values()) < node.parameters.safety.fresh_samples:
            return Reason.NOT_READY
        if not self._look() or self._node.second_source():  # what was seen last may have been mended since
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
        reason, terms, began = Reason.NONE if self._alone else Reason.SECOND_PUBLISHER, None, time.monotonic_ns()
        if node.computes:
            terms = node.inputs.serve(now, self.received(), now - self._origin, reason)
        else:
            node.loop.skip(now - self._origin, Reason.IN_STANDBY)
        node.publish_period(now, terms, began)
        if node.starts and not self.ready():
            node.activate_quietly()

    # -- clock and graph ----------------------------------------------------------------------------------------------

    def _look(self) -> bool:
        """Look whether command and reference have one publisher each."""
        self._alone = not self._node.second_publisher()
        return self._alone

    def _check(self) -> None:
        """Look for a clock that has not begun or was stepped, and for a second publisher of the command or the reference."""
        node, now = self._node, self._node.now()
        if not self._look():
            node.get_logger().error(node.second_command, throttle_duration_sec=WARNING_PERIOD)
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
