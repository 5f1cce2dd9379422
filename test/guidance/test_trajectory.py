"""Whole trajectories: bit-identical whether stepped by the node, computed at once, or compiled."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from compiling import only_compiled
from durations import rest_long
from hulls import COUPLING

from vessel_hsmc_ros.core.exceptions import ParameterError, SimulationError
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.factory import REFERENCES, Compiler, ReferenceShipParameters, make_reference, trajectory
from vessel_hsmc_ros.simulation.compilation import compiled

COUNT, RATE_HZ = 600, 20.0
EXAMPLES = 3


def drawn(mode: str, seed: int) -> ReferenceShipParameters:
    """Parameters of a mode with random numbers; a hull with coupled sway and yaw in turn with the paper's."""
    rng = np.random.default_rng((seed, *mode.encode()))
    times = np.sort(rng.uniform(0.0, 0.8 * COUNT / RATE_HZ, 3))
    values: dict[str, Any] = {
        "initial_pose": rng.uniform(-50.0, 50.0, 3),
        "initial_velocity": rng.uniform(-1.0, 1.0, 3) * (1.0, 0.5, 0.05),
        "surge_force": rng.uniform(-2e5, 2e5),
        "yaw_moment_sine.amplitude": rng.uniform(0.0, 2e6),
        "yaw_moment_steps.times": times,
        "yaw_moment_steps.values": rng.uniform(-1e6, 1e6, 3),
        "surge_force_ramp.times": times,
        "surge_force_ramp.values": rng.uniform(-1e5, 1e5, 3),
        "course.heading_sine.amplitude": rng.uniform(0.0, 0.5),
        "course.heading_steps.times": times,
        "course.heading_steps.values": rng.uniform(-1.0, 1.0, 3),
        "course.heading_ramp.times": times,
        "course.heading_ramp.values": rng.uniform(-1.0, 1.0, 3),
        "course.surge_velocity": rng.uniform(0.5, 3.0),
        "motion.speed": rng.uniform(1.0, 3.0),
        # The second and the third goal follow each other like a stream, which then ends.
        "goal.times": [times[0], times[1], times[1] + 1.0],
        "goal.poses": rng.uniform(-1.0, 1.0, 9) * (30.0, 30.0, 3.0, 6.0, 6.0, 3.0, 6.0, 6.0, 3.0),
        "path.time": 1.0,
        "path.waypoints": rng.uniform(-200.0, 200.0, 8),
        "circle.radius": rng.choice([-1.0, 1.0]) * rng.uniform(40.0, 80.0),
        "figure_eight.length": rng.choice([-1.0, 1.0]) * rng.uniform(150.0, 250.0),
        "square.side": rng.choice([-1.0, 1.0]) * rng.uniform(120.0, 200.0),
        "lawnmower.leg_length": rng.uniform(10.0, 20.0),
        "lawnmower.spacing": rng.choice([-1.0, 1.0]) * rng.uniform(10.0, 100.0),
    }
    if seed % 2:
        values |= {f"vessel.{name}": value for name, value in COUPLING.items()}
    return build(ReferenceShipParameters, {"mode": mode, **values}, "reference_ship")


@cache
def drawn_and_stepped(mode: str, seed: int) -> np.ndarray:
    return stepped(drawn(mode, seed))


def stepped(parameters: ReferenceShipParameters, count: int = COUNT) -> np.ndarray:
    """The motion as the node publishes it."""
    reference = make_reference(parameters, 1.0 / RATE_HZ)
    rows = []
    for _ in range(count):
        rows.append([*reference.state, *reference.acceleration()])
        reference.advance()
    return np.array(rows)


@pytest.mark.parametrize("compiler", rest_long([None, pytest.param(compiled, marks=only_compiled)]))
@pytest.mark.parametrize("mode", rest_long(REFERENCES))
def test_a_trajectory_is_that_of_the_node_also_compiled(mode: str, compiler: Compiler | None) -> None:
    for seed in range(EXAMPLES):
        expected = drawn_and_stepped(mode, seed)
        assert np.abs(np.diff(expected[:, :2], axis=0)).max() > 0.0
        np.testing.assert_array_equal(trajectory(drawn(mode, seed), RATE_HZ, COUNT, compiler), expected)


def test_a_motion_that_is_no_longer_finite_has_the_error_of_the_node() -> None:
    inertia = replace(ReferenceShipParameters().vessel, yaw_inertia=1e-3)
    parameters = replace(ReferenceShipParameters(), yaw_moment=1e12, vessel=inertia)
    with pytest.raises(SimulationError) as of_node:
        stepped(parameters)
    with pytest.raises(SimulationError, match="the motion of the virtual ship is no longer finite at t = ") as error:
        trajectory(parameters, RATE_HZ, COUNT)
    assert str(error.value) == str(of_node.value)


def test_inconsistent_parameters_have_the_error_of_the_factory() -> None:
    odd = replace(ReferenceShipParameters(mode="path").path, waypoints=(1.0,))
    with pytest.raises(ParameterError, match=r"path\.waypoints must be .*got 1 numbers"):
        trajectory(ReferenceShipParameters(mode="path", path=odd), RATE_HZ, COUNT)


@pytest.mark.parametrize("mode", REFERENCES)
def test_equal_parameters_are_one_key_and_others_are_not(mode: str) -> None:
    assert {drawn(mode, 0): 1}[drawn(mode, 0)] == 1
    assert len({drawn(mode, seed) for seed in range(EXAMPLES)}) == EXAMPLES
