"""References over time that are known as formulas: input programs, a heading, and the virtual ship.

Inputs as functions of time: the sum of a constant, a sine, steps and a ramp.

program(t) = constant + amplitude·sin(frequency·t + phase) + steps(t) + ramp(t)

The unit is that of the input, N, N·m or rad. A group with its default values contributes zero.

A heading over time: the reference of case 1, course control.

The heading is a given function of time with its exact derivatives. To make the reference complete, the position moves along the
heading at a constant speed; it is not the motion of a ship, and course-control laws ignore it.

The virtual ship that generates the desired trajectory, equation (8).

It has the dynamics (6) without disturbance and is driven by its own inputs tau_1d, tau_2d, so its trajectory is feasible for a
ship of the same kind. Its states and inputs carry the suffix d in the paper. The inputs are functions of time, which the paper
does not give; each is constant over a period.
"""

import math
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_motion
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.guidance.timetable import KernelReference, passed
from vessel_hsmc_ros.plant.dynamics import STILL_WATER, Vessel, rate_of_motion, rk4_step
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters, divergence, initial_pose, initial_velocity

MAX_INPUT_TIME, MAX_INPUT = 1e9, 1e12


def times(description: str) -> tuple[float, ...]:
    """Declare a list of times, (0,) by default."""
    return parameter((0.0,), description, unit="s", low=0.0, high=MAX_INPUT_TIME)


def values(description: str) -> tuple[float, ...]:
    """Declare the list of values at those times, (0,) by default."""
    return parameter((0.0,), description, low=-MAX_INPUT, high=MAX_INPUT)


@dataclass(frozen=True)
class SineParameters:
    """amplitude·sin(frequency·t + phase)."""

    amplitude: float = parameter(0.0, "Amplitude of the sine, in the unit of the input.", low=-MAX_INPUT, high=MAX_INPUT)
    frequency: float = parameter(0.05, "Angular frequency of the sine.", unit="rad/s", low=0.0, high=1e3)
    phase: float = parameter(0.0, "Phase of the sine at the start.", unit="rad", low=-1e3, high=1e3)


@dataclass(frozen=True)
class StepsParameters:
    """Steps: values[i] from times[i] until times[i + 1]; zero before times[0]."""

    times: tuple[float, ...] = times("Times of the steps, increasing.")
    values: tuple[float, ...] = values("Value from each time on, in the unit of the input.")


@dataclass(frozen=True)
class RampParameters:
    """Linear interpolation between the points (times[i], values[i]); constant before the first and after the last."""

    times: tuple[float, ...] = times("Times of the points, increasing.")
    values: tuple[float, ...] = values("Values of the points, in the unit of the input.")


class Program(NamedTuple):
    """An input as a function of time."""

    constant: float  # constant part, in the unit of the input
    # amplitude, frequency, phase: the sine; in the unit of the input, rad/s, rad
    amplitude: float
    frequency: float
    phase: float
    # step_times, step_values: the steps, shape (n,); s, in the unit of the input; n = 0 if they are zero
    step_times: Array
    step_values: Array
    # ramp_times, ramp_values: the points of the ramp, shape (m,); s, in the unit of the input; m = 0 if they are zero
    ramp_times: Array
    ramp_values: Array


def program(
    constant: float, sine: SineParameters, steps: StepsParameters, ramp: RampParameters, name: str = "program"
) -> Program:
    """The sum of a constant, a sine, steps and a ramp.

    `constant`: constant part, in the unit of the input. `name`: name of the constant's parameter, for error messages; the groups
    are named after it.
    """
    parts = (*arrays(steps, f"{name}_steps"), *arrays(ramp, f"{name}_ramp"))
    return Program(float(constant), float(sine.amplitude), float(sine.frequency), float(sine.phase), *parts)


def arrays(points: StepsParameters | RampParameters, name: str) -> tuple[Array, Array]:
    """Times and values as arrays; empty if all values are zero, which saves most inputs the search."""
    times, values = list(points.times), list(points.values)
    if len(times) != len(values) or not times:
        raise ParameterError(f"{name}.times must be as many as {name}.values = {values}, and at least one (got {times})")
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise ParameterError(f"{name}.times must increase (got {times})")
    nonzero = any(values)
    return np.array(times if nonzero else (), np.float64), np.array(values if nonzero else (), np.float64)


