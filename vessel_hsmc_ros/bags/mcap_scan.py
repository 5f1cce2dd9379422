"""What an MCAP file holds: from its summary, or by reading it from the front where the summary is missing."""

import io
import struct
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Attachment, Channel, Chunk, ChunkIndex, Header, MessageIndex, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream

from vessel_hsmc_ros.core.exceptions import BagError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEADER = struct.Struct("<BQ")
LONGEST_RECORD = 2**32

PRIVATE = 0x80
"""The first opcode of records that are nobody's but their writer's; readers skip them."""

DATA_END = RECORD_HEADER.pack(Opcode.DATA_END, 4) + bytes(4)
"""The record that ends the data; right before the footer in a file that is still growing, or was left behind so."""

_FOOTER_SIZE = 29

_ENDS = (0, Opcode.DATA_END, Opcode.FOOTER)
_MESSAGE_START = struct.Struct("<BQHIQ")
DAMAGE = (McapError, zstandard.ZstdError, struct.error, ValueError, RuntimeError, EOFError, KeyError, TypeError)
"""What the libraries raise at bytes that are not what they should be; RuntimeError is lz4's."""


@dataclass
class Contents:
    """What is in a file and where.

    Attributes:
        end: Where the last whole record of the data section ends.
        complete: Whether the file has a summary, with an index of its chunks, and all that belongs to an end.
        damaged: Where the chunks are whose bytes are not those that were written; they are not among `chunks`.
        unindexed: The index of the last chunk, as far as the file lacks it.
        loose: Whether messages lie outside of chunks.
    """

    path: Path
    end: int = 0
    complete: bool = False
    profile: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    counts: Counter[int] = field(default_factory=Counter)
    metadata: list[tuple[int, int, Metadata]] = field(default_factory=list)
    attachments: list[tuple[int, int, Attachment]] = field(default_factory=list)
    start_time: int | None = None
    end_time: int = 0
    damaged: list[int] = field(default_factory=list)
    unindexed: dict[int, MessageIndex] = field(default_factory=dict)
    loose: bool = False


def read_contents(path: Path) -> Contents:
    """Look into a file.

    Raises:
        BagError: it cannot be read or is no MCAP file.
    """
    try:
        with path.open("rb") as stream:
            start = stream.read(len(MAGIC))
            if not start:
                raise BagError(f"{path} is empty")
            if start != MAGIC:
                raise BagError(f"{path} is not an MCAP file")
            return _from_summary(path, stream) or scan(path)
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from None


def chunk_bytes(path: Path, stream: IO[bytes], index: ChunkIndex) -> bytes:
    """The uncompressed records of a chunk.

    Raises:
        BagError: they are damaged.
    """
    try:
        stream.seek(index.chunk_start_offset + RECORD_HEADER.size)
        return _unpacked(Chunk.read(ReadDataStream(stream)))
    except DAMAGE:
        where = index.chunk_start_offset
        raise BagError(f"{path} is damaged at byte {where}: `vessel-hsmc recover` makes the rest of it readable") from None


def message_places(data: bytes) -> dict[int, list[int]]:
    """Where the message records of each channel start in a chunk's records."""
    places: dict[int, list[int]] = defaultdict(list)
    unpack, size, end, position = _MESSAGE_START.unpack_from, RECORD_HEADER.size, len(data), 0
    padded = data + bytes(_MESSAGE_START.size)
    while position < end:
        opcode, length, channel, _, _ = unpack(padded, position)
        if opcode == Opcode.MESSAGE:
            places[channel].append(position)
        position += size + length
    return places


def scan(path: Path) -> Contents:
    """Read whole records from the front until the file's data ends or breaks off.

    Raises:
        BagError: there is not even a beginning.
    """
    contents, doubtful = Contents(path), []
    for opcode, start, data in records(path):
        if opcode >= PRIVATE:  # nothing of ours; at the end, what a growing file has in reserve
            continue
        try:
            _take(contents, opcode, start, data)
        except DAMAGE:
            if opcode != Opcode.CHUNK:
                break
            doubtful.append(start)  # the last one may be what was being written when the writer was killed
        else:
            contents.end = start + RECORD_HEADER.size + len(data)
    contents.damaged = [start for start in doubtful if start < contents.end]
    if not contents.end:
        raise BagError(f"{path} holds nothing readable: not even the beginning of an MCAP file")
    return contents


