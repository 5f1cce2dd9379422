"""What the actuators make of a commanded wrench: lag, rate limit and limit, each for itself in surge and in yaw.

| symbol | meaning | unit |
|---|---|---|
| T | period of the plant | s |
| tau_c | commanded force or moment, cut at the limit | N, N·m |
| tau | what arrives at the hull, held over a period | N, N·m |
| T_l | time constant of the lag | s |
"""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter


def lag(what: str) -> float:
    """Declare the time constant of an actuator's lag."""
    return parameter(0.0, f"Time constant with which {what} follows its command.", unit="s", low=0.0, high=1e3)


@dataclass(frozen=True)
class ActuatorParameters:
    """Limits and lags of thrust and yaw moment; none, as in the paper, unless said otherwise."""

    surge_force_limit: float = parameter(math.inf, "Largest surge force, either way.", unit="N", low=0.0, high=math.inf)
    yaw_moment_limit: float = parameter(math.inf, "Largest yaw moment, either way.", unit="N·m", low=0.0, high=math.inf)
    surge_force_rate: float = parameter(math.inf, "Fastest change of the surge force.", unit="N/s", low=0.0, high=math.inf)
    yaw_moment_rate: float = parameter(math.inf, "Fastest change of the yaw moment.", unit="N·m/s", low=0.0, high=math.inf)
    surge_lag: float = lag("the surge force")
    yaw_lag: float = lag("the yaw moment")


class Actuator:
    """One actuator, in steps of a period.

    Args:
        limit: Largest value, either way.
        rate: Fastest change, per second.
        lag: T_l, s.
        period: T, s.
    """

    def __init__(self, limit: float, rate: float, lag: float, period: float) -> None:
        self._limit = limit
        self._most = rate * period
        self._instant = lag == 0.0
        self._share = 1.0 if self._instant else -math.expm1(-period / lag)
        self.value = 0.0

    def step(self, command: float) -> float:
        """What arrives in the next period: tau + (1 - exp(-T/T_l))(tau_c - tau), where the lag is at its end, within the rate.

        Args:
            command: Finite.
        """
        limit, most, last = self._limit, self._most, self.value
        wanted = min(max(command, -limit), limit)
        change = self._share * (wanted - last)
        if abs(change) > most:
            wanted = last + math.copysign(most, change)
        elif not self._instant:
            wanted = last + change
        self.value = min(max(wanted, -limit), limit)
        return self.value


class Actuators:
    """Thrust and yaw moment, at rest to begin with.

    Args:
        parameters: Limits and lags.
        period: Time between two steps, s.
    """

    def __init__(self, parameters: ActuatorParameters, period: float) -> None:
        p = parameters
        self._surge = Actuator(p.surge_force_limit, p.surge_force_rate, p.surge_lag, period)
        self._yaw = Actuator(p.yaw_moment_limit, p.yaw_moment_rate, p.yaw_lag, period)

    def step(self, command: tuple[float, float]) -> tuple[float, float]:
        """The wrench that reaches the hull over the next period.

        Args:
            command: Surge force [N] and yaw moment [N·m], finite.
        """
        return self._surge.step(command[0]), self._yaw.step(command[1])
