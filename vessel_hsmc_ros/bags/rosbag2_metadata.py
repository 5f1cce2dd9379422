"""A bag's metadata.yaml and the QoS profiles in it, in the form that rosbag2 of ROS 2 Jazzy writes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from mcap.records import Channel

from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.scenario.parameters_file import read_text, read_yaml

METADATA = "metadata.yaml"
VERSION = 9  # version of metadata.yaml in Jazzy
_INFINITE = (9223372036, 854775807)
"""An infinite duration in seconds and nanoseconds: the largest 64-bit number of nanoseconds, as rmw writes it."""
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


@dataclass
class Topic:
    """A recorded topic."""

    name: str
    kind: str  # its message type, such as `nav_msgs/msg/Odometry`
    definition: str  # the type's text in the form ros2msg with all types that it uses
    type_hash: str  # RIHS01 hash of the type
    qos: list[dict[str, Any]]  # the profiles that its publishers offered, as `qos_entry` gives them
    encoding: str = "cdr"
    count: int = field(default=0, init=False)  # number of messages so far
    channel: int = field(default=0, init=False)  # id of its channel in the current file


class FileEntry(NamedTuple):
    """One file of a bag: name, first and last log time [ns], messages."""

    name: str
    start: int | None
    end: int
    messages: int


def write_metadata(directory: Path, information: Mapping[str, Any]) -> None:
    """Replace a bag's metadata.yaml in one step: a concurrent reader finds the complete old or the complete new text."""
    # Renaming within a folder is atomic; writing is not.
    new = directory / f".{METADATA}"
    new.write_text(yaml_text({"rosbag2_bagfile_information": dict(information)}), encoding="utf-8")
    new.replace(directory / METADATA)


def metadata(topics: Sequence[Topic], files: Sequence[FileEntry], notes: Mapping[str, str]) -> dict[str, Any]:
    """The content of metadata.yaml below its top key.

    `notes`: further texts by name, its `custom_data`.
    """
    starts = [file.start for file in files if file.start is not None]
    start, end = min(starts, default=0), max(file.end for file in files)
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        **_span(start, end),
        "message_count": sum(file.messages for file in files),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.kind,
                    "serialization_format": topic.encoding,
                    "offered_qos_profiles": topic.qos,
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.count,
            }
            for topic in topics
        ],
        # Of rosbag2's own compression; that of MCAP chunks is not declared here.
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.name for file in files],
        "files": [{"path": f.name, **_span(f.start or 0, f.end), "message_count": f.messages} for f in files],
        "custom_data": dict(notes),
        "ros_distro": "jazzy",
    }


def qos_entry(reliable: bool, transient_local: bool, **others: Any) -> dict[str, Any]:
    """A QoS profile as rosbag2 writes it; discovery transmits neither history nor depth.

    `reliable`: reliability: reliable, or best effort. `transient_local`: durability: transient local, or volatile. `others`:
    `deadline`, `lifespan` and `liveliness_lease_duration` as seconds and nanoseconds, infinite if not given; `liveliness`,
    automatic if not given.
    """
    times = {}
    for name in ("deadline", "lifespan", "liveliness_lease_duration"):
        sec, nsec = others.get(name, _INFINITE)
        times[name] = {"sec": sec, "nsec": nsec}
    # rosbag2 reads only profiles with all nine keys, in lower-case words.
    return {
        "history": "unknown",
        "depth": 0,
        "reliability": "reliable" if reliable else "best_effort",
        "durability": "transient_local" if transient_local else "volatile",
        "deadline": times["deadline"],
        "lifespan": times["lifespan"],
        "liveliness": others.get("liveliness", "automatic"),
        "liveliness_lease_duration": times["liveliness_lease_duration"],
        "avoid_ros_namespace_conventions": False,
    }


def yaml_text(document: Any) -> str:
    """YAML with the keys in their given order."""
    text: str = yaml.dump(document, Dumper=_DUMPER, sort_keys=False)
    return text


def _span(start: int, end: int) -> dict[str, Any]:
    duration = max(0, end - start)
    return {"starting_time": {"nanoseconds_since_epoch": start}, "duration": {"nanoseconds": duration}}


def bag_information(directory: Path, strict: bool = True) -> dict[str, Any]:
    """The content of a bag's metadata.yaml; empty where there is none.

    `strict`: whether a metadata.yaml that cannot be parsed is an error; else it counts as missing.
    """
    path = directory / METADATA
    if not path.is_file():
        return {}
    try:
        document = read_yaml(read_text(path))
        information: dict[str, Any] = document["rosbag2_bagfile_information"]
        version, storage = int(information["version"]), str(information["storage_identifier"] or "")
        dict(information.get("custom_data") or {})
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        if not strict:
            return {}
        reason = " ".join(f"{type(error).__name__} {error}".split())
        raise BagError(f"{path} cannot be read as a bag's metadata: {reason}") from None
    if version > VERSION:
        raise BagError(f"{path} has version {version}, which is newer than {VERSION}, the last that this package reads")
    if storage not in ("mcap", ""):  # rosbag2 leaves it empty when it indexes MCAP files anew
        raise BagError(f"bag {directory} is stored as {storage}: only mcap is read; `ros2 bag convert` makes it one")
    return information


def offered_qos(channel: Channel) -> list[dict[str, Any]]:
    """The QoS profiles of a channel's publishers; none where they cannot be read."""
    try:
        found = read_yaml(channel.metadata.get("offered_qos_profiles", ""))
    except yaml.YAMLError:
        return []
    return [dict(each) for each in found if isinstance(each, dict)] if isinstance(found, list) else []
