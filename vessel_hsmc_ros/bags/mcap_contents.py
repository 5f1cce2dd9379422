"""Contents of an MCAP file: from its summary, or by a scan from its beginning if that is missing or damaged.

A record is an opcode, the length of its content and the content, little-endian and without padding (https://mcap.dev/spec).
"""

import io
import struct
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Attachment, Channel, Chunk, ChunkIndex, Header, MessageIndex, Metadata, Schema, Statistics
from mcap.stream_reader import get_chunk_data_stream

from vessel_hsmc_ros.core.exceptions import BagError

MAGIC = b"\x89MCAP0\r\n"  # first and last bytes of a complete file
RECORD_HEADER = struct.Struct("<BQ")  # opcode and length of the content; at the start of every record
MESSAGE_HEADER = struct.Struct("<BQHIQQ")
"""Of a Message record, all before the serialised message: record header, channel, sequence, log time, publish time."""

MESSAGE_FIELDS = MESSAGE_HEADER.size - RECORD_HEADER.size  # bytes of a Message record's content before the serialised message
MESSAGE_HEADER_TYPE = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<i8"), ("publish_time", "<i8")]
)
"""MESSAGE_HEADER as a NumPy type, to read the headers of many messages at once."""

MESSAGE_INDEX_HEADER = struct.Struct("<BQHI")
"""Of a MessageIndex record, all before the entries: record header, channel, bytes of the entries."""

INDEX_ENTRY_SIZE = 16  # bytes of an entry of a MessageIndex: log time and offset of a message within its chunk
FOOTER = struct.Struct("<BQQQI")
"""The Footer record: record header, start of the summary, start of the summary offsets, checksum."""

CHECKSUM_SIZE = 4  # bytes of a checksum, the last field of DataEnd and Footer
DATA_END = RECORD_HEADER.pack(Opcode.DATA_END, CHECKSUM_SIZE) + bytes(CHECKSUM_SIZE)
"""The DataEnd record without a checksum; directly before the footer in a file that was not closed."""

FIRST_PRIVATE = 0x80
"""The first of the opcodes that the specification leaves to applications; readers skip records with such an opcode."""

_NOT_DATA = (0, Opcode.DATA_END, Opcode.FOOTER)


def file_records(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Opcode, offset and content of the complete records in a file's data section, up to where it ends or breaks off."""
    with path.open("rb") as stream:
        size, start = path.stat().st_size, stream.seek(len(MAGIC))
        while len(header := stream.read(RECORD_HEADER.size)) == RECORD_HEADER.size:
            opcode, length = RECORD_HEADER.unpack(header)
            # An opcode that is neither specified nor private comes from damaged bytes, whose length means nothing either.
            if opcode in _NOT_DATA or Opcode.DATA_END < opcode < FIRST_PRIVATE:
                return
            if start + RECORD_HEADER.size + length > size:  # before the memory for it is allocated
                return
            content = stream.read(length)
            yield opcode, start, content
            start += RECORD_HEADER.size + length


def chunk_records(data: bytes) -> tuple[dict[int, list[int]], list[int]]:
    """Offsets of the records in a chunk's uncompressed bytes: of messages by channel, and of the others.

    Raises ValueError if a record is cut off, or shorter than its header.
    """
    messages: dict[int, list[int]] = defaultdict(list)
    others: list[int] = []
    unpack, header_size, position = MESSAGE_HEADER.unpack_from, RECORD_HEADER.size, 0
    padded = data + bytes(MESSAGE_HEADER.size)  # so that the header of a short last record can be unpacked as a message's
    # One unpacking for all kinds of records: this loop visits every message of a bag.
    while position < len(data):
        opcode, length, channel, _, _, _ = unpack(padded, position)
        if opcode != Opcode.MESSAGE:
            others.append(position)
        else:
            messages[channel].append(position)
            if length < MESSAGE_FIELDS:
                raise ValueError("a message is shorter than its header")
        position += header_size + length
    if position != len(data):
        raise ValueError("a record is cut off")
    return messages, others


DAMAGE = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    RuntimeError,
    EOFError,
    LookupError,
    TypeError,
    MemoryError,
    OverflowError,
)
"""Exceptions of the libraries for damaged bytes: RuntimeError is lz4's, MemoryError results from a damaged length."""


