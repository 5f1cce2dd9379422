"""`BagWriter`: bags that other readers read, complete metadata and indexes, and errors of the file system."""

import resource
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from bag_making import CLOCK, STATUS, clock, serialized, status, topic
from bag_making import write_clock as write
from mcap.reader import make_reader
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter, Splitting
from vessel_hsmc_ros.core.exceptions import BagError


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_rosbags_and_mcap_ros2_read_what_was_written(tmp_path: Path, compression: str) -> None:
    write(tmp_path / "bag", 500, compression)
    with AnyReader([tmp_path / "bag"]) as reader:
        messages: list[Any] = [reader.deserialize(data, c.msgtype) for c, _, data in reader.messages()]
        stamps = [message.clock for message in messages]
        assert [(s.sec, s.nanosec) for s in stamps] == [divmod(k * 10_000_000, 10**9) for k in range(500)]
        assert {c.topic: c.msgcount for c in reader.connections} == {"/clock": 500, "/odom": 0}
        assert reader.duration == 499 * 10_000_000 + 1
    decoded = list(read_ros2_messages(tmp_path / "bag" / "bag_0.mcap"))
    assert [m.ros_msg.clock.sec * 10**9 + m.ros_msg.clock.nanosec for m in decoded] == [k * 10_000_000 for k in range(500)]


def test_a_file_has_profile_index_and_checksums(tmp_path: Path) -> None:
    write(tmp_path / "bag", 2000)
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary.statistics.message_count == 2000
        assert summary.chunk_indexes
        assert len(list(reader.iter_messages())) == 2000


def test_metadata_has_every_key_that_rosbag2_requires(tmp_path: Path) -> None:
    write(tmp_path / "bag", 3)
    text = (tmp_path / "bag" / "metadata.yaml").read_text()
    assert "&" not in text
    information = yaml.safe_load(text)["rosbag2_bagfile_information"]
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["ros_distro"] == "jazzy"
    assert information["relative_file_paths"] == ["bag_0.mcap"]
    assert information["message_count"] == 3
    assert information["duration"] == {"nanoseconds": 20_000_000}
    assert information["starting_time"] == {"nanoseconds_since_epoch": 0}
    profile = information["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"][0]
    assert len(profile) == 9
    assert profile["deadline"] == {"sec": 9223372036, "nsec": 854775807}


