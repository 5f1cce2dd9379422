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
from vessel_hsmc_ros.core.install_paths import missing_module, require
from vessel_hsmc_ros.core.node_list import PROGRAMS, NodeProgram
from vessel_hsmc_ros.nodes.ros_environment import check_ros


def entry_point(program: NodeProgram) -> Callable[[], int]:
    """Make the entry point of a node; its exit code is 2 if a module that the node needs is not installed."""

    def main() -> int:
        end_on_interrupt()
        try:
            require("rclpy", "numpy", "yaml", *program.libraries)
            check_ros()  # that two installations of ROS do not mix
            node_class = getattr(import_module(program.source), program.kind)
            from vessel_hsmc_ros.nodes.process import run_node
        except ModuleNotFoundError as error:
            sys.stderr.write(f"[FATAL]: {missing_module(error)}\n")
            return 2
        except InstallationError as error:
            sys.stderr.write(f"[FATAL]: {error}\n")
            return 2
        return run_node(node_class)

    return main


def end_on_interrupt() -> None:
    """Let SIGINT end the process at once: until the node's own handlers follow, there is nothing to complete."""
    signal.signal(signal.SIGINT, lambda *_: os._exit(0))


_MAINS = {program.executable: entry_point(program) for program in PROGRAMS.values()}


def __getattr__(name: str) -> Callable[[], int]:
    """The entry point of an executable by its name, as the scripts import it."""
    if name not in _MAINS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _MAINS[name]
