"""Odometry from satellite fixes: the position of the vessel's origin, heading and velocity from each source."""

import math
from typing import Any

import pytest
from definitions import module
from geometry_msgs.msg import QuaternionStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, NavSatFix
from std_msgs.msg import Float64

from vessel_hsmc_ros.boats.navsat_odom import NavsatOdometryNode
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Plane
from vessel_hsmc_ros.messages import conversions as conv

DATUM = (59.9, 10.7)
ANTENNA = (1.5, -0.4)
KINDS = {
    "fix": NavSatFix,
    "fix_2": NavSatFix,
    "imu": Imu,
    "heading": QuaternionStamped,
    "fix_velocity": TwistStamped,
    "course": Float64,
    "speed": Float64,
}


class Sensors:
    """Sensors of a ship at x, y with heading psi, and a velocity, m/s."""

    def __init__(self, bench: Any, **parameters: Any) -> None:
        self.bench = bench
        self.odometry = bench.collect(Odometry, "odom")
        self.node = bench.start(NavsatOdometryNode, lockstep=False, datum=list(DATUM), antenna=list(ANTENNA), **parameters)
        names = {subscription.topic_name.strip("/") for subscription in self.node.subscriptions}
        self.outputs = {n: bench.probe.create_publisher(KINDS[n], n, qos_profile_sensor_data) for n in names & KINDS.keys()}
        bench.until(lambda: self.node.connected and all(out.get_subscription_count() for out in self.outputs.values()))

    def send(self, name: str, message: Any, stamp: Any = None) -> None:
        if hasattr(message, "header"):
            message.header.stamp = stamp or self.bench.probe.get_clock().now().to_msg()
        self.outputs[name].publish(message)

    def fix(self, x: float, y: float, psi: float, ahead: float, port: float, **fields: Any) -> NavSatFix:
        east = x + ahead * math.cos(psi) - port * math.sin(psi)
        north = y + ahead * math.sin(psi) + port * math.cos(psi)
        message = NavSatFix()
        message.latitude, message.longitude = Plane(*DATUM).coordinates(east, north)
        message.status.status = 0
        for name, value in fields.items():
            setattr(message, name, value)
        return message

    def answer(self, send: Any) -> Any:
        """The motion that is published after messages were sent, which is repeated until there is one."""
        count = len(self.odometry)

        def published() -> bool:
            send()
            return len(self.odometry) > count + 2

        self.bench.until(published)
        return conv.read_odometry(self.odometry[-1])


def test_a_yaw_in_degrees_in_place_of_the_quaternion_and_a_fix_of_unknown_status_are_taken(bench: Any) -> None:
    sensors = Sensors(bench, heading="imu_euler")
    psi, r = 2.3, 0.2

    def send() -> None:
        imu, fix = Imu(), sensors.fix(300.0, -200.0, psi, *ANTENNA)
        imu.orientation.z, imu.angular_velocity.z = math.degrees(0.5 * math.pi - psi), -math.degrees(r)
        fix.status.status = -2
        sensors.send("imu", imu)
        sensors.send("fix", fix)

    motion = sensors.answer(send)
    assert motion[:3] == pytest.approx((300.0, -200.0, psi), abs=2e-2), "the heading is extrapolated to the time of the fix"
    assert motion.r == pytest.approx(r)


@pytest.mark.parametrize("kind", ["imu", "quaternion"])
def test_the_position_is_that_of_the_origin_whatever_the_heading(bench: Any, kind: str) -> None:
    sensors = Sensors(bench, heading=kind, heading_offset=0.2)
    psi = 2.3
    q = {"z": math.sin(0.5 * (psi - 0.2)), "w": math.cos(0.5 * (psi - 0.2))}

    def send() -> None:
        message = Imu() if kind == "imu" else QuaternionStamped()
        rotation = message.orientation if kind == "imu" else message.quaternion
        rotation.z, rotation.w = q["z"], q["w"]
        sensors.send("imu" if kind == "imu" else "heading", message)
        covariance = [4.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0]
        fix = sensors.fix(300.0, -200.0, psi, *ANTENNA, position_covariance=covariance, position_covariance_type=2)
        sensors.send("fix", fix)

    motion = sensors.answer(send)
    assert motion[:3] == pytest.approx((300.0, -200.0, psi), abs=2e-4), "but for the convergence, 8e-5 rad"
    assert motion[3:5] == (0.0, 0.0)
    assert (sensors.odometry[-1].pose.covariance[0], sensors.odometry[-1].pose.covariance[7]) == (4.0, 9.0)


