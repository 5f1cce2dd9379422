"""The topics of a run and their message types; names without a leading slash are relative to the nodes' namespace.

The definition of a type, as bags store it, is its .msg file with those of all types that it uses.
"""

import re
from functools import cache

from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.install_paths import prefixes, share_directory

EVENTS = "events"  # calls of services, changed parameters, accepted goals and paths, of all nodes of a vessel
DATUM = "odom/datum"  # sensor_msgs/NavSatFix, latched: latitude and longitude of the origin of the odometry
RECORDED_TOPICS = {
    "odom": "nav_msgs/msg/Odometry",
    "odom/truth": "nav_msgs/msg/Odometry",
    "cmd_wrench": "geometry_msgs/msg/WrenchStamped",
    "applied_wrench": "geometry_msgs/msg/WrenchStamped",
    "allocated_wrench": "geometry_msgs/msg/WrenchStamped",
    "disturbance": "geometry_msgs/msg/WrenchStamped",
    "dynamics/truth": "geometry_msgs/msg/AccelStamped",
    "reference": "vessel_hsmc_msgs/msg/ReferenceState",
    "reference/pose": "geometry_msgs/msg/PoseStamped",
    "goal_pose": "geometry_msgs/msg/PoseStamped",
    "path": "nav_msgs/msg/Path",
    "controller/state": "vessel_hsmc_msgs/msg/ControlState",
    "controller/estimate": "nav_msgs/msg/Odometry",
    EVENTS: "vessel_hsmc_msgs/msg/Event",
    "/clock": "rosgraph_msgs/msg/Clock",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/rosout": "rcl_interfaces/msg/Log",
    "/parameter_events": "rcl_interfaces/msg/ParameterEvent",
}

RELAYED = "relayed/"  # prefix of the topics on which the relay of scripted faults passes messages on
THRUSTER_DEMAND = "std_msgs/msg/Float64"  # type of the demands below `thrusters/`
FOREIGN_TOPICS = ("goal_pose", "path")
"""Recorded topics that other programs publish; their stamps need not be in the time of the run."""

OPTIONAL_TOPICS = ("odom/truth", "allocated_wrench", "controller/estimate", *FOREIGN_TOPICS)
"""Recorded topics that are not present in every run."""

TYPES_OF_EVERY_NODE = (
    "diagnostic_msgs/msg/DiagnosticArray",
    "rcl_interfaces/msg/Log",
    "rcl_interfaces/msg/ParameterEvent",
    "vessel_hsmc_msgs/msg/Event",
)
"""Message types that several nodes publish on one topic: not numbered in sequence, and not stamped in the order of the run."""

WATCHED_TOPICS = {
    **RECORDED_TOPICS,
    "markers": "visualization_msgs/msg/MarkerArray",
    "ship/path": "nav_msgs/msg/Path",
    "reference/path": "nav_msgs/msg/Path",
    "/tf": "tf2_msgs/msg/TFMessage",
}


def message_type(topic: str) -> str:
    """The type of a topic of a run, without its namespace."""
    return RECORDED_TOPICS.get(topic, THRUSTER_DEMAND)


SEPARATOR = "\n" + "=" * 80 + "\nMSG: "

OWN = "vessel_hsmc_msgs"  # the package whose messages this one brings along, for a machine on which they are not built
_FIELD = re.compile(r"^\s*([A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]\w*")


def definition(kind: str) -> str:
    """The definition of a type such as `nav_msgs/msg/Odometry`, followed by each type that it uses, once and depth first."""
    package, _, name = kind.split("/")
    seen = [f"{package}/{name}"]
    parts = [_text(package, name)]
    _collect(package, parts[0], seen, parts)
    return parts[0] + "".join(f"{SEPARATOR}{used}\n{text}" for used, text in zip(seen[1:], parts[1:], strict=True))


def _collect(package: str, text: str, seen: list[str], parts: list[str]) -> None:
    for used in _used_types(package, text):
        if used not in seen:
            seen.append(used)
            inner_package, name = used.split("/")
            inner = _text(inner_package, name)
            parts.append(inner)
            _collect(inner_package, inner, seen, parts)


def _used_types(package: str, text: str) -> list[str]:
    found = []
    # Constants and comments use no further types: a constant has a primitive type, a comment is cut off.
    for line in text.splitlines():
        match = _FIELD.match(line.split("#", 1)[0])
        if match and not match[1].islower():  # names of primitive types have no capital letter
            found.append(match[1] if "/" in match[1] else f"{package}/{match[1]}")
    return found


@cache
def _text(package: str, name: str) -> str:
    own = share_directory() / "msg_defs" / "msg" / f"{name}.msg"
    for path in (*(prefix / "share" / package / "msg" / f"{name}.msg" for prefix in prefixes()), own):
        if path.is_file() and (path is not own or package == OWN):
            return path.read_text(encoding="utf-8")
    return _standard(f"{package}/msg/{name}")


def _standard(kind: str) -> str:
    """The text of a type of ROS 2 Jazzy where ROS is not installed: without comments, otherwise equivalent."""
    from rosbags.typesys import Stores, get_typestore  # takes a while to load, and is needed without ROS only

    store = get_typestore(Stores.ROS2_JAZZY)
    if kind not in store.fielddefs:
        raise BagError(f"message type {kind} is not installed: its .msg file is missing")
    text: str = store.generate_msgdef(kind, ros_version=2)[0]
    return text.split(SEPARATOR, 1)[0]
