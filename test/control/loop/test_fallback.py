"""The law of the safe action: each use begins like the first one."""

import math

import numpy as np
import pytest

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.loop.control_loop import Fallback, Inputs
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

REFERENCE = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0)


def inputs(y: float) -> Inputs:
    """A ship beside its reference, m."""
    return Motion(0.0, y, 0.1, 0.8, 0.05, 0.01), REFERENCE, Acceleration(0.0, 0.0, 0.0), 0.0, 0.1


def fallback(law: str) -> Fallback:
    return Fallback(make_controller(law, 0.1))


@pytest.mark.parametrize("law", ["los_pid", "guided"])
@pytest.mark.parametrize(
    "pause",
    [(inputs(1.0), False), (None, True), (inputs(math.nan), True)],
    ids=["not wanted", "inputs missing", "undefined"],
)
def test_the_second_use_of_the_fallback_law_begins_like_the_first(law: str, pause: tuple[Inputs | None, bool]) -> None:
    used, new = fallback(law), fallback(law)
    for _ in range(50):
        used.step(inputs(8.0), True)
    assert used.step(*pause) is None
    np.testing.assert_array_equal(
        [used.step(inputs(-2.0), True) for _ in range(5)], [new.step(inputs(-2.0), True) for _ in range(5)]
    )


def test_the_fallback_law_keeps_its_state_while_it_is_in_use() -> None:
    used = fallback("los_pid")
    wrenches = [used.step(inputs(8.0), True) for _ in range(50)]
    assert len(set(wrenches)) > 10, "its integrals grow"
