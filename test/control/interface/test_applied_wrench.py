"""What a law knows of its actuators: the lead against a lag, and commands that arrive after a dead time."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.interface.actuators import applied, arriving, channel, lead

T = 0.02


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.05, 5.0), st.floats(0.01, 1.0))
def test_with_the_lead_an_input_approaches_what_is_wanted_with_the_shorter_lag(
    tau: float, wanted: float, lag: float, share: float
) -> None:
    c = channel(1e6, lag, share * lag, math.inf, 0.0, T)
    after = applied(tau, lead(tau, wanted, c), c)
    expected = tau + -math.expm1(-T / (share * lag)) * (wanted - tau)
    assert after == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_a_command_arrives_after_its_dead_time() -> None:
    queue = np.array([[5.0, 6.0, 7.0, 8.0], [0.0, 0.0, 0.0, 0.0]])
    assert [arriving(queue, 0, 1, age) for age in range(4)] == [6.0, 5.0, 8.0, 7.0]
