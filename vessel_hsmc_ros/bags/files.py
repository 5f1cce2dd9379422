"""The files of a bag in order, complete or not, and the messages in them, also compressed by rosbag2.

rosbag2 compresses file by file (`bag_0.mcap.zstd`), or message by message. That is independent of the compression of
chunks within MCAP files, which metadata.yaml does not declare.
"""

import heapq
import re
import shutil
import tempfile
import warnings
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import zstandard
from mcap.opcode import Opcode

from vessel_hsmc_ros.bags.mcap_contents import (
    MESSAGE_FIELDS,
    MESSAGE_HEADER,
    RECORD_HEADER,
    Contents,
    chunk_bytes,
    chunk_records,
    file_records,
    read_contents,
)
from vessel_hsmc_ros.bags.rosbag2_metadata import METADATA, bag_information
from vessel_hsmc_ros.core.exceptions import BagError, BagWarning, NoBagError
from vessel_hsmc_ros.scenario.run_folder import RunFolder

SUFFIX = ".zstd"  # suffix of the files of a bag that is compressed file by file


def messages_are_compressed(bag: Path, information: Mapping[str, Any]) -> bool:
    """Whether each message of a bag is compressed on its own."""
    kind = str(information.get("compression_format") or "")
    mode = str(information.get("compression_mode") or "").upper()
    if mode in ("", "NONE") and not kind:
        return False
    if kind != "zstd" or mode not in ("FILE", "MESSAGE"):
        given = f"format {kind or 'none'}, mode {mode or 'none'}"
        raise BagError(f"bag {bag} must be compressed as zstd by FILE or MESSAGE (got {given}): `ros2 bag convert` rewrites it")
    return mode == "MESSAGE"


def decompress_file(path: Path, folder: Path) -> Path:
    """Decompress one `.mcap.zstd` file block by block into a folder; returns the MCAP file.

    A truncated file is decompressed up to where it breaks off.
    """
    target = folder / path.name.removesuffix(SUFFIX)
    try:
        # A frame that was cut off ends without an error: its MCAP file is then read as one that was cut off.
        with path.open("rb") as source, target.open("wb") as sink:
            shutil.copyfileobj(zstandard.ZstdDecompressor().stream_reader(source, read_across_frames=True), sink)
    except zstandard.ZstdError:
        raise BagError(f"{path} is damaged: it cannot be decompressed as zstd") from None
    except OSError as error:
        raise BagError(f"{path} cannot be decompressed into {folder}: {error.strerror}; TMPDIR chooses another disk") from None
    return target


def decompress_messages(path: Path, records: bytes) -> bytes:
    """The Message records of a chunk with their data decompressed. Raises BagError if a message is damaged."""
    decompressor = zstandard.ZstdDecompressor()
    parts: list[bytes] = []
    try:
        messages, _ = chunk_records(records)  # schemas and channels are known from the scan or the summary
        for start in heapq.merge(*messages.values()):
            opcode, length, *fields = MESSAGE_HEADER.unpack_from(records, start)
            packed = records[start + MESSAGE_HEADER.size : start + RECORD_HEADER.size + length]
            data = decompressor.decompressobj().decompress(packed)
            parts += [MESSAGE_HEADER.pack(opcode, MESSAGE_FIELDS + len(data), *fields), data]
    except ValueError as error:
        raise BagError(f"{path} is damaged: {error}") from None
    except (zstandard.ZstdError, MemoryError) as error:
        raise BagError(f"{path} is damaged: a compressed message cannot be decompressed ({error})") from None
    return b"".join(parts)


BLOCK = 1 << 22  # bytes of records that are decoded together: enough messages of each topic for NumPy to pay, little memory
MAX_LISTED_FILES = 5  # largest number of files that an error message names
_NUMBERED = re.compile(rf"_(\d+)\.mcap({SUFFIX})?$")


