"""An MCAP file being written that can be read at any moment, also when its writer is killed.

Messages are gathered into chunks; a chunk goes to the operating system together with an index of all chunks so far. The file
it goes into is whole after every system call (`growing_file`), for readers with and without an index.
"""

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from vessel_hsmc_ros.bags.crash_safe_file import GrowingFile
from vessel_hsmc_ros.bags.mcap_scan import DATA_END, MAGIC, Contents

CHUNK_SIZE = 256 * 1024
"""Bytes of messages in one chunk: what a crash can cost, at most, beside what has come within a flush period."""

SUMMARY_SHARE, SUMMARY_FLOOR = 8, 1 << 20
"""All summaries together may take this many times the bytes of the data, and this many bytes besides: in a long recording, where
one is large, they come less often."""

_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_FIELDS = _MESSAGE.size - 9
_INDEX_HEADER = struct.Struct("<BQHI")
_COMPRESSORS = {"none": bytes, "lz4": lz4.frame.compress, "zstd": zstandard.ZstdCompressor(level=1).compress}


class McapFile:
    """Schemas, channels, messages, attachments and metadata into one new file.

    Args:
        path: The file, which must not exist.
        compression: none, lz4 or zstd.
    """

    def __init__(self, path: Path, compression: str) -> None:
        self.contents = Contents(path, profile="ros2")
        self._compression = compression
        self._file = GrowingFile(path, MAGIC + _bytes(Header("ros2", "vessel_hsmc_ros")))
        self.contents.end = self._file.end
        self._chunk: list[bytes] = []
        self._chunk_size = 0
        self._places: dict[int, list[int]] = {}
        self._index, self._chunks = bytearray(), 0
        self._spent = 0
        self._known: tuple[int, ...] = ()
        self._described = b""
        self._pending: list[bytes] = []

    @property
    def size(self) -> int:
        """Bytes so far, the chunk in progress as it is."""
        return self.contents.end + self._chunk_size

    def add_schema(self, name: str, definition: str) -> int:
        """A ros2msg schema; its number."""
        number = len(self.contents.schemas) + 1
        self.contents.schemas[number] = Schema(id=number, name=name, encoding="ros2msg", data=definition.encode())
        self._gather(_bytes(self.contents.schemas[number]))
        return number

    def add_channel(self, topic: str, schema: int, described: Mapping[str, str]) -> int:
        """A cdr channel; its number."""
        number = len(self.contents.channels) + 1
        channel = Channel(id=number, topic=topic, message_encoding="cdr", schema_id=schema, metadata=dict(described))
        self.contents.channels[number] = channel
        self._gather(_bytes(channel))
        return number

    def add_message(self, channel: int, log_time: int, data: bytes, publish_time: int) -> None:
        """Append a message, times in nanoseconds."""
        places = self._places.get(channel)
        if places is None:
            places = self._places[channel] = []
        places += (log_time, self._chunk_size)
        header = _MESSAGE.pack(Opcode.MESSAGE, _MESSAGE_FIELDS + len(data), channel, 0, log_time, publish_time)
        self._chunk += (header, data)
        self._chunk_size += _MESSAGE.size + len(data)
        if self._chunk_size > CHUNK_SIZE:
            self.commit()

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Append a file that travels with the messages."""
        record = Attachment(create_time=0, log_time=self.contents.end_time, name=name, media_type=media_type, data=data)
        start, written = self.contents.end, _bytes(record)
        self._append(written)
        self.contents.attachments.append((start, len(written), record))

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Append named texts."""
        record = Metadata(name=name, metadata=dict(values))
        start, written = self.contents.end, _bytes(record)
        self._append(written)
        self.contents.metadata.append((start, len(written), record))

    def commit(self) -> None:
        """Hand everything to the operating system.

        Raises:
            OSError: it does not take it.
        """
        self._end_chunk()
        if not self._pending:
            return
        self._place()
        parts: list[bytes | bytearray] = [self._index, _statistics(self.contents, self._chunks), self._describe()]
        size = sum(map(len, parts))
        if self._spent + size < SUMMARY_FLOOR + SUMMARY_SHARE * self.contents.end:
            self._file.set_summary(parts)
            self._spent += size

    def close(self) -> None:
        """Write what is left and the end, and close the file.

        Raises:
            OSError: it cannot be written.
        """
        self._end_chunk()
        self._place()
        self._file.close(ending(self.contents, bytes(self._index), self._chunks))

    def _describe(self) -> bytes:
        """`described`, made anew only when there is more to describe."""
        told = self.contents
        known = len(told.channels), len(told.attachments), len(told.metadata)
        if known != self._known:
            self._known, self._described = known, described(told)
        return self._described

    def _place(self) -> None:
        if self._pending:
            self._file.append(self._pending)
            self._pending, self.contents.end = [], self._file.end

    def _gather(self, record: bytes) -> None:
        self._chunk.append(record)
        self._chunk_size += len(record)

    def _append(self, record: bytes) -> None:
        self._pending.append(record)
        self.contents.end += len(record)

    def _end_chunk(self) -> None:
        """The messages gathered so far as a chunk, followed by its index."""
        if not self._places:
            return
        data = b"".join(self._chunk)
        times = [time for places in self._places.values() for time in places[::2]]
        compression = "" if self._compression == "none" else self._compression
        packed = _COMPRESSORS[self._compression](data)
        chunk = Chunk(compression, packed, max(times), min(times), zlib.crc32(data), len(data))
        index = ChunkIndex(0, self.contents.end, compression, len(packed), max(times), 0, {}, min(times), len(data))
        written = _bytes(chunk)
        index.chunk_length = len(written)
        self._append(written)
        for channel, places in self._places.items():
            index.message_index_offsets[channel] = self.contents.end
            record = _INDEX_HEADER.pack(Opcode.MESSAGE_INDEX, 6 + 8 * len(places), channel, 8 * len(places))
            self._append(record + struct.pack(f"<{len(places)}Q", *places))
            self.contents.counts[channel] += len(places) // 2
        index.message_index_length = self.contents.end - index.chunk_start_offset - index.chunk_length
        self._index += _bytes(index)  # as bytes: a long recording has many
        self._chunks += 1
        told = self.contents
        told.end_time = max(told.end_time, *times)
        told.start_time = min(times) if told.start_time is None else min(told.start_time, *times)
        self._chunk, self._chunk_size, self._places = [], 0, {}


