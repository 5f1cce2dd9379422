"""Where the package's own data files are: config, launch."""

import os
import sys
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import ScenarioError

PACKAGE = "vessel_hsmc_ros"


def prefixes() -> list[Path]:
    """The prefixes that packages are installed into: those of the ROS workspaces, then Python's own."""
    named = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return [Path(prefix) for prefix in (*named, sys.prefix) if prefix]


def share_directory() -> Path:
    """The checkout this module runs from, else the share folder of the prefix it was installed into.

    Raises:
        ScenarioError: the package is installed without its data files.
    """
    checkout = Path(__file__).resolve().parents[2]
    if (checkout / "package.xml").is_file():
        return checkout
    candidates = [prefix / "share" / PACKAGE for prefix in prefixes()]
    for candidate in candidates:
        if (candidate / "config").is_dir():
            return candidate
    raise ScenarioError("the package's config folder is in none of " + ", ".join(map(str, candidates)))
