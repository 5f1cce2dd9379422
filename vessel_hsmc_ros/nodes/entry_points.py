"""Entry points of the node executables: each imports its node's module and runs it.

A node's module imports generated messages and ROS at its top. Importing it here instead of in the entry point itself turns a
package that is not installed into one line instead of a traceback.
"""

import os
import signal
import sys
from collections.abc import Callable, Sequence
from importlib import import_module

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.install_paths import missing_module, require
from vessel_hsmc_ros.core.node_list import AUXILIARY, LOOP, WATCHERS, NodeProgram
from vessel_hsmc_ros.nodes.ros_environment import check_ros


def entry_point(program: NodeProgram) -> Callable[[], int]:
    """Make the entry point of a node; its exit code is 2 if a module that the node needs is not installed.

    `program`: the node, whose module has a function `main`.
    """

    def main() -> int:
        end_on_interrupt()
        try:
            _check(program)
            node = import_module(program.source)
        except ModuleNotFoundError as error:
            sys.stderr.write(f"[FATAL]: {missing_module(error)}\n")
            return 2
        except InstallationError as error:
            sys.stderr.write(f"[FATAL]: {error}\n")
            return 2
        code: int = node.main()
        return code

    return main


def end_on_interrupt() -> None:
    """Let SIGINT end the process at once: until the node's own handlers follow, there is nothing to complete."""
    signal.signal(signal.SIGINT, lambda *_: os._exit(0))


def check_module(command: Sequence[str]) -> None:
    """Exit in one line, where the command of this process runs the module of a node that lacks a library.

    `command`: the command line, such as `python -m vessel_hsmc_ros.nodes.controller`.
    """
    module = command[command.index("-m") + 1] if "-m" in command else ""
    for program in _PROGRAMS:
        if program.module == module:
            try:
                _check(program)
            except InstallationError as error:
                sys.stderr.write(f"[FATAL]: {error}\n")
                sys.exit(2)


def _check(program: NodeProgram) -> None:
    """Check that all is installed that a node needs.

    Raises InstallationError if a library is missing, or two installations of ROS would mix.
    """
    require("rclpy", "numpy", "yaml", *program.libraries)
    check_ros()


_PROGRAMS = (LOOP | AUXILIARY | WATCHERS).values()
_MAINS = {program.executable: entry_point(program) for program in _PROGRAMS}


def __getattr__(name: str) -> Callable[[], int]:
    """The entry point of an executable by its name, as the scripts import it."""
    if name not in _MAINS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _MAINS[name]
