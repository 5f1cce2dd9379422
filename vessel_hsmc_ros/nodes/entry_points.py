"""Entry points of the node executables: each imports its node's module and runs it.

A node's module imports generated messages and ROS at its top. Importing it here instead of in the entry point itself turns a
package that is not installed into one line instead of a traceback.
"""

import sys
from collections.abc import Callable
from importlib import import_module

from vessel_hsmc_ros.core.install_paths import missing_module


def entry_point(module: str) -> Callable[[], int]:
    """Make the entry point of a node; its exit code is 2 if a module that the node needs is not installed.

    Args:
        module: The node's module, which has a function `main`.
    """

    def main() -> int:
        try:
            node = import_module(module)
        except ModuleNotFoundError as error:
            sys.stderr.write(f"[FATAL]: {missing_module(error)}\n")
            return 2
        code: int = node.main()
        return code

    return main


vessel_sim_node = entry_point("vessel_sim_node.node")
reference_ship_node = entry_point("vessel_hsmc_ros.nodes.reference_ship")
controller_node = entry_point("vessel_hsmc_ros.nodes.controller")
recorder_node = entry_point("vessel_hsmc_ros.nodes.recorder")
marker_node = entry_point("vessel_hsmc_ros.nodes.markers")
live_node = entry_point("vessel_hsmc_ros.nodes.live")
