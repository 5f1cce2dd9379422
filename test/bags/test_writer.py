"""Bags without ROS: written here, read by readers that were not."""

import itertools
import resource

import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from vessel_hsmc_ros.bags.mcap_writer import CHUNK_SIZE
from vessel_hsmc_ros.bags.repair import is_complete, repair
from vessel_hsmc_ros.bags.writer import BagWriter, Topic, qos_entry
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages.definitions import definition

STORE = get_typestore(Stores.ROS2_JAZZY)


def topic(name, kind):
    _, hashed = STORE.generate_msgdef(kind, ros_version=2), STORE.hash_rihs01(kind)
    return Topic(name, kind, definition(kind), hashed, [qos_entry(True, False)])


def clock(stamp):
    time = STORE.types["builtin_interfaces/msg/Time"]
    message = STORE.types["rosgraph_msgs/msg/Clock"](clock=time(sec=stamp // 10**9, nanosec=stamp % 10**9))
    return bytes(STORE.serialize_cdr(message, "rosgraph_msgs/msg/Clock"))


def write(directory, count, compression="zstd", close=True):
    writer = BagWriter(directory, compression)
    ticks, empty = topic("/clock", "rosgraph_msgs/msg/Clock"), topic("/odom", "nav_msgs/msg/Odometry")
    for each in (ticks, empty):
        writer.add_topic(each)
    for k in range(count):
        writer.write(ticks, clock(k * 10_000_000), k * 10_000_000, k * 10_000_000)
    writer.flush()
    if close:
        writer.close()
    return writer


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_two_foreign_readers_read_what_was_written(tmp_path, compression):
    write(tmp_path / "bag", 500, compression)
    with AnyReader([tmp_path / "bag"]) as reader:
        stamps = [reader.deserialize(data, c.msgtype).clock for c, _, data in reader.messages()]
        assert [(s.sec, s.nanosec) for s in stamps] == [divmod(k * 10_000_000, 10**9) for k in range(500)]
        assert {c.topic: c.msgcount for c in reader.connections} == {"/clock": 500, "/odom": 0}
        assert reader.duration == 499 * 10_000_000 + 1
    decoded = list(read_ros2_messages(tmp_path / "bag" / "bag_0.mcap"))
    assert [m.ros_msg.clock.sec * 10**9 + m.ros_msg.clock.nanosec for m in decoded] == [k * 10_000_000 for k in range(500)]


def test_the_file_is_profiled_indexed_and_checked(tmp_path):
    write(tmp_path / "bag", 2000)
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary.statistics.message_count == 2000
        assert summary.chunk_indexes
        assert len(list(reader.iter_messages())) == 2000


def test_metadata_has_what_rosbag2_insists_on(tmp_path):
    write(tmp_path / "bag", 3)
    text = (tmp_path / "bag" / "metadata.yaml").read_text()
    assert "&" not in text
    told = yaml.safe_load(text)["rosbag2_bagfile_information"]
    assert told["version"] == 9
    assert told["storage_identifier"] == "mcap"
    assert told["ros_distro"] == "jazzy"
    assert told["relative_file_paths"] == ["bag_0.mcap"]
    assert told["message_count"] == 3
    assert told["duration"] == {"nanoseconds": 20_000_000}
    assert told["starting_time"] == {"nanoseconds_since_epoch": 0}
    profile = told["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"][0]
    assert len(profile) == 9
    assert profile["deadline"] == {"sec": 9223372036, "nsec": 854775807}


@pytest.fixture
def full_disk():
    """No file may grow beyond 200 kB."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.usefixtures("full_disk")
def test_a_full_disk_is_told_in_one_line(tmp_path):
    with pytest.raises(BagError, match=r"bag .*/bag cannot be written: File too large"):
        write(tmp_path / "bag", 20_000, "none")


def test_a_folder_that_exists_is_refused(tmp_path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(BagError, match="cannot be made: File exists"):
        BagWriter(tmp_path / "bag")


@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_a_bag_cut_anywhere_is_repaired_up_to_its_last_whole_chunk(tmp_path, compression):
    writer = write(tmp_path / "whole" / "bag", 5_000, compression)
    content = (writer.directory / "bag_0.mcap").read_bytes()
    per_chunk = CHUNK_SIZE // 43 + 2  # a Clock record's length in the chunk, and the topics' own records in the first
    saved_before = 0
    for case, cut in enumerate(itertools.chain(range(1000, len(content), len(content) // 11), [len(content) - 1])):
        directory = tmp_path / str(case) / "bag"
        directory.mkdir(parents=True)
        (directory / "bag_0.mcap").write_bytes(content[:cut])
        assert not is_complete(directory)
        saved = repair(directory).messages
        assert is_complete(directory)
        with Reader(directory) as reader:
            assert reader.message_count == saved == sum(1 for _ in reader.messages())
        with (directory / "bag_0.mcap").open("rb") as stream:
            messages = list(make_reader(stream).iter_messages())
        assert [m.log_time for _, _, m in messages] == [k * 10_000_000 for k in range(saved)]
        assert saved_before <= saved <= 5_000
        saved_before = saved
    assert saved_before >= 5_000 - per_chunk


def test_a_bag_of_a_recorder_killed_at_once_is_empty_but_readable(tmp_path):
    writer = write(tmp_path / "bag", 0, close=False)
    assert repair(writer.directory).messages == 0
    with Reader(writer.directory) as reader:
        assert list(reader.messages()) == []


def test_repair_twice_is_as_good_as_once(tmp_path):
    writer = write(tmp_path / "bag", 8000, close=False)
    first = repair(writer.directory).messages
    content = (writer.directory / "bag_0.mcap").read_bytes()
    assert first > 0
    assert repair(writer.directory).messages == first
    assert (writer.directory / "bag_0.mcap").read_bytes() == content


def test_what_is_no_bag_is_refused(tmp_path):
    with pytest.raises(BagError, match="is not a bag: it holds no MCAP file"):
        repair(tmp_path)
    (tmp_path / "x_0.mcap").write_bytes(b"nothing of the kind")
    with pytest.raises(BagError, match="is not an MCAP file"):
        repair(tmp_path)
