"""References along curves: on the curve, at constant speed, feasible for the hull, mirrored for turns to starboard."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference
from vessel_hsmc_ros.plant.dynamics import derivative
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

PERIOD = 0.1
START = (3.0, 4.0, 0.7)
SIZES = {"straight": {}, "circle": {"radius": 25.0}, "figure_eight": {"length": 80.0}, "square": {"side": 60.0}}
SIZED = [mode for mode, sizes in SIZES.items() if sizes]

modes = pytest.mark.parametrize("mode", SIZES)


def parameters(mode: str, **values: Any) -> ReferenceShipParameters:
    named = {f"{mode}.{name}": value for name, value in ({"rise_time": 0.0} | SIZES[mode] | values).items()}
    return build(ReferenceShipParameters, {"mode": mode, "initial_pose": list(START), **named}, "reference_ship")


def motion(mode: str, seconds: float, period: float = PERIOD, **values: Any) -> tuple[Any, Any]:
    """States (n, 6) and accelerations (n, 3)."""
    reference = make_reference(parameters(mode, **values), period)
    states, accelerations = [], []
    for _ in range(round(seconds / period) + 1):
        states.append(reference.state)
        accelerations.append(reference.acceleration())
        reference.advance()
    return np.array(states), np.array(accelerations)


@modes
def test_the_speed_is_constant_and_the_initial_angle_is_the_course(mode: str) -> None:
    states, _ = motion(mode, 300.0, speed=1.2)
    np.testing.assert_allclose(np.hypot(states[:, 3], states[:, 4]), 1.2, rtol=1e-14)
    assert states[0, :2] == pytest.approx(START[:2], abs=1e-12)
    assert states[0, 2] + math.atan2(states[0, 4], states[0, 3]) == pytest.approx(START[2])


@pytest.mark.long
@modes
def test_velocities_and_accelerations_are_the_derivatives_of_the_pose(mode: str) -> None:
    step = 1e-3
    states, accelerations = motion(mode, 8.0, step, speed=2.0)
    psi, u, v, r = states[1:-1, 2:].T
    moved = (states[2:] - states[:-2]) / (2.0 * step)
    np.testing.assert_allclose(moved[:, 0], u * np.cos(psi) - v * np.sin(psi), atol=1e-6)
    np.testing.assert_allclose(moved[:, 1], u * np.sin(psi) + v * np.cos(psi), atol=1e-6)
    np.testing.assert_allclose(moved[:, 2], r, atol=1e-6)
    np.testing.assert_allclose(moved[:, 3:], accelerations[1:-1], atol=1e-5)


@pytest.mark.long
@modes
def test_the_motion_satisfies_the_dynamics_of_the_hull_with_a_force_and_a_moment_only(mode: str) -> None:
    states, accelerations = motion(mode, 300.0)
    vessel = parameters(mode).vessel.coefficients()
    unforced = np.array([derivative(state, (0.0, 0.0), (0.0, 0.0, 0.0), vessel)[4] for state in states])
    assert np.abs(accelerations[:, 1] - unforced).max() < (1e-9 if mode in ("straight", "circle") else 1e-6)


@pytest.mark.parametrize("mode", rest_long(SIZED, 2))
def test_turns_to_port_and_to_starboard_are_mirror_images(mode: str) -> None:
    ((name, size),) = SIZES[mode].items()
    port, port_acceleration = motion(mode, 60.0)
    starboard, starboard_acceleration = motion(mode, 60.0, **{name: -size})
    mirror = np.array([1.0, -1.0, -1.0])
    np.testing.assert_allclose(starboard[:, 3:], port[:, 3:] * mirror, atol=1e-15)
    np.testing.assert_allclose(starboard_acceleration, port_acceleration * mirror, atol=1e-15)
    np.testing.assert_allclose(starboard[:, 2] - START[2], START[2] - port[:, 2], atol=1e-12)
    assert port[:200, 5].mean() > 0.01  # to port is counter-clockwise


def test_a_circle_lies_to_port_of_its_start_and_stays_exact_for_hours() -> None:
    states, _ = motion("circle", 36_000.0, 10.0)
    x, y, course = START
    centre = np.array([x - 25.0 * math.sin(course), y + 25.0 * math.cos(course)])
    np.testing.assert_allclose(np.hypot(*(states[:, :2] - centre).T), 25.0, atol=1e-9)
    np.testing.assert_array_equal(states[:, 3:], np.tile(states[0, 3:], (len(states), 1)))


@pytest.mark.long
@modes
def test_the_start_from_rest_is_smooth_and_leads_into_the_motion_at_constant_speed(mode: str) -> None:
    period, rise_time = 1e-2, 10.0
    states, accelerations = motion(mode, 12.0, period, rise_time=rise_time)
    np.testing.assert_array_equal(states[0, 3:], 0.0)
    np.testing.assert_array_equal(accelerations[0], 0.0)
    assert states[0, 2] == pytest.approx(START[2])
    psi, u, v, r = states[1:-1, 2:].T
    moved = (states[2:] - states[:-2]) / (2.0 * period)
    velocity = np.column_stack((u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi), r))
    np.testing.assert_allclose(moved, np.column_stack((velocity, accelerations[1:-1])), atol=1e-5)
    # The start covers half the distance of full speed.
    np.testing.assert_allclose(states[1100], motion(mode, 12.0, period)[0][600], atol=1e-12)


@pytest.mark.parametrize(
    ("mode", "values", "reason"),
    [
        (
            "circle",
            {"radius": 0.0},
            r"reference_ship\.circle\.radius must have a magnitude of at least 0\.01 m \(got 0 m\)",
        ),
        ("square", {"side": 10.0, "corner_radius": 4.0}, "radius must be 0.02 to 2.72 m, for a side of 10 m .got 4 m"),
        ("square", {"side": 1000.0, "corner_radius": 1.0}, "must be 2 to 272 m"),
    ],
)
def test_an_impossible_size_is_rejected_with_the_allowed_range(mode: str, values: Any, reason: str) -> None:
    with pytest.raises(ParameterError, match=reason):
        make_reference(parameters(mode, **values), PERIOD)


def test_the_default_corner_of_a_square_is_a_fifth_of_its_side() -> None:
    default, given = motion("square", 50.0)[0], motion("square", 50.0, corner_radius=12.0)[0]
    np.testing.assert_array_equal(default, given)


def test_without_sway_damping_a_line_is_feasible_and_a_circle_is_not() -> None:
    undamped = VesselParameters(sway_damping=0.0, sway_damping_quadratic=0.0, sway_damping_cubic=0.0)
    make_reference(replace(parameters("straight"), vessel=undamped), PERIOD)
    with pytest.raises(ParameterError, match=r"drift angle of 89° .*; no speed is feasible; use a larger curve"):
        make_reference(replace(parameters("circle"), vessel=undamped), PERIOD)
