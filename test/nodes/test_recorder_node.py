import math
from pathlib import Path
from typing import Any

import pytest
import rclpy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from mcap.reader import make_reader
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from recording import read, record, recorded_topics, warnings, wrench
from rosgraph_msgs.msg import Clock
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos


def test_the_bytes_in_the_bag_are_the_bytes_published(bench: Any, tmp_path: Path) -> None:
    publisher = bench.publisher(WrenchStamped, "cmd_wrench")
    node = record(bench, tmp_path)
    bench.until(lambda: publisher.get_subscription_count())
    sent = [serialize_message(wrench(k)) for k in range(500)]  # twice serialised, a message's padding may differ
    for data in sent:
        publisher.publish(data)
    bench.until(lambda: node.status()[2]["messages"] == 500)
    node.close()
    assert [data for _, _, data in read(tmp_path)] == sent
    assert [stamp for _, stamp, _ in read(tmp_path)] == [k * 10_000_000 for k in range(500)]
    assert node.status()[2]["dropped"] == 0


def test_a_topic_that_appears_later_is_recorded_too(bench: Any, tmp_path: Path) -> None:
    node = record(bench, tmp_path)
    bench.spin(0.2)
    publisher = bench.publisher(ReferenceState, "reference")
    bench.until(lambda: publisher.get_subscription_count())
    publisher.publish(conv.new_reference())
    bench.until(lambda: node.status()[2]["messages"] == 1)
    node.close()
    assert [topic for topic, _, _ in read(tmp_path)] == ["/reference"]


def test_a_best_effort_publisher_is_recorded(bench: Any, tmp_path: Path) -> None:
    profile = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = bench.probe.create_publisher(WrenchStamped, "cmd_wrench", profile)
    node = record(bench, tmp_path)
    bench.until(lambda: publisher.get_subscription_count())
    publisher.publish(wrench(1))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    node.close()


@pytest.mark.parametrize("missed", [1, 3])
def test_every_message_missed_from_a_publisher_that_waits_for_the_recorder_counts_as_dropped(
    bench: Any, tmp_path: Path, missed: Any
) -> None:
    publisher = bench.publisher(WrenchStamped, "cmd_wrench")
    for k in range(missed):
        publisher.publish(wrench(k))
    node = record(bench, tmp_path, recorded=True)
    bench.until(lambda: publisher.get_subscription_count())
    publisher.publish(wrench(missed))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    assert node.status()[2]["dropped"] == missed
    node.close()


@pytest.mark.parametrize("lockstep", [True, False])
def test_what_was_published_before_a_recorder_joined_is_named_and_does_not_count_as_dropped(
    bench: Any, tmp_path: Path, lockstep: Any
) -> None:
    publisher = bench.publisher(WrenchStamped, "cmd_wrench", lockstep)
    publisher.publish(wrench(0))
    warned = warnings(bench)
    node = record(bench, tmp_path, lockstep=lockstep)
    bench.until(lambda: publisher.get_subscription_count())
    publisher.publish(wrench(1))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    assert node.status()[2]["dropped"] == 0
    missed = "joined late: messages published before are not in the bag: 1 of /cmd_wrench"
    bench.until(lambda: warned() == [missed])
    node._flush()
    node.get_logger().warning("flushed")
    bench.until(lambda: "flushed" in warned())
    assert warned() == [missed, "flushed"]
    node.close()
    assert open_bag(tmp_path / "bag").recording["joined_late"] == "1 of /cmd_wrench"


def test_messages_of_two_publishers_in_turns_are_no_gaps(bench: Any, tmp_path: Path) -> None:
    first = bench.publisher(WrenchStamped, "cmd_wrench")
    node = record(bench, tmp_path)
    bench.until(first.get_subscription_count)
    publishers = [first]
    for count in range(1, 11):
        if count == 5:
            publishers.append(bench.publisher(WrenchStamped, "cmd_wrench"))
            bench.until(publishers[1].get_subscription_count)
        publishers[count % len(publishers)].publish(wrench(count))
        bench.until(lambda count=count: node.status()[2]["messages"] == count)  # type: ignore[misc]
    assert node.status()[2]["dropped"] == 0
    node.close()


def test_the_log_time_is_the_time_of_receipt_and_the_publish_time_that_of_sending(bench: Any, tmp_path: Path) -> None:
    publisher = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    node = record(bench, tmp_path, lockstep=False)
    bench.until(lambda: publisher.get_subscription_count())
    (subscription,) = node.direct_subscriptions
    info = {"publication_sequence_number": 1, "received_timestamp": 7_000_000_000, "source_timestamp": 5_000_000_000}
    subscription.callback(serialize_message(wrench(0)), info)
    node.close()
    (path,) = (tmp_path / "bag").glob("*.mcap")
    with path.open("rb") as stream:
        ((_, _, message),) = make_reader(stream).iter_messages()
    assert (message.log_time, message.publish_time) == (7_000_000_000, 5_000_000_000)


def test_in_real_time_the_log_time_lies_between_sending_and_now(bench: Any, tmp_path: Path) -> None:
    publisher = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    node = record(bench, tmp_path, lockstep=False)
    bench.until(lambda: publisher.get_subscription_count())
    before = bench.probe.get_clock().now().nanoseconds
    publisher.publish(wrench(1))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    node.close()
    assert before <= read(tmp_path)[0][1] <= bench.probe.get_clock().now().nanoseconds


