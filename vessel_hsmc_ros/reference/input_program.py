"""What drives a reference over time: a constant, a sine, steps and a ramp, all added up.

program(t) = constant + amplitude·sin(frequency·t + phase) + steps(t) + ramp(t)

The unit is that of what is driven: N, N·m, rad. A group that is left at its defaults adds nothing.
"""

import bisect
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter

EARLY = 0.5e-9
"""Half a nanosecond, s: a step falls on its instant, whatever the rounding of the time."""

LONGEST, LARGEST = 1e9, 1e12


def times(description: str) -> tuple[float, ...]:
    """Declare instants, the start unless said otherwise."""
    return parameter((0.0,), description, unit="s", low=0.0, high=LONGEST)


def values(description: str) -> tuple[float, ...]:
    """Declare what belongs to the instants, nothing unless said otherwise."""
    return parameter((0.0,), description, low=-LARGEST, high=LARGEST)


@dataclass(frozen=True)
class SineParameters:
    """amplitude·sin(frequency·t + phase)."""

    amplitude: float = parameter(0.0, "Amplitude of the sine, in the unit of what it drives.", low=-LARGEST, high=LARGEST)
    frequency: float = parameter(0.05, "Angular frequency of the sine.", unit="rad/s", low=0.0, high=1e3)
    phase: float = parameter(0.0, "Phase of the sine at the start.", unit="rad", low=-1e3, high=1e3)


@dataclass(frozen=True)
class StepsParameters:
    """values[i] from times[i] on, until the next; nothing before the first."""

    times: tuple[float, ...] = times("When each value begins to hold; increasing.")
    values: tuple[float, ...] = values("The value that holds from each time on, in the unit of what it drives.")


@dataclass(frozen=True)
class RampParameters:
    """A straight line from each point (times[i], values[i]) to the next; the outer values hold before and after."""

    times: tuple[float, ...] = times("Times of the points that straight lines join; increasing.")
    values: tuple[float, ...] = values("Values at those times, in the unit of what they drive.")


class InputProgram:
    """A constant, a sine, steps and a ramp.

    Args:
        constant: In the unit of what is driven, as all values.
        sine, steps, ramp: What is added to it.
        name: The parameter of the constant, for error messages; the groups are named after it.

    Raises:
        ParameterError: the times of the steps or of the ramp do not increase, or are not as many as the values.
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
        self._offset = previous._offset + (previous._sine.frequency - self._sine.frequency) * time

    def value(self, time: float) -> float:
        """The sum at a time since the start, s."""
        s = self._sine
        sine = s.amplitude * math.sin(s.frequency * time + s.phase + self._offset)
        return self._constant + sine + held(self._steps, time) + self._interpolated(time)[0]

    def rates(self, time: float) -> tuple[float, float]:
        """First and second derivative at a time, per s and per s²; a step has none, a ramp its slope."""
        s = self._sine
        angle = s.frequency * time + s.phase + self._offset
        first = s.amplitude * s.frequency * math.cos(angle) + self._interpolated(time)[1]
        return first, -s.amplitude * s.frequency * s.frequency * math.sin(angle)

    def _interpolated(self, time: float) -> tuple[float, float]:
        """Value and slope of the ramp; at a point, the slope of what follows."""
        t, y = self._ramp.times, self._ramp.values
        after = bisect.bisect_right(t, time + EARLY)
        if after == 0:
            return y[0], 0.0
        if after == len(t):
            return y[-1], 0.0
        slope = (y[after] - y[after - 1]) / (t[after] - t[after - 1])
        return y[after - 1] + slope * (time - t[after - 1]), slope


def program_of(parameters: Any, name: str, owner: str) -> InputProgram:
    """The programme of one input: a constant of that name and the three groups named after it.

    Args:
        parameters: Holds `name`, `name_sine`, `name_steps` and `name_ramp`.
        name: Of the constant.
        owner: What the parameters belong to, for error messages.

    Raises:
        ParameterError: the times of its steps or ramp do not fit their values.
    """
    sine, steps, ramp = (getattr(parameters, f"{name}_{kind}") for kind in ("sine", "steps", "ramp"))
    return InputProgram(getattr(parameters, name), sine, steps, ramp, f"{owner}.{name}")


def held(steps: StepsParameters, time: float) -> float:
    """The value of the last step that has begun; 0 before the first."""
    begun = bisect.bisect_right(steps.times, time + EARLY)
    return steps.values[begun - 1] if begun else 0.0


def check_points(points: StepsParameters | RampParameters, name: str) -> None:
    """Refuse times without values, values without times, and times that go back.

    Raises:
        ParameterError: they are so.
    """
    times, values = list(points.times), list(points.values)
    if len(times) != len(values) or not times:
        raise ParameterError(f"{name}.times = {times} does not fit {name}.values = {values}: it takes as many, and one at least")
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise ParameterError(f"{name}.times = {times} is not allowed: it takes increasing times")
