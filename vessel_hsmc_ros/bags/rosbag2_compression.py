"""Bags that rosbag2 compressed itself: file by file (`bag_0.mcap.zstd`), or message by message.

It is independent of the compression of chunks within MCAP files, which metadata.yaml does not declare.
"""

import shutil
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import zstandard
from mcap.opcode import Opcode

from vessel_hsmc_ros.bags.mcap_layout import LARGEST_CHUNK, MESSAGE_FIELDS, MESSAGE_HEADER, chunk_records
from vessel_hsmc_ros.core.exceptions import BagError

SUFFIX = ".zstd"
"""Suffix of the files of a bag that is compressed file by file."""

LARGEST_MESSAGE = LARGEST_CHUNK
"""A compressed message that claims more bytes than this is taken for damage, and its memory is not allocated."""

LARGEST_FACTOR = 1000
"""A file that decompresses to more than this many times its size is refused: recordings compress to a third or a tenth."""

_BLOCK = 1 << 22
_FRAME_HEADER = 18
"""Bytes of the longest header of a zstd frame."""


def messages_are_compressed(bag: Path, information: Mapping[str, Any]) -> bool:
    """Whether each message of a bag is compressed on its own.

    Args:
        bag: The bag, for error messages.
        information: Its metadata.yaml.

    Raises:
        BagError: the bag is compressed in a format or mode that this package does not read.
    """
    kind = str(information.get("compression_format") or "")
    mode = str(information.get("compression_mode") or "").upper()
    if mode in ("", "NONE") and not kind:
        return False
    if not kind:
        raise BagError(f"bag {bag} has the compression mode {mode}, but no compression format: only zstd is read")
    if kind != "zstd":
        raise BagError(f"bag {bag} is compressed as {kind}: only zstd is read; `ros2 bag convert` can rewrite it")
    if mode not in ("FILE", "MESSAGE"):
        raise BagError(f"bag {bag} has the compression mode {mode or 'none'}: only FILE and MESSAGE are read")
    return mode == "MESSAGE"


def decompress_file(path: Path, folder: Path) -> Path:
    """Decompress one `.mcap.zstd` file block by block into a folder; returns the MCAP file.

    A truncated file is decompressed up to where it breaks off.

    Raises:
        BagError: the file is damaged, or the folder's disk has no room for it.
    """
    target = folder / path.name.removesuffix(SUFFIX)
    try:
        with path.open("rb") as source, target.open("wb") as sink:
            _require_room(path, source.read(_FRAME_HEADER), folder)
            source.seek(0)
            # A frame that was cut off ends without an error: its MCAP file is then read as one that was cut off.
            with zstandard.ZstdDecompressor().stream_reader(source, closefd=False, read_across_frames=True) as stream:
                limit, written = LARGEST_FACTOR * path.stat().st_size + _BLOCK, 0
                while block := stream.read(_BLOCK):
                    if written > limit:
                        raise BagError(f"{path} is refused: it decompresses to more than {LARGEST_FACTOR} times its size")
                    written += sink.write(block)
    except zstandard.ZstdError:
        raise BagError(f"{path} is damaged: it cannot be decompressed as zstd") from None
    except OSError as error:
        raise BagError(f"{path} cannot be decompressed into {folder}: {error.strerror}") from None
    return target


def decompress_messages(path: Path, records: bytes) -> bytes:
    """The Message records of a chunk with their data decompressed.

    Args:
        path: The file, for error messages.
        records: The chunk's uncompressed bytes.

    Raises:
        BagError: a message is damaged.
    """
    decompressor = zstandard.ZstdDecompressor()
    parts: list[bytes] = []
    size = 0
    for opcode, start, end in _records(path, records):
        if opcode != Opcode.MESSAGE:  # schemas and channels are known from the scan or the summary
            continue
        _, _, *fields = MESSAGE_HEADER.unpack_from(records, start)
        data = _decompressed(path, decompressor, records[start + MESSAGE_HEADER.size : end])
        parts += [MESSAGE_HEADER.pack(opcode, MESSAGE_FIELDS + len(data), *fields), data]
        size += len(data)
        if size > LARGEST_CHUNK:
            raise BagError(f"{path} is refused: the messages of a chunk decompress to more than {LARGEST_CHUNK >> 20} MiB")
    return b"".join(parts)


def _records(path: Path, records: bytes) -> Iterator[tuple[int, int, int]]:
    try:
        yield from chunk_records(records)
    except struct.error:
        raise BagError(f"{path} is damaged: a record of a chunk is cut off") from None


def _decompressed(path: Path, decompressor: zstandard.ZstdDecompressor, data: bytes) -> bytes:
    try:
        if zstandard.frame_content_size(data) > LARGEST_MESSAGE:
            raise BagError(f"{path} is damaged: a compressed message claims more than {LARGEST_MESSAGE >> 20} MiB")
        # The limit takes effect if the frame does not declare its size.
        return decompressor.decompress(data, max_output_size=LARGEST_MESSAGE)
    except zstandard.ZstdError as error:
        raise BagError(f"{path} is damaged: a compressed message cannot be decompressed ({error})") from None


def _require_room(path: Path, head: bytes, folder: Path) -> None:
    """Raise a BagError before anything is written, if the frame's header declares a size that exceeds the free space."""
    needed, free = zstandard.frame_content_size(head), shutil.disk_usage(folder).free
    if needed > free:
        sizes = f"{path} takes {needed >> 20} MiB decompressed, but {folder} has {free >> 20} MiB free"
        raise BagError(f"{sizes}: set TMPDIR to a folder on a larger disk")
