"""The complete definition of a message type, as bags store it: its .msg file and those of all types that it uses."""

import re
from functools import cache

from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.install_paths import prefixes, share_directory

SEPARATOR = "\n" + "=" * 80 + "\nMSG: "

OWN = "vessel_hsmc_msgs"
"""The package whose messages this one brings along, for a machine on which they are not built."""

_FIELD = re.compile(r"^\s*([A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]\w*")


def definition(kind: str) -> str:
    """The definition of a type such as `nav_msgs/msg/Odometry`, followed by each type that it uses, once and depth first.

    Raises:
        BagError: a type is not installed.
    """
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
