"""The delays of the guided law's two inputs, unlike each other, and ages that are no whole periods."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.guided.controller import GuidedController, ahead, delays
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters
from vessel_hsmc_ros.control.interface.actuators import arriving, channel
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

T = 0.1
STEADY = Acceleration(0.0, 0.0, 0.0)
UNLIKE = {**INSTANT, "surge_dead_time": 0.2, "yaw_dead_time": 0.5}


def controller(**known: Any) -> GuidedController:
    return GuidedController(GuidedParameters(), KnownVessel(**known), T)


@given(st.integers(0, 200), st.sampled_from([0.01, 0.02, 0.05, 0.1, 0.2]))
def test_a_dead_time_of_whole_periods_has_as_many(count: int, period: float) -> None:
    """0.3/0.1 is 2.9999999999999996: the quotient is rounded, not truncated."""
    decimal = round(count * period, 9)
    assert channel(1.0, 0.0, 0.0, 1.0, decimal, period).delay == count


@pytest.mark.parametrize(("age", "periods"), [(0.0, 0), (0.04, 0), (0.06, 1), (0.16, 2), (0.24, 2), (0.3, 3)])
def test_an_age_counts_as_the_nearest_number_of_periods_in_both_inputs(age: float, periods: int) -> None:
    law = controller(**UNLIKE)
    assert delays(age, law.memory, law.constants.gains) == (2 + periods, 5 + periods)


@pytest.mark.parametrize("known", [UNLIKE, {**INSTANT, "surge_dead_time": 0.5, "yaw_dead_time": 0.2}], ids=["yaw", "surge"])
@pytest.mark.parametrize("speed", [2.0, -2.0], ids=["ahead", "astern"])
def test_a_ship_on_its_reference_is_commanded_to_go_on_whichever_input_is_later(known: dict[str, Any], speed: float) -> None:
    """Ship and reference are predicted over one time: over unlike times they would be metres apart."""
    law, moving = controller(**known), Motion(0.0, 0.0, 0.3, speed, 0.0, 0.0)
    _, terms = law.step(moving, moving, STEADY)
    # Damping is expected to take some of its way until the command arrives.
    assert terms.commanded_surge_velocity == pytest.approx(speed, abs=0.02)
    assert terms.commanded_heading == pytest.approx(0.3, abs=1e-9)


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=20), st.integers(1, 6))
def test_the_command_of_some_periods_ago_is_found_wherever_the_ring_has_wrapped(commands: list[float], length: int) -> None:
    queue, head = np.zeros((2, length)), 0
    for k, command in enumerate(commands):
        head = k % length
        queue[:, head] = command, -command
    for age in range(min(length, len(commands))):
        assert arriving(queue, 0, head, age) == commands[-1 - age]
        assert arriving(queue, 1, head, age) == -commands[-1 - age]


def test_the_motion_is_predicted_by_the_commands_on_their_way_each_after_its_own_delay() -> None:
    """From rest: 2 and 5 periods; after the last known surge force, which is held, three more yaw moments arrive."""
    law = controller(**UNLIKE)
    g, m = law.constants.gains, law.memory
    force, moment = np.arange(1.0, 1.0 + m.queue.shape[1]) * 1e-3, np.arange(5.0, 5.0 + m.queue.shape[1]) ** 2 * 1e-4
    m.queue[0], m.queue[1], m.x[:] = force, moment, 0.0
    m = m._replace(head=9)
    motion, tau_1, tau_2 = ahead(Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 2, 5, m, g)
    assert (tau_1, tau_2) == (force[8], moment[8])
    assert motion.u == pytest.approx(g.h * (force[7] + 4 * force[8]))
    assert motion.r == pytest.approx(g.h * moment[4:9].sum())
