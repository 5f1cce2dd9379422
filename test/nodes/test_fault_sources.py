"""What a fault script adds to a run in real time, step by step: clocks that are off, and second publishers that come and go."""

from types import SimpleNamespace
from typing import Any

import pytest
from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.faults import Fault, FaultScript
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.messages.raw import message_class
from vessel_hsmc_ros.messages.topics import message_type
from vessel_hsmc_ros.nodes import fault_relay
from vessel_hsmc_ros.nodes.fault_relay import CLOCK_PERIOD, PUBLISHER_PERIOD, SecondPublisher, SteppedClock, stepped_nodes

SECOND = 1_000_000_000
START = 1000 * SECOND


class Ros:
    """Stands for the nodes: notes what they publish by topic, and which nodes are there."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, Any]] = []
        self.there: list[str] = []
        self.context = None

    def node(self, name: str, **_: Any) -> Any:
        self.there.append(name)
        return SimpleNamespace(
            create_publisher=self.create_publisher,
            create_subscription=lambda *_: None,
            destroy_node=lambda: self.there.remove(name),
        )

    def create_publisher(self, _kind: Any, topic: str, *_: Any) -> Any:
        return SimpleNamespace(publish=lambda message: self.sent.append((topic, message)))

    def get_namespace(self) -> str:
        return "/"


@pytest.mark.parametrize(
    "offsets", [(5.0, 2.0), (-3.0, -0.5), (4.0, -7.25), (-2.0, 2.0)], ids=["ahead", "back", "both", "that cancel"]
)
def test_two_faults_of_a_clock_add_up_while_both_are_active_and_each_ends_for_itself(offsets: tuple[float, float]) -> None:
    ros: Any = Ros()
    faults = [
        Fault(at=1.0, duration=3.0, kind="clock_step", offset=offsets[0]),
        Fault(at=2.0, duration=4.0, kind="clock_step", offset=offsets[1]),
    ]
    clock = SteppedClock(ros, "controller", faults)
    found = []
    for second in range(8):
        now = START + second * SECOND
        clock.act(now, second * SECOND)
        topic, message = ros.sent[-1]
        assert topic == "relayed/clock/controller"
        found.append((conv.nanoseconds(message.clock) - now) / SECOND)
    first, second_one = offsets
    assert found == [0.0, first, first + second_one, first + second_one, second_one, second_one, 0.0, 0.0]


def test_a_clock_ticks_at_its_rate_however_often_it_is_looked_at() -> None:
    ros: Any = Ros()
    clock = SteppedClock(ros, "controller", [])
    for k in range(100):
        clock.act(START + k * CLOCK_PERIOD // 4, 0)
    assert [type(message) for _, message in ros.sent] == [Clock] * 25


@pytest.mark.parametrize("kind", ["second_publisher", "mismatched_qos"])
def test_a_second_node_is_there_exactly_while_its_fault_is_active(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    ros: Any = Ros()
    monkeypatch.setattr(fault_relay, "Node", ros.node)
    source = SecondPublisher(ros, Fault(at=1.0, duration=2.0, kind=kind, topic="cmd_wrench", amount=7.0), "second_one")
    there = []
    for k in range(40):
        elapsed = k * SECOND // 10
        count = len(ros.sent)
        source.act(START + elapsed, elapsed)
        there.append(ros.there == ["second_one"])
        active = 1.0 <= k / 10 < 3.0
        assert len(ros.sent) - count == (active and kind == "second_publisher")
    assert there == [10 <= k < 30 for k in range(40)]
    assert PUBLISHER_PERIOD < SECOND // 10


@pytest.mark.parametrize(
    ("nodes", "expected"),
    [
        (("",), {"vessel_sim": 1, "reference_ship": 1, "controller": 1}),
        (("controller",), {"controller": 1}),
        (("controller", "", "vessel_sim"), {"vessel_sim": 2, "reference_ship": 1, "controller": 2}),
    ],
)
def test_a_step_without_a_node_is_one_of_all_nodes_but_the_recorder(nodes: tuple[str, ...], expected: dict[str, int]) -> None:
    faults = (*(Fault(kind="clock_step", node=node, offset=1.0) for node in nodes), Fault(kind="kill", node="controller"))
    assert {node: len(each) for node, each in stepped_nodes(FaultScript(faults), False).items()} == expected
    assert ("thruster_allocation" in stepped_nodes(FaultScript(faults), True)) is ("" in nodes)


@pytest.mark.parametrize("topic", ["odom", "reference", "cmd_wrench", "thrusters/left/thrust", "thrusters/left/angle"])
def test_a_second_publisher_of_each_topic_has_fresh_messages_of_its_type_and_its_amount(
    monkeypatch: pytest.MonkeyPatch, topic: str
) -> None:
    ros: Any = Ros()
    monkeypatch.setattr(fault_relay, "Node", ros.node)
    source = SecondPublisher(ros, Fault(kind="second_publisher", topic=topic, amount=7.0), "second_one")
    for k in range(2):
        now = START + k * SECOND
        source.act(now, k * SECOND)
        name, message = ros.sent[-1]
        assert (name, type(message)) == (f"relayed/{topic}", message_class(message_type(topic)))
        if hasattr(message, "header"):
            assert conv.nanoseconds(message.header.stamp) == now
            assert message.header.frame_id
        if topic == "cmd_wrench":
            assert conv.read_wrench(message) == (7.0, 0.0)
        elif topic.startswith("thrusters/"):
            assert message.data == 7.0
