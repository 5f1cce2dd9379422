"""A node as a process: command line and help, scheduling, signals, reported failures and exit codes."""

import faulthandler
import gc
import inspect
import os
import signal
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from traceback import walk_tb
from types import FrameType
from typing import Any

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.node_list import PROGRAMS
from vessel_hsmc_ros.nodes.base import VesselNode
from vessel_hsmc_ros.nodes.node_parameters import in_ros_names
from vessel_hsmc_ros.nodes.rclpy_parts import RCLError
from vessel_hsmc_ros.nodes.ros_environment import start_error
from vessel_hsmc_ros.scenario import parameters
from vessel_hsmc_ros.scenario.parameters_file import check_rules

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

FAILED, CANNOT_START = 1, 2
"""Exit codes: the node failed at work; it could not start, for instance because a parameter is not allowed."""

DESTROYED_WITHIN = 3.0
"""Time after which a process ends by SIGALRM whose middleware does not let the node be destroyed, s, with the stacks.

Fast DDS 2.14 can block itself while publishers with a liveliness lease leave: discovery waits for a timer, which waits for it.
The node's work is done by then, its last messages are published: a run that ends so has not failed (nodes/runs/processes.py).
"""


def run_node(node_class: type[VesselNode], arguments: list[str] | None = None) -> int:
    """Run a node until it has finished, fails, or receives SIGINT or SIGTERM.

    The signals only request the shutdown: the node completes its work while its context is valid, whereas rclpy's own handlers
    would invalidate the context at once. After that work they are ignored, because Python restores the default handlers while
    it exits: a second Ctrl-C, such as one from the terminal and one from `ros2 launch`, would turn a normal exit into a death
    by signal. For the same reason rclpy must leave the handlers alone: it would restore the default ones for an instant.
    `arguments`: command-line arguments; those of the process if None. Returns the exit code: 0, or 1 when the node failed, or 2
    when it could not start.
    """
    trace_crashes()
    if (code := _answer(node_class, sys.argv[1:] if arguments is None else arguments)) is not None:
        return code
    os.nice(node_class.NICENESS)  # before the middleware starts its threads, which inherit it
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


def _answer(node_class: type[VesselNode], arguments: Sequence[str]) -> int | None:
    """Print the help text if that is requested, or an error if an argument is wrong; None if the node is to run."""
    try:
        others = node_class.take_options([argument for argument in remove_ros_args(args=list(arguments)) if argument])
    except RuntimeError:  # invalid ROS arguments, which rclpy.init reports
        return None
    except VesselHsmcError as error:
        get_logger(node_class.NAME).fatal(str(error))
        return CANNOT_START
    if {"-h", "--help"} & {*others}:  # it takes precedence over what is wrong
        sys.stdout.buffer.write(help_text(node_class).encode(sys.stdout.encoding, "replace"))
        return 0
    if others:
        remedy = "parameters are given by --ros-args -p NAME:=VALUE, and --help lists them"
        get_logger(node_class.NAME).fatal(f"{others[0]} is not an argument of this node: {remedy}")
        return CANNOT_START
    return None


def _run(node_class: type[VesselNode], arguments: list[str] | None, running: Callable[[], bool]) -> int:
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, ValueError) as error:
        get_logger(node_class.NAME).fatal(f"cannot start: {start_error(error)}")
        return CANNOT_START
    command_line = sys.argv[1:] if arguments is None else arguments
    try:
        node = node_class(command_line=command_line)
        check_rules(command_line, node.get_name(), node.get_namespace())
    except (VesselHsmcError, RCLError, ParameterException) as error:
        get_logger(node_class.NAME).fatal(in_ros_names(start_error(error), node_class.NAME))
        rclpy.shutdown(uninstall_handlers=False)
        return CANNOT_START
    try:
        node.on_own_process()
        node.announce()
        node.claim_real_time()
        spare_collections()
        return do_all((partial(node.spin, running), node.close), [node])
    finally:
        # By now the node has left the ship without a command, and published its last messages.
        with bounded_end(DESTROYED_WITHIN):
            node.destroy_node()
            rclpy.shutdown(uninstall_handlers=False)