class RawMessage(NamedTuple):
    """A recorded message: topic, times, ns, and the serialised message, CDR with its encapsulation header."""

    topic: str
    log_time: int
    publish_time: int
    data: bytes


class BagFiles:
    """The files of an opened bag; those that rosbag2 compressed are decompressed into a temporary folder.

    Attributes:
        path: The folder or file.
        information: The content of metadata.yaml; empty for a bare file.
        contents: What each file contains, in order.
        missing: Names of further files that metadata.yaml has, and the folder has not.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        files, self.missing, _ = bag_files(path)
        self.information = bag_information(path) if path.is_dir() else {}
        self._compressed_messages = messages_are_compressed(path, self.information)
        if any(file.suffix == SUFFIX for file in files):
            self._folder = tempfile.TemporaryDirectory(prefix="vessel_hsmc_bag_")  # removed together with this object
            files = [decompress_file(f, Path(self._folder.name)) if f.suffix == SUFFIX else f for f in files]
        self.contents = [read_contents(file) for file in files]

    def blocks(self) -> Iterator[tuple[Contents, bytes]]:
        """Uncompressed records, many chunks at a time, with the file that each block comes from."""
        for contents in self.contents:
            block: list[bytes] = []
            size = 0
            for data in self._chunks(contents):
                block.append(data)
                size += len(data)
                if size > BLOCK:
                    yield contents, b"".join(block)
                    block, size = [], 0
            yield contents, b"".join(block)

    def raw_messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The messages of some topics in the recorded order."""
        for contents, block in self.blocks():
            offsets = channel_offsets(contents, block)
            chosen = [[(start, i) for start in offsets[i]] for i in offsets if contents.channels[i].topic in topics]
            # Merged by offset: within a block that is the recorded order.
            for start, channel in heapq.merge(*chosen):
                _, length, _, _, log_time, publish_time = MESSAGE_HEADER.unpack_from(block, start)
                data = block[start + MESSAGE_HEADER.size : start + RECORD_HEADER.size + length]
                yield RawMessage(contents.channels[channel].topic, log_time, publish_time, data)

    def _chunks(self, contents: Contents) -> Iterator[bytes]:
        """The uncompressed records of each chunk, and those outside of chunks."""
        try:
            with contents.path.open("rb") as stream:
                for index in contents.chunks:
                    yield self._decompressed(contents.path, chunk_bytes(contents.path, stream, index))
            for opcode, _, content in file_records(contents.path) if contents.loose else ():
                if opcode == Opcode.MESSAGE:
                    yield self._decompressed(contents.path, RECORD_HEADER.pack(opcode, len(content)) + content)
        except OSError as error:
            raise BagError(f"{contents.path} cannot be read: {error.strerror}") from None

    def _decompressed(self, path: Path, records: bytes) -> bytes:
        return decompress_messages(path, records) if self._compressed_messages else records


def channel_offsets(contents: Contents, block: bytes) -> dict[int, list[int]]:
    """Offsets of the Message records in a block of a file, by channel."""
    try:
        offsets, _ = chunk_records(block)
    except ValueError as error:
        raise BagError(f"{contents.path} is damaged: {error}") from None
    if unknown := offsets.keys() - contents.channels.keys():
        raise BagError(f"{contents.path} is damaged: it has messages of channel {min(unknown)}, but not the channel")
    return offsets


def bag_path(path: Path) -> Path:
    """The bag at a path: a bag's folder, an MCAP file, or the bag in a run folder. Raises BagError if there is neither."""
    if not path.exists():
        raise NoBagError(f"bag {path} does not exist")
    folder = RunFolder(path)
    if not path.is_dir() or (path / METADATA).is_file() or _visible(path, ".mcap*"):
        return path
    if folder.bag.is_dir():
        return folder.bag
    if folder.summary.is_file():
        raise BagError(f"run folder {path} has no bag: the run was made with --no-bag, or failed before its start")
    if runs := sorted(found.parent for found in path.glob("*/bag")):
        raise BagError(f"{path} is not a bag: it holds {len(runs)} run folder(s), choose one, such as {runs[-1]}")
    names = ", ".join(sorted(found.name for found in path.iterdir())[:MAX_LISTED_FILES]) or "nothing"
    raise BagError(f"{path} is not a bag: it holds no MCAP file, but {names}")


