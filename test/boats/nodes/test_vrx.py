"""The plant behind the topics of VRX: what goes in and out by their names and types, its scoring and its pace."""

import math
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, NavSatFix
from std_msgs.msg import Float32, Float64

from vessel_hsmc_ros.boats.plants import ANTENNA, ORIGIN, RATE, Goal, World, pose_error
from vessel_hsmc_ros.boats.vrx import Vrx, main, read_goal, wam_v
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Motion, Plane
from vessel_hsmc_ros.scenario.scenario import load_scenario

FULL, LEVER, ABAFT = 2353.5, 1.027135, 2.652
FORCES, ANGLES = st.floats(-FULL, FULL), st.floats(-math.pi, math.pi)


def world() -> World:
    return World(wam_v().vessel_sim, Goal(3.0, 4.0, 0.5))


@pytest.mark.long
@given(FORCES, FORCES, ANGLES, ANGLES)
def test_the_wrench_is_that_of_two_thrusters_that_turn(left: float, right: float, a: float, b: float) -> None:
    made = world()
    for index, (force, angle) in enumerate(((left, a), (right, b))):
        made.thrust(index, force)
        made.turn(index, angle)
    surge, sway, yaw = made.wrench()
    forces = [complex(force * math.cos(angle), force * math.sin(angle)) for force, angle in ((left, a), (right, b))]
    moment = sum(-ABAFT * f.imag - side * LEVER * f.real for f, side in zip(forces, (1.0, -1.0), strict=True))
    assert (surge, sway, yaw) == pytest.approx((sum(forces).real, sum(forces).imag, moment), abs=1e-6)


def test_a_thrust_keeps_to_its_limits_and_one_that_is_not_finite_does_not_count() -> None:
    made = world()
    for force, expected in ((1e5, FULL), (math.nan, FULL), (-1e5, -FULL), (math.inf, -FULL)):
        made.thrust(0, force)
        made.turn(0, math.nan)
        assert made.wrench()[0] == pytest.approx(expected)


def test_the_score_is_the_mean_of_the_pose_errors_and_that_of_vrx() -> None:
    assert pose_error(Motion(0.0, 0.0, 0.5, 0.0, 0.0, 0.0), Goal(3.0, 4.0, 0.5)) == 5.0
    assert pose_error(Motion(3.0, 2.0, -3.0, 0.0, 0.0, 0.0), Goal(3.0, 4.0, 3.0)) == pytest.approx(
        2.0 + 0.75**2 * (2.0 * math.pi - 6.0)
    )
    made, errors = world(), []
    made.thrust(0, 300.0)
    for _ in range(300):
        made.step()
        errors.append(made.error)
    assert made.mean == pytest.approx(sum(errors) / len(errors))
    assert (made.steps, made.stamp) == (300, 3_000_000_000)


def test_the_fix_is_that_of_the_antenna_and_the_specific_force_that_of_the_motion() -> None:
    made = world()
    for index in (0, 1):
        made.thrust(index, 500.0)
    made.step()
    ahead, port = made.acceleration()
    assert ahead == pytest.approx(1000.0 / 180.0, rel=0.02)
    assert port == pytest.approx(0.0, abs=1e-9)
    for _ in range(500):
        made.step()
    place = Plane(*ORIGIN).place(*made.fix())
    assert (place.x, place.y) == pytest.approx((made.motion.x + ANTENNA[0], made.motion.y), abs=1e-3)


def test_teams_see_the_topics_and_types_of_vrx(bench: Any) -> None:
    node = Vrx(world(), context=bench.context)
    received: dict[str, list[Any]] = {}
    kinds = {
        "/clock": (Clock, 10),
        "/wamv/sensors/gps/gps/fix": (NavSatFix, qos_profile_sensor_data),
        "/wamv/sensors/imu/imu/data": (Imu, qos_profile_sensor_data),
        "/vrx/stationkeeping/goal": (PoseStamped, 10),
        "/vrx/stationkeeping/pose_error": (Float32, 10),
        "/vrx/stationkeeping/mean_pose_error": (Float32, 10),
    }
    for topic, (kind, profile) in kinds.items():
        received[topic] = []
        bench.probe.create_subscription(kind, topic, received[topic].append, profile)
    thrusts = [bench.probe.create_publisher(Float64, f"/wamv/thrusters/{side}/thrust", 10) for side in ("left", "right")]
    angle = bench.probe.create_publisher(Float64, "/wamv/thrusters/left/pos", 10)
    bench.nodes.append(node)

    bench.until(lambda: all(p.get_subscription_count() for p in (*thrusts, angle)))
    for publisher, value in zip((*thrusts, angle), (400.0, 200.0, 0.1), strict=True):
        publisher.publish(Float64(data=value))
    expected = 400.0 * math.cos(0.1) + 200.0

    def arrived() -> bool:
        node.listen()
        return bool(node.world.wrench()[0] == pytest.approx(expected))

    bench.until(arrived)

    def all_there() -> bool:
        node.step()
        return all(received.values())

    bench.until(all_there)
    assert node.world.motion.u > 0.0
    goal = received["/vrx/stationkeeping/goal"][-1].pose.position
    place = Plane(*ORIGIN).place(goal.x, goal.y)
    assert (place.x, place.y) == pytest.approx((3.0, 4.0), abs=1e-3)
    assert received["/vrx/stationkeeping/pose_error"][-1].data > 0.0


def test_what_is_not_possible_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ParameterError, match="--goal must be x,y,heading"):
        read_goal("1,2")
    with pytest.raises(ParameterError, match=r"thrusters\.names must name thrusters"):
        World(load_scenario("realistic").vessel_sim, Goal(0.0, 0.0, 0.0))
    assert main(["--speed", "0"]) == 1
    assert capsys.readouterr().err == "vrx: --speed must be above 0 (got 0)\n"
    assert RATE == 100.0