def test_a_bag_is_never_overwritten(bench: Any, tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    with pytest.raises(BagError, match="File exists"):
        record(bench, tmp_path)


def test_with_simulated_time_the_recorder_waits_for_the_clock_and_takes_log_times_from_it(bench: Any, tmp_path: Path) -> None:
    publisher = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    node = record(bench, tmp_path, lockstep=False, use_sim_time=True)
    bench.spin(0.3)
    assert publisher.get_subscription_count() == 0
    ticking = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK)
    ticking.publish(Clock(clock=conv.time_message(5_000_000_000)))
    bench.until(publisher.get_subscription_count)
    publisher.publish(wrench(1))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    node.close()
    assert read(tmp_path)[0][1] == 5_000_000_000


def test_every_file_contains_the_scenario_and_the_parameters_of_every_node(bench: Any, tmp_path: Path) -> None:
    bench.probe.declare_parameter("gains.first", [1.0, 2.5])
    (tmp_path / "mine.yaml").write_text("/**: {ros__parameters: {lockstep: true}}\n")
    publisher = bench.publisher(WrenchStamped, "cmd_wrench")
    node = record(bench, tmp_path, split_duration=0.5, scenario="mine", scenario_file=str(tmp_path / "mine.yaml"))
    bench.until(publisher.get_subscription_count)
    bench.until(lambda: "/probe" in open_bag(tmp_path / "bag").parameters)  # a bag can be read while it is recorded
    for k in range(100):
        publisher.publish(wrench(k))
    bench.until(lambda: node.status()[2]["messages"] == 100)
    node.close()
    for number in (0, 1):
        bag = open_bag(tmp_path / "bag" / f"bag_{number}.mcap")
        assert bag["cmd_wrench"].count == 50
        assert bag.parameters["/probe"]["gains.first"] == [1.0, 2.5]
        assert bag.parameters["/recorder"]["split_duration"] == 0.5
        assert bag.scenario().name == "mine"
        assert bag.recording["mode"] == "lockstep"
    assert open_bag(tmp_path / "bag").recording["messages_dropped"] == "0"


def test_a_scenario_file_that_does_not_exist_is_refused(bench: Any, tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r"recorder\.scenario_file = /nowhere\.yaml cannot be read"):
        record(bench, tmp_path, scenario_file="/nowhere.yaml")


def test_a_goal_of_a_short_lived_publisher_is_recorded_with_the_time_of_the_run(bench: Any, tmp_path: Path) -> None:
    bench.collect(PoseStamped, "goal_pose")  # the reader that shows the topic to the recorder
    commands = bench.publisher(WrenchStamped, "cmd_wrench")
    node = record(bench, tmp_path, topics=["cmd_wrench", "goal_pose"])
    bench.until(lambda: recorded_topics(node) == {"/cmd_wrench", "/goal_pose"} and commands.get_subscription_count())
    commands.publish(wrench(7))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    goals = bench.probe.create_publisher(PoseStamped, "goal_pose", 10)
    bench.until(lambda: goals.get_subscription_count() == 2)
    goal = conv.new_pose()
    goal.header.stamp = conv.time_message(1_700_000_000 * 10**9)
    goals.publish(goal)
    bench.until(lambda: node.status()[2]["messages"] == 2)
    bench.probe.destroy_publisher(goals)
    node.close()
    assert [(topic, stamp) for topic, stamp, _ in read(tmp_path)] == [("/cmd_wrench", 70_000_000), ("/goal_pose", 70_000_000)]
    assert node.status()[2]["dropped"] == 0


@pytest.fixture
def silent(bench: Any) -> Any:
    """A node that publishes a topic of a run, and does not answer requests until it is added to the executor."""
    node = rclpy.create_node("silent", context=bench.context)
    bench.nodes.append(node)
    node.declare_parameter("gain", 2.5)
    node.create_publisher(WrenchStamped, "cmd_wrench", qos.LOSSLESS)
    return node


def test_the_recorder_of_a_run_joins_a_topic_once_it_has_the_parameters_of_its_publisher(
    bench: Any, tmp_path: Path, silent: Any
) -> None:
    node = record(bench, tmp_path, recorded=True, topics=["cmd_wrench"])
    node._parameters_until = math.inf
    bench.until(lambda: "/silent" in node._collector._requested)
    assert not recorded_topics(node)
    bench.executor.add_node(silent)
    bench.until(lambda: recorded_topics(node))
    assert node._collector.parameters["/silent"]["gain"] == 2.5
    node.close()
    assert "parameters_missing" not in open_bag(tmp_path / "bag").recording


def test_a_bag_states_which_parameters_it_lacks_and_the_recorder_waits_for_them_for_a_while_only(
    bench: Any, tmp_path: Path, silent: Any
) -> None:
    node = record(bench, tmp_path, recorded=True, topics=["cmd_wrench"])
    node._parameters_until = 0.0
    bench.until(lambda: recorded_topics(node))
    lines = warnings(bench)
    node.close()
    assert open_bag(tmp_path / "bag").recording["parameters_missing"] == "/silent"
    bench.until(lambda: "the bag lacks the parameters of /silent: no answer came" in lines())


def test_a_recorder_of_no_run_joins_at_once(bench: Any, tmp_path: Path, silent: Any) -> None:
    node = record(bench, tmp_path, topics=["cmd_wrench"])
    bench.until(lambda: recorded_topics(node))
    assert "/silent" not in node._collector.parameters
