"""Sensor model: bias, white noise, sampling with a zero-order hold, and delay.

| symbol | meaning | unit |
|---|---|---|
| x, y | position, GNSS | m |
| psi | heading, compass | rad |
| u, v, r | velocities over ground, log and gyro | m/s, m/s, rad/s |
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel, whole_periods
from vessel_hsmc_ros.core.kinematics import Motion, as_motion
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.timing import Instants, RateGrid


def deviation(description: str, unit: str = "") -> float:
    """Declare the standard deviation of a sensor's white noise."""
    return parameter(0.0, f"Standard deviation of the white noise on {description}.", unit=unit, low=0.0, high=1e6)


def sample_rate(what: str) -> float:
    """Declare the sampling rate of a sensor."""
    return parameter(
        0.0,
        f"Sampling rate of {what}, with the last sample held in between; 0 samples for every message.",
        unit="Hz",
        low=0.0,
        high=1000.0,
    )


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
    delay: float = parameter(
        0.0,
        "Age of the measurements that odometry shows, whose times are its stamps; rounded to whole periods of the plant.",
        unit="s",
        low=0.0,
        high=10.0,
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
