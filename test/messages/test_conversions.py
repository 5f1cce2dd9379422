"""Conversions between messages and arrays: what is written is read, frames follow REP-103, non-finite values are named."""

import math

import numpy as np
import pytest
from bag_making import STORE
from message_reading import read_acceleration, read_control_state, read_disturbance
from rclpy.serialization import deserialize_message
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.control.interface.law import diagnosed
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.kinematics import as_acceleration, as_motion
from vessel_hsmc_ros.messages import conversions

STATE = np.array([3.0, -4.0, 2.5, 1.0, -0.5, 0.1])
ACCELERATION = np.array([0.3, 0.2, -0.1])
STAMP = 12_345_678_901


def test_a_time_stamp_survives_to_the_nanosecond() -> None:
    assert conversions.nanoseconds(conversions.time_message(STAMP)) == STAMP


def test_odometry_is_read_as_it_was_written() -> None:
    odometry = conversions.new_odometry()
    conversions.write_odometry(odometry, conversions.time_message(STAMP), STATE)
    np.testing.assert_allclose(conversions.read_odometry(odometry), STATE, rtol=1e-15)
    assert conversions.nanoseconds(odometry.header.stamp) == STAMP
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_link")


def test_a_reference_is_read_as_it_was_written() -> None:
    reference = conversions.new_reference()
    conversions.write_reference(reference, conversions.time_message(STAMP), STATE, ACCELERATION)
    state, acceleration = conversions.read_reference(reference)
    np.testing.assert_allclose(state, STATE, rtol=1e-15)
    np.testing.assert_array_equal(acceleration, ACCELERATION)
    assert reference.header.frame_id == "odom"


def test_a_heading_is_written_as_a_rotation_about_the_upward_axis() -> None:
    pose = conversions.new_pose()
    conversions.write_pose_stamped(pose, conversions.time_message(STAMP), STATE)
    q = pose.pose.orientation
    assert (q.x, q.y) == (0.0, 0.0)
    assert (q.z, q.w) == pytest.approx((math.sin(1.25), math.cos(1.25)))
    assert pose.header.frame_id == "odom"


def test_wrenches_and_accelerations_are_written_in_the_body_frame() -> None:
    stamp = conversions.time_message(STAMP)
    control, disturbance, acceleration = conversions.new_wrench(), conversions.new_wrench(), conversions.new_acceleration()
    conversions.write_wrench(control, stamp, (1e5, -2e6))
    conversions.write_body_wrench(disturbance, stamp, (1.0, 2.0, 3.0))
    data = conversions.Outgoing(acceleration, conversions.ACCELERATION)(STAMP, (0.1, 0.2, 0.3))
    acceleration = deserialize_message(data, type(acceleration))
    assert conversions.read_wrench(control) == (1e5, -2e6)
    assert read_disturbance(control) == (1e5, 0.0, -2e6)
    assert read_disturbance(disturbance) == (1.0, 2.0, 3.0)
    assert read_acceleration(acceleration) == (0.1, 0.2, 0.3)
    assert {made.header.frame_id for made in (control, disturbance, acceleration)} == {"base_link"}


def test_the_terms_of_a_law_are_written_into_fields_of_the_same_name() -> None:
    _, terms = make_controller("hierarchical_printed", period=0.01).update(0.0, STATE, STATE + 1.0, ACCELERATION)
    outgoing = conversions.Outgoing(conversions.new_control_state(), conversions.CONTROL_STATE)
    state = deserialize_message(outgoing(STAMP, diagnosed(terms, None, 0.01), 1, 0, 0.0, 0), ControlState)
    written = read_control_state(state)
    for name, value in diagnosed(terms, None, 0.01)._asdict().items():
        np.testing.assert_array_equal(written[name], value)


@pytest.mark.parametrize(("namespace", "expected"), [("", {"a": "in the root"}), ("alpha/", {"a": "in alpha"})])
def test_diagnostics_are_those_of_the_nodes_directly_in_a_namespace(namespace: str, expected: dict[str, str]) -> None:
    entry = STORE.types["diagnostic_msgs/msg/DiagnosticStatus"]
    names = {"a": "in the root", "alpha/a": "in alpha", "alpha/beta/a": "below alpha", "a: inputs": "one task"}
    status = [entry(level=0, name=name, message=text, hardware_id="", values=[]) for name, text in names.items()]
    read = conversions.read_status(status, namespace)
    assert {node: values["message"] for node, values in read.items()} == expected


def test_values_that_are_not_finite_are_named() -> None:
    state, acceleration = as_motion(STATE), as_acceleration(ACCELERATION)
    assert conversions.not_finite(state, acceleration) is None
    state, acceleration = state._replace(psi=math.nan), acceleration._replace(dv=math.inf)
    assert conversions.not_finite(state) == "heading = nan"
    assert conversions.not_finite(state, acceleration) == "heading = nan, sway acceleration = inf"
