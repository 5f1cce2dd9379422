"""The live view step by step: clients that come and go, the times that they are shown, and a second run."""

from types import SimpleNamespace
from typing import Any

import pytest
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.messages import conversions as conv

pytest.importorskip("foxglove", exc_type=ImportError)

from vessel_hsmc_ros.nodes.live import LiveNode, Subscriptions

KINDS = {"/odom": Odometry, "/events": Event, "/goal_pose": Odometry, "/thrusters/left/thrust": Float64}
SECOND = 1_000_000_000


class View:
    """A live node whose messages the test makes; `shown` has the topic and the time of each that clients receive."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, lockstep: bool) -> None:
        self.node = bench.start(LiveNode, lockstep=lockstep, port=0)
        self.clients, self.shown = self.node._subscribed, []
        self.callbacks: dict[str, Any] = {}
        monkeypatch.setattr(self.node, "create_subscription", self._create)
        self.node.direct_subscriptions = []
        for name, kind in KINDS.items():
            made = kind.__module__.split(".")[0] + "/msg/" + kind.__name__
            channel = SimpleNamespace(schema_name=lambda made=made: made, log=self._log(name))
            self.node._channels[name] = channel, kind
            self.node._subscribe(name)

    shown: list[tuple[str, int]]

    def _create(self, _kind: Any, name: str, callback: Any, *_: Any, **__: Any) -> None:
        self.callbacks[name] = callback

    def _log(self, name: str) -> Any:
        return lambda _data, log_time: self.shown.append((name, log_time))

    def enter(self, *names: str) -> None:
        for name in names:
            self.clients.on_subscribe(None, SimpleNamespace(topic=name))

    def leave(self, name: str) -> None:
        self.clients.on_unsubscribe(None, SimpleNamespace(topic=name))

    def receive(self, name: str, stamp: int, received: int = 0) -> list[tuple[str, int]]:
        """What clients are shown of a message with a stamp, ns."""
        message, count = KINDS[name](), len(self.shown)
        if hasattr(message, "header"):
            message.header.stamp = conv.time_message(stamp)
        self.callbacks[name](serialize_message(message), {"received_timestamp": received})
        return self.shown[count:]


@pytest.fixture
def view(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda lockstep: View(bench, monkeypatch, lockstep)


def test_a_topic_is_shown_while_any_client_has_it_whoever_leaves_and_again(view: Any) -> None:
    made = view(True)
    made.enter("/odom", "/events")
    made.leave("/odom")
    assert made.receive("/odom", 1) == []
    for _ in range(2):
        made.enter("/odom", "/odom")
        assert made.receive("/odom", SECOND)
        made.leave("/odom")
        assert made.receive("/odom", SECOND), "the other client is still there"
        made.leave("/odom")
        assert made.receive("/odom", SECOND) == []
        assert made.receive("/events", SECOND), "another topic"


def test_a_client_that_leaves_twice_takes_nothing_from_the_next(view: Any) -> None:
    clients = Subscriptions()
    odom = SimpleNamespace(topic="/odom")
    clients.on_unsubscribe(None, odom)
    clients.on_subscribe(None, odom)
    assert clients.topics == {"/odom": 1}


def test_in_lockstep_a_message_is_shown_at_its_stamp_and_one_without_a_stamp_of_the_run_at_the_present(view: Any) -> None:
    made = view(True)
    made.enter(*KINDS)
    assert made.receive("/odom", 7 * SECOND) == [("/odom", 7 * SECOND)]
    for name in ("/events", "/goal_pose", "/thrusters/left/thrust"):
        assert made.receive(name, 10**18) == [(name, 7 * SECOND)]
    assert made.node.stamp == 7 * SECOND


def test_in_real_time_every_message_is_shown_at_its_receipt(view: Any) -> None:
    made = view(False)
    made.enter(*KINDS)
    for k, name in enumerate(KINDS):
        assert made.receive(name, 5, 10**18 + k) == [(name, 10**18 + k)]


def test_the_time_that_is_shown_stands_for_a_message_out_of_order_and_goes_back_for_a_new_run(
    view: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, times = view(True), []
    made.enter("/odom")
    monkeypatch.setattr(made.node, "_server", SimpleNamespace(broadcast_time=times.append, stop=lambda: None))
    for seconds in (20, 21, 20, 12, 22, 0, 1, 0, 13, 2):
        made.receive("/odom", seconds * SECOND)
        made.node._broadcast_time()
        made.node._broadcast_time()
    assert [time / SECOND for time in times] == [20, 21, 22, 0, 1, 13, 2], "each time once"