def described(contents: Contents) -> bytes:
    """What a summary has besides the index of the chunks and the statistics."""
    summary = RecordBuilder()
    for record in (*contents.schemas.values(), *contents.channels.values()):
        record.write(summary)
    for offset, length, a in contents.attachments:
        AttachmentIndex(offset, length, a.log_time, a.create_time, len(a.data), a.name, a.media_type).write(summary)
    for offset, length, metadata in contents.metadata:
        MetadataIndex(offset, length, metadata.name).write(summary)
    written: bytes = summary.end()
    return written


def ending(contents: Contents, index: bytes, chunks: int) -> list[bytes]:
    """End of data, summary and footer of a file whose data ends at `contents.end`."""
    rest = _statistics(contents, chunks) + described(contents)
    footer = _bytes(Footer(contents.end + len(DATA_END), 0, 0))[:-4]
    footer += struct.pack("<I", zlib.crc32(footer, zlib.crc32(rest, zlib.crc32(index))))
    return [DATA_END, index, rest, footer, MAGIC]


def ending_of(contents: Contents) -> bytes:
    """The same, from what was found in a file."""
    return b"".join(ending(contents, b"".join(map(_bytes, contents.chunks)), len(contents.chunks)))


def _statistics(contents: Contents, chunks: int) -> bytes:
    statistics = Statistics(
        attachment_count=len(contents.attachments),
        channel_count=len(contents.channels),
        channel_message_counts=dict(contents.counts),
        chunk_count=chunks,
        message_count=contents.counts.total(),
        message_end_time=contents.end_time,
        message_start_time=contents.start_time or 0,
        metadata_count=len(contents.metadata),
        schema_count=len(contents.schemas),
    )
    return _bytes(statistics)


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    written: bytes = builder.end()
    return written
