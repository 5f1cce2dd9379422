"""Supervision of a run by the real nodes: starts their processes, monitors and stops them, and completes the bag.

With scripted faults, the relay stands between the nodes, and processes are stopped, continued and killed.
"""

import os
import signal
import socket
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from types import FrameType

from vessel_hsmc_ros.bags import repair
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import RunError, VesselHsmcError
from vessel_hsmc_ros.core.node_list import PLANT, RELAY
from vessel_hsmc_ros.faults import THRUSTERS, FaultScript
from vessel_hsmc_ros.messages.topics import RELAYED
from vessel_hsmc_ros.nodes.fault_relay import clock_topic, stepped_nodes
from vessel_hsmc_ros.nodes.ros_environment import loopback_down
from vessel_hsmc_ros.nodes.runs.processes import NodeGroup, NodeProcess, Processes, StatusListener, alone, spread
from vessel_hsmc_ros.scenario.fault_script import dump_script
from vessel_hsmc_ros.scenario.parameter_groups import FaultRelayParameters
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.parameters_file import yaml_text
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario, relayed_topics


@dataclass(frozen=True)
class Injection:
    """The faults of a run."""

    script: FaultScript
    scenario: Scenario  # the scenario in which they are carried out

    def relayed(self, scenario: Scenario) -> Scenario:
        """The scenario as its nodes run it: they record what is relayed, and in lockstep answer every step."""
        topics = (*scenario.recorder.topics, *(f"{RELAYED}{topic}" for topic in relayed_topics(scenario)))
        made = replace(scenario, recorder=replace(scenario.recorder, topics=topics))
        names = [f"{node}.ride_through" for node, cls in NODES.items() if "ride_through" in schema.entries(cls)]
        return made.changed(dict.fromkeys(names, True)) if names and scenario.controller.lockstep else made

    def write(self, folder: Path) -> Path:
        """Write the script, and the parameters of the relay; returns the path of the parameters."""
        script = folder / "faults.yaml"
        script.write_text(dump_script(self.script), encoding="utf-8")
        sim = self.scenario.vessel_sim
        parameters = FaultRelayParameters(
            lockstep=sim.lockstep,
            recorded=sim.recorded,
            frame_prefix=sim.frame_prefix,
            script=str(script.absolute()),
            topics=relayed_topics(self.scenario),
            rate_hz=sim.rate_hz,
        )
        values = {name: list(v) if isinstance(v, tuple) else v for name, v in schema.flatten(parameters).items()}
        path = folder / "logs" / f"{RELAY}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(yaml_text({f"/**/{RELAY}": {"ros__parameters": values}}), encoding="utf-8")
        return path

    def arguments(self) -> dict[str, list[str]]:
        """Further ROS arguments of each node: what it receives comes through the relay."""
        names = {node: _remapped(node, relayed_topics(self.scenario)) for node in NODES}
        found = {node: [part for pair in pairs for part in ("-r", pair)] for node, pairs in names.items()}
        for node in stepped_nodes(self.script, self.scenario.vessel_sim.by_thrusters):
            found[node] += ["-r", f"/clock:={clock_topic(node)}", "-p", "use_sim_time:=true"]
        return found


def _remapped(node: str, topics: Sequence[str]) -> list[str]:
    """The remapping rules by which a node receives relayed messages, and by which it finds its partners in the handshake."""
    demands = [topic for topic in topics if topic.startswith(THRUSTERS)]
    received = {
        "vessel_sim": [*demands, "cmd_wrench"],
        "controller": ["odom", "reference"],
        "thruster_allocation": ["cmd_wrench", "odom"],
        # It waits for the node that reads its reference and publishes the wrench, which is the relay.
        "reference_ship": ["cmd_wrench"],
    }
    rules = [f"{topic}:={RELAYED}{topic}" for topic in received.get(node, [])]
    # With rudders the plant waits for the allocation to read its odometry, which the relay reads in its place.
    return [*rules, f"allocated_wrench:={RELAYED}odom"] if node == "vessel_sim" and demands else rules


