"""Whether the ROS that this process would load is one and whole: variables of a shell can mix two installations.

Checked before ROS is imported, because a mixture ends later, at random, and without a name.
"""

import os
import re
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.install_paths import MESSAGES, messages_remedy, prefixes, share_directory

MIDDLEWARES = "share/ament_index/resource_index/rmw_typesupport"  # folder of a prefix in which every middleware has an entry
_FIELD = re.compile(r"^[A-Za-z][\w/]*(?:<=\d+)?(?:\[[^\]]*\])?\s+([a-z]\w*)", re.MULTILINE)


def check_ros() -> None:
    """Check what ROS takes from the environment; choose another folder for its logs where the home cannot be written."""
    for problem in _problems():
        raise InstallationError(problem)


def check_messages() -> None:
    """Check that the messages of this package are those that it was written for."""
    package = import_module(f"{MESSAGES}.msg")
    for path in sorted((share_directory() / "msg_defs" / "msg").glob("*.msg")):
        kind = getattr(package, path.stem, None)
        fields = _FIELD.findall(path.read_text(encoding="utf-8"))
        if kind is None or [*kind.get_fields_and_field_types()] != fields:
            place = Path(str(package.__file__)).parents[1]
            raise InstallationError(f"{path.stem} of {place} is not that of this package: {messages_remedy()}")


def _problems() -> Iterator[str]:
    middlewares = {path.name for prefix in prefixes() for path in (prefix / MIDDLEWARES).glob("*")}
    wanted = os.environ.get("RMW_IMPLEMENTATION", "")
    if wanted and middlewares and wanted not in middlewares:
        there = ", ".join(sorted(middlewares))
        yield f"RMW_IMPLEMENTATION = {wanted} is not installed, there is {there}: unset RMW_IMPLEMENTATION"
    yield from _mixtures()
    yield from _log_folder()


def _mixtures() -> Iterator[str]:
    """Variables that bring another ROS into an environment with one of its own."""
    own = Path(sysconfig.get_path("purelib")) / "rclpy"
    if not own.is_dir():
        return
    found = find_spec("rclpy")
    if found and found.origin and Path(found.origin).parent != own:
        yield f"PYTHONPATH leads to rclpy in {Path(found.origin).parent} instead of that of {sys.prefix}: unset PYTHONPATH"
    for part in filter(None, os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)):
        if (Path(part) / "librcl.so").exists() and not Path(part).resolve().is_relative_to(Path(sys.prefix).resolve()):
            yield f"LD_LIBRARY_PATH has the ROS of {part} beside that of {sys.prefix}: unset LD_LIBRARY_PATH"


def _log_folder() -> Iterator[str]:
    """Where ROS writes its logs: without a folder it does not start."""
    if given := os.environ.get("ROS_LOG_DIR"):
        if not _writable(Path(given)):
            yield f"ROS_LOG_DIR = {given} cannot be written: unset ROS_LOG_DIR"
        return
    home = os.environ.get("ROS_HOME") or (Path.home() / ".ros" if os.environ.get("HOME") else "")  # without HOME, ROS finds none
    if not home or not _writable(Path(home) / "log"):
        os.environ["ROS_LOG_DIR"] = str(Path(tempfile.gettempdir()) / f"ros_log_{os.getuid()}")


def _writable(folder: Path) -> bool:
    """Whether a folder can be written or created."""
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    return existing.is_dir() and os.access(existing, os.W_OK) and not str(existing).startswith("/proc")


ENABLE, KEYSTORE = "ROS_SECURITY_ENABLE", "ROS_SECURITY_KEYSTORE"

_NOT_BUILT_IN = "doesn't have the security libraries"


def start_error(error: Exception) -> str:
    """The reason in one line why rclpy has not started a node; in words of its own where security is demanded.

    rcl's text for a missing keystore is empty, and that of a Fast DDS without security advises to compile it.
    """
    text = " ".join(str(error).split())
    if not demanded():
        return text
    if _NOT_BUILT_IN in text:
        return f"{ENABLE} is true, but this Fast DDS has no security: a ROS 2 installation has one, see docs/security.md"
    if not (keystore := os.environ.get(KEYSTORE)):
        return f"{ENABLE} is true, but {KEYSTORE} is not set: it must be the folder of a keystore, see docs/security.md"
    return f"{ENABLE} is true, but keystore {keystore} does not serve: {text}"


def demanded() -> bool:
    """Whether the environment demands security; rcl takes only this spelling."""
    return os.environ.get(ENABLE) == "true"


LOOPBACK = Path("/sys/class/net/lo/flags")
"""Where Linux shows the state of the interface by which processes of one machine reach each other."""


def loopback_down(flags: Path = LOOPBACK) -> str:
    """That the loopback interface is down, as the end of an error message; empty if it is up or not known."""
    try:
        up = int(flags.read_text(), 16) & 1  # IFF_UP
    except (OSError, ValueError):
        return ""
    return "" if up else "; the loopback interface is down, by which nodes find each other: `ip link set lo up`"
