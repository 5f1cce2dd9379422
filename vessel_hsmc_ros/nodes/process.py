"""A node as a process: command line, signals, reported failures and exit codes."""

import signal
import sys
from collections.abc import Callable
from functools import partial
from types import FrameType

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.nodes.base import VesselNode

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

FAILED, CANNOT_START = 1, 2
"""Exit codes: the node failed at work; it could not start, for instance because a parameter is not allowed."""


def run_node(
    node_class: type[VesselNode], arguments: list[str] | None = None, before: Callable[[list[str]], None] | None = None
) -> int:
    """Run a node until it has finished, fails, or receives SIGINT or SIGTERM.

    The signals only request the shutdown: the node completes its work while its context is valid, whereas rclpy's own handlers
    would invalidate the context at once. After that work they are ignored, because Python restores the default handlers while it
    exits: a second Ctrl-C, such as one from the terminal and one from `ros2 launch`, would turn a normal exit into a death by
    signal.

    Args:
        node_class: The class of the node.
        arguments: Command-line arguments; those of the process if None.
        before: Called with the arguments before the node is constructed.

    Returns:
        The exit code: 0, or 1 when the node failed, or 2 when it could not start.
    """
    received: list[int] = []  # the numbers of the signals, appended by the handler

    def request_stop(number: int, _frame: FrameType | None) -> None:
        received.append(number)

    for number in STOP_SIGNALS:
        signal.signal(number, request_stop)
    try:
        return _run(node_class, arguments, lambda: not received, before)
    finally:
        for number in STOP_SIGNALS:
            signal.signal(number, signal.SIG_IGN)


def _run(
    node_class: type[VesselNode],
    arguments: list[str] | None,
    running: Callable[[], bool],
    before: Callable[[list[str]], None] | None,
) -> int:
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, ValueError) as error:
        get_logger(node_class.NAME).fatal(f"cannot start: {' '.join(str(error).split())}")
        return CANNOT_START
    try:
        if before:
            before(sys.argv[1:] if arguments is None else arguments)
        node = node_class()
    except VesselHsmcError as error:
        get_logger(node_class.NAME).fatal(str(error))
        rclpy.shutdown()
        return CANNOT_START
    try:
        node.on_own_process()
        node.announce()
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
            raise
    return code