class ProcessFaults:
    """Carries out the faults of processes, when the relay reports that they begin and end.

    Attributes:
        affected: The nodes that are absent because a fault demands it.
        restarted: The nodes started again, which may not have come up yet when the run ends.
    """

    def __init__(self, script: FaultScript, nodes: NodeGroup) -> None:
        self._nodes = nodes
        faults = [fault for fault in script.faults if fault.kind in ("kill", "stop", "restart")]
        self._begin = {f"{fault.describe()} begins": fault for fault in faults}
        self._end = {f"{fault.describe()} ends": fault for fault in faults if fault.kind != "kill"}
        self.affected: set[str] = set()
        self.restarted: set[str] = set()

    def on_event(self, text: str) -> str:
        """Carry out what an event announces; returns the name of a node that is back, empty if none is."""
        if fault := self._begin.get(text):
            self.affected.add(fault.node)
            self._nodes.send_signal(fault.node, signal.SIGSTOP if fault.kind == "stop" else signal.SIGKILL)
        elif fault := self._end.get(text):
            self.affected.discard(fault.node)
            if fault.kind == "stop":
                self._nodes.send_signal(fault.node, signal.SIGCONT)
            else:
                self._nodes.restart(fault.node)
                self.restarted.add(fault.node)
            return fault.node
        return ""


CONNECT_LIMIT = 20.0
"""Time limit for the discovery of the nodes after the last of them has first reported, and for the start of the live view, s:
beside busy processes the start itself may take longer."""
CONNECT_LIMIT_PER_VESSEL = 10.0
"""Further time for the discovery of the nodes of each vessel of a fleet, s: their processes share the cores while they start."""

SILENCE_LIMIT, SILENCE_LIMIT_OF_FLEET = 3.5, 10.0
"""A node publishes diagnostics every second; without any for this time, s, it is considered to hang. The many processes of a
fleet share the cores."""

REPORT_LIMIT = 2.0  # time within which a node that lives reports, s
STARVED_LIMIT = 20.0
"""After this time, s, without a report of any node all of them are considered to hang, not the machine to be busy."""

INTERRUPTED = 128  # offset of the exit code after a signal, whose number is added to it, as in a shell
Progress = Callable[[float], None]


@dataclass(frozen=True)
class ExitStatus:
    """How a run ended."""

    code: int  # 0; 1 if a node failed; 128 plus the number of the signal that interrupted the run
    failure: str = ""  # what failed, in one line; empty if nothing did


class Interrupts:
    """A context in which SIGINT and SIGTERM are recorded instead of ending the process."""

    def __init__(self) -> None:
        self.received = 0

    def __enter__(self) -> "Interrupts":
        self._previous = {number: signal.signal(number, self._on_signal) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)

    def status(self) -> ExitStatus | None:
        """How a run that was interrupted ends; None without an interrupt."""
        if not self.received:
            return None
        return ExitStatus(INTERRUPTED + self.received, f"interrupted by {signal.Signals(self.received).name}")

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        self.received = self.received or number


def after_shutdown(status: ExitStatus, failed: NodeProcess | None, bag: Path) -> ExitStatus:
    """How a run ended whose nodes have shut down, its bag complete.

    `failed`: a node that has failed; one may do so after the plant has ended the run.
    """
    if not status.failure and failed:
        status = ExitStatus(1, failed.describe_exit())
    try:
        if bag.exists() and not repair.is_complete(bag):
            repair.repair(bag)
    except VesselHsmcError as error:  # the bag of a run that failed may be empty; its failure is what matters
        status = status if status.code else ExitStatus(1, str(error))
    return status


def silence(heard_at: Mapping[str, float], limit: float) -> str:
    """The nodes without diagnostics for longer than a limit, as the end of an error message.

    `heard_at`: times of the latest diagnostics of the nodes that should have some, on the monotonic clock, s.
    """
    now = time.monotonic()
    latest = min(max(heard_at.values(), default=now), now)
    # Where no node reports, the machine is busy, or this process was: silence counts from the latest report of any.
    at_last = now if now - latest > STARVED_LIMIT else latest
    return _named({name: at for name, at in heard_at.items() if at_last - at > limit})


def _named(silent: Mapping[str, float]) -> str:
    """The silent nodes by the times of their latest diagnostics, as the end of an error message."""
    now = time.monotonic()
    return "".join(f"; {name} has been silent for {now - at:.1f} s" for name, at in silent.items())


