"""Completing a bag whose recorder was killed: what came after the last whole chunk is cut off, the index is written anew."""

import struct
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import yaml
from mcap.data_stream import RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, MessageIndex, Schema, Statistics
from mcap.stream_reader import StreamReader, get_chunk_data_stream

from vessel_hsmc_ros.bag import Topic, metadata, write_metadata
from vessel_hsmc_ros.exceptions import BagError

MAGIC = b"\x89MCAP0\r\n"


@dataclass
class Contents:
    """What a cut-off file holds up to the end of its last chunk that is whole, index included.

    While a chunk is being taken, `unindexed` of its messages have not been seen in its index yet.
    """

    end: int = 0
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    counts: Counter[int] = field(default_factory=Counter)
    chunk_counts: Counter[int] = field(default_factory=Counter)
    unindexed: int = 0

    @property
    def start_time(self) -> int:
        """First log time, ns."""
        return min((chunk.message_start_time for chunk in self.chunks), default=0)

    @property
    def end_time(self) -> int:
        """Last log time, ns."""
        return max((chunk.message_end_time for chunk in self.chunks), default=0)


def is_complete(directory: Path) -> bool:
    """Whether the bag's file ends as a finished MCAP file does.

    Raises:
        BagError: the folder does not hold exactly one MCAP file.
    """
    content = mcap_file(directory)
    with content.open("rb") as stream:
        stream.seek(max(0, content.stat().st_size - len(MAGIC)))
        return content.stat().st_size > len(MAGIC) and stream.read() == MAGIC


def repair(directory: Path) -> int:
    """Give a cut-off bag its index and metadata, in place.

    Returns:
        The messages that are readable now.

    Raises:
        BagError: the folder does not hold exactly one MCAP file, or that has not even a beginning.
    """
    path = mcap_file(directory)
    contents = _scan(path)
    with path.open("r+b") as stream:
        stream.truncate(contents.end)
        stream.seek(contents.end)
        stream.write(_ending(contents))
    topics = [_topic(contents, channel) for channel in contents.channels.values()]
    write_metadata(directory, metadata(path.name, topics, contents.start_time, contents.end_time))
    return contents.counts.total()


def mcap_file(directory: Path) -> Path:
    """The one MCAP file of a bag.

    Raises:
        BagError: there is none, or more than one.
    """
    files = sorted(directory.glob("*.mcap"))
    if len(files) != 1:
        raise BagError(f"{directory} is not a bag of one file: it holds {len(files)} MCAP files")
    return files[0]


def _scan(path: Path) -> Contents:
    """Read whole records until the file breaks off."""
    contents = Contents()
    with path.open("rb") as stream:
        try:
            start = len(MAGIC)
            for record in StreamReader(stream, emit_chunks=True).records:
                if isinstance(record, Chunk):
                    _take_chunk(contents, record, start, stream.tell())
                elif isinstance(record, MessageIndex):
                    _take_index(contents, record, start, stream.tell())
                elif not isinstance(record, Header):
                    break  # the data section is over
                start = stream.tell()
                if not contents.unindexed:
                    contents.end = start
        except (McapError, struct.error, ValueError):
            pass  # here it breaks off
    if contents.unindexed:
        contents.counts -= contents.chunk_counts
        contents.chunks.pop()
    if not contents.end:
        raise BagError(f"{path} holds nothing readable: not even the beginning of an MCAP file")
    return contents


def _take_chunk(contents: Contents, chunk: Chunk, start: int, end: int) -> None:
    contents.chunk_counts.clear()
    data, size = get_chunk_data_stream(chunk, validate_crc=True)
    while data.count < size:
        opcode, length = data.read1(), data.read8()
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(data)
            contents.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(data)
            contents.channels[channel.id] = channel
        else:
            data.read(length)
            contents.unindexed += opcode == Opcode.MESSAGE
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


def _take_index(contents: Contents, index: MessageIndex, start: int, end: int) -> None:
    chunk = contents.chunks[-1]
    chunk.message_index_offsets[index.channel_id] = start
    chunk.message_index_length += end - start
    contents.chunk_counts[index.channel_id] += len(index.records)
    contents.counts[index.channel_id] += len(index.records)
    contents.unindexed -= len(index.records)


def _ending(contents: Contents) -> bytes:
    """End of data, summary and footer, as the writer would have put them."""
    data_end, summary, footer = RecordBuilder(), RecordBuilder(), RecordBuilder()
    DataEnd(data_section_crc=0).write(data_end)
    statistics = Statistics(
        attachment_count=0,
        channel_count=len(contents.channels),
        channel_message_counts=dict(contents.counts),
        chunk_count=len(contents.chunks),
        message_count=contents.counts.total(),
        message_end_time=contents.end_time,
        message_start_time=contents.start_time,
        metadata_count=0,
        schema_count=len(contents.schemas),
    )
    for record in (*contents.schemas.values(), *contents.channels.values(), statistics, *contents.chunks):
        record.write(summary)
    data_end_bytes = data_end.end()
    Footer(summary_start=contents.end + len(data_end_bytes), summary_offset_start=0, summary_crc=0).write(footer)
    return b"".join((data_end_bytes, summary.end(), footer.end(), MAGIC))


def _topic(contents: Contents, channel: Channel) -> Topic:
    schema = contents.schemas[channel.schema_id]
    qos = yaml.safe_load(channel.metadata["offered_qos_profiles"])
    topic = Topic(channel.topic, schema.name, schema.data.decode(), channel.metadata["topic_type_hash"], qos)
    topic.count = contents.counts[channel.id]
    return topic
