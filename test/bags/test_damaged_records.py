"""`repair` of bags with damaged bytes anywhere: what is readable before and behind them stays."""

import os
import struct
from pathlib import Path

import pytest
import yaml
from bag_making import CLOCK, clock, topic
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Schema
from mcap.writer import CompressionType, Writer

from vessel_hsmc_ros.bags import files, mcap_writer
from vessel_hsmc_ros.bags.mcap_contents import MESSAGE_FIELDS, MESSAGE_HEADER, RECORD_HEADER, file_records, scan
from vessel_hsmc_ros.bags.mcap_writer import record_bytes
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import is_complete, repair
from vessel_hsmc_ros.bags.writer import RECORDING, SCENARIO, BagWriter
from vessel_hsmc_ros.core.exceptions import BagError

COUNT = 120

LENGTH = RECORD_HEADER.size - 1
"""Bytes of a record's length, which follows its opcode."""


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The only file of a complete bag of several chunks."""
    monkeypatch.setattr(mcap_writer, "CHUNK_SIZE", 1600)
    writer, ticks = BagWriter(tmp_path / "bag", "none"), topic("/clock", CLOCK)
    writer.add_topic(ticks)
    writer.attach(SCENARIO, "given: 1")
    for k in range(COUNT):
        writer.write(ticks, clock(k), k, k)
    writer.close()
    return tmp_path / "bag" / "bag_0.mcap"


def records(path: Path, wanted: int) -> list[tuple[int, int]]:
    """Offset and length of the records with an opcode."""
    found = file_records(path)
    return [(start, RECORD_HEADER.size + len(content)) for opcode, start, content in found if opcode == wanted]


def overwrite(path: Path, offset: int, data: bytes) -> None:
    content = bytearray(path.read_bytes())
    content[offset : offset + len(data)] = data
    path.write_bytes(content)


def recovered(path: Path) -> list[int]:
    """Repair a bag; log times of its messages, which readers find with the index and without."""
    done = repair(path.parent)
    assert is_complete(path.parent)
    assert repair(path.parent).files == 0
    bag = open_bag(path.parent)
    times = [message.log_time for message in bag.raw_messages()]
    with path.open("rb") as stream:
        assert [message.log_time for _, _, message in make_reader(stream).iter_messages()] == times
    assert (done.files, done.messages, bag.information["message_count"]) == (1, len(times), len(times))
    assert done.damaged
    return times


HEADERS = {
    "too long": struct.pack("<Q", 1 << 40),
    "into the next chunks": struct.pack("<Q", 5000),
    "shorter": struct.pack("<Q", 100),
    "zero": bytes(LENGTH),
}


def assert_is_refused(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(BagError, match="is damaged before or at byte"):
        repair(path.parent)
    assert path.read_bytes() == before


@pytest.mark.parametrize("length", HEADERS.values(), ids=HEADERS)
@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_damaged_length_of_a_chunk_is_refused_and_nothing_is_cut_off(bag: Path, length: bytes, number: int) -> None:
    chunks = records(bag, Opcode.CHUNK)
    assert len(chunks) == 4
    overwrite(bag, chunks[number][0] + 1, length)
    assert_is_refused(bag)


@pytest.mark.parametrize("opcode", [0, 0x7F, 0x80, Opcode.SCHEMA, Opcode.DATA_END])
def test_a_damaged_opcode_of_a_chunk_is_refused_and_nothing_is_cut_off(bag: Path, opcode: int) -> None:
    overwrite(bag, records(bag, Opcode.CHUNK)[2][0], bytes([opcode]))
    assert_is_refused(bag)


@pytest.mark.parametrize(("kind", "name"), [(Opcode.METADATA, 9), (Opcode.ATTACHMENT, 25)])
def test_damage_of_a_note_or_an_attachment_before_the_messages_loses_no_message(bag: Path, kind: int, name: int) -> None:
    start, _ = records(bag, kind)[0]
    assert start < records(bag, Opcode.CHUNK)[-1][0]
    overwrite(bag, start + name, b"\xff\xff\xff")
    assert recovered(bag) == list(range(COUNT))
    assert repair(bag.parent).damaged == 0


def test_a_sector_of_zeros_over_the_beginning_of_a_chunk_is_refused(bag: Path) -> None:
    chunks = records(bag, Opcode.CHUNK)
    overwrite(bag, chunks[2][0] - 50, bytes(512))
    assert_is_refused(bag)


def test_a_bag_that_was_not_closed_keeps_what_follows_a_damaged_note(bag: Path) -> None:
    """There is no index that knows what follows, but the length of the note leads to it."""
    start, _ = records(bag, Opcode.METADATA)[0]
    overwrite(bag, start + RECORD_HEADER.size, b"\xff\xff\xff\xff")
    bag.write_bytes(bag.read_bytes()[:-30])
    assert recovered(bag) == list(range(COUNT))
    with bag.open("rb") as stream:
        assert [record.name for record in make_reader(stream).iter_metadata()] == [RECORDING, "rosbag2"]


def foreign(path: Path, topic_name: str, log_times: list[int], chunked: bool = True) -> None:
    """A file as another recorder makes it, whose only channel has the number 1."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=100, compression=CompressionType.NONE, use_chunking=chunked)
        writer.start("ros2")
        schema = writer.register_schema(topic_name.strip("/"), "ros2msg", b"int32 x")
        channel = writer.register_channel(topic_name, "cdr", schema)
        for time in log_times:
            writer.add_message(channel, time, bytes(60), time)
        writer.finish()