@dataclass
class Contents:
    """The contents of a file and their locations."""

    path: Path
    end: int = 0  # offset of the end of the last complete record in the data section
    complete: bool = False  # whether the file was closed: it has a summary with an index of its chunks, and a footer
    profile: str = ""  # the profile in the file's header, `ros2` for rosbag2
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)  # index of the undamaged chunks
    counts: Counter[int] = field(default_factory=Counter)  # messages by channel id
    # metadata, attachments: offset, length and content of each record
    metadata: list[tuple[int, int, Metadata]] = field(default_factory=list)
    attachments: list[tuple[int, int, Attachment]] = field(default_factory=list)
    # start_time, end_time: first and last log time, ns; None and 0 without messages
    start_time: int | None = None
    end_time: int = 0
    # offset and length of what cannot be read between readable records, as a chunk that does not match its checksum
    damaged: list[tuple[int, int]] = field(default_factory=list)
    # the last chunk's message indexes that are missing in the file, by channel id
    unindexed: dict[int, MessageIndex] = field(default_factory=dict)
    loose: bool = False  # whether messages lie outside of chunks

    def extend_times(self, start: int, end: int) -> None:
        """Include messages with log times from `start` to `end` in the file's time range."""
        self.start_time = start if self.start_time is None else min(self.start_time, start)
        self.end_time = max(self.end_time, end)


def chunk_bytes(path: Path, stream: IO[bytes], index: ChunkIndex) -> bytes:
    """The uncompressed records of a chunk. Raises BagError if the chunk is damaged."""
    offset = index.chunk_start_offset
    try:
        stream.seek(offset + RECORD_HEADER.size)
        return _uncompressed(Chunk.read(_stream(stream.read(index.chunk_length - RECORD_HEADER.size))))
    except DAMAGE:
        raise BagError(f"{path} is damaged at byte {offset}: `vessel-hsmc recover` makes the rest of it readable") from None


def scan(path: Path, summary: Contents | None = None) -> Contents:
    """Read complete records from the beginning until the data section ends or breaks off.

    `summary`: what a valid summary knows.
    """
    doubtful: list[tuple[int, int]] = []
    contents, chunks = Contents(path), set()
    for opcode, start, content in file_records(path):
        length = RECORD_HEADER.size + len(content)
        if opcode >= FIRST_PRIVATE:  # reserved space of a file that was not closed, or a damaged record that was disabled
            continue
        if opcode == Opcode.CHUNK:
            chunks.add(start)
        try:
            _add_record(contents, opcode, start, content)
        except DAMAGE:
            doubtful.append((start, length))
        else:
            contents.end = start + length
    if not contents.end:
        raise BagError(f"{path} has nothing readable, not even the beginning of an MCAP file")
    if lost := {chunk.chunk_start_offset for chunk in summary.chunks} - chunks if summary else None:
        raise BagError(f"{path} is damaged before or at byte {min(lost)} in a way that cannot be repaired")
    # A bad record behind the last good one was being written when the writer was killed: it is cut off, not damaged.
    contents.damaged = [(start, length) for start, length in doubtful if start < contents.end]
    return contents


def _add_record(contents: Contents, opcode: int, start: int, content: bytes) -> None:
    size = RECORD_HEADER.size + len(content)
    if opcode == Opcode.CHUNK:
        _add_chunk(contents, Chunk.read(_stream(content)), start, size)
    elif opcode == Opcode.MESSAGE_INDEX and contents.chunks:
        channel = _stream(content).read2()
        if contents.unindexed.pop(channel, None):
            contents.chunks[-1].message_index_offsets[channel] = start
            contents.chunks[-1].message_index_length += size
    elif opcode == Opcode.METADATA:
        contents.metadata.append((start, size, Metadata.read(_stream(content))))
    elif opcode == Opcode.ATTACHMENT:
        contents.attachments.append((start, size, Attachment.read(_stream(content))))
    elif opcode == Opcode.HEADER:
        contents.profile = Header.read(_stream(content)).profile
    else:
        _add_messages(contents, RECORD_HEADER.pack(opcode, len(content)) + content)
        contents.loose |= opcode == Opcode.MESSAGE


def _add_chunk(contents: Contents, chunk: Chunk, start: int, size: int) -> None:
    contents.unindexed = {}  # also when the chunk turns out damaged: the message indexes that follow belong to it
    contents.unindexed = _add_messages(contents, _uncompressed(chunk))
    contents.chunks.append(
        ChunkIndex(
            chunk_length=size,
            chunk_start_offset=start,
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            message_end_time=chunk.message_end_time,
            message_index_length=0,
            message_index_offsets={},
            message_start_time=chunk.message_start_time,
            uncompressed_size=chunk.uncompressed_size,
        )
    )


