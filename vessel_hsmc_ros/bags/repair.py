"""Completing a bag whose recorder was killed: what was broken off is cut away, index and metadata are written anew."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml
from mcap.data_stream import RecordBuilder

from vessel_hsmc_ros.bags.files import bag_files, information
from vessel_hsmc_ros.bags.mcap_scan import PRIVATE, Contents, read_contents, scan
from vessel_hsmc_ros.bags.mcap_writer import ending_of
from vessel_hsmc_ros.bags.writer import RECORDING, FileFacts, Topic, metadata, write_metadata
from vessel_hsmc_ros.core.exceptions import BagError


@dataclass(frozen=True)
class Repair:
    """What became of a bag.

    Attributes:
        messages: Those that are readable now.
        files: How many files were completed.
        cut: Bytes at the ends of files that hold nothing whole.
        damaged: Chunks left out, because their bytes are not those that were written.
        described: Whether metadata.yaml had to be written.
    """

    messages: int
    files: int
    cut: int
    damaged: int
    described: bool


def is_complete(directory: Path) -> bool:
    """Whether the bag's files have their indexes and its metadata speaks of all their messages.

    Raises:
        BagError: the folder holds no bag.
    """
    found = [read_contents(file) for file in bag_files(directory, strict=False)]
    return all(c.complete for c in found) and _described(directory, found)


def repair(directory: Path) -> Repair:
    """Give a bag that was cut off its index and metadata, in place; what is complete and undamaged is left as it is.

    Raises:
        BagError: the folder holds no bag, or a file of it has not even a beginning.
    """
    files = bag_files(directory, strict=False)
    found, repaired, cut, damaged = [], 0, 0, 0
    for file in files:
        told, contents = read_contents(file), scan(file)
        if contents.damaged or not (told.complete and told.counts == contents.counts):
            cut += max(0, file.stat().st_size - contents.end) if not told.complete else 0
            _complete(contents)
            repaired += 1
        found.append(contents)
        damaged += len(contents.damaged)
    undescribed = repaired > 0 or not _described(directory, found)
    if undescribed:
        _write_metadata(directory, found)
    return Repair(sum(c.counts.total() for c in found), repaired, cut, damaged, undescribed)


def _described(directory: Path, found: Sequence[Contents]) -> bool:
    listed = information(directory, strict=False).get("files", [])
    return [(e.get("path"), e.get("message_count")) for e in listed] == [(c.path.name, c.counts.total()) for c in found]


def _complete(contents: Contents) -> None:
    """Turn damaged chunks into records that every reader skips, cut off what makes no sense, write the end."""
    if contents.loose:
        raise BagError(f"{contents.path} has messages outside of chunks: `ros2 bag convert` can index it")
    try:
        with contents.path.open("r+b") as stream:
            for place in contents.damaged:
                stream.seek(place)
                stream.write(bytes([PRIVATE]))
            stream.truncate(contents.end)
            stream.seek(contents.end)
            stream.write(_ending(contents))
    except OSError as error:
        raise BagError(f"{contents.path} cannot be repaired: {error.strerror}") from None


def _write_metadata(directory: Path, files: Sequence[Contents]) -> None:
    """Topics in the order of their first appearance, counts over all files."""
    topics: dict[str, Topic] = {}
    facts = []
    noted = dict(information(directory, strict=False).get("custom_data") or {})
    for contents in files:
        for channel in contents.channels.values():
            schema = contents.schemas[channel.schema_id]
            qos = yaml.safe_load(channel.metadata.get("offered_qos_profiles", "[]"))
            hashed = channel.metadata.get("topic_type_hash", "")
            topic = topics.setdefault(channel.topic, Topic(channel.topic, schema.name, schema.data.decode(), hashed, qos))
            topic.count += contents.counts[channel.id]
        facts.append(FileFacts(contents.path.name, contents.start_time, contents.end_time, contents.counts.total()))
        noted |= {k: v for _, _, record in contents.metadata if record.name == RECORDING for k, v in record.metadata.items()}
    write_metadata(directory, metadata(list(topics.values()), facts, noted | {"recovered": "true"}))


def _ending(contents: Contents) -> bytes:
    """What the last chunk lacks of its index, and the end of the file, as the writer would have put them."""
    index = RecordBuilder()
    for number, entry in contents.unindexed.items():
        contents.chunks[-1].message_index_offsets[number] = contents.end + index.count
        entry.write(index)
    if contents.unindexed:
        contents.chunks[-1].message_index_length += index.count
    missing: bytes = index.end()
    contents.end += len(missing)
    return missing + ending_of(contents)