class FoundFiles(NamedTuple):
    """The files of a bag in order, the names of those that are missing, and those in its folder that are not of the bag."""

    present: list[Path]
    missing: tuple[str, ...] = ()
    strays: tuple[str, ...] = ()

    @property
    def difference(self) -> str:
        """How the folder and its metadata.yaml differ; empty if they do not."""
        verb = "is" if len(self.missing) == 1 else "are"
        parts = [f"metadata.yaml names {', '.join(self.missing)}, which {verb} missing"] if self.missing else []
        left_out = "left out (without metadata.yaml all files count)"
        parts += [f"metadata.yaml does not name {', '.join(self.strays)}: {left_out}"] if self.strays else []
        return "; ".join(parts)


def bag_files(path: Path, strict: bool = True) -> FoundFiles:
    """The MCAP files of a bag: those that its metadata.yaml names, without one all in its folder; or a single file.

    Hidden files are none of a bag: macOS leaves such on foreign disks. An empty file among others is left out: its recorder
    was killed when it had only begun the file. A BagWarning names the differences between folder and metadata.yaml. `strict`:
    whether its metadata.yaml must be readable.
    """
    if path.is_file():
        return FoundFiles([path])
    if not path.is_dir():
        raise NoBagError(f"bag {path} does not exist")
    found = _found(path, _named(bag_information(path, strict)))
    if not found.present:
        if found.strays:
            raise BagError(f"bag {path}: {found.difference}")
        raise BagError(f"{path} is not a bag: it holds no MCAP file")
    if found.difference:
        warnings.warn(f"bag {path}: {found.difference}", BagWarning, stacklevel=2)
    return found._replace(present=[file for file in found.present if file.stat().st_size] or found.present[:1])


def _found(path: Path, named: list[str]) -> FoundFiles:
    """The files in a folder by the names in its metadata.yaml, if there are any."""
    plain = [file for file in _visible(path, ".mcap") if file.is_file()]  # a pipe would be waited for
    # rosbag2 decompresses a file beside itself when it plays it: both are the same file of the bag.
    packed = [file for file in _visible(path, f".mcap{SUFFIX}") if file.is_file() and file.with_suffix("") not in plain]
    there = {file.name.removesuffix(SUFFIX): file for file in sorted(plain + packed, key=_number)}
    if not named:
        stems = {_NUMBERED.sub("", file.name): file for file in reversed(there.values())}
        if len(stems) > 1:
            raise BagError(
                f"{path} holds files of {len(stems)} bags, and no metadata.yaml: choose one, such as {min(stems.values())}"
            )
        return FoundFiles([*there.values()])
    names = list(dict.fromkeys(name.removesuffix(SUFFIX) for name in named))
    chosen = [there[name] for name in names if name in there]
    missing = tuple(name for name in names if name not in there)
    return FoundFiles(chosen, missing, tuple(file.name for name, file in there.items() if name not in names))


def _named(information: Mapping[str, Any]) -> list[str]:
    """The names of files in a metadata.yaml: former versions of rosbag2 wrote them with the folder."""
    listed = information.get("relative_file_paths")
    return [Path(each).name for each in listed if isinstance(each, str)] if isinstance(listed, list) else []


def _visible(folder: Path, suffix: str) -> list[Path]:
    return [file for file in folder.glob(f"*{suffix}") if not file.name.startswith(".")]


def _number(path: Path) -> tuple[int, str]:
    # By number, because _10 comes after _9.
    found = _NUMBERED.search(path.name)
    return int(found[1]) if found else 0, path.name
