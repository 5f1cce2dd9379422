"""A law run at its own fixed rate, under supervision; shared by the controller node, the offline loop and the verification."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import Law, Terms, diagnosed, guarded, guarded_step
from vessel_hsmc_ros.control.loop.control_period import ORIGIN, START, ControlledPoint, at_origin, to_controlled_point
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.safety.fence_guard import FenceGuard
from vessel_hsmc_ros.control.safety.monitors import Alarm, Heading, Innovation, Monitor, NotMoving, Saturation, Velocities
from vessel_hsmc_ros.control.safety.parameters import MonitorParameters, Operation, Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.supervision import NO_WRENCH, Authority, Supervision
from vessel_hsmc_ros.core.exceptions import ControlError, LawError, ParameterError
from vessel_hsmc_ros.core.hull import steered
from vessel_hsmc_ros.core.kernel import DelayLine, delay_line, delayed, put, whole_periods
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.timing import Instants, RateGrid


class Watch:
    """The monitors of a control loop.

    `limits`: largest surge force and yaw moment, N and N·m. `length`: of the ship, m. `fence`: what keeps it inside of its fence,
    if it has one.

    Attributes:
        heading: What compares the heading with the motion.
    """

    def __init__(
        self, parameters: MonitorParameters, limits: tuple[float, float], length: float, fence: FenceGuard | None = None
    ) -> None:
        self.fence = fence
        self._moving, self._saturation = NotMoving(parameters, limits), Saturation(parameters, limits)
        self._innovation, self._velocities = Innovation(parameters), Velocities(parameters, length)
        self.heading = Heading(parameters, length)

    @property
    def monitors(self) -> tuple[Monitor, ...]:
        """All monitors, the most important first."""
        fence = (self.fence,) if self.fence else ()
        return *fence, self._moving, self._velocities, self.heading, self._innovation, self._saturation

    def reset(self) -> None:
        """Forget the past."""
        for monitor in self.monitors:
            monitor.reset()

    def step(
        self, command: tuple[float, float], motion: Motion, observer: Observer | None, period: float, measured: tuple[int, Motion]
    ) -> Reason:
        """Watch a control period; returns the reason of the first monitor that demands the safe action.

        `command`: the last command, N and N·m. `measured`: time of the latest measurement, ns, and the motion as measured.
        """
        self._moving.step(command, (motion.u, motion.r), period)
        self._saturation.step(command, period)
        self.heading.step(*measured)
        if observer:
            # The observer itself tests each new sample, and no other: sensors may be slower than the control period.
            self._innovation.step(not observer.accepts, period)
        else:  # which takes no velocities
            self._velocities.step(*measured, period)
        # That of the fence has been stepped before, because it may replace the reference.
        return next((monitor.reason for monitor in self.monitors if monitor.alarm is Alarm.SAFE), Reason.NONE)


Inputs = tuple[Motion, Motion, Acceleration, float, float]


class Fallback:
    """Steps a second law while its wrench is used, each time from its initial state."""

    def __init__(self, law: Law[Any]) -> None:
        self._law = law
        self._in_use = False

    def step(self, inputs: Inputs | None, needed: bool) -> tuple[float, float] | None:
        """The wrench of the fallback law; None where it is not needed or has none.

        `inputs`: ship, reference, acceleration of the reference, age and measured heading, as `guarded_step` takes them; None
        where they are missing. `needed`: whether the wrench is used.
        """
        if not needed or inputs is None:
            self._in_use = False
            return None
        try:
            if not self._in_use:
                with guarded(self._law):
                    self._law.reset()
            self._in_use = True
            return guarded_step(self._law, *inputs)[0]
        except ControlError:  # also an error in its code: the ramp takes its place
            self._in_use = False
            return None


__all__ = ["NO_WRENCH", "ControlLoop", "ages", "past_commands"]

AT_REST = Acceleration(0.0, 0.0, 0.0)
LONGEST_AGE = 10.0  # age of a measurement up to which the command of its time is known to the observer, s


def ages(stamps: Instants, measured_at: Instants, period: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Ages of measurements as `ControlLoop.step` takes them, s, and the control periods that it counts for them; (n,) each.

    `stamps`: times of the steps, (n,) ns. `measured_at`: times of the measurements, (n,) ns.
    """
    age = np.multiply(stamps - measured_at, 1e-9, dtype=np.float64)
    return age, np.rint(np.minimum(age, LONGEST_AGE) / period).astype(np.int64)


