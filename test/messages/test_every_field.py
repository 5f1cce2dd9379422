"""Every field that a message of this package has is filled in from its own number, and read back from it."""

import math
from typing import Any

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.messages import conversions as conv

pytest.importorskip("rclpy", reason="the messages come with ROS")

STATE = Motion(11.0, -12.0, 2.5, 1.4, -0.15, 0.06)
STAMP = 1_700_000_001_234_567_890


def leaves(message: Any, prefix: str = "") -> dict[str, Any]:
    """Numbers, texts and sequences of a message by their dotted names."""
    found: dict[str, Any] = {}
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if hasattr(value, "get_fields_and_field_types"):
            found |= leaves(value, f"{prefix}{name}.")
        else:
            found[f"{prefix}{name}"] = value
    return found


def changed(message: Any, kind: Any) -> dict[str, Any]:
    """What differs from an empty message of its kind."""
    empty = leaves(kind())
    return {name: value for name, value in leaves(message).items() if not np.array_equal(value, empty[name])}


STAMPED = {"header.stamp.sec": 1_700_000_001, "header.stamp.nanosec": 234_567_890}


def pose_of(prefix: str) -> dict[str, float]:
    half = 0.5 * STATE.psi
    values = {"position.x": 11.0, "position.y": -12.0, "orientation.z": math.sin(half), "orientation.w": math.cos(half)}
    return {f"{prefix}.{name}": value for name, value in values.items()}


def twist_of(prefix: str) -> dict[str, float]:
    return {f"{prefix}.linear.x": 1.4, f"{prefix}.linear.y": -0.15, f"{prefix}.angular.z": 0.06}


def test_times_are_exact_and_go_both_ways() -> None:
    for stamp in (0, 1, 999_999_999, 10**9, STAMP):
        message = conv.time_message(stamp)
        assert (message.sec, message.nanosec) == divmod(stamp, 10**9)
        assert conv.nanoseconds(message) == stamp


def test_odometry_has_pose_and_twist_in_their_frames() -> None:
    message = conv.new_odometry()
    conv.write_odometry(message, conv.time_message(STAMP), STATE)
    frames = {"header.frame_id": "odom", "child_frame_id": "base_link"}
    assert changed(message, type(message)) == pytest.approx(
        {**STAMPED, **pose_of("pose.pose"), **twist_of("twist.twist")} | frames
    )
    assert conv.read_odometry(message) == pytest.approx(STATE)


def test_a_reference_has_pose_twist_and_acceleration() -> None:
    message = conv.new_reference()
    conv.write_reference(message, conv.time_message(STAMP), np.array(STATE), np.array([0.21, -0.032, 0.0043]))
    acceleration = {"acceleration.linear.x": 0.21, "acceleration.linear.y": -0.032, "acceleration.angular.z": 0.0043}
    expected = {**STAMPED, **pose_of("pose"), **twist_of("twist"), **acceleration, "header.frame_id": "odom"}
    assert changed(message, type(message)) == pytest.approx(expected)
    state, rates = conv.read_reference(message)
    assert state == pytest.approx(STATE)
    assert rates == Acceleration(0.21, -0.032, 0.0043)


def test_a_stamped_pose_has_the_pose() -> None:
    message = conv.new_pose()
    conv.write_pose_stamped(message, conv.time_message(STAMP), np.array(STATE))
    assert changed(message, type(message)) == pytest.approx({**STAMPED, **pose_of("pose"), "header.frame_id": "odom"})


def test_wrenches_and_accelerations_have_each_component_in_its_place() -> None:
    message, frame = conv.new_wrench(), {"header.frame_id": "base_link"}
    conv.write_wrench(message, conv.time_message(STAMP), (3.0, -4.0))
    assert changed(message, type(message)) == {**STAMPED, **frame, "wrench.force.x": 3.0, "wrench.torque.z": -4.0}
    assert conv.read_wrench(message) == (3.0, -4.0)
    message = conv.new_wrench()
    conv.write_body_wrench(message, conv.time_message(STAMP), (3.0, 5.0, -4.0))
    own = {"wrench.force.x": 3.0, "wrench.force.y": 5.0, "wrench.torque.z": -4.0}
    assert changed(message, type(message)) == {**STAMPED, **frame, **own}
    message = conv.new_acceleration()
    message = deserialize_message(conv.Outgoing(message, conv.ACCELERATION)(STAMP, (0.3, 0.5, -0.4)), type(message))
    own = {"accel.linear.x": 0.3, "accel.linear.y": 0.5, "accel.angular.z": -0.4}
    assert changed(message, type(message)) == {**STAMPED, **frame, **own}


def test_a_control_state_has_each_term_under_its_name() -> None:
    numbers = {name: 1.5 + k for k, name in enumerate(Terms._fields)}
    values: dict[str, Any] = {
        name: np.array([numbers[name], -1.0]) if isinstance(default, np.ndarray) else default is False or numbers[name]
        for name, default in Terms._field_defaults.items()
    }
    data = conv.Outgoing(conv.new_control_state(), conv.CONTROL_STATE)(STAMP, Terms(**values), 1, 2, 0.5, 3)
    message = deserialize_message(data, ControlState)
    assert (message.reason, message.compute_time, message.missed_periods) == (2, 0.5, 3)
    assert (message.header.frame_id, message.operation) == ("base_link", message.ACTIVE)
    assert conv.nanoseconds(message.header.stamp) == STAMP
    for name, value in values.items():
        np.testing.assert_array_equal(getattr(message, name), value, err_msg=name)
    assert {name for name in leaves(message) if "." not in name} >= set(Terms._fields)


@pytest.mark.parametrize("which", ["x", "y", "z", "w", ""])
def test_only_an_orientation_of_zeros_was_not_filled_in(which: str) -> None:
    message = conv.new_odometry()
    message.pose.pose.orientation.w = 0.0
    if which:
        setattr(message.pose.pose.orientation, which, 0.7)
    psi = conv.read_odometry(message).psi
    assert math.isnan(psi) is (which == "")
    if which:
        assert abs(psi) == pytest.approx({"x": 0.0, "y": math.pi, "z": math.pi, "w": 0.0}[which])


@pytest.mark.parametrize("place", range(9))
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_each_number_that_is_not_finite_is_named(place: int, bad: float) -> None:
    values = [float(k) for k in range(9)]
    values[place] = bad
    motion, acceleration = Motion(*values[:6]), Acceleration(*values[6:])
    names = ["x", "y", "heading", "surge velocity", "sway velocity", "yaw velocity"]
    names += ["surge acceleration", "sway acceleration", "yaw acceleration"]
    assert conv.not_finite(motion, acceleration) == f"{names[place]} = {bad}"
    assert (conv.not_finite(motion) is None) is (place >= 6)


def test_the_status_of_a_node_is_that_of_the_namespace_and_of_no_task() -> None:
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

    def status(name: str) -> DiagnosticStatus:
        return DiagnosticStatus(name=name, message=f"of {name}", values=[KeyValue(key="law", value="guided")])

    names = ["controller", "controller: timing", "alpha/controller", "alpha/controller: command", "alpha/beta/controller"]
    message = DiagnosticArray(status=[status(name) for name in names])
    assert conv.read_status(message.status, "") == {"controller": {"message": "of controller", "law": "guided"}}
    assert conv.read_status(message.status, "alpha/") == {"controller": {"message": "of alpha/controller", "law": "guided"}}
    assert conv.read_status(message.status, "gamma/") == {}
