"""Files as other recorders may write them: with and without each part of the format that is left to the writer."""

from pathlib import Path
from typing import Any

import pytest
from bag_making import CLOCK, clock
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

from vessel_hsmc_ros.bags.mcap_contents import RECORD_HEADER, read_contents
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import is_complete, repair
from vessel_hsmc_ros.messages.topics import definition

COUNT = 40

WHOLE: dict[str, dict[str, Any]] = {
    "all": {},
    "without checksums": {"enable_crcs": False},
    "with a checksum of the data": {"enable_data_crcs": True},
    "without the index of messages": {"index_types": IndexType.ALL & ~IndexType.MESSAGE},
    "without offsets of the summary": {"use_summary_offsets": False},
    "without compression": {"compression": CompressionType.NONE},
}
"""Options of a writer whose file has all that a reader needs."""

LACKING: dict[str, dict[str, Any]] = {
    "without statistics": {"use_statistics": False},
    "without the index of attachments": {"index_types": IndexType.CHUNK | IndexType.METADATA},
    "without the index of notes": {"index_types": IndexType.CHUNK | IndexType.ATTACHMENT},
    "without index": {"index_types": IndexType.NONE},
    "without channels in the summary": {"repeat_channels": False},
    "without schemas in the summary": {"repeat_schemas": False},
}
"""Options of a writer whose file is read by a scan."""


def written(folder: Path, options: dict[str, Any]) -> Path:
    """A bag without metadata.yaml: one file of clock messages in several chunks, with a note and an attachment."""
    folder.mkdir()
    path = folder / "other_0.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=200, **options)
        writer.start("ros2")
        channel = writer.register_channel("/clock", "cdr", writer.register_schema(CLOCK, "ros2msg", definition(CLOCK).encode()))
        for k in range(COUNT):
            writer.add_message(channel, k, clock(k), k + 1)
        writer.add_attachment(0, 0, "notes.txt", "text/plain", b"calm")
        writer.add_metadata("theirs", {"ship": "small"})
        writer.finish()
    return path


def messages(path: Path) -> list[tuple[int, int, bytes]]:
    return [(message.log_time, message.publish_time, message.data) for message in open_bag(path).raw_messages("/clock")]


EVERY = [(k, k + 1, clock(k)) for k in range(COUNT)]


@pytest.mark.parametrize("options", WHOLE.values(), ids=WHOLE)
def test_a_whole_file_of_another_writer_is_complete_and_a_repair_adds_its_description_alone(
    tmp_path: Path, options: dict[str, Any]
) -> None:
    path = written(tmp_path / "bag", options)
    before = path.read_bytes()
    assert messages(path) == EVERY
    assert open_bag(path).complete
    assert not is_complete(path.parent)
    done = repair(path.parent)
    assert (done.files, done.messages, done.cut, done.damaged, done.described) == (0, COUNT, 0, 0, True)
    assert path.read_bytes() == before
    assert is_complete(path.parent)
    assert messages(path.parent) == EVERY


@pytest.mark.parametrize("options", (WHOLE | LACKING).values(), ids=WHOLE | LACKING)
@pytest.mark.parametrize("cut", [0, 20])
def test_no_message_note_or_attachment_of_a_file_of_another_writer_is_lost_by_a_repair(
    tmp_path: Path, options: dict[str, Any], cut: int
) -> None:
    path = written(tmp_path / "bag", options)
    path.write_bytes(path.read_bytes()[: path.stat().st_size - cut])
    assert messages(path) == EVERY
    done = repair(path.parent)
    assert (done.messages, done.damaged) == (COUNT, 0)
    assert is_complete(path.parent)
    assert repair(path.parent).files == 0
    bag = open_bag(path.parent)
    assert messages(path.parent) == EVERY
    assert bag.attachments == {"notes.txt": b"calm"}
    assert bag["clock"].stamp.tolist() == [*range(COUNT)]
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert [message.data for _, _, message in reader.iter_messages()] == [data for _, _, data in EVERY]
        assert [record.metadata for record in reader.iter_metadata()] == [{"ship": "small"}]


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD])
def test_a_last_record_that_does_not_hold_is_cut_off_and_no_damage(tmp_path: Path, compression: CompressionType) -> None:
    """As a loss of power leaves it: its length is there, its bytes are not."""
    path = written(tmp_path / "bag", {"compression": compression, "index_types": IndexType.NONE})
    content = path.read_bytes()
    start, size = [(start, size) for opcode, start, size in _records(content) if opcode == Opcode.CHUNK][-1]
    path.write_bytes(content[: start + size - 12] + bytes(12))
    done = repair(path.parent)
    assert (done.cut, done.damaged, done.files) == (size, 0, 1)
    assert messages(path.parent) == EVERY[: done.messages]
    assert 0 < done.messages < COUNT
    assert read_contents(path).complete


def _records(content: bytes) -> list[tuple[int, int, int]]:
    """Opcode, offset and size of the records of a file."""
    found, at = [], 8
    while at < len(content) - 8:
        opcode, length = RECORD_HEADER.unpack_from(content, at)
        found.append((opcode, at, RECORD_HEADER.size + length))
        at += RECORD_HEADER.size + length
    return found