@pytest.fixture
def full_disk() -> Iterator[None]:
    """Limit the size of files to 200 kB."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.usefixtures("full_disk")
def test_a_full_disk_is_reported_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r"bag .*/bag cannot be written: File too large"):
        write(tmp_path / "bag", 20_000, "none")


def test_a_folder_that_exists_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    with pytest.raises(BagError, match="cannot be made: File exists"):
        BagWriter(tmp_path / "bag")


def test_a_chunk_index_covers_messages_that_come_out_of_order(tmp_path: Path) -> None:
    """Readers that seek by time skip chunks by these times: the first message of a chunk need not be the oldest."""
    writer = BagWriter(tmp_path / "bag")
    first, second = topic("/first", CLOCK), topic("/second", CLOCK)
    for each in (first, second):
        writer.add_topic(each)
    for each, stamp in ((first, 30), (first, 40), (second, 10), (second, 20)):
        writer.write(each, clock(stamp), stamp, stamp)
    writer.close()
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        [index] = summary.chunk_indexes
        assert (index.message_start_time, index.message_end_time) == (10, 40)
        assert summary.statistics is not None
        assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (10, 40)
        assert [m.log_time for _, _, m in reader.iter_messages(starting_at=5, ending_before=15)] == [10]


def log_times(path: Path) -> list[int]:
    with path.open("rb") as stream:
        return [message.log_time for _, _, message in make_reader(stream).iter_messages()]


def test_after_a_gap_files_are_split_by_their_own_first_message(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1.0))
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    stamps = [0, 500_000_000, *(60_000_000_000 + k * 250_000_000 for k in range(8))]  # a gap of a minute, then 2 s
    for stamp in stamps:
        writer.write(ticks, clock(stamp), stamp, stamp)
    writer.close()
    files = sorted((tmp_path / "bag").glob("*.mcap"))
    assert [log_times(path) for path in files] == [stamps[:2], stamps[2:6], stamps[6:]]


def test_the_duration_of_a_file_counts_from_its_first_message_also_after_a_split_by_size(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", "none", Splitting(size=100_000, duration=1.0))
    texts, rng = topic("/diagnostics", STATUS), np.random.default_rng(0)
    writer.add_topic(texts)
    steps = [0, 600_000_000, 700_000_000, 1_200_000_000, 1_650_000_000, 1_700_000_000]
    for stamp, length in zip(steps, [10, 100_000, 10, 10, 10, 10], strict=True):
        writer.write(texts, serialized(status(stamp, rng, "x" * length), STATUS), stamp, stamp)
    writer.close()
    files = sorted((tmp_path / "bag").glob("*.mcap"))
    assert [log_times(path) for path in files] == [steps[:2], steps[2:5], steps[5:]]


def test_a_chunk_index_covers_messages_of_one_topic_that_come_out_of_order(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for stamp in (30, 10, 50, 40):
        writer.write(ticks, clock(stamp), stamp, stamp)
    writer.close()
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    [index] = summary.chunk_indexes
    assert (index.message_start_time, index.message_end_time) == (10, 50)


def test_each_file_of_a_split_bag_has_all_topics_and_the_latest_attachments(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1.0))
    first, second = topic("/first", CLOCK), topic("/second", CLOCK)
    for each in (first, second):
        writer.add_topic(each)
    for text in ("old: 1", "new: 2"):
        writer.attach("scenario.yaml", text)
    for stamp in (0, 2_000_000_000, 4_000_000_000):
        writer.write(first, clock(stamp), stamp, stamp)
        writer.write(second, clock(stamp), stamp, stamp)
    writer.close()
    files = sorted((tmp_path / "bag").glob("*.mcap"))
    assert len(files) == 3
    for path in files:
        alone = open_bag(path)
        assert {name: series.count for name, series in alone.topics.items()} == {"/first": 1, "/second": 1}
        assert alone.attachments["scenario.yaml"] == b"new: 2"


@pytest.mark.parametrize("changed", [0, 1, 2])
def test_of_an_attachment_that_changes_the_latest_counts_in_whatever_file_it_is(tmp_path: Path, changed: int) -> None:
    writer, ticks = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1.0)), topic("/clock", CLOCK)
    writer.add_topic(ticks)
    writer.attach("scenario.yaml", "old: 1")
    writer.attach("parameters.yaml", "kept: 3")
    for number, stamp in enumerate((0, 2_000_000_000, 4_000_000_000)):
        writer.write(ticks, clock(stamp), stamp, stamp)
        if number == changed:
            writer.attach("scenario.yaml", "new: 2")
    writer.close()
    assert len([*(tmp_path / "bag").glob("*.mcap")]) == 3
    assert open_bag(tmp_path / "bag").attachments == {"scenario.yaml": b"new: 2", "parameters.yaml": b"kept: 3"}


def test_a_recorder_that_was_killed_leaves_the_files_and_attachments_so_far(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1.0))
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for name, stamp in (("a.yaml", 0), ("b.yaml", 2_000_000_000)):
        writer.write(ticks, clock(stamp), stamp, stamp)
        writer.attach(name, "given: 1")
    information = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert information["relative_file_paths"] == ["bag_0.mcap", "bag_1.mcap"]
    with (tmp_path / "bag" / "bag_1.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert [each.name for each in summary.attachment_indexes] == ["a.yaml", "b.yaml"]


def test_wherever_a_record_ends_before_a_page_the_index_leads_to_all_that_follows(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", "none")
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    path, texts = tmp_path / "bag" / "bag_0.mcap", {}
    writer.flush()
    for number, gap in enumerate(range(10)):
        before = writer._file._file.end
        writer.attach(f"a{number}", "")
        overhead = writer._file._file.end - before
        texts[f"a{number}"] = "x" * (8192 - (writer._file._file.end + overhead + gap) % 4096)
        writer.attach(f"a{number}", texts[f"a{number}"])  # ends so many bytes before a page, but for what fills it up
        writer.write(ticks, clock(number), number, number)
        writer.flush()
    writer.close()
    with path.open("rb") as stream:
        reader = make_reader(stream)
        found = {each.name: each.data.decode() for each in reader.iter_attachments()}
        assert {name: text for name, text in found.items() if text} == texts
        assert [message.log_time for _, _, message in reader.iter_messages()] == list(range(10))


def test_each_file_of_a_split_bag_has_the_notes_of_its_end(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1.0), notes={"messages_dropped": "0"})
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for dropped, stamp in enumerate((0, 2_000_000_000, 4_000_000_000)):
        writer.write(ticks, clock(stamp), stamp, stamp)
        writer.notes["messages_dropped"] = str(dropped + 1)
    writer.close()
    files = sorted((tmp_path / "bag").glob("*.mcap"))
    assert [open_bag(path).recording["messages_dropped"] for path in files] == ["1", "2", "3"]


@pytest.mark.parametrize("splitting", [Splitting(), Splitting(duration=1.0)])
def test_the_last_file_of_a_bag_has_the_content_of_its_metadata(tmp_path: Path, splitting: Splitting) -> None:
    writer = BagWriter(tmp_path / "bag", splitting=splitting, notes={"mode": "lockstep"})
    first, second = topic("/first", CLOCK), topic("/second", CLOCK)
    writer.add_topic(first)
    for stamp in (2_000_000_000, 4_000_000_000, 3_000_000_000, 6_000_000_000):  # a clock that was set back, too
        writer.write(first, clock(stamp), stamp, stamp)
    writer.add_topic(second)
    writer.close()
    information = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert information["starting_time"]["nanoseconds_since_epoch"] == 2_000_000_000
    assert information["duration"]["nanoseconds"] == 4_000_000_000
    with sorted((tmp_path / "bag").glob("*.mcap"))[-1].open("rb") as stream:
        (record,) = (each for each in make_reader(stream).iter_metadata() if each.name == "rosbag2")
    assert yaml.safe_load(record.metadata["serialized_metadata"]) == information


def test_a_bag_whose_recorder_is_killed_before_it_flushes_has_its_notes_and_attachments_in_every_file(tmp_path: Path) -> None:
    """What is on the disk at that time is copied, and read alone."""
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1.0), notes={"mode": "lockstep"})
    assert writer.message_count == 0
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    writer.attach("a.yaml", "given: 1")
    for count, stamp in enumerate((0, 2_000_000_000, 4_000_000_000)):
        writer.write(ticks, clock(stamp), stamp, stamp)
        assert writer.message_count == count + 1
        name = f"bag_{count}.mcap"
        killed = tmp_path / name
        killed.write_bytes((tmp_path / "bag" / name).read_bytes())
        bag = open_bag(killed)
        assert bag.recording["mode"] == "lockstep"
        assert bag.attachments["a.yaml"] == b"given: 1"
    writer.close()


def test_each_flush_after_a_new_topic_brings_it_into_the_metadata(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    for count in (1, 2, 3):
        writer.add_topic(topic(f"/clock_{count}", CLOCK))
        writer.flush()
        information = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
        names = [each["topic_metadata"]["name"] for each in information["topics_with_message_count"]]
        assert names == [f"/clock_{k}" for k in range(1, count + 1)]
    writer.close()


def test_the_tenth_file_of_a_bag_follows_the_ninth(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1.0))
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    stamps = [k * 1_000_000_000 for k in range(13)]
    for stamp in stamps:
        writer.write(ticks, clock(stamp), stamp, stamp)
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert [contents.path.name for contents in bag.files] == [f"bag_{k}.mcap" for k in range(13)]
    assert [message.log_time for message in bag.raw_messages()] == stamps
