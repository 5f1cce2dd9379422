"""A law comes back after any jump of the position that the checks take, however far."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.control.safety.samples import LARGEST
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

RATE, BEGIN = 20.0, 50.0
BACK = 120.0
"""Time after the jump within which the vessel is back, s; from 1e8 m guided takes longer than a minute."""


def displaced(law: str, distance: float, course: float, lasts: float) -> float:
    """The largest position error from `BACK` after a jump on, m."""
    rates = {f"{node}.rate_hz": RATE for node in ("vessel_sim", "reference_ship", "controller")}
    end = BEGIN + lasts + BACK
    scenario = load_scenario("case2_tracking", {"controller.law": law, "vessel_sim.duration": end + 20.0, **rates})
    base: Any = LAWS[law].controller

    class Displaced(base):  # type: ignore[misc]
        count = 0

        def step(self, motion: Motion, desired: Motion, acceleration: Acceleration, **age: float) -> Any:
            now, self.count = self.count / RATE, self.count + 1
            if BEGIN <= now < BEGIN + lasts:
                x, y = motion.x + distance * math.cos(course), motion.y + distance * math.sin(course)
                motion = motion._replace(x=x, y=y)
            return super().step(motion, desired, acceleration, **age)

    parameters = getattr(scenario.controller, law)
    run = simulate(scenario, law=Displaced(parameters, scenario.controller.vessel.as_controlled(), 1.0 / RATE), interpreted=True)
    error = np.hypot(*(run.state[:, :2] - run.reference[:, :2]).T)
    return float(error[run.time >= end].max())


@pytest.mark.long
@pytest.mark.parametrize("law", ["hierarchical", "guided"])
@given(exponent=st.floats(1.0, math.log10(LARGEST) - 0.01), course=st.floats(-math.pi, math.pi), lasts=st.floats(0.1, 8.0))
@settings(max_examples=2, deadline=None)
def test_a_law_is_back_within_two_minutes_of_a_jump(law: str, exponent: float, course: float, lasts: float) -> None:
    assert displaced(law, 10.0**exponent, course, lasts) < 1.0
