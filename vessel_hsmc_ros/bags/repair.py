"""Repair of a bag whose recorder was killed: removes incomplete records, and restores index and metadata."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from mcap.data_stream import RecordBuilder

from vessel_hsmc_ros.bags.files import bag_files
from vessel_hsmc_ros.bags.mcap_contents import FIRST_PRIVATE, RECORD_HEADER, Contents, read_contents, scan
from vessel_hsmc_ros.bags.mcap_writer import ending_of, is_being_written
from vessel_hsmc_ros.bags.rosbag2_metadata import bag_information, metadata, write_metadata
from vessel_hsmc_ros.bags.writer import RECORDING
from vessel_hsmc_ros.core.exceptions import BagError


@dataclass(frozen=True)
class Repair:
    """The result of a repair."""

    messages: int  # number of readable messages
    files: int  # number of files that were completed
    cut: int  # bytes cut off at the ends of files, which did not make a complete record
    damaged: int  # chunks and other records disabled, because their bytes are damaged
    described: bool  # whether metadata.yaml was rewritten


def is_complete(directory: Path) -> bool:
    """Whether the bag's files were closed and metadata.yaml lists all their messages."""
    files = bag_files(directory, strict=False)
    found = [read_contents(file) for file in files.present]
    return all(c.complete for c in found) and _metadata_matches(directory, found)


def repair(directory: Path) -> Repair:
    """Restore the missing index and metadata of a bag in place; complete and undamaged files are not changed."""
    files, missing, _ = bag_files(directory, strict=False)
    for file in files:
        if is_being_written(file):
            raise BagError(f"{file} is being recorded: end the recorder before the repair")
    summaries = [read_contents(file) for file in files]
    found = [scan(file, each if each.complete else None) for file, each in zip(files, summaries, strict=True)]
    repaired = cut = 0
    for file, summarised, contents in zip(files, summaries, found, strict=True):
        _restore_channels(contents, summarised, *(other for other in found if _is_own(contents) and _is_own(other)))
        # A summary alone does not show damage, and may be older than the data.
        if contents.damaged or not (summarised.complete and summarised.counts == contents.counts):
            cut += max(0, file.stat().st_size - contents.end) if not summarised.complete else 0
            _complete(contents)
            repaired += 1
    damaged = sum(len(contents.damaged) for contents in found)
    undescribed = repaired > 0 or not _metadata_matches(directory, found)
    if undescribed:
        _write_metadata(directory, found, missing)
    return Repair(sum(c.counts.total() for c in found), repaired, cut, damaged, undescribed)


def _is_own(contents: Contents) -> bool:
    """Whether a file is of this package, which gives a topic the same number in every file of a bag."""
    return any(record.name == RECORDING for _, _, record in contents.metadata)


def _restore_channels(contents: Contents, *others: Contents) -> None:
    """Take channels and schemas that only damaged chunks had, as the first one of a file, from a summary or another file."""
    for other in others:
        for number in (contents.counts.keys() - contents.channels.keys()) & other.channels.keys():
            channel = contents.channels[number] = other.channels[number]
            if channel.schema_id in other.schemas:
                contents.schemas.setdefault(channel.schema_id, other.schemas[channel.schema_id])


def _metadata_matches(directory: Path, found: Sequence[Contents]) -> bool:
    listed = bag_information(directory, strict=False).get("files")
    entries = [each for each in listed if isinstance(each, dict)] if isinstance(listed, list) else []
    return [(e.get("path"), e.get("message_count")) for e in entries] == [(c.path.name, c.counts.total()) for c in found]


def _complete(contents: Contents) -> None:
    """Turn what is damaged into records that readers skip, cut off an incomplete record, write index, summary and footer."""
    if contents.loose:
        raise BagError(f"{contents.path} has messages outside of chunks: `ros2 bag convert` can index it")
    try:
        with contents.path.open("r+b") as stream:
            for offset, length in contents.damaged:
                stream.seek(offset)
                stream.write(RECORD_HEADER.pack(FIRST_PRIVATE, length - RECORD_HEADER.size))
            stream.truncate(contents.end)
            stream.seek(contents.end)
            stream.write(_ending(contents))
    except OSError as error:
        raise BagError(f"{contents.path} cannot be repaired: {error.strerror}") from None


def _write_metadata(directory: Path, files: Sequence[Contents], missing: Sequence[str]) -> None:
    """Write metadata.yaml anew, with the facts about the recording that the files and the former one have."""
    before = bag_information(directory, strict=False)
    notes: dict[str, str] = {}
    for _, _, record in chain.from_iterable(contents.metadata for contents in files):
        if record.name == RECORDING:
            notes |= record.metadata
    # The notes in a file are those of its beginning or its end; metadata.yaml is brought up to date in between.
    notes |= before.get("custom_data") or {}
    notes |= {"missing_files": ", ".join(missing)} if missing else {}
    # How rosbag2 compressed each message is written nowhere else.
    kept = {key: before[key] for key in ("compression_format", "compression_mode") if key in before}
    write_metadata(directory, metadata(files, notes | {"recovered": "true"}) | kept)


def _ending(contents: Contents) -> bytes:
    """The missing message indexes of the last chunk and the end of the file, as the writer would have written them."""
    index = RecordBuilder()
    for channel, entry in contents.unindexed.items():
        contents.chunks[-1].message_index_offsets[channel] = contents.end + index.count
        entry.write(index)
    if contents.unindexed:
        contents.chunks[-1].message_index_length += index.count
    missing: bytes = index.end()
    contents.end += len(missing)
    return missing + ending_of(contents)
