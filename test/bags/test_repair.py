"""`repair`: bags that were cut off anywhere become complete, with indexes that lead to every message."""

import fcntl
import itertools
import struct
from pathlib import Path

import pytest
from bag_making import CLOCK, clock, topic, write_run
from bag_making import write_clock as write
from durations import rest_long
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex, Message, MessageIndex
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.rosbag2 import Reader

from vessel_hsmc_ros.bags import mcap_writer
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import Repair, is_complete, repair
from vessel_hsmc_ros.bags.writer import BagWriter, Splitting
from vessel_hsmc_ros.core.exceptions import BagError


@pytest.mark.parametrize("compression", rest_long(["none", "zstd"]))
def test_a_bag_cut_anywhere_is_repaired_up_to_its_last_complete_chunk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compression: str
) -> None:
    count, chunk_size = 2_500, 16 * 1024  # seven chunks
    monkeypatch.setattr(mcap_writer, "CHUNK_SIZE", chunk_size)
    writer = write(tmp_path / "whole" / "bag", count, compression)
    content = (writer.directory / "bag_0.mcap").read_bytes()
    per_chunk = chunk_size // 43 + 2  # 43 bytes a Clock record; the first chunk also has schemas and channels
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
        assert saved_before <= saved <= count
        saved_before = saved
    assert saved_before >= count - per_chunk


def test_a_bag_of_a_recorder_that_was_killed_at_once_is_empty_and_readable(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag", 0, close=False)
    assert repair(writer.directory).messages == 0
    with Reader(writer.directory) as reader:
        assert list(reader.messages()) == []


@pytest.mark.long
def test_a_recovered_bag_has_the_latest_notes(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(size=1), notes={"messages_dropped": "0"})
    write_run(None, 1, writer=writer, close=False)
    writer.notes["messages_dropped"] = "3"
    write_run(None, 1, writer=writer, close=False)  # ends the first file, which has the notes of then at its end
    (tmp_path / "bag" / "metadata.yaml").unlink()
    repair(tmp_path / "bag")
    assert open_bag(tmp_path / "bag").information["custom_data"]["messages_dropped"] == "3"


@pytest.mark.parametrize("files", [1, 2])
def test_a_recovered_bag_has_the_notes_that_only_its_description_has(tmp_path: Path, files: int) -> None:
    """Between two files the notes are brought up to date in metadata.yaml alone."""
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1e-3))
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for k in range(files):
        writer.write(ticks, clock(k * 2_000_000), k * 2_000_000, k * 2_000_000)
        writer.notes["messages_dropped"] = str(3 + k)
    writer.flush_metadata()
    fcntl.flock(writer._file._file._fd, fcntl.LOCK_UN)  # as the end of its process does
    assert len(list((tmp_path / "bag").glob("*.mcap"))) == files
    repair(tmp_path / "bag")
    assert open_bag(tmp_path / "bag").information["custom_data"]["messages_dropped"] == str(2 + files)


def test_a_second_repair_changes_nothing(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag", 8000, close=False)
    first = repair(writer.directory).messages
    content = (writer.directory / "bag_0.mcap").read_bytes()
    assert first > 0
    assert repair(writer.directory).messages == first
    assert (writer.directory / "bag_0.mcap").read_bytes() == content


def test_a_bag_that_was_completed_without_its_description_gets_one_of_all_its_messages(tmp_path: Path) -> None:
    """As by a recorder that is killed after it has closed its last file."""
    writer, ticks = BagWriter(tmp_path / "bag"), topic("/clock", CLOCK)
    writer.add_topic(ticks)
    before = (tmp_path / "bag" / "metadata.yaml").read_bytes()
    for stamp in range(100):
        writer.write(ticks, clock(stamp), stamp, stamp)
    writer.close()
    assert is_complete(tmp_path / "bag")
    (tmp_path / "bag" / "metadata.yaml").write_bytes(before)
    assert not is_complete(tmp_path / "bag")
    done = repair(tmp_path / "bag")
    assert (done.messages, done.files, done.described) == (100, 0, True)
    assert open_bag(tmp_path / "bag").information["message_count"] == 100
    assert is_complete(tmp_path / "bag")


def test_a_folder_that_is_not_a_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="is not a bag: it holds no MCAP file"):
        repair(tmp_path)
    (tmp_path / "x_0.mcap").write_bytes(b"nothing of the kind")
    with pytest.raises(BagError, match="is not an MCAP file"):
        repair(tmp_path)


def chunk_indexes(path: Path) -> list[ChunkIndex]:
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return list(summary.chunk_indexes)


def indexed_messages(path: Path, chunk: ChunkIndex) -> dict[int, list[int]]:
    """Log times by channel that a chunk's message indexes list, read from the offsets in the chunk's index."""
    found = {}
    end = chunk.chunk_start_offset + chunk.chunk_length
    with path.open("rb") as stream:
        for channel, offset in chunk.message_index_offsets.items():
            stream.seek(offset)
            opcode, length = struct.unpack("<BQ", stream.read(9))
            assert opcode == Opcode.MESSAGE_INDEX
            index = MessageIndex.read(ReadDataStream(stream))
            assert index.channel_id == channel
            found[channel] = [log_time for log_time, _ in index.records]
            end = max(end, offset + 9 + length)
    assert end == chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length
    return found


