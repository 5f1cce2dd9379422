"""The relay of scripted faults step by step: what comes before its start, and from when the faults count."""

from pathlib import Path
from typing import Any

import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64
from stepped_node import SteppedNode

from vessel_hsmc_ros.faults import Fault, FaultScript
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.fault_relay import FaultRelayNode
from vessel_hsmc_ros.scenario.fault_script import dump_script

THRUST = "thrusters/left/thrust"
MADE = {"odom": conv.new_odometry, "reference": conv.new_reference, "cmd_wrench": conv.new_wrench}


class Relay(SteppedNode):
    """A relay with the script of some faults, whose messages the test gives it."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, folder: Path, *faults: Fault, **more: Any) -> None:
        path = folder / "faults.yaml"
        path.write_text(dump_script(FaultScript(faults, 1)), encoding="utf-8")
        given = {"topics": ["odom", "reference", "cmd_wrench", THRUST], "script": str(path), "rate_hz": 10.0, **more}
        super().__init__(bench, monkeypatch, FaultRelayNode, (), **given)
        self.node._start = 0 if more.get("lockstep") else -1
        self.events: list[str] = []
        monkeypatch.setattr(self.node._log, "publish", lambda event: self.events.append(event.text))

    def give(self, topic: str, late: float = 0.0) -> list[str]:
        """Give it a message of the present; returns the topics on which it passes something on."""
        message = Float64(data=7.0) if topic == THRUST else self.stamped(MADE[topic](), late)
        return self.passed(lambda: self.node._on_message(topic, serialize_message(message)))

    def passed(self, act: Any) -> list[str]:
        count = len(self.sent)
        act()
        return [topic.removeprefix("relayed/") for topic, _ in self.sent[count:]]


@pytest.fixture
def relay(bench: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    return lambda *faults, **more: Relay(bench, monkeypatch, tmp_path, *faults, **more)


def test_what_comes_before_all_receivers_are_connected_is_passed_on_in_its_order_then(relay: Any) -> None:
    made = relay()
    made.node.connected = False
    early = ["cmd_wrench", THRUST, "odom", "reference", "odom", THRUST]
    for topic in early:
        assert made.give(topic) == []
    made.node.connected = True
    assert made.passed(made.node.on_connected) == early
    assert made.passed(made.node.on_connected) == [], "once"
    assert made.give("odom") == ["odom"]


@pytest.mark.parametrize("first", ["reference", "cmd_wrench", THRUST])
def test_the_times_of_faults_count_from_the_first_odometry_not_from_what_comes_before(relay: Any, first: str) -> None:
    made = relay(Fault(at=1.0, duration=1.0, kind="drop", topic="cmd_wrench"))
    found = []
    for k in range(60):
        made.wait(0.1)
        made.give(first)
        if k >= 20:
            made.give("odom")
        found.append(bool(made.give("cmd_wrench")))
        made.node._act()
    lost = [k for k, there in enumerate(found) if not there]
    assert lost == list(range(30, 40)), "1 s after the 21st period, for 1 s"
    assert made.events == ["drop of cmd_wrench begins", "drop of cmd_wrench ends"]


def test_faults_that_begin_together_are_all_named_at_once_and_once(relay: Any) -> None:
    kinds = ("drop", "duplicate", "freeze")
    made = relay(*(Fault(at=1.0, kind=kind, topic="odom") for kind in kinds))
    made.give("odom")
    made.wait(1.0)
    made.node._act()
    assert made.events == [f"{kind} of odom begins" for kind in kinds]
    made.node._act()
    assert len(made.events) == 3


def test_delayed_messages_go_on_by_the_time_although_nothing_more_comes(relay: Any) -> None:
    made = relay(Fault(at=0.0, kind="delay", topic="cmd_wrench", delay=0.25))
    made.give("odom")
    made.wait(0.1)
    assert made.give("cmd_wrench") == []
    for expected in ([], [], ["cmd_wrench"], []):
        made.wait(0.1)
        assert made.passed(made.node._act) == expected
    counts = made.node.status()[2]
    assert counts["cmd_wrench"] == "1 received, 1 sent"
