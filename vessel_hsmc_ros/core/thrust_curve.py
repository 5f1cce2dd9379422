"""The thrust of a propeller by the pulse width of its speed controller: a measured curve with a deadband, and its inverse.

Between the measured points the curve is straight, beyond them constant; within the deadband about the neutral pulse the thrust is
zero, and from its edges on the curve goes to the nearest measured points.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError

LOWEST, HIGHEST = 1000.0, 2000.0  # range of pulse widths, µs


class ThrustCurve(NamedTuple):
    """A curve from its most negative to its largest thrust."""

    neutral: float  # pulse width of rest, µs
    deadband: float  # half the width of the deadband, µs
    # pulses, thrusts: its points outside the deadband, µs and N, both increasing
    pulses: tuple[float, ...]
    thrusts: tuple[float, ...]

    def pulse(self, thrust: float) -> float:
        """The pulse width for a thrust, N, within the curve; neutral for none."""
        if not thrust:
            return self.neutral
        side, edge = (1.0, self.neutral + self.deadband) if thrust > 0.0 else (-1.0, self.neutral - self.deadband)
        points = sorted((abs(t), p) for p, t in zip(self.pulses, self.thrusts, strict=True) if t * side > 0.0)
        return float(np.interp(abs(thrust), [0.0, *(t for t, _ in points)], [edge, *(p for _, p in points)]))

    def thrust(self, pulse: float) -> float:
        """The thrust for a pulse width, µs; N."""
        if abs(pulse - self.neutral) <= self.deadband:
            return 0.0
        edges = [(self.neutral - self.deadband, 0.0), (self.neutral + self.deadband, 0.0)]
        points = sorted([*zip(self.pulses, self.thrusts, strict=True), *edges])
        return float(np.interp(pulse, [p for p, _ in points], [t for _, t in points]))


def thrust_curve(neutral: float, deadband: float, pulses: Sequence[float], thrusts: Sequence[float], name: str) -> ThrustCurve:
    """A curve of measured points.

    Args:
        neutral: Pulse width of rest, µs.
        deadband: Half the width of the deadband, µs.
        pulses: Pulse widths of the measurements, µs, increasing, outside the deadband.
        thrusts: The measured thrusts, N: negative below the deadband, positive above it, increasing.
        name: Of the group of parameters, for errors.

    Raises:
        ParameterError: the numbers are not such a curve.
    """
    if len(pulses) != len(thrusts) or not pulses:
        raise ParameterError(
            f"{name}.curve_thrusts must have one element for each of {len(pulses)} curve_pulses (got {len(thrusts)})"
        )
    if not all(LOWEST <= p <= HIGHEST for p in pulses) or any(b <= a for a, b in pairwise(pulses)):
        raise ParameterError(f"{name}.curve_pulses must be increasing numbers from 1000 to 2000 µs (got {list(pulses)})")
    if any(b <= a for a, b in pairwise(thrusts)) or not all(map(math.isfinite, thrusts)):
        raise ParameterError(f"{name}.curve_thrusts must be increasing finite numbers, N (got {list(thrusts)})")
    for p, t in zip(pulses, thrusts, strict=True):
        if abs(p - neutral) <= deadband or (p - neutral) * t <= 0.0:
            raise ParameterError(
                f"{name}.curve_thrusts must be negative below {neutral - deadband:g} µs, positive above {neutral + deadband:g} µs"
                f" and without a point between them (got {t:g} N at {p:g} µs); pwm.reversed exchanges ahead and astern"
            )
    return ThrustCurve(neutral, deadband, tuple(pulses), tuple(thrusts))