def _add_messages(contents: Contents, data: bytes) -> dict[int, MessageIndex]:
    """Count the messages of a chunk, and add its schemas and channels; returns the message indexes by channel."""
    messages, others = chunk_records(data)
    for start in others:
        opcode, length = RECORD_HEADER.unpack_from(data, start)
        content = _stream(data[start + RECORD_HEADER.size : start + RECORD_HEADER.size + length])
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(content)
            contents.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(content)
            contents.channels[channel.id] = channel
    indexes = {}
    for number, offsets in messages.items():
        times = [MESSAGE_HEADER.unpack_from(data, start)[4] for start in offsets]
        indexes[number] = MessageIndex(channel_id=number, records=list(zip(times, offsets, strict=True)))
        contents.counts[number] += len(times)
        contents.extend_times(min(times), max(times))
    return indexes


def _uncompressed(chunk: Chunk) -> bytes:
    data, length = get_chunk_data_stream(chunk, validate_crc=True)
    return bytes(data.read(length))


def _stream(data: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(data))


ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def read_contents(path: Path) -> Contents:
    """Read the contents of a file from its summary if it is valid, else by a scan of the complete file."""
    try:
        with path.open("rb") as stream:
            start = stream.read(len(MAGIC))
            if not start:
                raise BagError(f"{path} is empty")
            if start.startswith(ZSTD_MAGIC):
                raise BagError(f"{path} is compressed with zstd: `zstd -d {path.name}` makes it an MCAP file")
            if start != MAGIC:
                raise BagError(f"{path} is not an MCAP file")
            contents = _from_summary(path, stream) if _summary_is_valid(path, stream) else None
            return contents or scan(path)
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from None


def _summary_is_valid(path: Path, stream: IO[bytes]) -> bool:
    """Whether the file was closed and its summary matches the checksum in the footer."""
    size = path.stat().st_size
    ending = len(DATA_END) + FOOTER.size + len(MAGIC)
    if size < len(MAGIC) + ending:
        return False
    stream.seek(size - ending)
    tail = stream.read()
    # DataEnd directly before the footer: the file was not closed, its summary may be older than its data.
    if not tail.endswith(MAGIC) or tail.startswith(DATA_END):
        return False
    start: int
    _, _, start, _, checksum = FOOTER.unpack_from(tail, len(DATA_END))
    end = size - len(MAGIC) - CHECKSUM_SIZE
    if not 0 < start < end:
        return False
    stream.seek(start)
    return not checksum or zlib.crc32(stream.read(end - start)) == int(checksum)  # 0: written without a checksum


def _from_summary(path: Path, stream: IO[bytes]) -> Contents | None:
    """Contents according to the summary; None where there is no summary or it lacks something."""
    stream.seek(0)
    try:
        reader: Any = SeekingReader(stream)
        profile, summary = reader.get_header().profile, reader.get_summary()
        if summary is None or summary.statistics is None:
            return None
        statistics = summary.statistics
        contents = Contents(path, path.stat().st_size, True, profile, summary.schemas, summary.channels, summary.chunk_indexes)
        contents.counts = Counter(statistics.channel_message_counts)
        if statistics.message_count:
            contents.extend_times(statistics.message_start_time, statistics.message_end_time)
        contents.metadata = [(i.offset, i.length, _record_at(stream, i, Metadata)) for i in summary.metadata_indexes]
        contents.attachments = [(i.offset, i.length, _record_at(stream, i, Attachment)) for i in summary.attachment_indexes]
    except DAMAGE:
        return None
    # A writer may omit any kind of record from the summary; then only a scan finds what it leads to.
    return contents if _has_all(contents, statistics) else None


def _has_all(contents: Contents, statistics: Statistics) -> bool:
    """Whether contents according to a summary have all that its statistics count and that its channels refer to."""
    schemas = {channel.schema_id for channel in contents.channels.values()} - {0}  # 0: without a schema
    return (
        contents.counts.keys() <= contents.channels.keys()
        and schemas <= contents.schemas.keys()
        and len(contents.attachments) >= statistics.attachment_count
        and len(contents.metadata) >= statistics.metadata_count
        and bool(contents.chunks or not statistics.message_count)
    )


def _record_at(stream: IO[bytes], index: Any, kind: Any) -> Any:
    """The record that an index entry names."""
    stream.seek(index.offset + RECORD_HEADER.size)
    return kind.read(_stream(stream.read(index.length - RECORD_HEADER.size)))
