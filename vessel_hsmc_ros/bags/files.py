"""The files of a bag, in order, whether it is complete or not."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from mcap.opcode import Opcode

from vessel_hsmc_ros.bags.mcap_scan import RECORD_HEADER, Contents, chunk_bytes, records
from vessel_hsmc_ros.bags.writer import METADATA, VERSION
from vessel_hsmc_ros.core.exceptions import BagError

BLOCK = 1 << 22
"""Bytes of records that are handed out together: many messages of each topic, and little memory."""

_NUMBERED = re.compile(r"_(\d+)\.mcap$")


def bag_files(path: Path, strict: bool = True) -> list[Path]:
    """The MCAP files of a bag: a folder with or without its metadata.yaml, or one file.

    A file that was only begun when the recorder was killed, one among others, is not counted.

    Args:
        path: The folder or file.
        strict: Whether its metadata.yaml must be readable.

    Raises:
        BagError: there are none, or the bag is one that this package does not read.
    """
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise BagError(f"bag {path} does not exist")
    information(path, strict)
    files = sorted(path.glob("*.mcap"), key=_number)
    if not files:
        raise BagError(f"{path} is not a bag: it holds no MCAP file")
    return [file for file in files if file.stat().st_size] or files[:1]


def information(directory: Path, strict: bool = True) -> dict[str, Any]:
    """What a bag's metadata.yaml says; nothing where it is missing, or is no such thing and need not be.

    Raises:
        BagError: it cannot be read, is newer than this package or speaks of another storage than MCAP.
    """
    path = directory / METADATA
    if not path.is_file():
        return {}
    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
        told = document["rosbag2_bagfile_information"]
        version, storage = int(told["version"]), str(told["storage_identifier"])
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        if not strict:
            return {}
        raise BagError(f"{path} cannot be read as a bag's metadata: {_line(error)}") from None
    if version > VERSION:
        raise BagError(f"{path} has version {version}, which is newer than {VERSION}, the last that this package reads")
    if storage != "mcap":
        raise BagError(f"bag {directory} is stored as {storage}: only mcap is read; `ros2 bag convert` makes it one")
    result: dict[str, Any] = told
    return result


def record_blocks(contents: Contents) -> Iterator[bytes]:
    """The records of a file's messages, many chunks at a time.

    Raises:
        BagError: a chunk is damaged.
    """
    block: list[bytes] = []
    size = 0
    for data in _pieces(contents):
        block.append(data)
        size += len(data)
        if size > BLOCK:
            yield b"".join(block)
            block, size = [], 0
    yield b"".join(block)


def _pieces(contents: Contents) -> Iterator[bytes]:
    with contents.path.open("rb") as stream:
        for index in contents.chunks:
            yield chunk_bytes(contents.path, stream, index)
    if contents.loose:
        for opcode, _, data in records(contents.path):
            if opcode == Opcode.MESSAGE:
                yield RECORD_HEADER.pack(opcode, len(data)) + data


def _number(path: Path) -> tuple[int, str]:
    found = _NUMBERED.search(path.name)
    return int(found[1]) if found else 0, path.name


def _line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__} {error}".split())