def silent_after(listener: StatusListener, names: Collection[str], limit: float) -> str:
    """The nodes that report nothing any more after another has ended, as the end of an error message.

    A node that gave up waiting names itself; the one that it waited for is the likely cause. It may have reported just before
    it hung, or never: so this listens until every node has reported again, or for the limit. `limit`: the limit, s; longer than
    the period of diagnostics.
    """
    failed_at = time.monotonic()
    quiet = {*names}
    while quiet and time.monotonic() < failed_at + limit:
        listener.listen(0.05)
        quiet = {name for name in names if listener.heard_at.get(name, 0.0) <= failed_at}
    return _named({name: listener.heard_at.get(name, failed_at) for name in sorted(quiet)})


def not_discovered(limit: float) -> ExitStatus:
    """The end of a run whose nodes have not found each other in time."""
    return ExitStatus(1, f"the nodes did not discover each other within {limit:g} s, see their logs{loopback_down()}")


def supervise(
    folder: RunFolder,
    scenario: Scenario,
    namespace: str,
    progress: Progress,
    live_port: int | None = None,
    injection: Injection | None = None,
    vessels: Sequence[str] = (),
    composed: bool = False,
) -> ExitStatus:
    """Start the nodes, wait until every plant has ended the run, stop them.

    `folder`: run folder with the parameters of the nodes; the bag and the logs are written there. `namespace`: namespace of the
    nodes, without leading and trailing slashes. `live_port`: port of the live view; None for no live view. `vessels`: namespaces
    of the vessels of a fleet, which have one recorder. `composed`: whether all nodes share one process. Returns how the run
    ended; a failure names the node, with the namespace of its vessel in a fleet, and is not raised.
    """
    extra = injection.arguments() if injection else {}
    lockstep = scenario.controller.lockstep
    processes = spread(vessels, scenario.vessel_sim.by_thrusters, lockstep, composed)
    # The processes come first: they start while this one creates its own node, and before it has threads (they are forked).
    with (
        Interrupts() as interrupts,
        live_view(folder, namespace, lockstep, live_port, interrupts),
        relaying(injection, folder, namespace) as relay,
        NodeGroup(folder.parameters, folder.logs, namespace, processes, extra) as nodes,
        StatusListener(namespace, vessels) as listener,
    ):
        faults = ProcessFaults(injection.script if injection else FaultScript(), nodes)
        listener.on_fault(faults.on_event)
        status = _monitor(Watched(processes, nodes, relay, listener, faults), interrupts, progress)
    return after_shutdown(status, relay.failed() or nodes.failed(but=faults.affected | faults.restarted), folder.bag)


def relaying(injection: Injection | None, folder: RunFolder, namespace: str) -> NodeGroup:
    """The process of the relay, if there are faults."""
    if injection is None:
        return NodeGroup(folder.parameters, folder.logs, namespace, {})
    return NodeGroup(injection.write(folder.path), folder.logs, namespace, alone((RELAY,)))


@contextmanager
def live_view(folder: RunFolder, namespace: str, lockstep: bool, live_port: int | None, interrupts: Interrupts) -> Iterator[None]:
    """A context in which the nodes of the live view run; ready when it is entered; their failure does not affect the run.

    `interrupts`: an interrupt ends the wait for the port.
    """
    if live_port is None:
        yield
        return
    settings = {"live": {"port": live_port, "lockstep": lockstep}, "markers": {"lockstep": lockstep}}
    document = {f"/**/{node}": {"ros__parameters": parameters} for node, parameters in settings.items()}
    folder.logs.mkdir(parents=True, exist_ok=True)
    parameters = folder.logs / "watchers.yaml"
    parameters.write_text(yaml_text(document), encoding="utf-8")
    with NodeGroup(parameters, folder.logs, namespace, alone((*settings,))) as group:
        deadline = time.monotonic() + CONNECT_LIMIT
        while not (_is_listening(live_port) or group.ended() or interrupts.received or time.monotonic() > deadline):
            time.sleep(0.05)
        yield


def _is_listening(port: int) -> bool:
    """Whether a process listens on a port of this machine."""
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=1.0):
            return True
    except OSError:
        return False


