"""Contents of an MCAP file: from its summary, or by a scan from its beginning if that is missing or damaged."""

import io
import struct
import zlib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Attachment, Channel, Chunk, ChunkIndex, Header, MessageIndex, Metadata, Schema, Statistics

from vessel_hsmc_ros.bags.mcap_layout import (
    CHECKSUM_SIZE,
    DATA_END,
    FIRST_PRIVATE,
    FOOTER,
    LARGEST_CHUNK,
    LONGEST_RECORD,
    MAGIC,
    MESSAGE_HEADER,
    RECORD_HEADER,
    chunk_records,
    file_records,
)
from vessel_hsmc_ros.core.exceptions import BagError

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
        if index.chunk_length > LONGEST_RECORD:
            raise ValueError("too large")
        stream.seek(offset + RECORD_HEADER.size)
        # No more than the chunk's own bytes: a damaged length within them could request any amount of memory.
        return _uncompressed(Chunk.read(_stream(stream.read(index.chunk_length - RECORD_HEADER.size))))
    except DAMAGE:
        raise BagError(f"{path} is damaged at byte {offset}: `vessel-hsmc recover` makes the rest of it readable") from None


def scan(path: Path, summary: Contents | None = None) -> Contents:
    """Read complete records from the beginning until the data section ends or breaks off.

    `summary`: what a valid summary knows. Raises BagError if the file has no complete record, or the walk does not come to a
    chunk that the summary knows: the length or the kind of a record before it is damaged.
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
    indexes: dict[int, MessageIndex] = {}
    for opcode, start, end in chunk_records(data):
        content = start + RECORD_HEADER.size
        if opcode == Opcode.MESSAGE:
            _, _, number, _, log_time, _ = MESSAGE_HEADER.unpack_from(data, start)
            indexes.setdefault(number, MessageIndex(channel_id=number, records=[])).records.append((log_time, start))
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(_stream(data[content:end]))
            contents.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(_stream(data[content:end]))
            contents.channels[channel.id] = channel
    for number, index in indexes.items():
        contents.counts[number] += len(index.records)
        times = [log_time for log_time, _ in index.records]
        contents.extend_times(min(times), max(times))
    return indexes


def _uncompressed(chunk: Chunk) -> bytes:
    """The uncompressed bytes of a chunk, never more than it claims, and never more than LARGEST_CHUNK."""
    size = chunk.uncompressed_size
    if size > LARGEST_CHUNK:
        raise ValueError("too large")
    data = _decompressed(chunk.compression, chunk.data, size)
    if len(data) != size or (chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc):
        raise ValueError("cut off")
    return data


def _decompressed(compression: str, data: bytes, size: int) -> bytes:
    """Decompress to at most `size` bytes; a library that is left to itself allocates what the data claim."""
    if compression == "":
        return data
    if compression == "lz4":
        unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size)
        return unpacked
    if compression != "zstd":
        raise ValueError(f"compression {compression} is unknown")
    if zstandard.frame_content_size(data) > size:
        raise ValueError("claims more than the chunk")
    return zstandard.ZstdDecompressor().decompress(data, max_output_size=size) if size else b""


def _stream(data: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(data))


ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def read_contents(path: Path) -> Contents:
    """Read the contents of a file from its summary if it is valid, else by a scan of the complete file.

    Raises BagError if the file cannot be read or is not an MCAP file.
    """
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
    if not 0 < start < end or end - start > LONGEST_RECORD:
        return False
    stream.seek(start)
    return not checksum or zlib.crc32(stream.read(end - start)) == int(checksum)  # 0: written without a checksum


def _from_summary(path: Path, stream: IO[bytes]) -> Contents | None:
    """Contents according to the summary; None where there is no summary or it lacks something."""
    stream.seek(0)
    try:
        reader: Any = SeekingReader(stream, record_size_limit=LONGEST_RECORD)
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
    """The record that an index entry names; of its bytes and no more, because lengths within it can be damaged too."""
    if index.length > LONGEST_RECORD:
        raise ValueError("too large")
    stream.seek(index.offset + RECORD_HEADER.size)
    return kind.read(ReadDataStream(io.BytesIO(stream.read(index.length - RECORD_HEADER.size))))
