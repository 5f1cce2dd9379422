"""VehicleOdometry of PX4: the motion of a heeled boat, by rotations of another library."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vessel_hsmc_ros.boats import autopilot as px4


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("velocity_frame", [px4.NED, px4.BODY])
def test_the_motion_of_a_heeled_boat_is_that_of_its_track_and_heading(seed: int, velocity_frame: int) -> None:
    random = np.random.default_rng(seed)
    yaw, pitch, roll = random.uniform([-3.1, -0.4, -0.4], [3.1, 0.4, 0.4])
    to_earth = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    in_earth = np.array([*random.uniform(-2.0, 2.0, 2), 0.0])
    x, y, z, w = to_earth.as_quat()
    turn = Rotation.from_rotvec([0.0, 0.0, 1e-6])  # in the earth's frame, clockwise
    rates = (to_earth.inv() * turn * to_earth).as_rotvec() / 1e-6 * 0.2
    message = SimpleNamespace(
        position=[3.0, 7.0, 0.5],
        q=[w, x, y, z],
        velocity=in_earth if velocity_frame == px4.NED else to_earth.inv().apply(in_earth),
        angular_velocity=rates,
        pose_frame=px4.NED,
        velocity_frame=velocity_frame,
    )
    assert not px4.problem(message)
    motion = px4.motion_of(message)
    ahead, starboard = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    expected = (7.0, 3.0, 0.5 * np.pi - yaw, in_earth[:2] @ ahead, -in_earth[:2] @ starboard, -0.2)
    assert [*motion[:2], *motion[3:]] == pytest.approx([*expected[:2], *expected[3:]], abs=1e-6)
    assert np.exp(1j * motion.psi) == pytest.approx(np.exp(1j * expected[2]))


@pytest.mark.parametrize("length", [0.8, 1.0, 1.5])
def test_the_length_of_the_quaternion_does_not_matter_for_the_attitude(length: float) -> None:
    roll, pitch, yaw = 0.3, -0.4, 2.0
    x, y, z, w = length * Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat()
    found = px4.attitude_of([w, x, y, z], (0.1, 0.2, 0.3))
    assert (found.roll, found.pitch, found.yaw) == pytest.approx((roll, pitch, yaw))
    assert (found.p, found.q, found.r) == (0.1, 0.2, 0.3)


@pytest.mark.parametrize("pose", range(5))
@pytest.mark.parametrize("velocity", range(5))
def test_only_a_velocity_of_the_frame_of_the_pose_or_of_the_body_makes_a_motion(pose: int, velocity: int) -> None:
    message = SimpleNamespace(
        position=[0.0] * 3,
        q=[1.0, 0.0, 0.0, 0.0],
        velocity=[1.0, 0.0, 0.0],
        angular_velocity=[0.0] * 3,
        pose_frame=pose,
        velocity_frame=velocity,
    )
    fits = pose in (px4.NED, px4.FRD) and velocity in (pose, px4.BODY)
    assert bool(px4.problem(message)) is not fits
    if not fits:
        assert px4.problem(message).endswith(f"(got {pose} and {velocity})")


@pytest.mark.parametrize("name", ["position", "q", "velocity", "angular_velocity"])
@pytest.mark.parametrize("index", range(3))
def test_each_number_that_is_not_finite_is_named_except_the_depth(name: str, index: int) -> None:
    parts = {"position": [0.0] * 3, "q": [1.0, 0.0, 0.0, 0.0], "velocity": [0.0] * 3, "angular_velocity": [0.0] * 3}
    parts[name][index] = np.nan
    message = SimpleNamespace(**parts, pose_frame=px4.NED, velocity_frame=px4.NED)
    assert px4.problem(message) == ("" if (name, index) == ("position", 2) else f"{name} not finite")
