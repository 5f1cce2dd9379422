"""The nodes of several vessels in one process: for large fleets in lockstep, whose single processes would crowd the machine.

Each node has its own name, namespace, topics and services, as in a process of its own. They share a ROS context, and so one
participant of the middleware, whose discovery costs grow with the square of the number of participants; and one executor.
"""

import signal
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from traceback import walk_tb
from typing import Any

import rclpy
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.node_list import LOOP, PLANT, RECORDER
from vessel_hsmc_ros.nodes.base import VesselNode
from vessel_hsmc_ros.nodes.executor import SERVICE_PERIOD, DirectExecutor
from vessel_hsmc_ros.nodes.process import (
    CANNOT_START,
    DESTROYED_WITHIN,
    FAILED,
    STOP_SIGNALS,
    bounded_end,
    spare_collections,
    trace_crashes,
)
from vessel_hsmc_ros.scenario.law_file import load_named_files

CLASSES = {name: program for name, program in LOOP.items() if name != RECORDER}
"""The nodes of a vessel; imported at the start, because the plant's node is above this room."""


def executor_of(nodes: Sequence[VesselNode]) -> DirectExecutor:
    """One executor for all nodes; the more there are, the less often it serves their timers and services."""
    shared: Any = []
    for node in nodes:  # a subscription that a node creates later is appended to the list that the executor serves
        shared += node.direct_subscriptions
        node.direct_subscriptions = node.connections.subscriptions = shared
    period = SERVICE_PERIOD * len(nodes) / len(CLASSES)
    executor = DirectExecutor(shared, context=nodes[0].context, service_period=period)
    for node in nodes:
        executor.add_node(node)
    return executor


def main(arguments: list[str] | None = None) -> int:
    """Run the nodes of the vessels whose namespaces are given, until their plants have finished or a signal ends them.

    The arguments are `NODES NAMESPACE...`, with the names of the nodes of each vessel separated by commas.
    """
    given = sys.argv[1:] if arguments is None else arguments
    end = given.index("--ros-args") if "--ros-args" in given else len(given)
    received: list[int] = []
    for number in STOP_SIGNALS:
        signal.signal(number, lambda number, _frame: received.append(number))
    nodes: list[VesselNode] = []
    names = namespace = ""
    trace_crashes()
    rclpy.init(args=given, signal_handler_options=SignalHandlerOptions.NO)
    try:
        names, *namespaces = load_named_files(given[:end])
        for namespace in namespaces:
            nodes += [_class_of(name)(command_line=given, namespace=f"/{namespace}") for name in names.split(",")]
        return _run(nodes, lambda: not received)
    except VesselHsmcError as error:
        get_logger(f"{namespace}.{names}" if namespace else "vessel_group").fatal(
            ": ".join(filter(None, (namespace, str(error))))
        )
        return CANNOT_START
    finally:
        for number in STOP_SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        with bounded_end(2.0 * DESTROYED_WITHIN):
            for node in nodes:
                node.destroy_node()
            rclpy.shutdown(uninstall_handlers=False)


def _class_of(name: str) -> Any:
    """The class of a node by its name."""
    return getattr(import_module(CLASSES[name].source), CLASSES[name].kind)


def _run(nodes: Sequence[VesselNode], running: Callable[[], bool]) -> int:
    """Serve the nodes until all plants have finished, then close them; returns the exit code."""
    plants = [node for node in nodes if node.get_name() == PLANT]
    for node in nodes:
        node.announce()
    spare_collections()
    code = 0
    with executor_of(nodes) as executor:
        spin = partial(executor.spin_while, lambda: running() and not all(plant.finished for plant in plants))
        works: list[Callable[[], None]] = [spin, *(node.close for node in nodes)]
        for work in works:
            try:
                work()
            except VesselHsmcError as error:
                node = _at_work(error, nodes)
                node.fail(f"{node.get_fully_qualified_name().strip('/')}: {error}")
                code = FAILED
    return code


def _at_work(error: Exception, nodes: Sequence[VesselNode]) -> VesselNode:
    """The node in whose callback an error occurred: an executor raises it and does not name the node."""
    owners = [frame.f_locals.get("self") for frame, _ in walk_tb(error.__traceback__)]
    return next((node for node in nodes for owner in owners if owner is node), nodes[0])