def past_commands(period: float) -> DelayLine:
    """A line for the commands of LONGEST_AGE; the control period in s."""
    return delay_line(whole_periods(LONGEST_AGE, period), 2)


class ControlLoop:
    """Steps the law once per control period, holds the wrench in between, and counts missed periods.

    Args:
        grid: The instants at which the control periods begin.
        observer: State estimator between measurement and law; None where the law takes the measured state.
        supervision: Decides what is commanded; by default always what the law computes.
        fallback: The law of the safe action, if there is one.
        watch: What finds that the ship does not do what is commanded; None where nothing does.

    Attributes:
        commands: The last commands, where there is an observer.
        estimate: The last state estimate that the law has received; None without an observer.
        delta: State of the filter along whose heading references are transformed to the centre of percussion.
        missed_periods: Control periods for which neither `step` nor `skip` was called.
    """

    def __init__(
        self,
        law: Law[Any],
        grid: RateGrid,
        observer: Observer | None = None,
        point: ControlledPoint = ORIGIN,
        supervision: Supervision | None = None,
        fallback: Fallback | None = None,
        watch: Watch | None = None,
    ) -> None:
        self.law = law
        self.grid = grid
        self.observer = observer
        self.point = point
        self.supervision = supervision or unsupervised()
        self.fallback = fallback
        self.watch = watch
        self.reset()

    @property
    def wrench(self) -> tuple[float, float]:
        """The present command, surge force [N] and yaw moment [N·m]."""
        return self.supervision.command

    @wrench.setter
    def wrench(self, command: tuple[float, float]) -> None:
        self.supervision.command = command

    @property
    def enabled(self) -> bool:
        """Whether the law commands, or the safe action in its place; otherwise the wrench is zero."""
        return self.supervision.operation in (Operation.ACTIVE, Operation.SAFE)

    @property
    def follows_law(self) -> bool:
        """Whether the next command is that of the law, in a loop whose supervision has no reason to intervene."""
        return self.watch is None and self.supervision.follows_law

    def reset(self) -> None:
        """Reset law, observer, wrench, count and time."""
        self._forget()
        self.wrench = NO_WRENCH
        self.commands = past_commands(self.grid.period)
        self.missed_periods = 0
        self._last_index: int | None = None
        self._lyapunov: float | None = None

    def forget(self) -> None:
        """Reset law and observer; wrench, time and count continue, from the present wrench at a bounded rate."""
        self._forget()
        self.supervision.handover()

    def _forget(self) -> None:
        with guarded(self.law):
            self.law.reset()
        self.delta = START
        self.estimate: Motion | None = None
        if self.observer:
            self.observer.reset()
        if self.watch:
            self.watch.reset()

    def retune(self, parameters: object) -> None:
        """Apply new parameters of the law, which keeps its internal state."""
        with guarded(self.law, ParameterError):
            self.law.retune(parameters)
        self.supervision.handover()

    def begin(self) -> None:
        """Count the control periods anew, as after a step of the clock: none is missed."""
        self._last_index = None

    def due(self, stamp: int) -> bool:
        """Whether a time in nanoseconds lies in a control period that has not been served yet."""
        return self.grid.index(stamp) != self._last_index

    def step(
        self,
        stamp: int,
        measured: Motion,
        desired: Motion,
        acceleration: Acceleration,
        measured_at: int | None = None,
        age: float = 0.0,
        reason: Reason = Reason.NONE,
    ) -> Terms:
        """Serve the control period that contains `stamp`: step the law and keep the command in `self.wrench`.

        In standby and while stopped, the law is stepped for its terms only: the wrench is zero and its internal state is reset.

        Args:
            stamp: Time of this step, ns.
            measured: Measured state of the ship.
            desired: State of the reference at the time of the measurement.
            acceleration: Derivatives of the reference's body velocities.
            measured_at: Time of the measurement, ns, on any clock; `stamp` by default. The observer integrates over its
                differences, which in real time are not those of the steps.
            age: How much older than this step the measurement is, s, for a law that predicts the motion over it; the observer
                takes the command of that time.
            reason: Why the law's wrench must not be commanded; NONE if it may.

        Returns:
            The terms of the law, with the tracking errors of the origin, weight norms and Lyapunov function.

        Raises:
            ControlError: the law is undefined for this input, its wrench is not finite, or its code fails; the safe action is
                commanded.
        """
        elapsed = self._elapsed_periods(stamp)
        # In real time measurement and step are stamped separately: the observer must integrate over the sampling interval.
        measured_at = stamp if measured_at is None else measured_at
        as_measured = measured_at, measured
        if self.observer:
            behind = whole_periods(min(age, LONGEST_AGE), self.grid.period)
            wrench = delayed(self.commands, behind, 0), delayed(self.commands, behind, 1)
            self.observer.take_for(self.law.known)
            measured = self.estimate = self.observer.update(measured_at, measured, wrench)
        if fence := self.watch.fence if self.watch else None:
            if not self.enabled:  # a person steers: what was an alarm counts no more
                fence.reset()
            # What the law observes is wrong while other commands than its own act.
            water = self.law.water if self.supervision.follows_law else None
            fence.step(measured, self.wrench[0], age, water, desired, self.grid.period)
            if fence.reference is not None:
                desired, acceleration = fence.reference, AT_REST
        at = to_controlled_point(measured, desired, acceleration, self.delta, self.point)
        inputs = at.motion, at.desired, at.acceleration, age, as_measured[1].psi
        if self.watch:
            reason = reason or self.watch.step(self.wrench, measured, self.observer, self.grid.period, as_measured)
        try:
            demand, terms = guarded_step(self.law, *inputs)
        except LawError:
            raise
        except ControlError:
            self._command(None, Reason.LAW_UNDEFINED, measured, inputs)
            raise
        self.delta = at.delta
        demand = steered(demand, measured.u, self.law.vessel.steering)
        self._command(demand, reason, measured, inputs)
        if not self.enabled:
            with guarded(self.law):
                self.law.reset()
        if self.point.x_p:
            terms = at_origin(terms, at.back)
        terms = diagnosed(terms, self._lyapunov, elapsed * self.grid.period)
        self._lyapunov = terms.lyapunov
        return terms

    def skip(self, stamp: int, reason: Reason = Reason.OVERDUE) -> None:
        """Serve the control period that contains a time, ns, without the law, whose inputs are missing, by the safe action.

        Such a period is not missed: during a pause of the plant, for instance, the controller is in time but has no odometry.
        """
        self._elapsed_periods(stamp)
        self._command(None, reason)

    def _command(
        self, demand: tuple[float, float] | None, reason: Reason, motion: Motion | None = None, inputs: Inputs | None = None
    ) -> None:
        """Command the law's wrench or what takes its place, and keep it."""
        fallback = self.fallback.step(inputs, self.supervision.wants_fallback) if self.fallback else None
        surge_and_yaw = None if motion is None else (motion.u, motion.r)
        fence = self.watch.fence if self.watch else None
        fenced = fence.command(demand, motion, self.grid.period) if fence and motion is not None else None
        self.supervision.step(demand, reason, self.grid.period, surge_and_yaw, fallback, fenced)
        if self.observer:
            put(self.commands, self.wrench)
        if demand is None:
            self._lyapunov = None  # its rate over the gap would belong to no single control period

    def _elapsed_periods(self, stamp: int) -> int:
        """Move on to the period that contains a time; the number of periods since the last step, at least 1."""
        index = self.grid.index(stamp)
        elapsed = 1
        # An earlier index is a clock that was set back, as by a restarted simulation: nothing was missed.
        if self._last_index is not None and index > self._last_index:
            elapsed = index - self._last_index
            self.missed_periods += elapsed - 1
        self._last_index = index
        return elapsed


def unsupervised() -> Supervision:
    """A supervision that commands what the law computes, whatever that is."""
    everything = Authority((math.inf, math.inf), (math.inf, math.inf), bounded=False)
    return Supervision(SafetyParameters(), everything)