def program_of(parameters: Any, name: str, owner: str) -> Program:
    """Make the input of a given name from its parameters.

    `parameters`: dataclass with the fields `name`, `name_sine`, `name_steps` and `name_ramp`. `owner`: name of the node or group
    of the parameters, for error messages. Returns the input as a function of time.
    """
    sine, steps, ramp = (getattr(parameters, f"{name}_{kind}") for kind in ("sine", "steps", "ramp"))
    return program(getattr(parameters, name), sine, steps, ramp, f"{owner}.{name}")


@kernel
def input_value(p: Program, offset: float, time: float) -> float:
    """The input at a time since the start, s.

    `offset`: added to the phase of the sine, rad. Returns the sum of its parts, in the unit of the input.
    """
    sine = p.amplitude * math.sin(p.frequency * time + p.phase + offset)
    begun = passed(p.step_times, time)
    step = float(p.step_values[begun - 1]) if begun > 0 else 0.0
    return p.constant + sine + step + interpolated(p, time)[0]


@kernel
def input_rates(p: Program, time: float) -> tuple[float, float]:
    """First and second derivative at a time since the start, per s and per s²; those of the steps are taken as zero."""
    angle = p.frequency * time + p.phase
    first = p.amplitude * p.frequency * math.cos(angle) + interpolated(p, time)[1]
    return first, -p.amplitude * p.frequency * p.frequency * math.sin(angle)


@kernel
def interpolated(p: Program, time: float) -> tuple[float, float]:
    """Value and slope of the ramp; at a point, the slope to its right."""
    t, y = p.ramp_times, p.ramp_values
    if len(t) == 0:
        return 0.0, 0.0
    after = passed(t, time)
    # Outside of its points the ramp is constant, so its slope is zero.
    if after == 0:
        return float(y[0]), 0.0
    last = float(y[after - 1])
    if after == len(t):
        return last, 0.0
    begin = float(t[after - 1])
    slope = (float(y[after]) - last) / (float(t[after]) - begin)
    return last + slope * (time - begin), slope


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
def move_course(m: CourseMemory, c: CourseConstants) -> CourseMemory:
    """The reference one period later, the position by the midpoint rule."""
    # Midpoint rule: psi is the heading in the middle of the period.
    psi = input_value(c.heading, 0.0, (m.steps + 0.5) * c.period)
    distance = c.speed * c.period
    return CourseMemory(m.x + distance * math.cos(psi), m.y + distance * math.sin(psi), m.steps + 1)


@kernel
def read_course(m: CourseMemory, c: CourseConstants) -> tuple[Motion, Acceleration]:
    """State and the derivatives 0, 0, dr_d of its velocities."""
    time = m.steps * c.period
    r, dr = input_rates(c.heading, time)
    return Motion(m.x, m.y, input_value(c.heading, 0.0, time), c.speed, 0.0, r), Acceleration(0.0, 0.0, dr)


class CourseReference(KernelReference):
    """A heading over time in discrete time.

    `parameters`: the heading as a function of time, and the speed. `start`: initial position x, y, m. `period`: time between two
    published states, s.
    """

    move, read = staticmethod(move_course), staticmethod(read_course)

    def __init__(self, parameters: CourseReferenceParameters, start: tuple[float, float], period: float) -> None:
        heading = program_of(parameters, "heading", "reference_ship.course")
        self.constants = CourseConstants(heading, float(parameters.surge_velocity), period)
        self._start = start
        self.reset()

    def reset(self) -> None:
        """Return to the start."""
        x, y = self._start
        self.memory = CourseMemory(float(x), float(y), 0)


UNDISTURBED = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class VirtualShipParameters:
    """Initial state, inputs and coefficients of the virtual ship."""

    initial_pose: tuple[float, ...] = initial_pose((15.0, 15.0, 0.0))
    initial_velocity: tuple[float, ...] = initial_velocity()
    surge_force: float = parameter(
        1e5, "Constant part of the surge force on the virtual ship.", unit="N", low=-1e9, high=1e9, symbol="tau_1d", tunable=True
    )
    surge_force_sine: SineParameters = group(SineParameters, tunable=True)
    surge_force_steps: StepsParameters = group(StepsParameters)
    surge_force_ramp: RampParameters = group(RampParameters)
    yaw_moment: float = parameter(
        1e6,
        "Constant part of the yaw moment on the virtual ship.",
        unit="N·m",
        low=-1e12,
        high=1e12,
        symbol="tau_2d",
        tunable=True,
    )
    yaw_moment_sine: SineParameters = group(SineParameters, tunable=True)
    yaw_moment_steps: StepsParameters = group(StepsParameters)
    yaw_moment_ramp: RampParameters = group(RampParameters)
    vessel: VesselParameters = group(VesselParameters)


