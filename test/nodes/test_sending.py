"""How a node sends: a reader that falls behind is waited for, but not for ever, and no message goes twice."""

from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.impl.implementation_singleton import rclpy_implementation
from stepped_node import SteppedTime

from vessel_hsmc_ros.core.exceptions import BackpressureError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import base
from vessel_hsmc_ros.nodes.base import SEND_LIMIT, VesselNode

ATTEMPT = 0.1
"""Time for which DDS blocks in each attempt, s."""


class Sending:
    """A publisher whose readers' queues are full for a while, on a clock of the test, and a node that sends by it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, black_box: bool) -> None:
        self.time = SteppedTime()
        monkeypatch.setattr(base, "time", self.time)
        self.full_until = 0.0
        self.published: list[Any] = []
        self.kept: list[str] = []
        box = SimpleNamespace(keep=lambda topic, *_: self.kept.append(topic)) if black_box else None
        self.node: Any = SimpleNamespace(black_box=box)
        handle = SimpleNamespace(publish_raw=self._publish)
        self.publisher: Any = SimpleNamespace(topic_name="/odom", msg_type=None, handle=handle)

    def _publish(self, message: Any) -> None:
        if self.time.seconds < self.full_until:
            self.time.seconds += ATTEMPT
            raise rclpy_implementation.RCLError("time-out")
        self.published.append(message)

    def send(self, full_for: float) -> None:
        self.full_until = self.time.seconds + full_for
        VesselNode.send(self.node, self.publisher, conv.new_odometry())


@pytest.mark.parametrize("black_box", [False, True])
def test_a_reader_that_catches_up_gets_each_message_once_and_in_order(monkeypatch: pytest.MonkeyPatch, black_box: bool) -> None:
    made = Sending(monkeypatch, black_box)
    for number, seconds in enumerate((0.0, 0.5, SEND_LIMIT - ATTEMPT, SEND_LIMIT - ATTEMPT), 1):
        made.send(seconds)
        assert len(made.published) == number
    assert made.kept == ["/odom"] * (4 * black_box)
    assert len(set(made.published)) == 1, "serialised once, whatever is kept"


@pytest.mark.parametrize("black_box", [False, True])
def test_a_reader_that_does_not_catch_up_is_an_error_with_its_topic(monkeypatch: pytest.MonkeyPatch, black_box: bool) -> None:
    made = Sending(monkeypatch, black_box)
    began = made.time.seconds
    with pytest.raises(BackpressureError, match="a reader of /odom has not kept up for 2 s"):
        made.send(1000.0)
    assert made.time.seconds - began == pytest.approx(SEND_LIMIT, abs=2.0 * ATTEMPT)
    assert not made.published
    assert not made.kept, "what was not sent is not in the black box"