def messages_in_chunks(path: Path) -> list[dict[int, list[int]]]:
    """Log times by channel of the messages in each chunk, read from front to back without any index."""
    found = []
    with path.open("rb") as stream:
        for chunk in StreamReader(stream, emit_chunks=True).records:
            if isinstance(chunk, Chunk):
                times: dict[int, list[int]] = {}
                for record in breakup_chunk(chunk):
                    if isinstance(record, Message):
                        times.setdefault(record.channel_id, []).append(record.log_time)
                found.append(times)
    return found


@pytest.mark.parametrize("part", [0.0, 0.3, 0.6, 0.99])
def test_a_bag_cut_within_the_last_message_indexes_gets_those_that_are_missing(tmp_path: Path, part: float) -> None:
    write_run(tmp_path / "bag", 150, "none")
    path = tmp_path / "bag" / "bag_0.mcap"
    last = chunk_indexes(path)[-1]
    assert len(last.message_index_offsets) > 5
    cut = last.chunk_start_offset + last.chunk_length + round(part * last.message_index_length)
    path.write_bytes(path.read_bytes()[:cut])
    repair(tmp_path / "bag")
    indexes = chunk_indexes(path)
    assert indexes[-1].chunk_start_offset == last.chunk_start_offset
    assert [indexed_messages(path, index) for index in indexes] == messages_in_chunks(path)


def test_a_bag_whose_later_file_is_being_recorded_is_left_as_it_is(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1e-3))
    ticks = topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for k in range(3):
        writer.write(ticks, clock(k * 2_000_000), k * 2_000_000, k * 2_000_000)
    writer.flush()
    files = sorted((tmp_path / "bag").iterdir())
    assert len(files) == 4, "three files and their description"
    before = [file.read_bytes() for file in files]
    with pytest.raises(BagError, match="is being recorded"):
        repair(tmp_path / "bag")
    assert [file.read_bytes() for file in files] == before
    writer.close()
    assert is_complete(tmp_path / "bag")


def damage(path: Path, chunks: tuple[int, ...], cut: int = 0) -> None:
    """Change a byte within some chunks of a file, and cut off its end."""
    content = bytearray(path.read_bytes())
    for index in chunks:
        chunk = chunk_indexes(path)[index]
        content[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 0xFF
    path.write_bytes(content[: len(content) - cut])


def test_every_damaged_chunk_of_every_file_is_omitted_and_counted_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_writer, "CHUNK_SIZE", 1000)
    writer = BagWriter(tmp_path / "bag", "none", Splitting(duration=1.0), {"messages_dropped": "0"})
    topics = [topic("/clock", CLOCK), topic("/other/clock", CLOCK)]
    for each in topics:
        writer.add_topic(each)
    for k in range(300):
        writer.write(topics[k % 3 == 0], clock(k * 10_000_000), k * 10_000_000, k * 10_000_000)
    writer.close()
    files = sorted((tmp_path / "bag").glob("*.mcap"))
    assert len(files) == 3
    lost = {stamp for path, at in ((files[0], 1), (files[0], 3), (files[2], 0)) for stamp in stamps_of(path, at)}
    damage(files[0], (1, 3))
    damage(files[2], (0,), cut=5)
    done = repair(tmp_path / "bag")
    assert (done.files, done.damaged, done.messages, done.described) == (2, 3, 300 - len(lost), True)
    assert done.cut > 0
    left = [k * 10_000_000 for k in range(300) if k * 10_000_000 not in lost]
    with Reader(tmp_path / "bag") as reader:
        assert [stamp for _, stamp, _ in reader.messages()] == left
        counts = {name: info.msgcount for name, info in reader.topics.items()}
    assert counts == {
        "/clock": sum(k // 10_000_000 % 3 != 0 for k in left),
        "/other/clock": sum(k // 10_000_000 % 3 == 0 for k in left),
    }
    assert open_bag(tmp_path / "bag").information["custom_data"]["recovered"] == "true"
    assert repair(tmp_path / "bag") == Repair(len(left), 0, 0, 0, described=False)


def stamps_of(path: Path, index: int) -> list[int]:
    """Log times of the messages in a chunk."""
    return [stamp for stamps in messages_in_chunks(path)[index].values() for stamp in stamps]


def test_a_damaged_bag_without_a_lost_message_is_marked_as_recovered(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag", 50)
    (path,) = (tmp_path / "bag").glob("*.mcap")
    path.write_bytes(path.read_bytes()[:-3])
    done = repair(writer.directory)
    assert (done.messages, done.files, done.damaged) == (50, 1, 0)
    assert open_bag(writer.directory).information["custom_data"]["recovered"] == "true"


def test_a_damaged_first_chunk_takes_no_topics_along_which_the_index_still_has(tmp_path: Path) -> None:
    """The first chunk has the schemas and channels of all others."""
    writer = BagWriter(tmp_path / "bag", "none")
    topics = [topic("/clock", CLOCK), topic("/other/clock", CLOCK)]
    for each in topics:
        writer.add_topic(each)
    for k in range(60):
        writer.write(topics[k % 2], clock(k), k, k)
        if k % 20 == 9:
            writer.flush()
    writer.close()
    (path,) = (tmp_path / "bag").glob("*.mcap")
    lost = sum(map(len, messages_in_chunks(path)[0].values()))
    damage(path, (0,))
    done = repair(tmp_path / "bag")
    assert done.messages == 60 - lost > 0
    assert done.cut == 0
    with Reader(tmp_path / "bag") as reader:
        assert {connection.topic for connection, _, _ in reader.messages()} == {"/clock", "/other/clock"}
