"""Inputs as functions of time: the sum of a constant, a sine, steps and a ramp.

program(t) = constant + amplitude·sin(frequency·t + phase) + steps(t) + ramp(t)

The unit is that of the input, N, N·m or rad. A group with its default values contributes zero.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.schema import parameter

Array = NDArray[np.float64]

EARLY = 0.5e-9  # tolerance of half a nanosecond, s: a step takes effect at its instant in spite of rounded times
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

    `constant`: constant part, in the unit of the input. `name`: name of the constant's parameter, for error messages; the
    groups are named after it. Raises ParameterError if times and values of the steps or of the ramp differ in number, or the
    times do not increase.
    """
    parts = (*arrays(steps, f"{name}_steps"), *arrays(ramp, f"{name}_ramp"))
    return Program(float(constant), float(sine.amplitude), float(sine.frequency), float(sine.phase), *parts)


def arrays(points: StepsParameters | RampParameters, name: str) -> tuple[Array, Array]:
    """Times and values as arrays; empty if all values are zero, which saves most inputs the search.

    Raises ParameterError if lengths differ, the lists are empty, or the times do not increase.
    """
    times, values = list(points.times), list(points.values)
    if len(times) != len(values) or not times:
        raise ParameterError(f"{name}.times must be as many as {name}.values = {values}, and at least one (got {times})")
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise ParameterError(f"{name}.times must increase (got {times})")
    nonzero = any(values)
    return np.array(times if nonzero else (), np.float64), np.array(values if nonzero else (), np.float64)


def program_of(parameters: Any, name: str, owner: str) -> Program:
    """Make the input of a given name from its parameters.

    `parameters`: dataclass with the fields `name`, `name_sine`, `name_steps` and `name_ramp`. `owner`: name of the node or
    group of the parameters, for error messages. Returns the input as a function of time. Raises ParameterError if times and
    values of the steps or of the ramp differ in number, or the times do not increase.
    """
    sine, steps, ramp = (getattr(parameters, f"{name}_{kind}") for kind in ("sine", "steps", "ramp"))
    return program(getattr(parameters, name), sine, steps, ramp, f"{owner}.{name}")


@kernel
def input_value(p: Program, offset: float, time: float) -> float:
    """The input at a time since the start, s.

    `offset`: added to the phase of the sine, rad. `time`: time since the start, s. Returns the sum of its parts, in the unit of
    the input.
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


@kernel
def passed(times: Array, time: float) -> int:
    """How many of some increasing times have passed, by bisection."""
    low, high = 0, len(times)
    while low < high:
        middle = (low + high) // 2
        if time + EARLY < times[middle]:
            high = middle
        else:
            low = middle + 1
    return low
