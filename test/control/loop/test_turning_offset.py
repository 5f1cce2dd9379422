import math

import numpy as np
import pytest
from numpy.typing import NDArray

from vessel_hsmc_ros.control.loop.control_period import MAX_COEFFICIENT, MAX_LEARNING_ERROR, NOISE, Turning, turning_offset

Array = NDArray[np.float64]

RATE, T = 0.07, 0.02


def learned(frequency: float, error: float, duration: float, learning: bool = True) -> Array:
    """The error that is left of a sine of the frequency of the turns, over time, where the offset acts on it at once."""
    turning, left = Turning(), []
    for t in np.arange(0.0, duration, T):
        r_d, dr_d = 0.1 * math.sin(frequency * t), 0.1 * frequency * math.cos(frequency * t)
        o = turning_offset(turning, 0.0, r_d, dr_d, RATE, T).o
        left.append(error * math.sin(frequency * t + 0.8) + o)
        turning = turning_offset(turning, left[-1] if learning else 0.0, r_d, dr_d, RATE, T).turning
    return np.array(left)


@pytest.mark.parametrize("frequency", [0.02, 0.05, 0.12])
def test_an_error_that_varies_as_the_reference_turns_is_learned(frequency: float) -> None:
    left = learned(frequency, 0.1, 1200.0)
    assert np.max(np.abs(left[-10_000:])) < 0.01


def test_nothing_is_learned_in_a_steady_turn() -> None:
    turning = Turning()
    for _ in range(50_000):
        turning = turning_offset(turning, 0.0, 0.1, 0.0, RATE, T).turning
    before = turning
    for _ in range(50_000):
        turning = turning_offset(turning, 0.2, 0.1, 0.0, RATE, T).turning
    assert turning.theta1 == pytest.approx(before.theta1, abs=1e-6)
    assert turning_offset(turning, 0.2, 0.1, 0.0, RATE, T).o == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_far_from_the_reference_nothing_is_learned(side: float) -> None:
    turning = Turning(0.05, 0.02, 0.01, 0.3, -0.2)
    for e, learns in ((MAX_LEARNING_ERROR, False), (1e3, False), (0.99 * MAX_LEARNING_ERROR, True)):
        after = turning_offset(turning, side * e, 0.1, 0.01, RATE, T).turning
        assert ((after.theta1, after.theta2) != (0.3, -0.2)) is learns


def test_the_derivatives_are_those_of_the_offset() -> None:
    turning, step, found = Turning(0.05, 0.02, 0.01, 0.3, -0.2), 1e-4, []
    for k in range(3):
        found.append(turning_offset(turning, 0.0, 0.1 + 0.02 * k * step, 0.02, RATE, step))
        turning = found[-1].turning
    assert (found[2].o - found[0].o) / (2.0 * step) == pytest.approx(found[1].do, abs=1e-7)
    assert (found[2].do - found[0].do) / (2.0 * step) == pytest.approx(found[1].ddo, abs=1e-7)


def test_the_coefficients_are_bounded() -> None:
    turning = Turning(0.05, 0.02, 0.01, 0.0, 0.0)
    for _ in range(100_000):
        turning = turning_offset(turning, -0.2, 0.1 * math.copysign(1.0, turning.a - 0.05), 0.0, RATE, T).turning
    assert abs(turning.theta1) <= 0.25 / (0.1 * RATE)
    assert abs(turning.theta2) <= 0.25 / (0.1 * RATE)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_coefficients_are_bounded_whatever_they_were(side: float) -> None:
    bound = MAX_COEFFICIENT / (NOISE * RATE)
    turning = turning_offset(Turning(0.05, 0.03, 0.02, side * 1e6, -side * 1e6), 0.1, 0.1, 0.0, RATE, T).turning
    assert (turning.theta1, turning.theta2) == (side * bound, -side * bound)