class ShipConstants(NamedTuple):
    """Inputs and hull of the virtual ship, and the length of a step, s."""

    surge_force: Program
    yaw_moment: Program
    vessel: Vessel
    period: float


class ShipMemory(NamedTuple):
    """State, inputs of the present step, number of steps, and phases by which changes have shifted the sines, rad."""

    motion: Motion
    tau: tuple[float, float]
    steps: int
    offset: tuple[float, float]


@kernel
def inputs(steps: int, offset: tuple[float, float], c: ShipConstants) -> tuple[float, float]:
    """tau_1d [N] and tau_2d [N·m] of a step."""
    time = steps * c.period
    return input_value(c.surge_force, offset[0], time), input_value(c.yaw_moment, offset[1], time)


@kernel
def move_ship(m: ShipMemory, c: ShipConstants) -> ShipMemory:
    """The virtual ship one period later, under the inputs at the beginning of the period."""
    motion = rk4_step(m.motion, (m.tau[0], 0.0, m.tau[1]), UNDISTURBED, c.vessel, c.period, STILL_WATER)
    return ShipMemory(motion, inputs(m.steps + 1, m.offset, c), m.steps + 1, m.offset)


@kernel
def read_ship(m: ShipMemory, c: ShipConstants) -> tuple[Motion, Acceleration]:
    """State of the virtual ship, and the derivatives of its velocities by (8)."""
    rate = rate_of_motion(m.motion, (m.tau[0], 0.0, m.tau[1]), UNDISTURBED, c.vessel, STILL_WATER)
    return m.motion, Acceleration(rate.u, rate.v, rate.r)


class ReferenceShip(KernelReference):
    """The virtual ship (8) in discrete time. `period`: time between two published states, s."""

    move, read = staticmethod(move_ship), staticmethod(read_ship)

    def __init__(self, parameters: VirtualShipParameters, period: float) -> None:
        self._period = period
        self._take(parameters)
        self.reset()

    def _take(self, parameters: VirtualShipParameters) -> None:
        surge_force, yaw_moment = (program_of(parameters, name, "reference_ship") for name in ("surge_force", "yaw_moment"))
        self.constants = ShipConstants(surge_force, yaw_moment, parameters.vessel.coefficients(), self._period)
        self._parameters = parameters

    def reset(self) -> None:
        """Return to the initial state and the start of the inputs."""
        start = as_motion(self._parameters.initial_pose + self._parameters.initial_velocity)
        self.memory = ShipMemory(start, inputs(0, (0.0, 0.0), self.constants), 0, (0.0, 0.0))

    def retune(self, parameters: VirtualShipParameters) -> None:
        """Take changed inputs from the next step on; the phase of a sine whose frequency changes is continuous."""
        old, m = self.constants, self.memory
        self._take(parameters)
        # Equal angles frequency·time + offset at the time of the change.
        time, new = m.steps * self._period, self.constants
        surge = m.offset[0] + (old.surge_force.frequency - new.surge_force.frequency) * time
        yaw = m.offset[1] + (old.yaw_moment.frequency - new.yaw_moment.frequency) * time
        self.memory = m._replace(offset=(surge, yaw))

    def advance(self) -> None:
        """Advance by one period under the inputs at its beginning. Raises SimulationError if the motion is no longer finite."""
        before = self.memory
        with suppress(ValueError):  # the cosine of an infinite heading
            self.memory = move_ship(before, self.constants)
        if self.memory is before or not all(map(math.isfinite, self.memory.motion)):
            cause = f"under {before.tau[0]:g} N and {before.tau[1]:g} N·m: they do not fit its hull, or the step is too long"
            raise divergence("virtual ship", before.steps * self._period, cause, self._parameters.vessel)
