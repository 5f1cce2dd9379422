"""Monitors of what no single sample shows: they warn after a time, and demand the safe action after a longer one."""

from enum import IntEnum

from vessel_hsmc_ros.safety.parameters import MonitorParameters
from vessel_hsmc_ros.safety.reasons import Reason

Pair = tuple[float, float]


class Alarm(IntEnum):
    """How far a monitor has come."""

    OK = 0
    WARN = 1
    SAFE = 2


class Monitor:
    """A condition that may last for a while.

    The safe action often ends the condition that caused it. So an alarm that demands it is kept until the condition has been
    absent for as long as a warning takes; then the law gets another try.

    Args:
        reason: What the condition means.
        warning, safe: Times after which it is a warning, and demands the safe action, s.

    Attributes:
        detail: What was found, beyond the reason.
    """

    detail = ""

    def __init__(self, reason: Reason, warning: float, safe: float) -> None:
        self.reason = reason
        self._warning, self._safe = warning, safe
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self.alarm = Alarm.OK
        self._present = self._absent = 0.0

    def watch(self, present: bool, period: float) -> Alarm:
        """Note whether the condition was present during a control period, s."""
        self._present = self._present + period if present else 0.0
        self._absent = 0.0 if present else self._absent + period
        if self._present >= self._safe:
            self.alarm = Alarm.SAFE
        elif self.alarm is not Alarm.SAFE or self._absent >= self._warning:
            self.alarm = Alarm.WARN if self._present >= self._warning else Alarm.OK
        return self.alarm


class NotMoving(Monitor):
    """Driven but not moving: a force or moment near its limit does not move the ship, as with a lost or blocked propeller.

    Args:
        parameters: Bounds and times.
        limits: Largest surge force and yaw moment, N and N·m.
    """

    def __init__(self, parameters: MonitorParameters, limits: Pair) -> None:
        super().__init__(Reason.NOT_MOVING, parameters.not_moving_warning, parameters.not_moving_safe)
        self._parameters, self._limits = parameters, limits
        self._axes = [_Axis(), _Axis()]

    def step(self, command: Pair, motion: Pair, period: float) -> Alarm:
        """Watch a control period.

        Args:
            command: Surge force and yaw moment that were commanded, N and N·m.
            motion: Measured surge speed and yaw rate, m/s and rad/s.
            period: s.
        """
        p = self._parameters
        bounds = p.moving_speed, p.moving_yaw_rate
        stuck = [
            axis.driven(tau, p.driven_share * limit) and abs(velocity) < bound
            for axis, tau, limit, velocity, bound in zip(self._axes, command, self._limits, motion, bounds, strict=True)
        ]
        return self.watch(any(stuck), period)


class Saturation(Monitor):
    """A command at one and the same limit; a law that switches between its limits is not saturated.

    Args:
        parameters: Times.
        limits: Largest surge force and yaw moment, N and N·m.
    """

    def __init__(self, parameters: MonitorParameters, limits: Pair) -> None:
        super().__init__(Reason.SATURATED, parameters.saturation_warning, parameters.saturation_safe)
        self._limits = limits
        self._axes = [_Axis(), _Axis()]

    def step(self, command: Pair, period: float) -> Alarm:
        """Watch the command of a control period, N and N·m; s."""
        driven = [axis.driven(tau, limit) for axis, tau, limit in zip(self._axes, command, self._limits, strict=True)]
        return self.watch(any(driven), period)


class Innovation(Monitor):
    """Measurements that contradict the estimate of the observer, by its own gate.

    Args:
        parameters: Times.
    """

    def __init__(self, parameters: MonitorParameters) -> None:
        super().__init__(Reason.INNOVATION, parameters.innovation_warning, parameters.innovation_safe)

    def step(self, rejected: bool, period: float) -> Alarm:
        """Watch whether the observer has rejected the measurement of a control period; s."""
        return self.watch(rejected, period)


class _Axis:
    """The direction in which a command has been at a bound since the last control period."""

    def __init__(self) -> None:
        self._side = 0

    def driven(self, tau: float, bound: float) -> bool:
        """Whether a command is at its bound, on the same side as the one before."""
        side = (tau >= bound) - (tau <= -bound)
        same, self._side = side != 0 and side == self._side, side
        return same
