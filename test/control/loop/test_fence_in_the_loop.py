"""The fence in the closed loop of a scenario: drawn currents and courses, held or led back inside."""

import math
from typing import Any

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import ClosedLoop

SQUARE = [-20.0, -20.0, 20.0, -20.0, 20.0, 20.0, -20.0, 20.0, -20.0, -20.0]


def sailed(law: str, action: str, current: complex, course: float = 0.0, **more: Any) -> tuple[np.ndarray, Any]:
    """The track of an otter that sails at its fence, and its loop."""
    nodes = ("controller", "reference_ship", "vessel_sim")
    changes = {
        "vessel": "otter",
        "controller.law": law,
        "reference_ship.mode": "straight",
        "reference_ship.straight.speed": 1.0,
        "vessel_sim.duration": 50.0,
        "vessel_sim.disturbance.current.east": current.real,
        "vessel_sim.disturbance.current.north": current.imag,
        **{f"{node}.initial_pose": [0.0, 0.0, course] for node in nodes[1:]},
        **{f"{node}.rate_hz": 10.0 for node in nodes},
        "controller.safety.fence.inside": SQUARE,
        "controller.safety.fence.action": action,
        "controller.guided.actuator_identification": False,
        **more,
    }
    closed = ClosedLoop(load_scenario("case2_straight", changes))
    closed.run()
    return closed.result().state[:, :2], closed._loop._loop  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("law", "current"), rest_long([("guided", 0j), ("guided", 0.5 + 0.3j), ("guided", 0.6j), ("los_pid", 0j)], 3)
)
def test_a_boat_that_sails_at_its_fence_is_held_inside(law: str, current: complex) -> None:
    track, loop = sailed(law, "hold", current)
    assert 5.0 < np.abs(track).max() < 20.0
    assert (loop.supervision.operation, loop.supervision.reason) == (Operation.SAFE, Reason.FENCE)
    assert np.hypot(*(track[-1] - track[-50])) < 1.0, "it keeps station"
    if law == "guided":
        observed, doubt, decay, _ = loop.law.water
        assert abs(observed - current) < max(doubt, 0.15)
        assert 0.05 < decay < 2.0


def test_a_boat_returns_along_its_way_to_where_it_began() -> None:
    track, _ = sailed("guided", "return", 0.3j, 0.5)
    assert np.abs(track).max() < 20.0
    assert math.hypot(*track[-1]) < 3.0
    course = np.array([math.cos(0.5), math.sin(0.5)])
    across = track[:, 1] * course[0] - track[:, 0] * course[1]
    assert np.abs(across).max() < 4.0


def test_with_a_declared_current_a_law_that_observes_none_acts_earlier() -> None:
    reach = [
        np.abs(sailed("los_pid", "hold", 0j, **{"controller.safety.fence.current": current})[0]).max() for current in (0.0, 0.4)
    ]
    assert reach[1] < reach[0] - 2.0
