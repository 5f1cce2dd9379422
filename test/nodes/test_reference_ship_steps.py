"""The reference ship in real time, step by step: pauses, goals in and out of order, and each of them a second time."""

from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from stepped_node import SteppedNode
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode

PERIOD = 0.1


class Reference(SteppedNode):
    """A reference ship that goes to goals."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, **parameters: Any) -> None:
        given = {"mode": "goal", "rate_hz": 1.0 / PERIOD, "frames": ["odom", "map"], **parameters}
        super().__init__(bench, monkeypatch, ReferenceShipNode, (), **given)
        self.events: list[tuple[str, str]] = []
        monkeypatch.setattr(self.node.reporter, "event", lambda *event: self.events.append(event))
        self.node.on_connected()

    def run(self, seconds: float) -> None:
        """Let time pass with the timer of the node, s."""
        for _ in range(round(seconds / PERIOD)):
            self.wait(PERIOD)
            self.node._on_timer()

    def goal(self, x: float, stamp: float = 0.0, frame: str = "odom", y: float = 0.0) -> str:
        """Send a goal; returns why it is refused."""
        message = PoseStamped()
        message.header.frame_id, message.header.stamp = frame, conv.time_message(round(stamp * 1e9))
        conv.write_pose(message.pose, np.array([x, y, 0.0]))
        self.node._on_goal(message)
        return str(self.node._refused)

    @property
    def references(self) -> list[ReferenceState]:
        return [message for topic, message in self.sent if topic == "reference"]

    def odometry(self, x: float, late: float = 0.0) -> None:
        """Send odometry of a vessel on the x axis, late by a time, s."""
        message = Odometry()
        stamp = self.node.now() - round(late * 1e9)
        conv.write_odometry(message, conv.time_message(stamp), np.array([x, 0.0, 0.0, 0.0, 0.0, 0.0]))
        self.node._vessel._on_odometry(message)

    def follow(self, seconds: float, late: float = 0.0) -> None:
        """Let time pass with odometry of a vessel on its reference, s."""
        for _ in range(round(seconds / PERIOD)):
            self.odometry(self.references[-1].pose.position.x, late)
            self.run(PERIOD)


@pytest.fixture
def reference(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda **parameters: Reference(bench, monkeypatch, **parameters)


def test_each_pause_holds_the_motion_and_what_follows_is_neither_caught_up_with_nor_a_jump(reference: Any) -> None:
    made = reference()
    made.goal(50.0)
    made.run(8.0)
    for paused_for in (3.0, 20.0):
        before = len(made.references)
        made.node._pause(True)
        made.run(paused_for)
        assert len(made.references) == before
        made.node._pause(False)
        made.run(2.0)
        assert len(made.references) == before + 20
        resumed = conv.nanoseconds(made.references[before].header.stamp)
        assert resumed == pytest.approx(made.time.monotonic_ns() - 1.9e9, abs=1e3), "by the present time"
    x = np.array([conv.read_reference(m)[0][0] for m in made.references])
    assert x[-1] - x[-2] > 0.5 * PERIOD
    assert np.abs(np.diff(x, 2)).max() < 0.3 * PERIOD**2, "a jump would be a large acceleration"
    assert made.node._pace.moves == 0


def test_goals_are_taken_in_the_order_of_their_stamps_and_those_of_another_clock_anew(reference: Any) -> None:
    made = reference()
    given = (100.0, 102.0, 101.0, 102.0, 103.0, 102.999, 98.0, 97.9, 98.5, 0.0, 98.4, 99.0)
    refused = [stamp for stamp in given if made.goal(5.0 + stamp, stamp)]
    # A goal 5 s and more before the last one is by another clock, and one without a stamp is of now.
    assert refused == [101.0, 102.999, 98.0]
    assert "out of order" not in made.node._refused
    assert not made.node._refused, "a good goal ends the refusal"


def test_a_goal_that_is_repeated_is_one_event_and_one_that_returns_is_another(reference: Any) -> None:
    made = reference()
    for x in (5.0, 5.0, 5.0, 9.0, 9.0, 5.0):
        made.goal(x)
        made.run(1.0)
    assert [text for kind, text in made.events if kind == "goal"] == [f"x = {x}, y = 0, heading = 0" for x in (5, 9, 5)]


def test_a_stream_of_goals_is_one_event(reference: Any) -> None:
    made = reference()
    for begin in (0.0, 100.0):
        for k in range(10):
            made.goal(begin + 0.1 * k)
            made.run(PERIOD)
    assert [text.partition(",")[0] for _, text in made.events] == ["x = 0", "x = 100"]


def test_a_refused_goal_changes_neither_target_nor_frame_nor_order(reference: Any) -> None:
    made = reference()
    made.goal(20.0, 10.0)
    made.run(1.0)
    assert "(got 'earth')" in made.goal(-20.0, 14.0, frame="earth")
    assert "nan" in made.goal(float("nan"), 15.0)
    made.run(1.0)
    assert made.references[-1].header.frame_id == "odom"
    assert made.node._ship.target().x == 20.0
    assert not made.goal(21.0, 12.0), "refused ones do not count for the order"


def test_the_frame_of_the_reference_is_that_of_its_latest_goal(reference: Any) -> None:
    made = reference()
    frames = []
    for frame in ("map", "odom", "map"):
        made.goal(3.0, frame=frame)
        made.run(PERIOD)
        frames.append({topic: message.header.frame_id for topic, message in made.sent[-2:]})
    assert frames == [dict.fromkeys(("reference", "reference/pose"), frame) for frame in ("map", "odom", "map")]


def test_each_reset_returns_to_the_start_without_an_earlier_goal(reference: Any) -> None:
    made = reference(initial_pose=[1.0, 2.0, 0.5])
    for _ in range(2):
        made.goal(30.0)
        made.run(5.0)
        assert conv.read_reference(made.references[-1])[0][0] != pytest.approx(1.0, abs=0.1)
        made.node._reset()
        made.run(5.0)
        assert conv.read_reference(made.references[-1])[0] == pytest.approx((1.0, 2.0, 0.5, 0.0, 0.0, 0.0))


def test_after_a_reset_the_frame_is_that_of_the_start_and_the_same_goal_is_an_event_again(reference: Any) -> None:
    made = reference()
    for _ in range(2):
        made.goal(30.0, frame="map")
        made.run(1.0)
        assert made.references[-1].header.frame_id == "map"
        made.node._reset()
        made.run(PERIOD)
        assert made.references[-1].header.frame_id == "odom"
    assert len(made.events) == 2


@pytest.mark.parametrize("waiting", [1, 2])
def test_a_reset_discards_the_path_that_is_planned_and_the_one_that_waits_for_it(reference: Any, waiting: int) -> None:
    made = reference(mode="path", initial_pose=[1.0, 2.0, 0.0])
    for x in (60.0, 90.0)[:waiting]:
        message = Path()
        message.header.frame_id = "odom"
        message.poses = [PoseStamped()]
        message.poses[0].pose.position.x = x
        made.node._on_path(message)
        if x == 60.0:
            made.node._on_timer()
            assert made.node.helm.planning.busy
    plan = made.node.helm.planning._plan
    made.node._reset()
    plan.result(60.0)
    made.run(3.0)
    assert not made.node.helm.planning.busy
    assert conv.read_reference(made.references[-1])[0] == pytest.approx((1.0, 2.0, 0.0, 0.0, 0.0, 0.0))
    assert [kind for kind, _ in made.events] == []


def test_a_reference_that_follows_its_vessel_stands_while_odometry_is_missing_old_or_not_finite_and_reports_it(
    reference: Any,
) -> None:
    made = reference(mode="straight", follow="vessel", initial_pose=[0.0, 0.0, 0.0])
    made.run(5.0)
    assert made.references[-1].pose.position.x == 0.0
    assert made.node.status()[1] == "the reference stands: no odometry on odom"
    made.follow(30.0)
    assert made.node.status()[1] == "running"
    assert made.references[-1].twist.linear.x > 1.4
    made.run(1.0 + 40.0)
    assert "the reference stands: odometry is" in made.node.status()[1]
    for stop in (lambda: made.follow(40.0, late=1.5), lambda: (made.odometry(np.nan), made.run(0.9))):
        before = made.references[-1].pose.position.x
        stop()
        assert made.references[-1].pose.position.x == pytest.approx(before, abs=0.01)
        assert made.references[-1].twist.linear.x == pytest.approx(0.0, abs=0.01)
    made.follow(30.0)
    assert made.references[-1].twist.linear.x > 1.4
