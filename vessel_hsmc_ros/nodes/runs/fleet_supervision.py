"""Supervision of a fleet: the nodes of every vessel and one recorder as processes, until every plant has ended the run."""

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vessel_hsmc_ros.core.node_list import PLANT, RECORDER, taking_part
from vessel_hsmc_ros.nodes.runs.processes import NodeGroup, NodeProcess
from vessel_hsmc_ros.nodes.runs.supervisor import (
    CONNECT_LIMIT,
    ExitStatus,
    Interrupts,
    Progress,
    after_shutdown,
    not_discovered,
    silence,
    silent_after,
)
from vessel_hsmc_ros.nodes.status_listener import StatusListener
from vessel_hsmc_ros.scenario.run_folder import RunFolder

CONNECT_LIMIT_PER_VESSEL = 10.0
"""Further time for the discovery of the nodes of each vessel, s: their processes share the cores while they start."""

SILENCE_LIMIT = 10.0  # as of a single vessel, s, but longer: many processes share the cores
OWN_PROCESSES = 4
"""Up to so many vessels, every node has a process of its own; in real time always, so that one does not delay another."""


@dataclass(frozen=True)
class Processes:
    """How the nodes of a fleet are spread over processes."""

    # the processes in the order of their start, each a node such as `vessel_2/controller`, or a group of vessels
    names: tuple[str, ...]
    groups: Mapping[str, Sequence[str]]  # the arguments of each group, by its name
    plants: Mapping[str, Sequence[str]]  # namespaces of the vessels whose plants run in a process, by its name


def spread(vessels: Sequence[str], by_thrusters: bool, lockstep: bool) -> Processes:
    """Give every node a process; the nodes of a large fleet in lockstep share as many processes as there are cores.

    `by_thrusters`: whether thrusters drive the ships, so that their allocations take part.
    """
    if len(vessels) <= OWN_PROCESSES or not lockstep:
        return Processes(taking_part(by_thrusters, vessels), {}, {f"{vessel}/{PLANT}": [vessel] for vessel in vessels})
    nodes = ",".join(name for name in taking_part(by_thrusters) if name != RECORDER)
    count = max(1, len(os.sched_getaffinity(0)))
    parts = {f"group_{number + 1}": vessels[number::count] for number in range(min(count, len(vessels)))}
    return Processes((RECORDER, *parts), {name: (nodes, *part) for name, part in parts.items()}, parts)


def supervise_fleet(folder: RunFolder, vessels: Sequence[str], progress: Progress, processes: Processes) -> ExitStatus:
    """Start the nodes of all vessels and a recorder, wait until every plant has ended the run, stop them.

    `folder`: run folder with the parameters of the nodes; the bag and the logs are written there. Returns how the run ended; a
    failure names the node with the namespace of its vessel, and is not raised.
    """
    with (
        Interrupts() as interrupts,
        NodeGroup(folder.parameters, folder.logs, "", processes.names, groups=processes.groups) as nodes,
        StatusListener("", vessels) as listener,
    ):
        status = _monitor(nodes, listener, interrupts, progress, processes.plants)
    return after_shutdown(status, nodes.failed(), folder.bag)


def _monitor(
    nodes: NodeGroup, listener: StatusListener, interrupts: Interrupts, progress: Progress, of_plants: Mapping[str, Sequence[str]]
) -> ExitStatus:
    """Wait until all plants have finished, a node has failed or stopped reporting, or the run is interrupted."""
    plants = [process for process in nodes.processes if process.name in of_plants]
    names = [f"{vessel}/{PLANT}" for part in of_plants.values() for vessel in part]
    limit = CONNECT_LIMIT + CONNECT_LIMIT_PER_VESSEL * len(names)
    deadline = time.monotonic() + limit
    while True:
        listener.listen(0.05)
        if interrupted := interrupts.status():
            return interrupted
        running = [process for process in nodes.processes if process.popen.poll() is None]
        if not any(plant in running for plant in plants) and all(plant.code == 0 for plant in plants):
            return ExitStatus(0)
        if failure := _failure(nodes, plants, running):
            return ExitStatus(1, failure + silent_after(listener, _reporting(running, listener), 0.2 * SILENCE_LIMIT))
        if silent := _silence(running, listener, SILENCE_LIMIT):
            return ExitStatus(1, f"the run has stalled{silent}")
        simulated = min(float(listener.status.get(name, {}).get("simulated_time", 0.0)) for name in names)
        if simulated > 0.0:
            progress(simulated)
        elif time.monotonic() > deadline:
            return not_discovered(limit)


def _failure(nodes: NodeGroup, plants: Sequence[NodeProcess], running: Sequence[NodeProcess]) -> str:
    """How the first node ended that should still run; empty if there is none. A plant may end before the others."""
    ended = [process for process in nodes.processes if process not in running]
    # Errors first: a node that lost its partner may have ended in order.
    ended.sort(key=lambda process: process.code == 0)
    return next((p.describe_exit() for p in ended if p.code or p not in plants), "")


def _reporting(running: Sequence[NodeProcess], listener: StatusListener) -> set[str]:
    """The nodes of the processes that run, of those that have reported so far."""
    own = {process.name for process in running}
    # The nodes of a group have no process of their own; all of them run until the group ends.
    grouped = len(own) > 1 and not any("/" in name for name in own)
    return {name for name in listener.heard_at if grouped or name in own}


def _silence(running: Sequence[NodeProcess], listener: StatusListener, limit: float) -> str:
    """The nodes without diagnostics for longer than a limit, as the end of an error message; none of those that have ended."""
    return silence({name: listener.heard_at[name] for name in _reporting(running, listener)}, limit)
