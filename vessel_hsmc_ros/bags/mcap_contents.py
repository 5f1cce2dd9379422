"""Contents of an MCAP file: from its summary, or by a scan if the summary is missing or damaged."""

import io
import zlib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

from mcap.data_stream import ReadDataStream
from mcap.reader import SeekingReader
from mcap.records import Attachment, ChunkIndex, Metadata

from vessel_hsmc_ros.bags.mcap_layout import CHECKSUM_SIZE, DATA_END, FOOTER, LONGEST_RECORD, MAGIC, RECORD_HEADER
from vessel_hsmc_ros.bags.mcap_scan import DAMAGE, Contents, scan
from vessel_hsmc_ros.core.exceptions import BagError

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def read_contents(path: Path) -> Contents:
    """Read the contents of a file from its summary if it is valid, else by a scan of the complete file.

    Raises:
        BagError: the file cannot be read or is not an MCAP file.
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
        statistics, size = summary.statistics, path.stat().st_size
        contents = Contents(path, size, True, profile, summary.schemas, summary.channels, summary.chunk_indexes)
        contents.counts = Counter(statistics.channel_message_counts)
        if statistics.message_count:
            contents.extend_times(statistics.message_start_time, statistics.message_end_time)
        contents.metadata = [(i.offset, i.length, _record_at(stream, i, Metadata)) for i in summary.metadata_indexes]
        contents.attachments = [(i.offset, i.length, _record_at(stream, i, Attachment)) for i in summary.attachment_indexes]
    except DAMAGE:
        return None
    # A writer may omit channels or the chunk index from the summary; then only a scan finds the messages.
    if not _apart(contents.chunks, size):
        return None
    unknown_channels = contents.counts.keys() - contents.channels.keys()
    return None if unknown_channels or (statistics.message_count and not contents.chunks) else contents


def _record_at(stream: IO[bytes], index: Any, kind: Any) -> Any:
    """The record that an index entry names; of its bytes and no more, because lengths within it can be damaged too."""
    if index.length > LONGEST_RECORD:
        raise ValueError("too large")
    stream.seek(index.offset + RECORD_HEADER.size)
    return kind.read(ReadDataStream(io.BytesIO(stream.read(index.length - RECORD_HEADER.size))))


def _apart(chunks: Sequence[ChunkIndex], size: int) -> bool:
    """Whether chunks lie within the file and apart: an index that names one of them a million times is not taken."""
    end = len(MAGIC)
    for chunk in sorted(chunks, key=lambda index: index.chunk_start_offset):
        if chunk.chunk_start_offset < end or chunk.chunk_length < RECORD_HEADER.size:
            return False
        end = chunk.chunk_start_offset + chunk.chunk_length
    return end <= size
