"""What happens to a node is published as an event, with the time from which on it has an effect."""

from pathlib import Path
from typing import Any

import pytest
from driving import STEP, Plant
from geometry_msgs.msg import PoseStamped
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.recorder import RecorderNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_sim_node.node import VesselSimNode


@pytest.fixture
def events(bench: Any) -> Any:
    """The events published so far; a node is waited for until its publisher is connected."""
    return bench.collect(Event, "events", qos.LOSSLESS)


def connected(bench: Any, node: Any) -> None:
    (publisher,) = (p for p in node.publishers if p.topic_name == "/events")
    bench.until(publisher.get_subscription_count)


def test_a_changed_parameter_is_an_event_with_the_stamp_of_the_last_command(bench: Any, plant: Plant, events: Any) -> None:
    node = plant.connect(bench.start(ControllerNode, law="guided"))
    connected(bench, node)
    for stamp in (0, STEP):
        plant.send_reference(stamp)
        plant.send_odometry(stamp)
        bench.until(lambda stamp=stamp: plant.stamps()[-1:] == [stamp])
    assert bench.set_parameters("controller", guided__position_gain=0.5).successful
    bench.until(lambda: events)
    (event,) = events
    assert (event.node, event.kind) == ("controller", "parameter")
    assert event.text == "controller.guided.position_gain: 1.5 -> 0.5"
    assert conv.nanoseconds(event.header.stamp) == STEP


def test_a_change_that_is_refused_or_changes_nothing_is_no_event(bench: Any, events: Any) -> None:
    connected(bench, bench.start(ControllerNode, law="guided"))
    assert not bench.set_parameters("controller", guided__position_gain=-2.0).successful
    assert bench.set_parameters("controller", guided__position_gain=1.5).successful
    assert bench.set_parameters("controller", guided__position_gain=0.4).successful
    bench.until(lambda: events)
    assert [event.text for event in events] == ["controller.guided.position_gain: 1.5 -> 0.4"]


def test_a_call_of_a_service_is_an_event(bench: Any, events: Any) -> None:
    for node_class in (VesselSimNode, ControllerNode, ReferenceShipNode):
        connected(bench, bench.start(node_class, lockstep=False))
    for service, flag in (("vessel_sim/pause", True), ("vessel_sim/pause", False), ("controller/enable", False)):
        assert bench.call(SetBool, f"/{service}", SetBool.Request(data=flag)).success
    for node in ("vessel_sim", "controller", "reference_ship"):
        assert bench.call(Trigger, f"/{node}/reset", Trigger.Request()).success
    bench.until(lambda: len(events) == 6)
    assert [(event.node, event.kind) for event in events] == [
        ("vessel_sim", "pause"),
        ("vessel_sim", "resume"),
        ("controller", "disable"),
        ("vessel_sim", "reset"),
        ("controller", "reset"),
        ("reference_ship", "reset"),
    ]


def test_a_pause_stops_the_reference_in_real_time(bench: Any, simulated_time: Any) -> None:
    node = bench.start(ReferenceShipNode, lockstep=False, use_sim_time=True)
    bench.until(lambda: node.connected)

    def messages_after(seconds: float) -> int:
        simulated_time.run(seconds)
        return int(node.status()[2]["messages"])

    count = messages_after(0.1)
    assert bench.call(SetBool, "/reference_ship/pause", SetBool.Request(data=True)).success
    assert messages_after(0.5) <= count + 1
    assert bench.call(SetBool, "/reference_ship/pause", SetBool.Request(data=False)).success
    assert messages_after(0.1) in range(count + 8, count + 13), "the periods of the pause are not made up for"


def test_a_stream_of_goals_is_one_event(bench: Any, events: Any) -> None:
    node = bench.start(ReferenceShipNode, lockstep=False, mode="goal", rate_hz=20.0)
    connected(bench, node)
    goals = bench.probe.create_publisher(PoseStamped, "goal_pose", 10)
    bench.until(goals.get_subscription_count)
    for k in range(10):  # at 0.5 m/s
        message = conv.new_pose()
        message.header.stamp = conv.time_message(1 + k * 200_000_000)
        message.pose.position.x = 20.0 + 0.1 * k
        goals.publish(message)
    last = conv.new_pose()
    last.pose.position.x = -100.0
    goals.publish(last)
    bench.until(lambda: events and "-100" in events[-1].text)
    assert [event.text for event in events] == ["x = 20, y = 0, heading = 0", "x = -100, y = 0, heading = 0"]


def test_an_event_from_before_a_recorder_connected_is_in_its_bag(bench: Any, tmp_path: Path) -> None:
    bench.start(ControllerNode, law="guided")
    assert bench.set_parameters("controller", guided__position_gain=0.4).successful
    node = bench.start(RecorderNode, directory=str(tmp_path / "bag"), topics=["events"])
    bench.until(lambda: node.status()[2]["messages"])
    node.close()
    (message,) = [message for _, _, message in open_bag(tmp_path / "bag").messages("events")]
    assert message.text == "controller.guided.position_gain: 1.5 -> 0.4"
    assert conv.nanoseconds(message.header.stamp) < 0, "must be effect at the first step"


def test_a_node_without_changeable_parameters_has_no_events(bench: Any, tmp_path: Path) -> None:
    node = bench.start(RecorderNode, directory=str(tmp_path / "bag"), topics=["odom"])
    assert "/events" not in [publisher.topic_name for publisher in node.publishers]
    node.close()