def records(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Opcode, place and content of the whole records of a file's data section."""
    with path.open("rb") as stream:
        start = stream.seek(len(MAGIC))
        while len(header := stream.read(RECORD_HEADER.size)) == RECORD_HEADER.size:
            opcode, length = RECORD_HEADER.unpack(header)
            if opcode in _ENDS or Opcode.DATA_END < opcode < PRIVATE or length > LONGEST_RECORD:
                return
            data = stream.read(length)
            if len(data) < length:
                return
            yield opcode, start, data
            start += len(header) + length


def _take(contents: Contents, opcode: int, start: int, data: bytes) -> None:
    end = start + RECORD_HEADER.size + len(data)
    if opcode == Opcode.CHUNK:
        _take_chunk(contents, Chunk.read(_stream(data)), start, end)
    elif opcode == Opcode.MESSAGE_INDEX and contents.chunks:
        channel = MessageIndex.read(_stream(data)).channel_id
        if contents.unindexed.pop(channel, None):
            contents.chunks[-1].message_index_offsets[channel] = start
            contents.chunks[-1].message_index_length += end - start
    elif opcode == Opcode.METADATA:
        contents.metadata.append((start, end - start, Metadata.read(_stream(data))))
    elif opcode == Opcode.ATTACHMENT:
        contents.attachments.append((start, end - start, Attachment.read(_stream(data))))
    elif opcode == Opcode.HEADER:
        contents.profile = Header.read(_stream(data)).profile
    else:
        _take_records(contents, RECORD_HEADER.pack(opcode, len(data)) + data)
        contents.loose |= opcode == Opcode.MESSAGE


def _take_chunk(contents: Contents, chunk: Chunk, start: int, end: int) -> None:
    contents.unindexed = {}
    contents.unindexed = _take_records(contents, _unpacked(chunk))
    contents.chunks.append(
        ChunkIndex(
            chunk_length=end - start,
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


def _take_records(contents: Contents, data: bytes) -> dict[int, MessageIndex]:
    """Schemas, channels and messages of a chunk; the index of its messages."""
    index: dict[int, MessageIndex] = {}
    position = 0
    while position < len(data):
        opcode, length = RECORD_HEADER.unpack_from(data, position)
        content = position + RECORD_HEADER.size
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(_stream(data[content : content + length]))
            contents.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(_stream(data[content : content + length]))
            contents.channels[channel.id] = channel
        elif opcode == Opcode.MESSAGE:
            _, _, number, _, time = _MESSAGE_START.unpack_from(data, position)
            index.setdefault(number, MessageIndex(channel_id=number, records=[])).records.append((time, position))
        position = content + length
    for number, entry in index.items():
        contents.counts[number] += len(entry.records)
        times = [time for time, _ in entry.records]
        contents.start_time = min(times) if contents.start_time is None else min(contents.start_time, *times)
        contents.end_time = max(contents.end_time, *times)
    return index


def _unpacked(chunk: Chunk) -> bytes:
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    if size != chunk.uncompressed_size:
        raise ValueError("cut off")
    data: bytes = stream.read(size)
    return data


def _stream(data: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(data))


def _from_summary(path: Path, stream: IO[bytes]) -> Contents | None:
    """What a finished file says of itself; None where it says too little, or nothing."""
    size = path.stat().st_size
    stream.seek(max(0, size - len(MAGIC) - _FOOTER_SIZE - len(DATA_END)))
    tail = stream.read()
    if size < 2 * len(MAGIC) or not tail.endswith(MAGIC) or tail.startswith(DATA_END):
        return None
    stream.seek(0)
    try:
        reader: Any = SeekingReader(stream, record_size_limit=LONGEST_RECORD)
        profile, summary = reader.get_header().profile, reader.get_summary()
        if summary is None or summary.statistics is None:
            return None
        told = summary.statistics
        contents = Contents(path, size, True, profile, summary.schemas, summary.channels, summary.chunk_indexes)
        contents.counts = Counter(told.channel_message_counts)
        if told.message_count:
            contents.start_time, contents.end_time = told.message_start_time, told.message_end_time
        contents.metadata = [(i.offset, i.length, _at(stream, i.offset, Metadata)) for i in summary.metadata_indexes]
        contents.attachments = [(i.offset, i.length, _at(stream, i.offset, Attachment)) for i in summary.attachment_indexes]
    except DAMAGE:
        return None
    listed = sum(1 for channel in contents.counts if channel not in contents.channels)
    return None if listed or (told.message_count and not contents.chunks) else contents


def _at(stream: IO[bytes], offset: int, kind: Any) -> Any:
    stream.seek(offset + RECORD_HEADER.size)
    return kind.read(ReadDataStream(stream))
