"""Channels whose messages cannot be decoded: they are counted and passed on, and the other topics are read."""

import functools
from collections.abc import Callable
from pathlib import Path

import pytest
from boat_bags import EPOCH, ODOMETRY, odometry, sailed, write_boat
from durations import rest_long
from mcap.writer import Writer

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import repair
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages.topics import definition
from vessel_hsmc_ros.preflight.expected import connection_in
from vessel_hsmc_ros.report.from_bag import of_bag
from vessel_hsmc_ros.studies.identification.measurements import from_bag

rows = functools.cache(lambda: sailed(duration=12.0))
PAYLOAD = b"\x00\x01\x00\x00something"

KINDS: dict[str, tuple[str, str, str, bytes]] = {
    "no definition": ("driver_msgs/msg/Status", "", "cdr", b""),
    "ros2idl": ("driver_msgs/msg/Status", "ros2idl", "cdr", b"struct Status { long value; };"),
    "json": ("Status", "jsonschema", "json", b'{"type": "object"}'),
    "protobuf": ("driver.Status", "protobuf", "protobuf", b"\x0a\x05"),
    "ros1": ("driver_msgs/Status", "ros1msg", "ros1", b"int32 value"),
    "broken definition": ("driver_msgs/msg/Status", "ros2msg", "cdr", b"int32[ value"),
    "type without definition in the text": ("driver_msgs/msg/Status", "ros2msg", "cdr", b"driver_msgs/Other other"),
    "known type in json": (ODOMETRY, "jsonschema", "json", b"{}"),
    "no encoding": ("driver_msgs/msg/Status", "", "", b""),
    "no schema": ("", "", "json", b""),
}
"""Type, encoding of the schema, encoding of the messages and text of a schema; without a type the channel has no schema."""


def channel(kind: str, topic: str, count: int) -> Callable[[Writer], None]:
    name, schema, encoding, text = KINDS[kind]

    def write(writer: Writer) -> None:
        number = writer.register_schema(name, schema, text) if name else 0
        channel = writer.register_channel(topic, encoding, number)
        for k in range(count):
            writer.add_message(channel, EPOCH * 10**9 + k, PAYLOAD, k)

    return write


@pytest.mark.parametrize(
    "topic", rest_long(["/driver/status", "/diagnostics", "/events", "/driver/odom", "/path", "/parameter_events"])
)
@pytest.mark.parametrize("count", rest_long([0, 5]))
@pytest.mark.parametrize("kind", rest_long(KINDS))
def test_the_other_topics_are_read_whatever_a_foreign_channel_is(tmp_path: Path, kind: str, count: int, topic: str) -> None:
    path = write_boat(tmp_path / "bag" / "bag_0.mcap", rows(), extra=channel(kind, topic, count))
    bag = open_bag(path)
    assert bag.topics[topic].count == count
    assert bag.count == 2 * len(rows()) + count
    assert [raw.data for raw in bag.raw_messages(topic)] == [PAYLOAD] * count
    assert len(bag["/odom"]["pose.pose.position.x"]) == len(rows())
    bag.load()
    assert sum(1 for _ in bag.messages()) == 2 * len(rows())
    assert len(from_bag(path, "/").time) == len(rows())
    assert len(of_bag(path, "/").run.time) == len(rows())
    assert len(connection_in(bag).topics["/odom"].received) == len(rows())
    done = repair(path.parent)
    assert done.messages == bag.count
    assert open_bag(path.parent).information["message_count"] == bag.count


@pytest.mark.parametrize("kind", KINDS)
def test_only_the_decoding_of_such_a_channel_is_refused_with_the_reason(tmp_path: Path, kind: str) -> None:
    path = write_boat(tmp_path / "bag_0.mcap", rows()[:5], extra=channel(kind, "/driver/status", 3))
    bag = open_bag(path)
    series = bag["/driver/status"]
    assert series.undecodable
    for use in (lambda: series.fields, lambda: series["value"], lambda: list(bag.messages("/driver/status"))):
        with pytest.raises(BagError, match=r"driver/status|Status") as error:
            use()
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", ["no definition", "json", "no schema"])
def test_odometry_that_cannot_be_decoded_is_named_with_the_reason(tmp_path: Path, kind: str) -> None:
    path = write_boat(tmp_path / "bag_0.mcap", rows(), topics=("/pose", "/wrench"), extra=channel(kind, "/odom", 3))
    reason = open_bag(path)["/odom"].undecodable
    with pytest.raises(BagError, match="has no odometry") as error:
        open_bag(path).namespace()
    assert f"/odom ({reason})" in str(error.value)


@pytest.mark.parametrize("count", [1, 500])
def test_a_topic_of_two_types_is_named_with_both(tmp_path: Path, count: int) -> None:
    pose = "geometry_msgs/msg/PoseStamped"

    def second(writer: Writer) -> None:
        number = writer.register_channel("/odom", "cdr", writer.register_schema(pose, "ros2msg", definition(pose).encode()))
        for k in range(count):
            writer.add_message(number, EPOCH * 10**9 + k, PAYLOAD, k)

    bag = open_bag(write_boat(tmp_path / "bag_0.mcap", rows(), extra=second))
    text = bag["/odom"].undecodable
    assert f"{ODOMETRY} in cdr" in text
    assert f"{pose} in cdr" in text
    with pytest.raises(BagError, match="has messages of several types"):
        bag["/odom"]["pose.pose.position.x"]
    assert len(bag["/applied_wrench"]["wrench.force.x"]) == len(rows())


def test_two_channels_of_one_type_are_one_topic(tmp_path: Path) -> None:
    def second(writer: Writer) -> None:
        number = writer.register_channel("/odom", "cdr", writer.register_schema(ODOMETRY, "", b""))
        for row in rows()[:3]:
            writer.add_message(number, (EPOCH + 100) * 10**9, odometry(EPOCH + 100.0 + row[0], row), 0)

    bag = open_bag(write_boat(tmp_path / "bag_0.mcap", rows(), extra=second))
    assert len(bag["/odom"]["pose.pose.position.x"]) == len(rows()) + 3
