"""A heading to follow and nothing else: the reference of case 1.

No ship makes this motion. The heading is a programme over time, its derivatives go with it, and the position runs along it at a
constant speed, so that the messages are complete; a law that steers by heading alone has no use for it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.reference.input_program import RampParameters, SineParameters, StepsParameters, program_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CourseReferenceParameters:
    """The heading over time; all its parts add up."""

    heading: float = parameter(0.0, "Constant part of the heading.", unit="rad", low=-1e3, high=1e3, symbol="psi_d")
    heading_sine: SineParameters = group(SineParameters)
    heading_steps: StepsParameters = group(StepsParameters)
    heading_ramp: RampParameters = group(RampParameters)
    surge_velocity: float = parameter(
        0.0, "Speed at which the position runs along the heading.", unit="m/s", low=-1e3, high=1e3, symbol="u_d"
    )


class CourseReference:
    """A heading over time, published in steps of 1/rate as a motion.

    Args:
        parameters: The heading's programme and the speed.
        start: x, y of the position at the start, m.
        period: Time between two published states, s.

    Raises:
        ParameterError: the times of the programme's steps or ramp do not fit their values.
    """

    def __init__(self, parameters: CourseReferenceParameters, start: tuple[float, float], period: float) -> None:
        self._heading = program_of(parameters, "heading", "reference_ship.course")
        self._speed = parameters.surge_velocity
        self._start = start
        self._period = period
        self.reset()

    def reset(self) -> None:
        """Begin the programme anew, at the start."""
        self._steps = 0
        self._position = self._start
        self._read()

    def acceleration(self) -> Array:
        """0, 0, dr_d, shape (3,): m/s², m/s², rad/s²."""
        return np.array([0.0, 0.0, self._turning])

    def advance(self) -> None:
        """Move on by one period, the position with the heading of its middle."""
        psi = self._heading.value((self._steps + 0.5) * self._period)
        x, y = self._position
        way = self._speed * self._period
        self._position = x + way * math.cos(psi), y + way * math.sin(psi)
        self._steps += 1
        self._read()

    def _read(self) -> None:
        time = self._steps * self._period
        rate, self._turning = self._heading.rates(time)
        self.state: Array = np.array([*self._position, self._heading.value(time), self._speed, 0.0, rate])
