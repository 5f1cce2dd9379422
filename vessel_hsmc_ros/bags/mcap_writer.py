"""An MCAP file that is readable while it is written, and after its writer was killed.

Messages are collected in chunks. A chunk is passed to the operating system with an index of all chunks so far. The file
is valid after every system call (`crash_safe_file`), for readers with and without an index. The repair of a file writes the same
end: DataEnd, summary and footer.
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

from vessel_hsmc_ros.bags.crash_safe_file import CrashSafeFile
from vessel_hsmc_ros.bags.mcap_contents import Contents
from vessel_hsmc_ros.bags.mcap_layout import (
    CHECKSUM_SIZE,
    DATA_END,
    INDEX_ENTRY_SIZE,
    MAGIC,
    MESSAGE_FIELDS,
    MESSAGE_HEADER,
    MESSAGE_INDEX_HEADER,
    RECORD_HEADER,
)


def definitions(contents: Contents) -> bytes:
    """The records of a summary besides chunk index and statistics: schemas, channels, attachment and metadata indexes."""
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
    """DataEnd, summary and footer of a file.

    `contents`: the contents of the file; its data ends at `contents.end`.
    """
    rest = statistics(contents, chunks) + definitions(contents)
    # The footer's checksum covers the summary and the footer's own bytes before the checksum.
    footer = record_bytes(Footer(contents.end + len(DATA_END), 0, 0))[:-CHECKSUM_SIZE]
    footer += struct.pack("<I", zlib.crc32(footer, zlib.crc32(rest, zlib.crc32(index))))
    return [DATA_END, index, rest, footer, MAGIC]


def ending_of(contents: Contents) -> bytes:
    """The ending of a file whose contents were found by a scan."""
    return b"".join(ending(contents, b"".join(map(record_bytes, contents.chunks)), len(contents.chunks)))


def statistics(contents: Contents, chunks: int) -> bytes:
    """The Statistics record of a file with a number of chunks."""
    record = Statistics(
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
    return record_bytes(record)


def record_bytes(record: McapRecord) -> bytes:
    """A record of the `mcap` library, encoded."""
    builder = RecordBuilder()
    record.write(builder)
    written: bytes = builder.end()
    return written


CHUNK_SIZE = 256 * 1024
"""Bytes of messages in one chunk: a crash loses at most one chunk, or what was received within a flush period."""

SUMMARY_SHARE, SUMMARY_FLOOR = 8, 1 << 20
"""Bytes of all summaries written so far: at most this many times those of the data, plus a constant. A summary grows with the
recording; writing it with every chunk would take time in proportion to the square of the length."""

_COMPRESSORS = {"none": bytes, "lz4": lz4.frame.compress, "zstd": zstandard.ZstdCompressor(level=1).compress}


class McapFile:
    """Writes schemas, channels, messages, attachments and metadata into one new file.

    After a method has failed, nothing but `abandon` is allowed. `path`: the file, which must not exist. `compression`: of the
    chunks: none, lz4 or zstd.

    Attributes:
        contents: The written records and their locations.
    """

    def __init__(self, path: Path, compression: str) -> None:
        self.contents = Contents(path, profile="ros2")
        self._compression = compression
        self._index, self._chunks = bytearray(), 0  # encoded: a long recording has many chunks
        self._file = CrashSafeFile(path, MAGIC + record_bytes(Header("ros2", "vessel_hsmc_ros")))
        self.contents.end = self._file.end
        self._chunk: list[bytes] = []
        self._chunk_size = 0
        self._entries: dict[int, list[int]] = {}  # by channel: log time and offset of each message, in turns
        self._summary_bytes = 0
        self._summarised: tuple[int, ...] = ()
        self._definitions = b""
        self._pending: list[bytes] = []

    @property
    def size(self) -> int:
        """Bytes so far, with the current chunk uncompressed."""
        return self.contents.end + self._chunk_size

    def add_schema(self, name: str, definition: str) -> int:
        """Add a ros2msg schema; returns its id."""
        number = len(self.contents.schemas) + 1
        self.contents.schemas[number] = Schema(id=number, name=name, encoding="ros2msg", data=definition.encode())
        self._add_to_chunk(record_bytes(self.contents.schemas[number]))
        return number

    def add_channel(self, topic: str, schema: int, metadata: Mapping[str, str]) -> int:
        """Add a channel of CDR messages.

        `schema`: the id of its type's schema. `metadata`: QoS profiles and type hash, as rosbag2 names them.
        """
        number = len(self.contents.channels) + 1
        channel = Channel(id=number, topic=topic, message_encoding="cdr", schema_id=schema, metadata=dict(metadata))
        self.contents.channels[number] = channel
        self._add_to_chunk(record_bytes(channel))
        return number

    def add_message(self, channel: int, log_time: int, data: bytes, publish_time: int) -> None:
        """Append a message; the chunk is committed when it is full.

        `log_time`: time of its receipt, ns. `publish_time`: time of its publication, ns.
        """
        entries = self._entries.get(channel)
        if entries is None:
            entries = self._entries[channel] = []
        entries += (log_time, self._chunk_size)
        # Packed here and not by a library's object: this runs once per message.
        header = MESSAGE_HEADER.pack(Opcode.MESSAGE, MESSAGE_FIELDS + len(data), channel, 0, log_time, publish_time)
        self._chunk += (header, data)
        self._chunk_size += MESSAGE_HEADER.size + len(data)
        if self._chunk_size > CHUNK_SIZE:
            self.commit()

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Append an attachment, a small file that is stored with the messages.

        `media_type`: such as `application/yaml`.
        """
        record = Attachment(create_time=0, log_time=self.contents.end_time, name=name, media_type=media_type, data=data)
        start, written = self.contents.end, record_bytes(record)
        self._append(written)
        self.contents.attachments.append((start, len(written), record))

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Append a metadata record."""
        record = Metadata(name=name, metadata=dict(values))
        start, written = self.contents.end, record_bytes(record)
        self._append(written)
        self.contents.metadata.append((start, len(written), record))

    def commit(self) -> None:
        """Pass all records to the operating system, and update the summary. Raises OSError if it refuses to write."""
        self._end_chunk()
        if not self._pending:
            return
        self._write_pending()
        present = len(self.contents.channels), len(self.contents.attachments), len(self.contents.metadata)
        if present != self._summarised:  # encoded again only when there are new ones
            self._summarised, self._definitions = present, definitions(self.contents)
        rest = statistics(self.contents, self._chunks) + self._definitions
        size = len(self._index) + len(rest)
        if self._summary_bytes + size < SUMMARY_FLOOR + SUMMARY_SHARE * self.contents.end:
            self._file.set_summary(bytes(self._index) + rest)
            self._summary_bytes += size

    def close(self) -> None:
        """Write the rest, summary and footer, and close the file. Raises OSError if it cannot be written."""
        self._end_chunk()
        self._write_pending()
        self._file.close(ending(self.contents, bytes(self._index), self._chunks))

    def abandon(self) -> None:
        """Leave the file as it is on the disk, and release its descriptor."""
        self._file.abandon()

    def _write_pending(self) -> None:
        if self._pending:
            self._file.append(self._pending)
            self._pending, self.contents.end = [], self._file.end

    def _add_to_chunk(self, record: bytes) -> None:
        self._chunk.append(record)
        self._chunk_size += len(record)

    def _append(self, record: bytes) -> None:
        self._pending.append(record)
        self.contents.end += len(record)

    def _end_chunk(self) -> None:
        """Turn the messages collected so far into a Chunk record, followed by its message indexes."""
        if not self._entries:
            return
        data = b"".join(self._chunk)
        # From all messages, not the first and the last: messages of different topics may come out of order.
        times = [time for entries in self._entries.values() for time in entries[::2]]
        start, end = min(times), max(times)
        compression = "" if self._compression == "none" else self._compression
        packed = _COMPRESSORS[self._compression](data)
        record = record_bytes(Chunk(compression, packed, end, start, zlib.crc32(data), len(data)))
        index = ChunkIndex(len(record), self.contents.end, compression, len(packed), end, 0, {}, start, len(data))
        self._append(record)
        self._append_message_indexes(index)
        self._index += record_bytes(index)
        self._chunks += 1
        self.contents.extend_times(start, end)
        self._chunk, self._chunk_size, self._entries = [], 0, {}

    def _append_message_indexes(self, index: ChunkIndex) -> None:
        """Append a MessageIndex record per channel of the current chunk, and note its offset in the chunk's index."""
        start = self.contents.end
        for channel, entries in self._entries.items():
            index.message_index_offsets[channel] = self.contents.end
            count = len(entries) // 2
            size = MESSAGE_INDEX_HEADER.size - RECORD_HEADER.size + INDEX_ENTRY_SIZE * count
            header = MESSAGE_INDEX_HEADER.pack(Opcode.MESSAGE_INDEX, size, channel, INDEX_ENTRY_SIZE * count)
            self._append(header + struct.pack(f"<{len(entries)}Q", *entries))
            self.contents.counts[channel] += count
        index.message_index_length = self.contents.end - start
