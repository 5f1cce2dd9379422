"""Nodes that share a process in lockstep: all of a composed run, or those of several vessels of a large fleet.

Each node has its own name, namespace, topics and services, as in a process of its own. They share a ROS context, and so one
participant of the middleware, which delivers their messages without a socket and finds them at once; and one executor, which
serves them in turn: no process is woken for a step.
"""

import signal
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from typing import Any

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.install_paths import missing_module
from vessel_hsmc_ros.core.node_list import GROUP, LOOP, PLANT, PROGRAMS
from vessel_hsmc_ros.nodes.base import VesselNode
from vessel_hsmc_ros.nodes.executor import SERVICE_PERIOD, DirectExecutor
from vessel_hsmc_ros.nodes.process import (
    CANNOT_START,
    DESTROYED_WITHIN,
    STOP_SIGNALS,
    bounded_end,
    do_all,
    spare_collections,
    trace_crashes,
)
from vessel_hsmc_ros.nodes.rclpy_parts import RCLError
from vessel_hsmc_ros.nodes.ros_environment import start_error
from vessel_hsmc_ros.scenario.law_file import load_named_files

NODES_SERVED = 2  # nodes whose timers and services are served in each period of the executor


def executor_of(nodes: Sequence[VesselNode]) -> DirectExecutor:
    """One executor for all nodes; the more there are, the less often it serves their timers and services.

    Those that poll are not among the nodes that a step waits for: they are served when the others are idle, and with the timers.
    """
    shared: Any = []
    for node in nodes:  # a subscription that a node creates later is appended to the list that the executor serves
        if not node.POLL_PERIOD:
            shared += node.direct_subscriptions
            node.direct_subscriptions = node.connections.subscriptions = shared
    period = SERVICE_PERIOD * max(1.0, len(nodes) / NODES_SERVED)
    executor = DirectExecutor(shared, context=nodes[0].context, service_period=period)
    for node in nodes:
        executor.add_node(node)
    return executor


def main(arguments: list[str] | None = None) -> int:
    """Run the nodes that are given, such as `vessel_2/controller`, until their plants have finished or a signal ends them."""
    given = sys.argv[1:] if arguments is None else arguments
    end = given.index("--ros-args") if "--ros-args" in given else len(given)
    received: list[int] = []
    for number in STOP_SIGNALS:
        signal.signal(number, lambda number, _frame: received.append(number))
    nodes: list[VesselNode] = []
    name = ""
    trace_crashes()
    try:
        rclpy.init(args=given, signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, ValueError) as error:
        get_logger(GROUP).fatal(f"cannot start: {start_error(error)}")
        return CANNOT_START
    try:
        for name in load_named_files(given[:end]):
            namespace, _, node = name.rpartition("/")
            nodes.append(_class_of(node)(command_line=given, namespace=f"/{namespace}"))
        return _run(nodes, lambda: not received)
    except (VesselHsmcError, RCLError, ParameterException, ModuleNotFoundError) as error:
        reason = missing_module(error) if isinstance(error, ModuleNotFoundError) else start_error(error)
        get_logger(name.replace("/", ".") or GROUP).fatal(reason)
        return CANNOT_START
    finally:
        for number in STOP_SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        with bounded_end(2.0 * DESTROYED_WITHIN):
            for made in nodes:
                made.destroy_node()
            rclpy.shutdown(uninstall_handlers=False)


def import_nodes(names: Sequence[str]) -> None:
    """Import the nodes among some arguments, with or without a namespace, before a fork."""
    for name in {name.rpartition("/")[2] for name in names} & PROGRAMS.keys():
        import_module(PROGRAMS[name].source)


def _class_of(name: str) -> Any:
    """The class of a node by its name; imported at the start, because the plant's node is above this room."""
    return getattr(import_module(LOOP[name].source), LOOP[name].kind)


def _run(nodes: Sequence[VesselNode], running: Callable[[], bool]) -> int:
    """Serve the nodes until all plants have finished, then close them, a recorder last; returns the exit code."""
    plants = [node for node in nodes if node.get_name() == PLANT]
    for node in nodes:
        node.announce()
    spare_collections()
    with executor_of(nodes) as executor:
        works: list[Callable[[], None]] = [
            partial(executor.spin_while, lambda: running() and not all(plant.finished for plant in plants))
        ]
        for node in sorted(nodes, key=lambda node: node.POLL_PERIOD > 0.0):
            works += [partial(node.spin, lambda: False), node.close]
        return do_all(works, nodes)
