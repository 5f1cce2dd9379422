"""A heading over time: the reference of case 1, course control.

The heading is a given function of time with its exact derivatives. To make the reference complete, the position moves along the
heading at a constant speed; it is not the motion of a ship, and course-control laws ignore it.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.guidance.input_program import (
    Program,
    RampParameters,
    SineParameters,
    StepsParameters,
    input_rates,
    input_value,
    program_of,
)
from vessel_hsmc_ros.guidance.kernel_reference import KernelReference


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


class CourseConstants(NamedTuple):
    """The heading as a function of time, the speed, m/s, and the length of a step, s."""

    heading: Program
    speed: float
    period: float


class CourseMemory(NamedTuple):
    """Position, m, and number of steps."""

    x: float
    y: float
    steps: int


@kernel
def move(m: CourseMemory, c: CourseConstants) -> CourseMemory:
    """The reference one period later, the position by the midpoint rule."""
    # Midpoint rule: psi is the heading in the middle of the period.
    psi = input_value(c.heading, 0.0, (m.steps + 0.5) * c.period)
    distance = c.speed * c.period
    return CourseMemory(m.x + distance * math.cos(psi), m.y + distance * math.sin(psi), m.steps + 1)


@kernel
def read(m: CourseMemory, c: CourseConstants) -> tuple[Motion, Acceleration]:
    """State and the derivatives 0, 0, dr_d of its velocities."""
    time = m.steps * c.period
    r, dr = input_rates(c.heading, time)
    return Motion(m.x, m.y, input_value(c.heading, 0.0, time), c.speed, 0.0, r), Acceleration(0.0, 0.0, dr)


class CourseReference(KernelReference):
    """A heading over time in discrete time.

    `parameters`: the heading as a function of time, and the speed. `start`: initial position x, y, m. `period`: time between
    two published states, s.

    Raises:
        ParameterError: times and values of the steps or of the ramp differ in number, or the times do not increase.
    """

    move, read = staticmethod(move), staticmethod(read)

    def __init__(self, parameters: CourseReferenceParameters, start: tuple[float, float], period: float) -> None:
        heading = program_of(parameters, "heading", "reference_ship.course")
        self.constants = CourseConstants(heading, float(parameters.surge_velocity), period)
        self._start = start
        self.reset()

    def reset(self) -> None:
        """Return to the start."""
        x, y = self._start
        self.memory = CourseMemory(float(x), float(y), 0)
