"""Which topics the recorder subscribes to, and in which quality of service."""

from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import WrenchStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from recording import record, recorded_topics, warnings, wrench
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import BagError, ParameterError
from vessel_hsmc_ros.nodes import recorder


def test_topics_are_chosen_by_regular_expression_and_left_out_by_another(bench: Any, tmp_path: Path) -> None:
    for name in ("camera/depth", "camera/colour", "sonar"):
        bench.publisher(WrenchStamped, name)
    node = record(bench, tmp_path, topics=["sonar"], regex="/cam.*", exclude=".*colour")
    bench.until(lambda: len(recorded_topics(node)) == 2)
    late = bench.publisher(WrenchStamped, "camera/late")
    bench.until(late.get_subscription_count)
    assert recorded_topics(node) == {"/sonar", "/camera/depth", "/camera/late"}
    node.close()


def test_all_topics_are_all_but_hidden_ones(bench: Any, tmp_path: Path) -> None:
    for name in ("sonar", "_hidden", "deep/_hidden"):
        bench.publisher(WrenchStamped, name)
    node = record(bench, tmp_path, topics=[], all_topics=True, exclude="/parameter_events|/events")  # of other nodes
    bench.until(lambda: "/sonar" in recorded_topics(node))
    bench.spin(0.3)
    assert recorded_topics(node) == {"/sonar", "/rosout", "/diagnostics"}
    node.close()


def test_an_invalid_regular_expression_is_refused(bench: Any, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"recorder\.regex must be a regular expression.*got \(cam"):
        record(bench, tmp_path, regex="(cam")
    assert not (tmp_path / "bag").exists()


def test_a_topic_without_messages_is_listed_with_a_count_of_zero(bench: Any, tmp_path: Path) -> None:
    publisher = bench.publisher(WrenchStamped, "cmd_wrench")
    node = record(bench, tmp_path)
    bench.until(publisher.get_subscription_count)
    node.close()
    with AnyReader([tmp_path / "bag"]) as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == {"/cmd_wrench": 0}


def test_publishers_of_different_quality_of_service_are_all_recorded_with_a_warning(bench: Any, tmp_path: Path) -> None:
    warned = warnings(bench)
    reliable = bench.publisher(WrenchStamped, "cmd_wrench")
    profile = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    lossy = bench.probe.create_publisher(WrenchStamped, "cmd_wrench", profile)
    node = record(bench, tmp_path)
    bench.until(lambda: reliable.get_subscription_count() and lossy.get_subscription_count())
    for k, publisher in enumerate((reliable, lossy)):
        publisher.publish(wrench(k))
    bench.until(lambda: node.status()[2]["messages"] == 2)
    assert node.status()[2]["dropped"] == 0
    bench.until(warned)
    assert warned() == [
        "/cmd_wrench is offered in different qualities of service: recorded as best effort, volatile, which all of them offer"
    ]
    node.close()
    offered = open_bag(tmp_path / "bag")["cmd_wrench"].qos
    assert sorted(entry["reliability"] for entry in offered) == ["best_effort", "reliable"]


def test_a_later_publisher_of_weaker_quality_of_service_causes_a_warning(bench: Any, tmp_path: Path) -> None:
    warned = warnings(bench)
    publisher = bench.publisher(WrenchStamped, "cmd_wrench")
    node = record(bench, tmp_path)
    bench.until(publisher.get_subscription_count)
    bench.probe.create_publisher(WrenchStamped, "cmd_wrench", QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT))
    bench.until(warned)
    assert (
        "/cmd_wrench: nothing passes between this subscription and the publisher of probe, because their reliability"
        in warned()[0]
    )
    node.close()


def test_an_earlier_message_of_a_latched_publisher_is_recorded(bench: Any, tmp_path: Path) -> None:
    profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = bench.probe.create_publisher(WrenchStamped, "cmd_wrench", profile)
    publisher.publish(wrench(7))
    node = record(bench, tmp_path, lockstep=False)
    bench.until(lambda: node.status()[2]["messages"] == 1)
    assert node.status()[2]["dropped"] == 0
    node.close()
    assert open_bag(tmp_path / "bag")["cmd_wrench"].qos[0]["durability"] == "transient_local"


def test_a_type_that_is_not_installed_is_left_out_with_a_warning(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    warned = warnings(bench)

    def missing(kind: Any) -> Any:
        raise BagError(f"message type {kind} is not installed")

    monkeypatch.setattr(recorder, "definition", missing)
    bench.publisher(WrenchStamped, "cmd_wrench")
    node = record(bench, tmp_path)
    bench.until(warned)
    assert warned() == ["/cmd_wrench is not recorded: message type geometry_msgs/msg/WrenchStamped is not installed"]
    node.close()
