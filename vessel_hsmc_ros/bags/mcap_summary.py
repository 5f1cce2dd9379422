"""The end of an MCAP file: DataEnd, summary and footer, for the writer and for the repair of a file."""

import struct
import zlib

from mcap.data_stream import RecordBuilder
from mcap.records import AttachmentIndex, Footer, McapRecord, MetadataIndex, Statistics

from vessel_hsmc_ros.bags.mcap_layout import CHECKSUM_SIZE, DATA_END, MAGIC
from vessel_hsmc_ros.bags.mcap_scan import Contents


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

    Args:
        contents: The contents of the file; its data ends at `contents.end`.
        index: The ChunkIndex records.
        chunks: Number of ChunkIndex records.

    Returns:
        The parts, to be written one after the other.
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