def test_a_file_of_another_recorder_takes_no_channels_from_its_neighbours(tmp_path: Path) -> None:
    """Its first chunk, which describes its only channel, is damaged, and its summary is cut off."""
    (tmp_path / "bag").mkdir()
    first, second = (tmp_path / "bag" / f"bag_{number}.mcap" for number in (0, 1))
    foreign(first, "/one", [1, 2, 3, 4, 5, 6])
    foreign(second, "/two", [7, 8, 9])
    start, length = records(first, Opcode.CHUNK)[0]
    overwrite(first, start + length - 40, b"\xff")
    first.write_bytes(first.read_bytes()[:-30])
    repair(tmp_path / "bag")
    listed = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    topics = {each["topic_metadata"]["name"]: each["message_count"] for each in listed["topics_with_message_count"]}
    assert topics == {"/two": 3}


def test_a_file_with_messages_outside_of_chunks_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    path = tmp_path / "bag" / "bag_0.mcap"
    foreign(path, "/one", [1, 2, 3], chunked=False)
    content = path.read_bytes()[:-20]
    path.write_bytes(content)
    with pytest.raises(BagError, match="messages outside of chunks"):
        repair(tmp_path / "bag")
    assert [each.read_bytes() for each in (tmp_path / "bag").iterdir()] == [content]


def test_messages_outside_of_chunks_beside_chunks_are_read_and_not_lost_by_a_repair(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    path = tmp_path / "bag" / "bag_0.mcap"
    foreign(path, "/one", [1, 2, 3])
    loose = MESSAGE_HEADER.pack(Opcode.MESSAGE, MESSAGE_FIELDS + 60, 1, 0, 9, 9) + bytes(60)
    schema = record_bytes(Schema(id=1, name="one", encoding="ros2msg", data=b"int32 x"))
    content = path.read_bytes()[: scan(path).end] + loose + schema
    path.write_bytes(content)
    assert [message.log_time for message in open_bag(path).raw_messages()] == [1, 2, 3, 9]
    with pytest.raises(BagError, match="messages outside of chunks"):
        repair(tmp_path / "bag")
    assert path.read_bytes() == content


def test_a_system_that_writes_less_than_it_is_given_is_given_the_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def written(folder: Path) -> bytes:
        writer, ticks = BagWriter(folder / "bag", "none"), topic("/clock", CLOCK)
        writer.add_topic(ticks)
        for k in range(COUNT):
            writer.write(ticks, clock(k), k, k)
        writer.close()
        return (folder / "bag" / "bag_0.mcap").read_bytes()

    expected, write = written(tmp_path / "one"), os.pwrite
    monkeypatch.setattr("os.pwrite", lambda fd, data, offset: write(fd, data[:700], offset))
    assert written(tmp_path / "other") == expected


@pytest.mark.parametrize("count", range(1, 8))
def test_a_block_of_records_that_is_not_full_is_read_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    monkeypatch.setattr(mcap_writer, "CHUNK_SIZE", 40)
    monkeypatch.setattr(files, "BLOCK", 100)
    writer, ticks = BagWriter(tmp_path / "bag", "none"), topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for k in range(count):
        writer.write(ticks, clock(k), k, k)
    writer.close()
    assert [message.log_time for message in open_bag(tmp_path / "bag").raw_messages()] == list(range(count))
    assert open_bag(tmp_path / "bag")["/clock"].log_time.tolist() == list(range(count))


def test_a_bag_whose_first_file_cannot_be_written_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("vessel_hsmc_ros.bags.writer.McapFile", full)
    with pytest.raises(BagError, match="No space left"):
        BagWriter(tmp_path / "bag")
    assert not (tmp_path / "bag").exists()
