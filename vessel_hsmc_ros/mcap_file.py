"""An MCAP file being written that can be read at any moment, also when its writer is killed.

Messages are gathered into chunks. Whatever goes to the operating system goes there together with an end of file: an index
of all chunks so far and the closing marks, which the next chunk overwrites. A file left behind by SIGKILL therefore is a
whole file but for its last chunk, for readers with and without an index.
"""

import os
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
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from vessel_hsmc_ros.mcap_contents import MAGIC, Contents

CHUNK_SIZE = 64 * 1024
"""Bytes of messages in one chunk: what a crash can cost, at most, beside what has come within a flush period."""

ENDING_SHARE, ENDING_FLOOR = 8, 1 << 20
"""Ends of file with an index may take this many times the bytes of the data, and this many bytes besides; an index that would
take more is left out until the file is closed."""

MANY = 512
"""Pieces that one system call surely takes."""

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
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self._chunk: list[bytes] = []
        self._chunk_size = 0
        self._places: dict[int, list[int]] = {}
        self._index, self._index_crc, self._chunks = bytearray(), 0, 0
        self._crc = self._spent = self._old_end = 0
        self._pending: list[bytes | bytearray] = []
        self._append(MAGIC + _bytes(Header("ros2", "vessel_hsmc_ros")))
        self.commit()

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
        """Hand everything to the operating system, closed by an end of file.

        Raises:
            OSError: it does not take it.
        """
        self._end_chunk()
        if self._pending:
            limit = ENDING_FLOOR + ENDING_SHARE * self.contents.end
            self._write(indexed=self._spent + len(self._index) < limit)

    def close(self) -> None:
        """Write what is left, with the index, and close the file.

        Raises:
            OSError: it cannot be written.
        """
        try:
            self._end_chunk()
            self._write(indexed=True)
        finally:
            os.close(self._fd)

    def _gather(self, record: bytes) -> None:
        self._chunk.append(record)
        self._chunk_size += len(record)

    def _append(self, record: bytes) -> None:
        self._pending.append(record)
        self._crc = zlib.crc32(record, self._crc)
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
        entry = _bytes(index)
        self._index += entry  # as bytes, a long recording would keep many
        self._index_crc = zlib.crc32(entry, self._index_crc)
        self._chunks += 1
        told = self.contents
        told.end_time = max(told.end_time, *times)
        told.start_time = min(times) if told.start_time is None else min(told.start_time, *times)
        self._chunk, self._chunk_size, self._places = [], 0, {}

    def _write(self, indexed: bool) -> None:
        parts = self._pending
        if indexed:
            data_end, rest = ending(self.contents, self._index_crc, self._chunks, self._crc)
            parts = [*parts, data_end, self._index, rest]
        else:
            parts = [*parts, bare_ending(self._crc)]
        if len(parts) > MANY:
            parts = [b"".join(parts)]
        start = self.contents.end - sum(map(len, self._pending))
        size = sum(map(len, parts))
        if start + size < self._old_end:
            os.ftruncate(self._fd, start)
        done = os.pwritev(self._fd, parts, start)  # in one call, so that hardly any moment finds half of it
        while done < size:
            done += os.pwrite(self._fd, b"".join(parts)[done:], start + done)
        self._old_end = start + size
        self._spent += start + size - self.contents.end
        self._pending = []


def ending(contents: Contents, index_crc: int, chunks: int, crc: int = 0) -> tuple[bytes, bytes]:
    """What comes before and after the chunk index at the end of a file: end of data; the rest of the summary and footer.

    Args:
        contents: What is in the file up to `contents.end`.
        index_crc: Of the records of the chunk index.
        chunks: How many they are.
        crc: Of all data; 0 where it is not known.
    """
    data_end, summary = _bytes(DataEnd(data_section_crc=crc)), RecordBuilder()
    for record in (*contents.schemas.values(), *contents.channels.values(), _statistics(contents, chunks)):
        record.write(summary)
    for offset, length, a in contents.attachments:
        AttachmentIndex(offset, length, a.log_time, a.create_time, len(a.data), a.name, a.media_type).write(summary)
    for offset, length, metadata in contents.metadata:
        MetadataIndex(offset, length, metadata.name).write(summary)
    start, written = contents.end + len(data_end), summary.end()
    footer = _bytes(Footer(summary_start=start, summary_offset_start=0, summary_crc=0))[:-4]
    footer += struct.pack("<I", zlib.crc32(footer, zlib.crc32(written, index_crc)))
    return data_end, b"".join((written, footer, MAGIC))


def bare_ending(crc: int = 0) -> bytes:
    """The end of a file without a summary."""
    return _bytes(DataEnd(data_section_crc=crc)) + _bytes(Footer(0, 0, 0)) + MAGIC


def indexed_ending(contents: Contents) -> bytes:
    """The end of a file, from what was found in it."""
    index = b"".join(map(_bytes, contents.chunks))
    data_end, rest = ending(contents, zlib.crc32(index), len(contents.chunks))
    return data_end + index + rest


def _statistics(contents: Contents, chunks: int) -> Statistics:
    return Statistics(
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


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    written: bytes = builder.end()
    return written
