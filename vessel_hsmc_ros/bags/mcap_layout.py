"""The byte layout of MCAP records, as far as this package reads and writes records without the `mcap` library's classes.

A record is an opcode, the length of its content and the content, little-endian and without padding (https://mcap.dev/spec).
Every number that depends on this layout is defined here.
"""

import struct
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"  # first and last bytes of a complete file
RECORD_HEADER = struct.Struct("<BQ")  # opcode and length of the content; at the start of every record
MESSAGE_HEADER = struct.Struct("<BQHIQQ")
"""Of a Message record, all before the serialised message: record header, channel, sequence, log time, publish time."""

MESSAGE_FIELDS = MESSAGE_HEADER.size - RECORD_HEADER.size  # bytes of a Message record's content before the serialised message
MESSAGE_HEADER_TYPE = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<i8"), ("publish_time", "<i8")]
)
"""MESSAGE_HEADER as a NumPy type, to read the headers of many messages at once."""

MESSAGE_INDEX_HEADER = struct.Struct("<BQHI")
"""Of a MessageIndex record, all before the entries: record header, channel, bytes of the entries."""

INDEX_ENTRY_SIZE = 16  # bytes of an entry of a MessageIndex: log time and offset of a message within its chunk
FOOTER = struct.Struct("<BQQQI")
"""The Footer record: record header, start of the summary, start of the summary offsets, checksum."""

CHECKSUM_SIZE = 4  # bytes of a checksum, the last field of DataEnd and Footer
DATA_END = RECORD_HEADER.pack(Opcode.DATA_END, CHECKSUM_SIZE) + bytes(CHECKSUM_SIZE)
"""The DataEnd record without a checksum; directly before the footer in a file that was not closed."""

LONGEST_RECORD = 1 << 28  # a record header with a greater length is taken for damage
LARGEST_CHUNK = 1 << 27  # uncompressed bytes of the largest chunk that is read; writers make chunks of some megabytes at most
FIRST_PRIVATE = 0x80
"""The first of the opcodes that the specification leaves to applications; readers skip records with such an opcode."""

_NOT_DATA = (0, Opcode.DATA_END, Opcode.FOOTER)


def file_records(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Opcode, offset and content of the complete records in a file's data section, up to where it ends or breaks off."""
    with path.open("rb") as stream:
        size, start = path.stat().st_size, stream.seek(len(MAGIC))
        while len(header := stream.read(RECORD_HEADER.size)) == RECORD_HEADER.size:
            opcode, length = RECORD_HEADER.unpack(header)
            # An opcode that is neither specified nor private comes from damaged bytes, whose length means nothing either.
            if opcode in _NOT_DATA or Opcode.DATA_END < opcode < FIRST_PRIVATE or length > LONGEST_RECORD:
                return
            if start + RECORD_HEADER.size + length > size:  # before the memory for it is allocated
                return
            content = stream.read(length)
            yield opcode, start, content
            start += RECORD_HEADER.size + length


def chunk_records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Opcode, offset and end of the records in a chunk's uncompressed bytes."""
    position = 0
    while position < len(data):
        opcode, length = RECORD_HEADER.unpack_from(data, position)
        end = position + RECORD_HEADER.size + length
        yield opcode, position, end
        position = end


def message_offsets(data: bytes) -> dict[int, list[int]]:
    """Offsets of the Message records in a chunk's uncompressed bytes, by channel.

    Raises ValueError if a record is shorter than its kind, or ends behind the last byte.
    """
    offsets: dict[int, list[int]] = defaultdict(list)
    unpack, header_size, position = MESSAGE_HEADER.unpack_from, RECORD_HEADER.size, 0
    padded = data + bytes(MESSAGE_HEADER.size)  # so that the header of a short last record can be unpacked as a message's
    # One unpacking for all kinds of records: this loop visits every message of a bag.
    while position < len(data):
        opcode, length, channel, _, _, _ = unpack(padded, position)
        if opcode == Opcode.MESSAGE:
            offsets[channel].append(position)
            if length < MESSAGE_FIELDS:
                raise ValueError("a message is shorter than its header")
        position += header_size + length
    if position != len(data):
        raise ValueError("cut off")
    return offsets
