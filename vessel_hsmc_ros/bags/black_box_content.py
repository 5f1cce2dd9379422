"""The content of a black box on its way to the process that writes it: a line of JSON, followed by records.

Apart from the writer, whose libraries a node need not load.
"""

import json
import struct
from collections.abc import Iterator, Mapping, Sequence

WRITER = "vessel_hsmc_ros.bags.black_box"
"""The module that writes it."""

_RECORD = struct.Struct("<qHI")


def header(folders: Sequence[str], notes: Mapping[str, str], topics: Mapping[str, str], parameters: str) -> bytes:
    """The first line of the content.

    `folders`: where the bag may be written, in the order of preference; the others are for a disk that is full. `notes`: facts
    about the recording by name. `topics`: message types by topic, in the order of the topics' numbers. `parameters`: parameters
    of the node, as a ROS parameters file.
    """
    content = {"folders": list(folders), "notes": dict(notes), "topics": list(topics.items()), "parameters": parameters}
    return json.dumps(content).encode() + b"\n"


def record(time: int, topic: int, data: bytes) -> bytes:
    """A message in the content."""
    return _RECORD.pack(time, topic, len(data)) + data


def records(content: bytes) -> Iterator[tuple[int, int, bytes]]:
    """The messages in a content without its first line: time, number of the topic, data.

    One that is cut off at the end, because the node was killed while it passed the content on, is left out.
    """
    begin = _RECORD.size
    while begin <= len(content):
        time, topic, length = _RECORD.unpack_from(content, begin - _RECORD.size)
        if begin + length > len(content):
            return
        yield time, topic, content[begin : begin + length]
        begin += length + _RECORD.size
