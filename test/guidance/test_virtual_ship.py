import numpy as np
import pytest

from vessel_hsmc_ros.core.kinematics import as_motion
from vessel_hsmc_ros.guidance.programs import ReferenceShip, SineParameters, StepsParameters, VirtualShipParameters


def test_the_virtual_ship_has_the_initial_state_of_the_paper() -> None:
    ship = ReferenceShip(VirtualShipParameters(), 0.01)
    np.testing.assert_array_equal(ship.state, [15.0, 15.0, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(ship.acceleration(), [1e5 / 120e3, 0.0, 1e6 / 636e5])


def test_constant_inputs_lead_to_a_circle() -> None:
    ship = ReferenceShip(VirtualShipParameters(), 0.05)
    for _ in range(4000):
        ship.advance()
    np.testing.assert_allclose(ship.acceleration(), 0.0, atol=1e-9)
    u, v, r = ship.state[3:]
    centre = (
        ship.state[:2]
        + np.array([-v, u])
        @ np.array([[np.cos(ship.state[2]), np.sin(ship.state[2])], [-np.sin(ship.state[2]), np.cos(ship.state[2])]])
        / r
    )
    radius = np.hypot(u, v) / r
    for _ in range(1000):
        ship.advance()
        assert np.hypot(*(ship.state[:2] - centre)) == pytest.approx(radius, rel=1e-6)


def test_acceleration_is_the_rate_of_the_velocity() -> None:
    ship = ReferenceShip(VirtualShipParameters(), 1e-4)
    before = ship.state.copy()
    acceleration = ship.acceleration()
    ship.advance()
    np.testing.assert_allclose((ship.state[3:] - before[3:]) / 1e-4, acceleration, atol=1e-4)
    ship.reset()
    np.testing.assert_array_equal(ship.state, before)


def test_inputs_follow_their_programmes() -> None:
    inputs = VirtualShipParameters(
        yaw_moment=0.0,
        yaw_moment_sine=SineParameters(1e6, 0.05),
        surge_force=0.0,
        surge_force_steps=StepsParameters((0.0, 0.5), (1e5, 2e5)),
    )
    ship = ReferenceShip(inputs, 0.01)
    for _ in range(50):
        ship.advance()
    # At rest the acceleration is the input alone.
    ship.memory = ship.memory._replace(motion=as_motion(np.zeros(6)))
    np.testing.assert_allclose(ship.acceleration(), [2e5 / 120e3, 0.0, 1e6 * np.sin(0.025) / 636e5])
    ship.reset()
    np.testing.assert_allclose(ship.acceleration(), [1e5 / 120e3, 0.0, 0.0])


def test_a_circle_becomes_a_straight_line() -> None:
    ship = ReferenceShip(VirtualShipParameters(yaw_moment_steps=StepsParameters((100.0,), (-1e6,))), 0.05)
    for _ in range(2000):
        ship.advance()
    assert ship.state[5] > 0.1
    for _ in range(8000):
        ship.advance()
    assert ship.state[5] == pytest.approx(0.0, abs=1e-9)
    assert ship.state[4] == pytest.approx(0.0, abs=1e-9)
