"""The relay between the real nodes: transparent without faults, and deterministic in lockstep."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from vessel_hsmc_msgs.msg import Event, ReferenceState

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.faults import Fault, FaultScript
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.fault_relay import FaultRelayNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.nodes.runs.supervisor import Injection
from vessel_hsmc_ros.scenario.fault_script import dump_script
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_sim_node.node import VesselSimNode

CLASSES = {"odom": Odometry, "reference": ReferenceState, "cmd_wrench": WrenchStamped}


@pytest.fixture
def script(tmp_path: Path) -> Any:
    """Write a script and return its path."""

    def write(*faults: Fault) -> str:
        path = tmp_path / "faults.yaml"
        path.write_text(dump_script(FaultScript(faults, 1)), encoding="utf-8")
        return str(path)

    return write


class Feed:
    """Publishes in place of plant, reference ship and controller; collects what is relayed.

    A node counts as a partner by a topic that it publishes, so the probe publishes and reads all of them.
    """

    def __init__(self, bench: Any, path: str, lockstep: bool = True) -> None:
        self.bench = bench
        self.publishers = {topic: bench.publisher(kind, topic, lockstep) for topic, kind in CLASSES.items()}
        profile = qos.data(lockstep)
        self.relayed = {topic: bench.collect(kind, f"relayed/{topic}", profile) for topic, kind in CLASSES.items()}
        self.events = bench.collect(Event, "events", qos.EVENTS)
        self.node = bench.start(FaultRelayNode, lockstep, script=path, rate_hz=10.0)
        bench.until(lambda: self.node.connected and all(p.get_subscription_count() for p in self.publishers.values()))

    def odometry(self, step: int, x: float = 0.0) -> None:
        message = conv.new_odometry()
        conv.write_odometry(message, conv.time_message(step * 100_000_000), np.array([x, 0.0, 0.0, 0.0, 0.0, 0.0]))
        self.publishers["odom"].publish(message)

    def run(self, count: int) -> list[tuple[int, float, str]]:
        """Publish odometry of some steps; returns step, x and frame of what is relayed, once the last step has been answered."""
        for step in range(count):
            self.odometry(step, float(step))
        last = (count - 1) * 100_000_000
        found = self.relayed["odom"]
        self.bench.until(lambda: any(conv.nanoseconds(m.header.stamp) >= last for m in found))
        return [(conv.nanoseconds(m.header.stamp) // 100_000_000, m.pose.pose.position.x, m.header.frame_id) for m in found]


def test_a_message_passes_unchanged_without_a_fault(bench: Any, script: Any) -> None:
    assert Feed(bench, script()).run(3) == [(0, 0.0, "odom"), (1, 1.0, "odom"), (2, 2.0, "odom")]


def test_a_dropped_step_is_announced_in_lockstep(bench: Any, script: Any) -> None:
    found = Feed(bench, script(Fault(at=0.1, duration=0.1, kind="drop", topic="odom"))).run(3)
    assert [(step, frame) for step, _, frame in found] == [(0, "odom"), (1, ""), (2, "odom")]
    assert np.isnan(found[1][1])


def test_the_announcement_of_a_delayed_step_comes_after_older_messages(bench: Any, script: Any) -> None:
    found = Feed(bench, script(Fault(at=0.1, duration=0.2, kind="delay", topic="odom", delay=0.1))).run(4)
    assert [(step, frame) for step, _, frame in found] == [(0, "odom"), (1, ""), (1, "odom"), (2, ""), (2, "odom"), (3, "odom")]


def test_an_event_names_each_fault_as_it_begins_and_ends(bench: Any, script: Any) -> None:
    feed = Feed(bench, script(Fault(at=0.1, duration=0.1, kind="drop", topic="odom")))
    feed.run(4)
    bench.until(lambda: len(feed.events) == 2)
    assert [(conv.nanoseconds(e.header.stamp), e.node, e.kind, e.text) for e in feed.events] == [
        (100_000_000, "fault_relay", "fault", "drop of odom begins"),
        (200_000_000, "fault_relay", "fault", "drop of odom ends"),
    ]


def test_in_real_time_an_event_has_the_time_of_day_at_which_its_fault_begins(bench: Any, script: Any) -> None:
    feed = Feed(bench, script(Fault(at=0.1, duration=0.1, kind="drop", topic="odom")), lockstep=False)
    feed.odometry(5_000)  # its stamp, 500 s, is the start of the script
    bench.until(lambda: len(feed.events) == 2)
    assert [conv.nanoseconds(event.header.stamp) for event in feed.events] == [500_100_000_000, 500_200_000_000]


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"kind": "lose"}, (0.0, 0.0)),
        ({"kind": "weaken", "factor": 0.5, "component": "surge"}, (1.0, 3.0)),
        ({"kind": "reverse", "component": "yaw"}, (2.0, -3.0)),
        ({"kind": "corrupt", "field": "wrench.force.x", "change": "huge"}, (1e30, 3.0)),
        ({"kind": "corrupt", "field": "wrench.torque.z", "change": "add", "amount": 4.0}, (2.0, 7.0)),
    ],
)
def test_a_command_is_changed_on_its_way(bench: Any, script: Any, settings: dict[str, Any], expected: Any) -> None:
    feed = Feed(bench, script(Fault(at=0.0, topic="cmd_wrench", **settings)))
    message = conv.new_wrench()
    conv.write_wrench(message, conv.time_message(0), (2.0, 3.0))
    feed.publishers["cmd_wrench"].publish(message)
    bench.until(lambda: feed.relayed["cmd_wrench"])
    (relayed,) = feed.relayed["cmd_wrench"]
    assert conv.read_wrench(relayed) == expected
    assert relayed.header.frame_id == "base_link"


def test_a_second_publisher_appears_and_leaves_in_real_time(bench: Any, script: Any) -> None:
    fault = Fault(at=0.0, duration=1.0, kind="second_publisher", topic="cmd_wrench", amount=7.0)
    feed = Feed(bench, script(fault), lockstep=False)
    feed.odometry(0)  # of 1970: the relay counts from this stamp, so the fault is over long ago
    bench.until(lambda: feed.relayed["odom"])
    assert not feed.relayed["cmd_wrench"]
    feed.node._start = feed.node.now()
    bench.until(lambda: feed.relayed["cmd_wrench"])
    assert conv.read_wrench(feed.relayed["cmd_wrench"][0]) == (7.0, 0.0)
    assert bench.probe.count_publishers("cmd_wrench") == 2
    bench.until(lambda: bench.probe.count_publishers("cmd_wrench") == 1)


# -- the whole loop -----------------------------------------------------------------------------------------------------


def closed_loop(bench: Any, scenario: Scenario, *faults: Fault) -> dict[str, list[Any]]:
    """Run plant, reference ship and controller behind the relay; returns the messages of the wrench and of the odometry."""
    injection = Injection(FaultScript(faults, 1), scenario)
    made = injection.relayed(scenario)
    arguments = injection.arguments()
    found: dict[str, list[Any]] = {"/applied_wrench": [], "/odom": []}
    for node_class in (VesselSimNode, ReferenceShipNode, ControllerNode):
        values = schema.flatten(getattr(made, node_class.NAME))
        _start(bench, node_class, values, arguments[node_class.NAME])
        if node_class is VesselSimNode:
            _tap(bench.nodes[-1], found)
    return found


def _start(bench: Any, node_class: Any, values: dict[str, Any], arguments: list[str]) -> None:
    overrides = [Parameter(name, value=list(v) if isinstance(v, tuple) else v) for name, v in values.items()]
    node = node_class(context=bench.context, parameter_overrides=overrides, cli_args=["--ros-args", *arguments])
    bench.nodes.append(node)
    bench.executor.add_node(node)


def _tap(node: Any, found: dict[str, list[Any]]) -> None:
    send = node.send

    def noting(publisher: Any, message: Any) -> None:
        if publisher.topic_name == "/odom":
            found["/odom"].append(conv.read_odometry(deserialize_message(message, Odometry)))
        elif publisher.topic_name == "/applied_wrench":
            found["/applied_wrench"].append(conv.read_wrench(deserialize_message(message, WrenchStamped)))
        send(publisher, message)

    node.send = noting


@pytest.mark.parametrize("name", ["figure_eight", "realistic"])
def test_a_lockstep_run_through_the_relay_is_bit_identical(
    bench: Any, script: Any, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VESSEL_HSMC_INTERPRETED", "1")  # a second of the run takes less than the compilation
    scenario = load_scenario(name, {"vessel_sim.duration": 1.0})
    bench.start(FaultRelayNode, script=script(), rate_hz=scenario.vessel_sim.rate_hz)
    found = closed_loop(bench, scenario)
    offline = simulate(scenario)
    bench.until(lambda: len(found["/applied_wrench"]) == len(offline.time), deadline=60.0)
    np.testing.assert_array_equal(np.array(found["/odom"]), offline.measured)
    np.testing.assert_array_equal(np.array(found["/applied_wrench"]), offline.wrench)