def test_two_antennas_give_the_heading(bench: Any) -> None:
    sensors = Sensors(bench, heading="antennas", heading_offset=0.5 * math.pi)

    def send() -> None:
        epoch = bench.probe.get_clock().now().to_msg()
        sensors.send("fix_2", sensors.fix(10.0, 5.0, -2.8, 1.5, 0.8), epoch)  # 1.2 m to port of the first
        sensors.send("fix", sensors.fix(10.0, 5.0, -2.8, *ANTENNA), epoch)

    assert sensors.answer(send)[:3] == pytest.approx((10.0, 5.0, -2.8), abs=1e-5)


@pytest.mark.parametrize("kind", ["twist", "course"])
def test_the_velocity_over_ground_is_resolved_along_the_hull_at_the_origin(bench: Any, kind: str) -> None:
    sensors = Sensors(bench, velocity=kind)
    psi, r, east, north = 0.5 * math.pi, 0.1, -0.3, 1.2  # heading north

    def send() -> None:
        imu = Imu()
        imu.orientation.z, imu.orientation.w, imu.angular_velocity.z = math.sin(0.5 * psi), math.cos(0.5 * psi), r
        sensors.send("imu", imu)
        if kind == "twist":
            velocity = TwistStamped()
            velocity.twist.linear.x, velocity.twist.linear.y = east, north
            sensors.send("fix_velocity", velocity)
        else:
            sensors.send("course", Float64(data=math.atan2(east, north)))
            sensors.send("speed", Float64(data=math.hypot(east, north)))
        sensors.send("fix", sensors.fix(0.0, 0.0, psi, *ANTENNA))

    u, v = north + r * ANTENNA[1], -east - r * ANTENNA[0]
    assert sensors.answer(send)[3:] == pytest.approx((u, v, r), abs=2e-2)


def test_a_velocity_that_ends_leaves_none_not_that_of_the_turn_at_the_antenna(bench: Any) -> None:
    sensors = Sensors(bench, velocity="twist", timeout=0.2)
    measured = True

    def send() -> None:
        imu = Imu()
        imu.orientation.w, imu.angular_velocity.z = 1.0, 0.5
        sensors.send("imu", imu)
        if measured:
            velocity = TwistStamped()
            velocity.twist.linear.x = 1.0
            sensors.send("fix_velocity", velocity)
        sensors.send("fix", sensors.fix(0.0, 0.0, 0.0, *ANTENNA))

    bench.until(lambda: sensors.answer(send).v == pytest.approx(-0.5 * ANTENNA[0], abs=2e-2))
    measured = False
    bench.until(lambda: sensors.answer(send)[3:5] == (0.0, 0.0))


def test_the_services_of_robot_localization_convert_both_ways_once_there_is_a_datum(bench: Any) -> None:
    services = module("robot_localization.srv")
    if services is None:
        pytest.skip("robot_localization is not installed, and nothing is there to compile its services")
    node = bench.start(NavsatOdometryNode, lockstep=False)
    there = services.FromLL.Request()
    there.ll_point.latitude, there.ll_point.longitude = Plane(*DATUM).coordinates(1234.5, -678.9)
    answer = bench.call(services.FromLL, "fromLL", there)
    assert (answer.map_point.x, answer.map_point.y) == (0.0, 0.0)
    assert node.status()[1] == "fromLL without a datum: there has been no fix"
    bench.stop(node)

    bench.start(NavsatOdometryNode, lockstep=False, namespace="boat", datum=list(DATUM))
    answer = bench.call(services.FromLL, "boat/fromLL", there)
    assert (answer.map_point.x, answer.map_point.y) == pytest.approx((1234.5, -678.9), abs=1e-6)
    back = bench.call(services.ToLL, "boat/toLL", services.ToLL.Request(map_point=answer.map_point))
    found, given = back.ll_point, there.ll_point
    assert (found.latitude, found.longitude) == pytest.approx((given.latitude, given.longitude), abs=1e-12)


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"latitude": math.nan}, "not at 0, 0 (got nan, 0.0)"),
        ({}, "not at 0, 0 (got 0.0, 0.0)"),
        ({"latitude": 59.9, "longitude": 10.7}, "fix without a heading of its time on /imu, within 0.5 s"),
        ({"bad": True}, "fix without a satellite fix (status -1)"),
    ],
)
def test_a_fix_that_cannot_be_used_is_named(bench: Any, fields: dict[str, Any], text: str) -> None:
    sensors = Sensors(bench)
    message = NavSatFix()
    message.status.status = -1 if fields.pop("bad", False) else 0
    for name, value in fields.items():
        setattr(message, name, value)

    def named() -> bool:
        sensors.send("fix", message)
        return text in sensors.node.status()[1]

    bench.until(named)
    assert not sensors.odometry


def test_a_datum_of_one_number_is_an_error() -> None:
    from vessel_hsmc_ros.boats.parameters import NavsatOdometryParameters

    with pytest.raises(ParameterError, match="latitude and a longitude, or empty"):
        NavsatOdometryParameters(datum=(59.0,))
