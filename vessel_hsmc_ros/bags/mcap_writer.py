"""An MCAP file that is readable while it is written, and after its writer was killed.

Messages are collected in chunks. A chunk is passed to the operating system with an index of all chunks so far. The repair of a
file writes the same end: DataEnd, summary and footer. The file is valid after every single system call, so that its writer may
be killed at any moment:

    [data][reserve ... | summary slot 0 | summary slot 1][end of data][footer][magic]

The reserve is a record with a private opcode, which readers skip. New data are written into it, still hidden by its header, and
become visible when the nine bytes of their first record's header replace those of the reserve. A new summary is written into
the slot that is not in use, and becomes valid when the footer is pointed to it. Such headers and the footer never cross a page
boundary, so that the operating system writes each of them entirely or not at all, even for a process that is being killed.
"""

import fcntl
import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
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

from vessel_hsmc_ros.bags.mcap_contents import (
    CHECKSUM_SIZE,
    DATA_END,
    FIRST_PRIVATE,
    FOOTER,
    INDEX_ENTRY_SIZE,
    MAGIC,
    MESSAGE_FIELDS,
    MESSAGE_HEADER,
    MESSAGE_INDEX_HEADER,
    RECORD_HEADER,
    Contents,
)

PAGE = 4096
HEADER = RECORD_HEADER.size

LEAST_RESERVE, RESERVE_SHARE = 128 * 1024, 8
"""A reserve that is too small is extended to this many bytes, or to this fraction of the file if that is more."""

_RESERVE, _SPACER, _FILLER = FIRST_PRIVATE, FIRST_PRIVATE + 1, FIRST_PRIVATE + 2

TRAILER = len(DATA_END) + FOOTER.size + len(MAGIC)


class CrashSafeFile:
    """A new MCAP file that grows by complete records.

    After a method has failed the file on the disk is valid, but its further layout is unknown: nothing but `abandon` is
    allowed. `path`: the file, which must not exist. `start`: its first bytes.

    Attributes:
        end: Offset at which the next record will lie.
    """

    def __init__(self, path: Path, start: bytes) -> None:
        self._fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        with suppress(OSError):  # a file system without locks
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)  # as long as it is written; a killed process leaves none behind
        self.end = len(start)
        self._slots = self._slot_size = self._trailer = 0
        self._summary: tuple[int, int] | None = None
        try:
            self._write([start], 0)
            self._extend(0, 0)
        except OSError:
            self.abandon()
            with suppress(OSError):
                path.unlink()  # without an end it is no MCAP file, and would make the bag unreadable
            raise

    def append(self, parts: Sequence[bytes]) -> None:
        """Add complete records after the present ones; the first part begins with a record's header."""
        size = sum(map(len, parts))
        if self.end + size + PAGE > self._slots:
            self._extend(size, 0)
        new_end = self.end + size
        filler = b""
        if 0 < (gap := -new_end % PAGE) < HEADER:  # the reserve's header would cross a page boundary
            filler = RECORD_HEADER.pack(_FILLER, gap) + bytes(gap)
            new_end += len(filler)
        first, *others = parts
        # All but the first header goes in while the old header still hides it; the header then shows everything at once.
        self._write([memoryview(first)[HEADER:], *others, filler, self._reserve(new_end)], self.end + HEADER)
        self._write([first[:HEADER]], self.end)
        self.end = new_end

    def set_summary(self, summary: bytes) -> None:
        """Replace the summary, for readers that begin at the end of the file."""
        if len(DATA_END) + len(summary) + HEADER > self._slot_size:
            self._extend(0, len(summary))
        first_in_use = self._summary is not None and self._summary[0] < self._slots + self._slot_size
        self._write_summary(summary, self._slots + (self._slot_size if first_in_use else 0))

    def close(self, parts: Sequence[bytes]) -> None:
        """Replace reserve and slots by the final records, and close the file."""
        ending = b"".join(parts)
        try:
            if self.end + len(ending) > self._slots:
                self._extend(len(ending), 0)
            self._write([ending[HEADER:]], self.end + HEADER)
            self._write([ending[:HEADER]], self.end)
            os.ftruncate(self._fd, self.end + len(ending))
        finally:
            self.abandon()

    def abandon(self) -> None:
        """Leave the file as it is, and release its descriptor, if that has not been done."""
        # The number is forgotten first: the operating system gives it to the next file that is opened.
        fd, self._fd = self._fd, -1
        if fd >= 0:
            with suppress(OSError):  # it is released all the same
                os.close(fd)

    def _extend(self, data_size: int, summary_size: int) -> None:
        """Enlarge reserve and slots behind the present trailer; the summary moves along."""
        summary = self._summary and os.pread(self._fd, self._summary[1], self._summary[0])
        reserve = max(LEAST_RESERVE, 2 * data_size, self.end // RESERVE_SHARE)
        self._slot_size = max(self._slot_size, _pages(2 * summary_size + PAGE), 4 * PAGE)
        after = self._trailer + TRAILER if self._trailer else 0
        self._slots = max(_pages(self.end + HEADER + reserve), after)
        self._trailer = self._slots + 2 * self._slot_size + PAGE - TRAILER
        self._write([DATA_END, self._footer(), MAGIC], self._trailer)
        if summary:
            self._write_summary(summary, self._slots)
        self._write([self._reserve(self.end)], self.end)  # last: until now the old trailer was the file's valid end

    def _write_summary(self, summary: bytes, slot: int) -> None:
        """Write a summary into an unused slot, preceded by a DataEnd record, and point the footer to it."""
        start = slot + len(DATA_END)
        rest = self._trailer + len(DATA_END) - start - len(summary) - HEADER
        self._write([DATA_END, summary, RECORD_HEADER.pack(_SPACER, rest)], slot)
        self._summary = start, len(summary)
        self._write([self._footer()], self._trailer + len(DATA_END))

    def _footer(self) -> bytes:
        return FOOTER.pack(Opcode.FOOTER, FOOTER.size - HEADER, self._summary[0] if self._summary else 0, 0, 0)

    def _reserve(self, start: int) -> bytes:
        return RECORD_HEADER.pack(_RESERVE, self._trailer - start - HEADER)

    def _write(self, parts: Sequence[bytes | memoryview], offset: int) -> None:
        """Write parts one after the other, by one call of the operating system."""
        data = b"".join(parts)
        while data:
            written = os.pwrite(self._fd, data, offset)
            data, offset = data[written:], offset + written


def is_being_written(path: Path) -> bool:
    """Whether a process has this file open as a CrashSafeFile."""
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        return False
    return False


def _pages(size: int) -> int:
    """A size rounded up to a multiple of PAGE."""
    return -(-size // PAGE) * PAGE


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
    chunks: none, lz4 or zstd. `before`: the contents of the bag's file before, whose schemas and channels it shares.

    Attributes:
        contents: The written records and their locations.
    """

    def __init__(self, path: Path, compression: str, before: Contents | None = None) -> None:
        self.contents = Contents(path, profile="ros2")
        if before:
            self.contents.schemas, self.contents.channels = before.schemas, before.channels
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
        for record in (*self.contents.schemas.values(), *self.contents.channels.values()):
            self._add_to_chunk(record_bytes(record))

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
