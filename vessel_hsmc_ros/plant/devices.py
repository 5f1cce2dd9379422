"""Actuators and sensors.

Actuators have a dead time, a first-order lag, a rate limit and a saturation, independently in surge and in yaw.

| symbol | meaning | unit |
|---|---|---|
| T | period of the plant | s |
| tau_c | commanded force or moment after saturation | N, N·m |
| tau | force or moment applied to the hull, constant over a period | N, N·m |
| T_l | time constant of the lag | s |

Sensors have a bias, white noise, sampling with a zero-order hold, and a delay: GNSS x, y (m), compass psi (rad), log and gyro
u, v, r over ground (m/s, m/s, rad/s).
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import DelayLine, clip, delayed, fill, kernel, put, whole_periods
from vessel_hsmc_ros.core.kinematics import Motion, as_motion
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.timing import Instants, RateGrid


def absent(description: str, unit: str, high: float) -> float:
    """Declare a property that a device does not have by default: 0, and never below."""
    return parameter(0.0, description, unit=unit, low=0.0, high=high)


def lag(what: str) -> float:
    """Declare the time constant of a first-order lag."""
    return absent(f"Time constant of the first-order lag of {what}; 0 for none.", "s", 1e3)


def dead_time(what: str) -> float:
    """Declare the time before a command begins to act."""
    return absent(f"Time before a command of {what} begins to act, rounded to whole periods of the plant; 0 for none.", "s", 60.0)


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


def deviation(description: str, unit: str = "") -> float:
    """Declare the standard deviation of a sensor's white noise."""
    return absent(f"Standard deviation of the white noise on {description}.", unit, 1e6)


def sample_rate(what: str) -> float:
    """Declare the sampling rate of a sensor."""
    return absent(f"Sampling rate of {what}, with the last sample held in between; 0 samples for every message.", "Hz", 1000.0)


@dataclass(frozen=True)
class SensorParameters:
    """Errors of the sensors; the defaults are perfect sensors, as in the paper."""

    position_noise: float = deviation("x and on y", "m")
    heading_noise: float = deviation("the heading", "rad")
    velocity_noise: float = deviation("surge and on sway velocity", "m/s")
    yaw_rate_noise: float = deviation("the yaw rate", "rad/s")
    position_bias: tuple[float, ...] = parameter((0.0, 0.0), "Constant error of x and y.", unit="m", low=-1e6, high=1e6, length=2)
    heading_bias: float = parameter(0.0, "Constant error of the heading.", unit="rad", low=-3.2, high=3.2)
    velocity_bias: tuple[float, ...] = parameter(
        (0.0, 0.0), "Constant error of surge and sway velocity.", unit="m/s", low=-1e3, high=1e3, length=2
    )
    yaw_rate_bias: float = parameter(0.0, "Constant error of the yaw rate.", unit="rad/s", low=-1e3, high=1e3)
    position_rate_hz: float = sample_rate("the position")
    heading_rate_hz: float = sample_rate("the heading")
    velocity_rate_hz: float = sample_rate("the velocities")
    measures_velocity: bool = parameter(True, "Whether velocities are measured; if not, odometry reports them as zero.")
    delay: float = absent(
        "Age of the measurements that odometry shows, whose times are its stamps; rounded to whole periods of the plant.",
        "s",
        10.0,
    )

    def perfect(self) -> bool:
        """Whether the measurements equal the true state."""
        return self == SensorParameters()

    def rates(self) -> tuple[float, float, float]:
        """The sampling rates of position, heading and velocities, separate sensors; 0 samples for every message."""
        return self.position_rate_hz, self.heading_rate_hz, self.velocity_rate_hz

    def constants(self, period: float) -> "Sensors":
        """What the measurement of a period needs; the period in s."""
        (x, y), (u, v) = self.position_bias, self.velocity_bias
        bias = (x, y, self.heading_bias, u, v, self.yaw_rate_bias)
        noise = [self.position_noise] * 2 + [self.heading_noise] + [self.velocity_noise] * 2 + [self.yaw_rate_noise]
        return Sensors(as_motion(bias), as_motion(noise), self.measures_velocity, whole_periods(self.delay, period))


class Sensors(NamedTuple):
    """The constants of the sensors."""

    bias: Motion  # constant errors
    noise: Motion  # standard deviations of the white noise
    measures_velocity: bool  # whether velocities are measured
    late: int  # delay of the odometry in periods


@kernel
def measurement(motion: Motion, held: Motion, sampled: tuple[bool, bool, bool], normal: Any, sensors: Sensors) -> Motion:
    """The measurement of a motion: new samples, and held ones of the sensors that do not sample now.

    `held`: the last measurement; zero before the first. `sampled`: whether position, heading and velocities are sampled now.
    `normal`: independent standard normal numbers, shape (6,).
    """
    b, n = sensors.bias, sensors.noise
    x, y, psi, u, v, r = held
    if sampled[0]:
        x, y = (motion.x + b.x) + n.x * normal[0], (motion.y + b.y) + n.y * normal[1]
    if sampled[1]:
        psi = (motion.psi + b.psi) + n.psi * normal[2]
    if sampled[2] and sensors.measures_velocity:
        u, v = (motion.u + b.u) + n.u * normal[3], (motion.v + b.v) + n.v * normal[4]
        r = (motion.r + b.r) + n.r * normal[5]
    return Motion(x, y, psi, u, v, r)


class Sampling:
    """The instants at which each sensor samples. `rates_hz`: sampling rates, 0 for every message."""

    def __init__(self, rates_hz: tuple[float, float, float]) -> None:
        self._grids = [RateGrid(rate) if rate else None for rate in rates_hz]
        self._last = [-1, -1, -1]

    def due(self, stamp: int) -> tuple[bool, bool, bool]:
        """Whether each sensor samples at a time: at the first message at or after each of its own instants.

        `stamp`: time since the start, ns; after that of the last call.
        """
        last, self._last = self._last, [grid.index(stamp) if grid else stamp for grid in self._grids]
        return self._last[0] != last[0], self._last[1] != last[1], self._last[2] != last[2]


def sampling(rates_hz: tuple[float, float, float], stamps: Instants) -> NDArray[np.bool_]:
    """`Sampling.due` of all messages of a run.

    `rates_hz`: sampling rates, 0 for every message. `stamps`: times of the messages since the start, increasing, ns, (n,).
    Returns whether position, heading and velocities are sampled, (n, 3).
    """
    due = np.ones((len(stamps), len(rates_hz)), np.bool_)
    for i, rate in enumerate(rates_hz):
        if rate:
            due[1:, i] = np.diff(RateGrid(rate).indices(stamps)) != 0
    return due
