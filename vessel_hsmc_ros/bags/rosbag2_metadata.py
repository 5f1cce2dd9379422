"""A bag's metadata.yaml and the QoS profiles in it, in the form that rosbag2 of ROS 2 Jazzy writes."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from mcap.records import Channel

from vessel_hsmc_ros.bags.mcap_contents import Contents
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.scenario.parameters_file import read_text, read_yaml, yaml_text

METADATA = "metadata.yaml"
VERSION = 9  # version of metadata.yaml in Jazzy
_INFINITE = (9223372036, 854775807)
"""An infinite duration in seconds and nanoseconds: the largest 64-bit number of nanoseconds, as rmw writes it."""


def write_metadata(directory: Path, information: Mapping[str, Any]) -> None:
    """Replace a bag's metadata.yaml in one step: a concurrent reader finds the complete old or the complete new text."""
    # Renaming within a folder is atomic; writing is not.
    new = directory / f".{METADATA}"
    new.write_text(yaml_text({"rosbag2_bagfile_information": dict(information)}), encoding="utf-8")
    new.replace(directory / METADATA)


def metadata(files: Sequence[Contents], notes: Mapping[str, str]) -> dict[str, Any]:
    """The content of metadata.yaml below its top key.

    `files`: what each file contains. `notes`: further texts by name, its `custom_data`.
    """
    topics: dict[str, dict[str, Any]] = {}
    for contents in files:
        for channel in contents.channels.values():
            if channel.topic not in topics:
                topics[channel.topic] = {"topic_metadata": _described(contents, channel), "message_count": 0}
            topics[channel.topic]["message_count"] += contents.counts[channel.id]
    starts = [contents.start_time for contents in files if contents.start_time is not None]
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        **_span(min(starts, default=0), max(contents.end_time for contents in files)),
        "message_count": sum(contents.counts.total() for contents in files),
        "topics_with_message_count": list(topics.values()),
        # Of rosbag2's own compression; that of MCAP chunks is not declared here.
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [contents.path.name for contents in files],
        "files": [
            {"path": c.path.name, **_span(c.start_time or 0, c.end_time), "message_count": c.counts.total()} for c in files
        ],
        "custom_data": dict(notes),
        "ros_distro": "jazzy",
    }


def _described(contents: Contents, channel: Channel) -> dict[str, Any]:
    schema = contents.schemas.get(channel.schema_id)
    return {
        "name": channel.topic,
        "type": schema.name if schema else "",
        "serialization_format": channel.message_encoding,
        "offered_qos_profiles": offered_qos(channel),
        "type_description_hash": channel.metadata.get("topic_type_hash", ""),
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
    return [dict(each) for each in _profiles(channel.metadata.get("offered_qos_profiles", ""))]


@lru_cache(maxsize=256)  # many topics have the same, and the metadata of a bag are written again and again
def _profiles(text: str) -> list[dict[str, Any]]:
    try:
        found = read_yaml(text)
    except yaml.YAMLError:
        return []
    return [each for each in found if isinstance(each, dict)] if isinstance(found, list) else []
