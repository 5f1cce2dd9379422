import pytest
from geometry_msgs.msg import WrenchStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros import conversions as conv
from vessel_hsmc_ros.exceptions import BagError
from vessel_hsmc_ros.recorder_node import RecorderNode


def wrench(k):
    message = conv.new_wrench()
    conv.write_wrench(message, conv.time_message(k * 10_000_000), (float(k), -0.5 * k))
    return message


def record(bench, tmp_path, **parameters):
    return bench.start(RecorderNode, directory=str(tmp_path / "bag"), **parameters)


def read(tmp_path):
    with AnyReader([tmp_path / "bag"]) as reader:
        return [(c.topic, stamp, bytes(data)) for c, stamp, data in reader.messages()]


def test_the_bytes_in_the_bag_are_the_bytes_published(bench, tmp_path):
    publisher = bench.publisher(WrenchStamped, "cmd_wrench")
    node = record(bench, tmp_path)
    bench.until(lambda: publisher.get_subscription_count())
    sent = [wrench(k) for k in range(500)]
    for message in sent:
        publisher.publish(message)
    bench.until(lambda: node.status()[2]["messages"] == 500)
    node.close()
    assert [data for _, _, data in read(tmp_path)] == [serialize_message(message) for message in sent]
    assert [stamp for _, stamp, _ in read(tmp_path)] == [k * 10_000_000 for k in range(500)]
    assert node.status()[2]["dropped"] == 0


def test_a_late_topic_is_recorded_too_with_a_message_of_our_own(bench, tmp_path):
    node = record(bench, tmp_path)
    bench.spin(0.2)
    publisher = bench.publisher(ReferenceState, "reference")
    bench.until(lambda: publisher.get_subscription_count())
    publisher.publish(conv.new_reference())
    bench.until(lambda: node.status()[2]["messages"] == 1)
    node.close()
    assert [topic for topic, _, _ in read(tmp_path)] == ["/reference"]


def test_a_best_effort_publisher_is_recorded(bench, tmp_path):
    profile = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = bench.probe.create_publisher(WrenchStamped, "cmd_wrench", profile)
    node = record(bench, tmp_path)
    bench.until(lambda: publisher.get_subscription_count())
    publisher.publish(wrench(1))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    node.close()


def test_messages_that_were_missed_are_counted(bench, tmp_path):
    publisher = bench.publisher(WrenchStamped, "cmd_wrench")
    publisher.publish(wrench(0))
    node = record(bench, tmp_path)
    bench.until(lambda: publisher.get_subscription_count())
    publisher.publish(wrench(1))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    assert node.status()[2]["dropped"] == 1
    node.close()


def test_in_real_time_messages_have_their_time_of_receipt(bench, tmp_path):
    publisher = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    node = record(bench, tmp_path, lockstep=False)
    bench.until(lambda: publisher.get_subscription_count())
    before = bench.probe.get_clock().now().nanoseconds
    publisher.publish(wrench(1))
    bench.until(lambda: node.status()[2]["messages"] == 1)
    node.close()
    assert before <= read(tmp_path)[0][1] <= bench.probe.get_clock().now().nanoseconds


def test_a_bag_is_never_overwritten(bench, tmp_path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(BagError, match="File exists"):
        record(bench, tmp_path)
