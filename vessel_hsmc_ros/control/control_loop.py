"""A law run at its own fixed rate; shared by the controller node, the offline loop and the verification of bags."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer import Observer
from vessel_hsmc_ros.control.pivot import ORIGIN, Pivot, at_origin, carry
from vessel_hsmc_ros.core.delay_line import DelayLine, delay_line, delayed, put, whole_periods
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.timing import Instants, RateGrid
from vessel_hsmc_ros.laws import Law, Terms
from vessel_hsmc_ros.laws.guard import guarded, guarded_step
from vessel_hsmc_ros.laws.terms import diagnosed

NO_WRENCH = (0.0, 0.0)

LONGEST_AGE = 10.0
"""Age of a measurement up to which the command of its time is known to the observer, s."""


def ages(stamps: Instants, measured_at: Instants, period: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Ages of measurements as `ControlLoop.step` takes them, s, and the control periods that it counts for them; (n,) each.

    Args:
        stamps: Times of the steps, (n,) ns.
        measured_at: Times of the measurements, (n,) ns.
        period: Control period, s.
    """
    age = np.multiply(stamps - measured_at, 1e-9, dtype=np.float64)
    return age, np.rint(np.minimum(age, LONGEST_AGE) / period).astype(np.int64)


def past_commands(period: float) -> DelayLine:
    """A line for the commands of LONGEST_AGE; the control period in s."""
    return delay_line(whole_periods(LONGEST_AGE, period), 2)


class ControlLoop:
    """Steps the law once per control period, holds the wrench in between, and counts missed periods.

    Args:
        law: The law to run.
        grid: The instants at which the control periods begin.
        observer: State estimator between measurement and law; None where the law takes the measured state.
        pivot: The point that the law controls.

    Attributes:
        wrench: The present command, surge force [N] and yaw moment [N·m].
        commands: The last commands, where there is an observer.
        estimate: The last state estimate that the law has received; None without an observer.
        delta: Filtered difference between the headings of ship and reference, along which references are carried to the pivot.
        missed_periods: Control periods for which neither `step` nor `skip` was called.
        enabled: Whether the wrench is commanded; while disabled it is zero.
    """

    def __init__(self, law: Law[Any], grid: RateGrid, observer: Observer | None = None, pivot: Pivot = ORIGIN) -> None:
        self.law = law
        self.grid = grid
        self.observer = observer
        self.pivot = pivot
        self.enabled = True
        self.reset()

    def reset(self) -> None:
        """Reset law, observer, wrench, count and time."""
        self.forget()
        self.wrench = NO_WRENCH
        self.commands = past_commands(self.grid.period)
        self.missed_periods = 0
        self._last_index: int | None = None
        self._lyapunov: float | None = None

    def forget(self) -> None:
        """Reset law and observer; wrench, time and count continue."""
        with guarded(self.law):
            self.law.reset()
        self.delta = 0.0
        self.estimate: Motion | None = None
        if self.observer:
            self.observer.reset()

    def retune(self, parameters: object) -> None:
        """Apply new parameters of the law, which keeps its internal state.

        Raises:
            ParameterError: the law rejects them, or its code fails.
        """
        with guarded(self.law, ParameterError):
            self.law.retune(parameters)

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
    ) -> Terms:
        """Serve the control period that contains `stamp`: step the law and keep its wrench in `self.wrench`.

        While disabled, the law is stepped for its terms only: the wrench is zero and its internal state is reset.

        Args:
            stamp: Time of this step, ns.
            measured: Measured state of the ship.
            desired: State of the reference at the time of the measurement.
            acceleration: Derivatives of the reference's body velocities.
            measured_at: Time of the measurement, ns, on any clock; `stamp` by default. The observer integrates over its
                differences, which in real time are not those of the steps.
            age: How much older than this step the measurement is, s, for a law that predicts the motion over it; the observer
                takes the command of that time.

        Returns:
            The terms of the law, with the tracking errors of the origin, weight norms and Lyapunov function.

        Raises:
            ControlError: the law is undefined for this input, its wrench is not finite, or its code fails.
        """
        elapsed = self._elapsed_periods(stamp)
        if self.observer:
            # In real time measurement and step are stamped separately: the observer must integrate over the sampling interval.
            measured_at = stamp if measured_at is None else measured_at
            behind = whole_periods(min(age, LONGEST_AGE), self.grid.period)
            wrench = delayed(self.commands, behind, 0), delayed(self.commands, behind, 1)
            measured = self.estimate = self.observer.update(measured_at, measured, wrench)
        at = carry(measured, desired, acceleration, self.delta, self.pivot)
        self.wrench, terms = guarded_step(self.law, at.motion, at.desired, at.acceleration, age)
        self.delta = at.delta
        if not self.enabled:
            self.wrench = NO_WRENCH
            with guarded(self.law):
                self.law.reset()
        self._keep_command()
        if self.pivot.x_p:
            terms = at_origin(terms, at.back)
        terms = diagnosed(terms, self._lyapunov, elapsed * self.grid.period)
        self._lyapunov = terms.lyapunov
        return terms

    def skip(self, stamp: int) -> None:
        """Serve the control period that contains a time, ns, without the law, whose inputs are missing: the wrench is zero.

        Such a period is not missed: during a pause of the plant, for instance, the controller is in time but has no odometry.
        """
        self._elapsed_periods(stamp)
        self.wrench = NO_WRENCH
        self._keep_command()
        self._lyapunov = None  # its rate over the gap would belong to no single control period

    def _keep_command(self) -> None:
        if self.observer:
            put(self.commands, self.wrench)

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
