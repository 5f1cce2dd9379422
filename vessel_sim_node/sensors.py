"""Sensor model: bias, white noise, and sampling with a zero-order hold.

| symbol | meaning | unit |
|---|---|---|
| x, y | position, GNSS | m |
| psi | heading, compass | rad |
| u, v, r | velocities over ground, log and gyro | m/s, m/s, rad/s |
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.timing import RateGrid

Array = NDArray[np.float64]

_CHANNELS = (slice(0, 2), slice(2, 3), slice(3, 6))
"""Position, heading and velocities are separate sensors with rates of their own."""


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

    def perfect(self) -> bool:
        """Whether the measurements equal the true state."""
        return self == SensorParameters()


class Sensors:
    """The sensors with their held samples.

    Args:
        parameters: Errors and sampling rates.
        random: Random-number generator of the noise.
    """

    def __init__(self, parameters: SensorParameters, random: np.random.Generator) -> None:
        p = parameters
        self._random = random
        self._noise = np.array([p.position_noise] * 2 + [p.heading_noise] + [p.velocity_noise] * 2 + [p.yaw_rate_noise])
        self._bias = np.array([*p.position_bias, p.heading_bias, *p.velocity_bias, p.yaw_rate_bias])
        rates = (p.position_rate_hz, p.heading_rate_hz, p.velocity_rate_hz)
        self._grids = [RateGrid(rate) if rate else None for rate in rates]
        self._measures_velocity = p.measures_velocity
        self._sampled: list[int | None] = [None] * len(rates)
        self._held = np.zeros(6)

    def measure(self, stamp: int, state: Array) -> Array:
        """The measurement at a time; each call draws noise.

        Args:
            stamp: Time since the start, ns; not before that of the last call.
            state: True x, y, psi, u, v, r, shape (6,).

        Returns:
            Measured x, y, psi, u, v, r, shape (6,).
        """
        # Noise is drawn at every call, also for held samples: so the random sequence does not depend on the sampling rates.
        sample = state + self._bias + self._noise * self._random.standard_normal(6)
        if not self._measures_velocity:
            sample[3:] = 0.0
        for i, (channel, grid) in enumerate(zip(_CHANNELS, self._grids, strict=True)):
            index = grid.index(stamp) if grid else stamp
            if index != self._sampled[i]:
                self._sampled[i] = index
                self._held[channel] = sample[channel]
        return self._held.copy()
