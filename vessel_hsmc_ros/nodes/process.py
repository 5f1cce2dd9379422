"""A node as a process: command line, signals, reported failures and exit codes."""

import faulthandler
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from types import FrameType

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.spelling import spelled
from vessel_hsmc_ros.nodes.argument_rules import check_rules
from vessel_hsmc_ros.nodes.base import VesselNode
from vessel_hsmc_ros.nodes.help_text import help_text, unknown_argument, without_ros_arguments
from vessel_hsmc_ros.nodes.scheduling import spare_collections
from vessel_hsmc_ros.nodes.security import start_error

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

FAILED, CANNOT_START = 1, 2
"""Exit codes: the node failed at work; it could not start, for instance because a parameter is not allowed."""


def run_node(
    node_class: type[VesselNode],
    arguments: list[str] | None = None,
    take_options: Callable[[Sequence[str]], list[str]] = list,
) -> int:
    """Run a node until it has finished, fails, or receives SIGINT or SIGTERM.

    The signals only request the shutdown: the node completes its work while its context is valid, whereas rclpy's own handlers
    would invalidate the context at once. After that work they are ignored, because Python restores the default handlers while it
    exits: a second Ctrl-C, such as one from the terminal and one from `ros2 launch`, would turn a normal exit into a death by
    signal.

    Args:
        node_class: The class of the node.
        arguments: Command-line arguments; those of the process if None.
        take_options: Takes the node's own options from the arguments that are not of ROS, and returns the others.

    Returns:
        The exit code: 0, or 1 when the node failed, or 2 when it could not start.
    """
    trace_crashes()
    if (code := _answer(node_class, sys.argv[1:] if arguments is None else arguments, take_options)) is not None:
        return code
    received: list[int] = []  # the numbers of the signals, appended by the handler

    def request_stop(number: int, _frame: FrameType | None) -> None:
        received.append(number)

    for number in STOP_SIGNALS:
        signal.signal(number, request_stop)
    try:
        return _run(node_class, arguments, lambda: not received)
    finally:
        for number in STOP_SIGNALS:
            signal.signal(number, signal.SIG_IGN)


def trace_crashes() -> None:
    """Let a crash of native code, such as the middleware's, print the stacks of all threads before it ends the process."""
    if not faulthandler.is_enabled():
        with suppress(OSError, RuntimeError):  # a standard error that is not a file, or none
            faulthandler.enable()


def _answer(
    node_class: type[VesselNode], arguments: Sequence[str], take_options: Callable[[Sequence[str]], list[str]]
) -> int | None:
    """Print the help text if that is requested, or an error if an argument is wrong; None if the node is to run."""
    try:
        unknown = unknown_argument(take_options(without_ros_arguments(arguments)))
    except RuntimeError:  # invalid ROS arguments, which rclpy.init reports
        return None
    except VesselHsmcError as error:
        get_logger(node_class.NAME).fatal(str(error))
        return CANNOT_START
    if unknown in ("-h", "--help"):
        sys.stdout.write(spelled(help_text(node_class), sys.stdout.encoding))
        return 0
    if unknown:
        remedy = "parameters are given by --ros-args -p NAME:=VALUE, and --help lists them"
        get_logger(node_class.NAME).fatal(f"{unknown} is not an argument of this node: {remedy}")
        return CANNOT_START
    return None


def _run(node_class: type[VesselNode], arguments: list[str] | None, running: Callable[[], bool]) -> int:
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, ValueError) as error:
        get_logger(node_class.NAME).fatal(f"cannot start: {start_error(error)}")
        return CANNOT_START
    try:
        node = node_class()
        check_rules(sys.argv[1:] if arguments is None else arguments, node.get_name(), node.get_namespace())
    except (VesselHsmcError, RCLError) as error:
        get_logger(node_class.NAME).fatal(start_error(error))
        rclpy.shutdown()
        return CANNOT_START
    try:
        node.on_own_process()
        node.announce()
        spare_collections()
        return _work(node, running)
    finally:
        node.destroy_node()
        rclpy.shutdown()


def _work(node: VesselNode, running: Callable[[], bool]) -> int:
    """Spin the node, then close it even if spinning failed; returns the exit code."""
    code = 0
    for work in (partial(node.spin, running), node.close):
        try:
            work()
        except VesselHsmcError as error:
            node.fail(str(error))
            code = FAILED
        except ExternalShutdownException:  # the context is invalid: nothing more can be published
            break
        except Exception as error:
            node.fail(f"unexpected {type(error).__name__}: {error}")
            if work is not node.close:
                node.close()  # an actuator must not be left with the last command, whatever has failed
            raise
    return code
