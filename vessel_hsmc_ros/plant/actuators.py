"""Actuator dynamics: dead time, first-order lag, rate limit and saturation, independently in surge and in yaw.

| symbol | meaning | unit |
|---|---|---|
| T | period of the plant | s |
| tau_c | commanded force or moment after saturation | N, N·m |
| tau | force or moment applied to the hull, constant over a period | N, N·m |
| T_l | time constant of the lag | s |
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import DelayLine, clip, delayed, fill, kernel, put, whole_periods
from vessel_hsmc_ros.core.schema import parameter


def lag(what: str) -> float:
    """Declare the time constant of a first-order lag."""
    return parameter(0.0, f"Time constant of the first-order lag of {what}; 0 for none.", unit="s", low=0.0, high=1e3)


def dead_time(what: str) -> float:
    """Declare the time before a command begins to act."""
    return parameter(
        0.0,
        f"Time before a command of {what} begins to act, rounded to whole periods of the plant; 0 for none.",
        unit="s",
        low=0.0,
        high=60.0,
    )


@dataclass(frozen=True)
class ActuatorParameters:
    """What drives the ship, and limits, lags and dead times of its force and moment; by default none, as in the paper."""

    kind: str = parameter(
        "wrench",
        "What drives the vessel: wrench applies cmd_wrench as it is, with the limits, lags and dead times of this group;"
        " thrusters applies the demands of vessel.thrusters, without them.",
        choices=("wrench", "thrusters"),
    )
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
    surge_dead_time: float = dead_time("the surge force")
    yaw_dead_time: float = dead_time("the yaw moment")

    def constants(self, period: float) -> tuple["Actuator", "Actuator"]:
        """The actuators of surge force and yaw moment in discrete time; the period in s."""
        return (
            actuator(self.surge_force_limit, self.surge_force_rate, self.surge_lag, period, self.surge_dead_time),
            actuator(self.yaw_moment_limit, self.yaw_moment_rate, self.yaw_lag, period, self.yaw_dead_time),
        )


class Actuator(NamedTuple):
    """The constants of one actuator in discrete time."""

    limit: float  # largest value, in either direction
    largest_change: float  # largest change in a period
    share: float  # 1 - exp(-T/T_l), the share of a step that the lag completes in a period
    instant: bool  # whether there is no lag
    late: int  # dead time in periods


def actuator(limit: float, rate: float, lag: float, period: float, dead_time: float = 0.0) -> Actuator:
    """The constants of an actuator.

    `rate`: largest rate of change, per second. `lag`: T_l, s. `dead_time`: time before a command begins to act, s.
    """
    share = 1.0 if lag == 0.0 else -math.expm1(-period / lag)
    return Actuator(limit, rate * period, share, lag == 0.0, whole_periods(dead_time, period))


@kernel
def arrived(command: tuple[float, float], line: DelayLine, surge: Actuator, yaw: Actuator) -> tuple[float, float]:
    """The commands that begin to act in this period; zero before the first.

    `command`: of this period, surge force [N] and yaw moment [N·m]. `line`: the commands of the last periods; written.
    """
    if surge.late == 0 and yaw.late == 0:
        return command
    if line.last[0] < 0:
        fill(line, (0.0, 0.0))
    put(line, command)
    return delayed(line, surge.late, 0), delayed(line, yaw.late, 1)


@kernel
def actuate(last: float, command: float, a: Actuator) -> float:
    """The value applied in the next period: tau + (1 - exp(-T/T_l))·(tau_c - tau) within the rate limit.

    That is the exact response of the lag to a constant command at the end of the period. `last`: the value of the last period.
    `command`: commanded value, finite.
    """
    # Order: dead time (`arrived`), saturation of the command, then lag, then rate limit.
    return clip(follow(last, clip(command, a.limit), a.largest_change, a.share, a.instant), a.limit)


@kernel
def follow(last: float, target: float, largest_change: float, share: float, instant: bool) -> float:
    """The value after a period in which it follows a constant target, without a saturation.

    `last`: the value of the last period. `largest_change`, `share`, `instant`: as of an `Actuator`.
    """
    change = share * (target - last)
    if abs(change) > largest_change:
        return last + math.copysign(largest_change, change)
    # An actuator without lag takes its command as it is, without a rounding error.
    return target if instant else last + change