@contextmanager
def bounded_end(limit: float) -> Iterator[None]:
    """End the process by SIGALRM, with the stacks of all threads, where the block takes longer than a limit, s."""
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    with suppress(OSError, RuntimeError):  # a standard error that is not a file, or none
        faulthandler.register(signal.SIGALRM, chain=True)  # neither needs the interpreter's lock, which the middleware may hold
    signal.setitimer(signal.ITIMER_REAL, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def do_all(works: Iterable[Callable[[], None]], nodes: Sequence[VesselNode]) -> int:
    """Let nodes work, and close them even if that has failed: no actuator is left with the last command; returns the exit code.

    `works`: what they have to do in turn, their closing last. A failure is reported by the node in whose code it occurred.
    """
    code, unexpected = 0, None
    for work in works:
        try:
            work()
        except VesselHsmcError as error:
            _fail(nodes, error, str(error))
            code = FAILED
        except ExternalShutdownException:  # the context is invalid: nothing more can be published
            break
        except (Exception, SystemExit) as error:  # the latter of a user's code
            _fail(nodes, error, f"unexpected {type(error).__name__}: {error}")
            unexpected = unexpected or error
    if unexpected:
        raise unexpected
    return code


def _fail(nodes: Sequence[VesselNode], error: BaseException, reason: str) -> None:
    """Report a failure by the node in whose code, or part, it occurred: an executor raises it and does not name the node."""
    owners = [frame.f_locals.get("self") for frame, _ in walk_tb(error.__traceback__)]
    owners += [getattr(owner, "_node", None) for owner in owners]
    next((node for node in nodes for owner in owners if owner is node), nodes[0]).fail(reason)


HELP_WIDTH = 110

HELP = """\
Usage: {executable}{options} [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r FROM:=TO]...]

{description}

Topics and services; every node also publishes /diagnostics:
{interface}

Examples:
  {executable} --ros-args --params-file config/case2_tracking.yaml
  {executable} --ros-args -r __ns:=/alpha -p {name}:={value}

Parameters of the node {node}, with their defaults; * can be changed while it runs, by `ros2 param set` or the
vessel-hsmc command:
{parameters}

A parameters file has a section `{node}: ros__parameters:`. Documentation: README.md and docs/parameters.md of vessel_hsmc_ros.
"""


def help_text(node_class: Any) -> str:
    """The help text of a node: its task, its topics and its parameters."""
    program = PROGRAMS[node_class.NAME]
    entries = schema.entries((parameters.NODES | parameters.WATCHERS)[node_class.NAME])
    example = next((entry for entry in entries.values() if entry.tunable), next(iter(entries.values())))
    return HELP.format(
        executable=program.executable,
        options=node_class.OPTIONS,
        description=inspect.getdoc(node_class),
        interface=_indented(inspect.cleandoc(node_class.INTERFACE)),
        node=node_class.NAME,
        name=example.name,
        value=_shown(example.default),
        parameters=_indented("\n".join(map(_parameter, entries.values()))),
    )


def _parameter(entry: schema.Entry) -> str:
    head = f"{'*' if entry.tunable else ' '} {entry.name} = {_shown(entry.default)}"
    meaning = f"{entry.description.rstrip('.')}. Must be {entry.allowed}."
    return "\n".join([head, *textwrap.wrap(meaning, HELP_WIDTH, initial_indent="      ", subsequent_indent="      ")])


def _shown(value: object) -> str:
    """A value as it is written on the command line."""
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_shown, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return "''" if value == "" else str(value)


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())


def spare_collections() -> None:
    """Leave what was created at the start, hundreds of thousands of objects, out of Python's garbage collections.

    One of them would take longer than a control period.
    """
    gc.collect()
    gc.freeze()
