"""`repair`: bags that were cut off anywhere become complete, with indexes that lead to every message."""

import fcntl
import itertools
import struct
from pathlib import Path

import pytest
from bag_making import CLOCK, clock, topic, write_run
from bag_making import write_clock as write
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex, Message, MessageIndex
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.rosbag2 import Reader

from vessel_hsmc_ros.bags.mcap_writer import CHUNK_SIZE
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import is_complete, repair
from vessel_hsmc_ros.bags.writer import BagWriter, Splitting
from vessel_hsmc_ros.core.exceptions import BagError


@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_a_bag_cut_anywhere_is_repaired_up_to_its_last_complete_chunk(tmp_path: Path, compression: str) -> None:
    writer = write(tmp_path / "whole" / "bag", 5_000, compression)
    content = (writer.directory / "bag_0.mcap").read_bytes()
    per_chunk = CHUNK_SIZE // 43 + 2  # 43 bytes a Clock record; the first chunk also has schemas and channels
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


def test_a_bag_of_a_recorder_that_was_killed_at_once_is_empty_and_readable(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag", 0, close=False)
    assert repair(writer.directory).messages == 0
    with Reader(writer.directory) as reader:
        assert list(reader.messages()) == []


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