@contextmanager
def exclusive(namespace: str, lockstep: bool = False, domain: str | None = None) -> Iterator[None]:
    """A context in which no other run on this machine uses the ROS domain and namespace, so that nodes do not mix.

    In lockstep the plant publishes /clock, which has no namespace: one such run excludes all others of its domain. Of several
    runs that start at the same instant exactly one gets the lock. `domain`: the ROS domain; by default that of this process.
    Raises RunError if another run uses them.
    """
    domain = domain or os.environ.get("ROS_DOMAIN_ID", "0")
    shared = {namespace.replace("/", "."): f"namespace /{namespace}"}
    if lockstep:
        shared["@clock"] = "its /clock in lockstep"  # no namespace has such a name
    with ExitStack() as locks:
        for name, meaning in shared.items():
            # A name instead of a file: it is the same for all users, as the domain is, and nothing is left behind. The kernel
            # releases it when this process ends, even if it is killed.
            lock = locks.enter_context(socket.socket(socket.AF_UNIX))
            try:
                lock.bind(f"\0vessel_hsmc_ros_{domain}_{sha256(name.encode()).hexdigest()[:32]}")  # such names have 107 bytes
            except OSError:
                raise RunError(
                    f"another run uses ROS domain {domain} and {meaning}: give this one another namespace in real time"
                    " (--namespace, or namespace:= in launch), or another ROS_DOMAIN_ID"
                ) from None
        yield


@dataclass(frozen=True)
class Watched:
    """A run under supervision: its processes, and what its nodes report."""

    processes: Processes
    nodes: NodeGroup
    relay: NodeGroup
    listener: StatusListener
    faults: ProcessFaults

    @property
    def plants(self) -> list[str]:
        """The names of the plants."""
        return [name for part in self.processes.values() for name in part if name.endswith(PLANT)]

    def simulated(self) -> float:
        """The simulated time that all plants have reported, s; 0 before the first step of one of them."""
        return min(float(self.listener.status.get(name, {}).get("simulated_time", 0.0)) for name in self.plants)

    def end(self) -> ExitStatus | None:
        """How the run has ended by the end of its plants, or of a node that should still run; None if it goes on."""
        ended = [p for p in (*self.nodes.processes, *self.relay.processes) if p.popen.poll() is not None]
        ended = [process for process in ended if process.name not in self.faults.affected]
        codes = {process.name: process.code for process in ended}
        pacing = [name for name, part in self.processes.items() if not set(part).isdisjoint(self.plants)]
        if all(codes.get(name) == 0 for name in pacing):
            return ExitStatus(0)
        ended.sort(key=lambda process: process.code == 0)  # errors first: a node that lost its partner may have ended in order
        # A plant of a fleet may end before the others.
        failure = next((p.describe_exit() for p in ended if p.code or p.name not in pacing), "")
        if not failure:
            return None
        return ExitStatus(1, failure + silent_after(self.listener, self.reporting() if self.simulated() else (), REPORT_LIMIT))

    def reporting(self) -> set[str]:
        """The nodes of the processes that run, of those that have reported so far; none that is absent on demand."""
        processes = [process.name for process in self.nodes.processes if process.popen.poll() is None]
        running = {name for process in processes for name in self.processes[process]}
        return {name for name in self.listener.heard_at if name in running} - self.faults.affected

    def silence(self, limit: float) -> str:
        """The nodes that are silent, as the end of an error message."""
        return silence({name: self.listener.heard_at[name] for name in self.reporting()}, limit)


def _monitor(run: Watched, interrupts: Interrupts, progress: Progress) -> ExitStatus:
    """Wait until all plants have finished, a node has failed or stopped reporting, or the run is interrupted."""
    fleet = len(run.plants) > 1
    silence_limit = SILENCE_LIMIT_OF_FLEET if fleet else SILENCE_LIMIT
    connect_limit = CONNECT_LIMIT + CONNECT_LIMIT_PER_VESSEL * len(run.plants) * fleet
    started, deadline = 0, time.monotonic() + connect_limit
    while True:
        run.listener.listen(0.05)
        if ended := interrupts.status() or run.end():
            return ended
        if run.silence(silence_limit):
            # The first to reach the limit may be a node that waits for one that hangs and is hardly younger.
            return ExitStatus(1, f"the run has stalled{run.silence(0.5 * silence_limit)}")
        if len(run.listener.heard_at) > started:
            started, deadline = len(run.listener.heard_at), time.monotonic() + connect_limit
        if simulated := run.simulated():
            progress(simulated)
        elif time.monotonic() > deadline:
            return not_discovered(connect_limit)
