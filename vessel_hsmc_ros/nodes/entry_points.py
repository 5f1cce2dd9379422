"""Entry points of the node executables: each imports its node's module and runs it.

A node's module imports generated messages and ROS at its top. Importing it here instead of in the entry point itself turns a
package that is not installed into one line instead of a traceback.
"""

import os
import signal
import sys
from collections.abc import Callable
from importlib import import_module

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.install_paths import missing_module
from vessel_hsmc_ros.core.node_list import AUXILIARY, LOOP, WATCHERS
from vessel_hsmc_ros.nodes.ros_environment import check_ros


def entry_point(module: str) -> Callable[[], int]:
    """Make the entry point of a node; its exit code is 2 if a module that the node needs is not installed.

    Args:
        module: The node's module, which has a function `main`.
    """

    def main() -> int:
        # The node's own handlers follow when it is imported; until then there is nothing to complete.
        signal.signal(signal.SIGINT, lambda *_: os._exit(0))
        try:
            check_ros()
            node = import_module(module)
        except ModuleNotFoundError as error:
            sys.stderr.write(f"[FATAL]: {missing_module(error)}\n")
            return 2
        except InstallationError as error:
            sys.stderr.write(f"[FATAL]: {error}\n")
            return 2
        code: int = node.main()
        return code

    return main


vessel_sim_node = entry_point(f"{LOOP['vessel_sim'].module}.node")  # its module is a package, run by `python -m`
reference_ship_node = entry_point(LOOP["reference_ship"].module)
controller_node = entry_point(LOOP["controller"].module)
thruster_allocation_node = entry_point(LOOP["thruster_allocation"].module)
recorder_node = entry_point(LOOP["recorder"].module)
fault_relay_node = entry_point(AUXILIARY["fault_relay"].module)
marker_node = entry_point(WATCHERS["markers"].module)
watchdog_node = entry_point(WATCHERS["watchdog"].module)
navsat_odom_node = entry_point(WATCHERS["navsat_odom"].module)
drive_node = entry_point(WATCHERS["drive"].module)
live_node = entry_point(WATCHERS["live"].module)
