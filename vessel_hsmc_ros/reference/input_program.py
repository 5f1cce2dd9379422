"""Inputs as functions of time: the sum of a constant, a sine, steps and a ramp.

program(t) = constant + amplitude·sin(frequency·t + phase) + steps(t) + ramp(t)

The unit is that of the input, N, N·m or rad. A group with its default values contributes zero.
"""

import bisect
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter

EARLY = 0.5e-9
"""Tolerance of half a nanosecond, s: a step takes effect at its instant in spite of rounded times."""

LONGEST, LARGEST = 1e9, 1e12


def times(description: str) -> tuple[float, ...]:
    """Declare a list of times, (0,) by default."""
    return parameter((0.0,), description, unit="s", low=0.0, high=LONGEST)


def values(description: str) -> tuple[float, ...]:
    """Declare the list of values at those times, (0,) by default."""
    return parameter((0.0,), description, low=-LARGEST, high=LARGEST)


@dataclass(frozen=True)
class SineParameters:
    """amplitude·sin(frequency·t + phase)."""

    amplitude: float = parameter(0.0, "Amplitude of the sine, in the unit of the input.", low=-LARGEST, high=LARGEST)
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


class InputProgram:
    """The sum of a constant, a sine, steps and a ramp.

    Args:
        constant: Constant part, in the unit of the input.
        sine, steps, ramp: The other parts.
        name: Name of the constant's parameter, for error messages; the groups are named after it.

    Raises:
        ParameterError: times and values of the steps or of the ramp differ in number, or the times do not increase.
    """

    def __init__(
        self, constant: float, sine: SineParameters, steps: StepsParameters, ramp: RampParameters, name: str = "program"
    ) -> None:
        for points, kind in ((steps, "steps"), (ramp, "ramp")):
            check_points(points, f"{name}_{kind}")
        self._constant, self._sine, self._steps, self._ramp = constant, sine, steps, ramp
        self._offset = 0.0

    def continue_phase(self, previous: "InputProgram", time: float) -> None:
        """Take over the phase that a previous programme's sine had come to, apart from a change of the parameter `phase` itself.

        Args:
            previous: The programme that this one replaces.
            time: Time of the change since the start, s.
        """
        # Equal angles frequency·time + offset at the time of the change.
        self._offset = previous._offset + (previous._sine.frequency - self._sine.frequency) * time

    def value(self, time: float) -> float:
        """The value at a time since the start, s."""
        s = self._sine
        sine = s.amplitude * math.sin(s.frequency * time + s.phase + self._offset)
        return self._constant + sine + step_value(self._steps, time) + self._interpolated(time)[0]

    def rates(self, time: float) -> tuple[float, float]:
        """First and second derivative at a time since the start, per s and per s²; those of the steps are taken as zero."""
        s = self._sine
        angle = s.frequency * time + s.phase + self._offset
        first = s.amplitude * s.frequency * math.cos(angle) + self._interpolated(time)[1]
        return first, -s.amplitude * s.frequency * s.frequency * math.sin(angle)

    def _interpolated(self, time: float) -> tuple[float, float]:
        """Value and slope of the ramp; at a point, the slope to its right."""
        t, y = self._ramp.times, self._ramp.values
        after = bisect.bisect_right(t, time + EARLY)
        # Outside of its points the ramp is constant, so its slope is zero.
        if after == 0:
            return y[0], 0.0
        if after == len(t):
            return y[-1], 0.0
        slope = (y[after] - y[after - 1]) / (t[after] - t[after - 1])
        return y[after - 1] + slope * (time - t[after - 1]), slope


def program_of(parameters: Any, name: str, owner: str) -> InputProgram:
    """Make the input of a given name from its parameters.

    Args:
        parameters: Dataclass with the fields `name`, `name_sine`, `name_steps` and `name_ramp`.
        name: Name of the constant.
        owner: Name of the node or group of the parameters, for error messages.

    Returns:
        The input as a function of time.

    Raises:
        ParameterError: times and values of the steps or of the ramp differ in number, or the times do not increase.
    """
    sine, steps, ramp = (getattr(parameters, f"{name}_{kind}") for kind in ("sine", "steps", "ramp"))
    return InputProgram(getattr(parameters, name), sine, steps, ramp, f"{owner}.{name}")


def step_value(steps: StepsParameters, time: float) -> float:
    """The value of the steps at a time since the start, s; 0 before the first."""
    begun = bisect.bisect_right(steps.times, time + EARLY)
    return steps.values[begun - 1] if begun else 0.0


def check_points(points: StepsParameters | RampParameters, name: str) -> None:
    """Check the times and values of steps or of a ramp.

    Args:
        points: Times and values.
        name: Name of the group, for error messages.

    Raises:
        ParameterError: lengths differ, the lists are empty, or the times do not increase.
    """
    times, values = list(points.times), list(points.values)
    if len(times) != len(values) or not times:
        raise ParameterError(f"{name}.times = {times} does not fit {name}.values = {values}: it takes as many, and one at least")
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise ParameterError(f"{name}.times = {times} is not allowed: it takes increasing times")
