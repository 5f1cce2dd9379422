"""A heading over time: the reference of case 1, course control.

The heading is a given function of time with its exact derivatives. To make the reference complete, the position moves along the
heading at a constant speed; it is not the motion of a ship, and course-control laws ignore it.
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
    """The heading over time: the sum of a constant, a sine, steps and a ramp."""

    heading: float = parameter(0.0, "Constant part of the heading.", unit="rad", low=-1e3, high=1e3, symbol="psi_d")
    heading_sine: SineParameters = group(SineParameters)
    heading_steps: StepsParameters = group(StepsParameters)
    heading_ramp: RampParameters = group(RampParameters)
    surge_velocity: float = parameter(
        0.0, "Speed of the position along the heading.", unit="m/s", low=-1e3, high=1e3, symbol="u_d"
    )


class CourseReference:
    """A heading over time in discrete time.

    Args:
        parameters: The heading as a function of time, and the speed.
        start: Initial position x, y, m.
        period: Time between two published states, s.

    Attributes:
        state: x, y, psi, u, v, r, shape (6,).

    Raises:
        ParameterError: times and values of the steps or of the ramp differ in number, or the times do not increase.
    """

    def __init__(self, parameters: CourseReferenceParameters, start: tuple[float, float], period: float) -> None:
        self._heading = program_of(parameters, "heading", "reference_ship.course")
        self._speed = parameters.surge_velocity
        self._start = start
        self._period = period
        self.reset()

    def reset(self) -> None:
        """Return to the start."""
        self._steps = 0
        self._position = self._start
        self._read()

    def acceleration(self) -> Array:
        """Derivatives 0, 0, dr_d of the body velocities, shape (3,): m/s², m/s², rad/s²."""
        return np.array([0.0, 0.0, self._yaw_acceleration])

    def advance(self) -> None:
        """Advance by one period, the position by the midpoint rule."""
        psi = self._heading.value((self._steps + 0.5) * self._period)
        x, y = self._position
        distance = self._speed * self._period
        # Midpoint rule: psi is the heading in the middle of the period.
        self._position = x + distance * math.cos(psi), y + distance * math.sin(psi)
        self._steps += 1
        self._read()

    def _read(self) -> None:
        time = self._steps * self._period
        rate, self._yaw_acceleration = self._heading.rates(time)
        self.state: Array = np.array([*self._position, self._heading.value(time), self._speed, 0.0, rate])
