"""Actuator dynamics: first-order lag, rate limit and saturation, independently in surge and in yaw.

| symbol | meaning | unit |
|---|---|---|
| T | period of the plant | s |
| tau_c | commanded force or moment after saturation | N, N·m |
| tau | force or moment applied to the hull, constant over a period | N, N·m |
| T_l | time constant of the lag | s |
"""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.core.schema import parameter


def lag(what: str) -> float:
    """Declare the time constant of a first-order lag."""
    return parameter(0.0, f"Time constant of the first-order lag of {what}; 0 for none.", unit="s", low=0.0, high=1e3)


@dataclass(frozen=True)
class ActuatorParameters:
    """Limits and lags of surge force and yaw moment; by default there are none, as in the paper."""

    surge_force_limit: float = parameter(math.inf, "Largest surge force, in either direction.", unit="N", low=0.0, high=math.inf)
    yaw_moment_limit: float = parameter(math.inf, "Largest yaw moment, in either direction.", unit="N·m", low=0.0, high=math.inf)
    surge_force_rate: float = parameter(
        math.inf, "Largest rate of change of the surge force.", unit="N/s", low=0.0, high=math.inf
    )
    yaw_moment_rate: float = parameter(
        math.inf, "Largest rate of change of the yaw moment.", unit="N·m/s", low=0.0, high=math.inf
    )
    surge_lag: float = lag("the surge force")
    yaw_lag: float = lag("the yaw moment")


class Actuator:
    """One actuator in discrete time.

    Args:
        limit: Largest value, in either direction.
        rate: Largest rate of change, per second.
        lag: T_l, s.
        period: T, s.
    """

    def __init__(self, limit: float, rate: float, lag: float, period: float) -> None:
        self._limit = limit
        self._largest_change = rate * period
        self._instant = lag == 0.0
        self._share = 1.0 if self._instant else -math.expm1(-period / lag)
        self.value = 0.0

    def step(self, command: float) -> float:
        """The value applied in the next period: tau + (1 - exp(-T/T_l))·(tau_c - tau) within the rate limit.

        That is the exact response of the lag to a constant command at the end of the period.

        Args:
            command: Commanded value, finite.
        """
        # Order: saturation of the command, then lag, then rate limit.
        last = self.value
        target = clip(command, self._limit)
        change = self._share * (target - last)
        if abs(change) > self._largest_change:
            target = last + math.copysign(self._largest_change, change)
        elif not self._instant:  # an actuator without lag takes its command as it is, without a rounding error
            target = last + change
        self.value = clip(target, self._limit)
        return self.value


class Actuators:
    """The actuators of surge force and yaw moment, initially at zero.

    Args:
        parameters: Limits and lags.
        period: Period of the plant, s.
    """

    def __init__(self, parameters: ActuatorParameters, period: float) -> None:
        p = parameters
        self._surge = Actuator(p.surge_force_limit, p.surge_force_rate, p.surge_lag, period)
        self._yaw = Actuator(p.yaw_moment_limit, p.yaw_moment_rate, p.yaw_lag, period)

    def step(self, command: tuple[float, float]) -> tuple[float, float]:
        """The wrench applied to the hull over the next period.

        Args:
            command: Surge force [N] and yaw moment [N·m], finite.
        """
        return self._surge.step(command[0]), self._yaw.step(command[1])
