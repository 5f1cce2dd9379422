"""The version of the package, where its own data files are installed, and what an incomplete installation lacks."""

import os
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import InstallationError

__version__: str
"""The version of the installed package; its source is package.xml."""

PACKAGE = "vessel_hsmc_ros"

OLD_PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
"""Environment variable of the profiles of Fast DDS 2, which Fast DDS 3 still reads."""

RANGE, PEERS, TRANSPORTS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS", "FASTDDS_BUILTIN_TRANSPORTS"
"""Environment variables by which a user chooses which machines the nodes discover, and how."""

MESSAGES = "vessel_hsmc_msgs"
PX4_MESSAGES = "px4_msgs"

DISTRIBUTIONS = {"foxglove": "foxglove-sdk", "mcap_ros2": "mcap-ros2-support", "yaml": "pyyaml"}
"""Packages of PyPI that are not named like their module."""

ROS = re.compile(r"rclpy|rcl_|rosidl_|rpyutils|ament_|\w+_(msgs|srvs|interfaces)$")  # modules that are parts of ROS 2
ROS_REMEDY = (
    "nodes need ROS 2, `pip install 'ros-jazzy-rclpy[fastrtps]' ros-jazzy-common-interfaces` or source a Jazzy workspace;"
    " `vessel-hsmc simulate` does without"
)


def __getattr__(name: str) -> str:
    """The version when it is asked for: the library that reads it takes longer to import than the command's help."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import version

    return version(PACKAGE)


def prefixes() -> list[Path]:
    """The prefixes that packages are installed into: those of the ROS workspaces, then Python's own."""
    # AMENT_PREFIX_PATH lists overlays before the workspaces below them, so the first match is the one that ROS uses.
    named = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return [Path(prefix) for prefix in (*named, sys.prefix) if prefix]


KILTED = any((prefix / "share" / "fastdds").is_dir() for prefix in prefixes())
"""Whether the ROS is Kilted, with Fast DDS 3; in Jazzy the folder is named fastrtps."""

PROFILES = "FASTDDS_DEFAULT_PROFILES_FILE" if KILTED else OLD_PROFILES
"""Environment variable of the Fast DDS profiles; those of this package stay on the local host and shorten discovery."""


def share_directory() -> Path:
    """The checkout this module runs from, else the share folder of the prefix it was installed into."""
    # In a checkout (and with pip install -e) the data files are beside the code, so that edits take effect at once.
    checkout = Path(__file__).resolve().parents[2]
    if (checkout / "package.xml").is_file():
        return checkout
    candidates = [prefix / "share" / PACKAGE for prefix in prefixes()]
    for candidate in candidates:
        if (candidate / "config").is_dir():
            return candidate
    raise InstallationError("the package's config folder is in none of " + ", ".join(map(str, candidates)))


def shell_command() -> str:
    """How this user's shell starts the command: colcon installs it into lib/vessel_hsmc_ros, which is not on the PATH."""
    off_path = os.environ.get("AMENT_PREFIX_PATH") and shutil.which("vessel-hsmc") is None
    return f"ros2 run {PACKAGE} vessel-hsmc" if off_path else "vessel-hsmc"


def discovery_profiles() -> str:
    """The Fast DDS profiles of the nodes that this package starts: the user's own, or those of the package.

    Without a word from the user the nodes use the loopback interface only. A discovery range beyond it, static peers or
    transports of his choice take effect as ROS documents them.
    """
    given = os.environ.get
    beyond = given(RANGE, "LOCALHOST").upper() != "LOCALHOST" or given(PEERS) or given(TRANSPORTS)
    name = "fastdds_network.xml" if beyond else "fastdds.xml"
    return given(PROFILES) or given(OLD_PROFILES) or str(profiles_folder() / name)


def profiles_folder() -> Path:
    """The folder of the package's Fast DDS profiles: Fast DDS 3 has other names for two of the elements."""
    return share_directory() / "config" / ("kilted" if KILTED else "")


@contextmanager
def discovery() -> Iterator[None]:
    """A context that creates a ROS node of this process with `discovery_profiles`; the environment is restored after it."""
    before = os.environ.get(PROFILES)
    os.environ[PROFILES] = discovery_profiles()
    try:
        yield
    finally:
        if before is None:
            del os.environ[PROFILES]
        else:
            os.environ[PROFILES] = before


def require(*modules: str) -> None:
    """Check that libraries are installed, before what needs them is imported or computed."""
    if missing := [name for name in modules if find_spec(name) is None]:
        raise InstallationError(_not_installed(missing))


def missing_module(error: ModuleNotFoundError) -> str:
    """One line with the name of a module that is missing, and how to install it."""
    # An import of a submodule reports its dotted name; the first part is what has to be installed.
    return _not_installed([(error.name or str(error)).partition(".")[0]])


def _not_installed(names: Sequence[str]) -> str:
    """One line on libraries that are missing, and how to install them."""
    if names[0] == MESSAGES:
        remedy = messages_remedy()
    elif names[0] == PX4_MESSAGES:
        remedy = "build the px4_msgs of your firmware's release with `colcon build`, and source the workspace"
    elif ROS.match(names[0]):
        remedy = ROS_REMEDY
    else:
        remedy = f"`pip install {' '.join(DISTRIBUTIONS.get(name, name) for name in names)}`"
        if os.environ.get("AMENT_PREFIX_PATH") and sys.prefix == sys.base_prefix:
            remedy = f"`rosdep install` in the workspace, or {remedy} in an environment above it (docs/installing.md)"
    return f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} not installed: {remedy}"


def messages_remedy() -> str:
    """How to install the message package: by colcon where a workspace is sourced, else by pip."""
    if os.environ.get("AMENT_PREFIX_PATH"):
        return "build the package, and its messages with it, by `colcon build`, and source the workspace"
    return "`pip install` its wheel, which `make wheels` builds beside that of this package (docs/installing.md)"
