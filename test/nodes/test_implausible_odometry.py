"""Odometry that is finite and recent, and no position of a ship all the same."""

import math
from typing import Any

import numpy as np
import pytest
from driving import STATE, STEP, RealTimePlant
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.controller import ControllerNode

TIMEOUT = 0.1


@pytest.fixture
def sea(bench: Any, simulated_time: Any) -> RealTimePlant:
    return RealTimePlant(bench, simulated_time)


def first_safe(sea: RealTimePlant) -> Any:
    return next(state for state in sea.states if state.operation == ControlState.SAFE)


def assert_in_time(sea: RealTimePlant, last: int) -> None:
    overdue = last + round(TIMEOUT * 1e9)
    assert overdue <= conv.nanoseconds(first_safe(sea).header.stamp) <= overdue + 2 * STEP


def test_jumps_that_never_agree_lead_to_the_safe_action_once_the_last_good_sample_is_too_old(sea: RealTimePlant) -> None:
    sea.start(ControllerNode, law="guided", input_timeout=TIMEOUT, safety__ramp_time=0.2)
    sea.run(0.5)
    last = sea.last["odometry"]
    for k in range(20):
        sea.state = STATE + np.array([1000.0 * (1 + k * k), 0.0, 0.0, 0.0, 0.0, 0.0])
        sea.run(0.01)
    assert_in_time(sea, last)
    assert first_safe(sea).reason == ControlState.JUMP
    sea.state = STATE
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.ACTIVE


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda odometry: setattr(odometry.pose.pose.orientation, "w", 0.0), ControlState.NOT_FINITE),
        (lambda odometry: setattr(odometry.pose.pose.position, "y", 1e30), ControlState.NOT_FINITE),
        (lambda odometry: odometry.pose.covariance.__setitem__(7, math.nan), ControlState.UNCERTAIN),
        (lambda odometry: setattr(odometry.header, "frame_id", "map"), ControlState.WRONG_FRAME),
    ],
)
def test_odometry_without_orientation_place_variance_or_frame_is_refused_and_the_state_gives_the_reason(
    sea: RealTimePlant, monkeypatch: pytest.MonkeyPatch, spoil: Any, reason: int
) -> None:
    sea.start(ControllerNode, law="guided", input_timeout=TIMEOUT)
    sea.state = np.zeros(6)  # at heading 0, x, y and z of the quaternion are zero too
    sea.run(0.4)
    send, last = sea.odometry.publish, sea.last["odometry"]
    monkeypatch.setattr(sea.odometry, "publish", lambda message: (spoil(message), send(message)))
    sea.run(0.2)
    assert_in_time(sea, last)
    assert first_safe(sea).reason == reason
