"""One run of a scenario by the real nodes: processes over DDS, watched to their end, recorded."""

import fcntl
import os
import signal
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import yaml

from vessel_hsmc_ros.bags import repair
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.nodes.status_listener import StatusListener
from vessel_hsmc_ros.runs.processes import MODULES, WATCHERS, NodeGroup
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import load_scenario

CONNECT_LIMIT = 20.0
"""Time the nodes get to find each other, and the live view to listen, s."""

SILENCE_LIMIT = 3.5
"""Nodes report once a second; one that has not for this long hangs, s."""

INTERRUPTED = 128
"""Added to the number of the signal that ended a run, as shells do."""

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes:
        exit_code: 0, 1 when a node failed, 128 plus the signal's number when it was interrupted.
        failure: What went wrong, in one line; empty when nothing did.
    """

    exit_code: int
    failure: str = ""


class Interrupts:
    """While its context lasts, remembers SIGINT and SIGTERM instead of acting on them."""

    def __init__(self) -> None:
        self.received = 0

    def __enter__(self) -> "Interrupts":
        self._previous = {number: signal.signal(number, self._on_signal) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        self.received = self.received or number


def run_nodes(folder: RunFolder, namespace: str, progress: Progress, live_port: int | None = None) -> Outcome:
    """Start the nodes on a folder's parameters, wait for the plant to end the run, stop them.

    Args:
        folder: Its parameters are read, its bag and logs are written.
        namespace: The nodes' namespace, without slashes at its ends.
        progress: Called with the simulated time whenever it is known anew, s.
        live_port: Where to let others watch; None for nowhere.
    """
    # The processes come first: they start while this one makes its own node, and before it has threads.
    with (
        Interrupts() as interrupts,
        watchers(folder, namespace, live_port, interrupts),
        NodeGroup(folder.parameters, folder.logs, namespace) as nodes,
        StatusListener(namespace) as listener,
    ):
        outcome = _watch(nodes, listener, interrupts, progress)
    if not outcome.failure and (bad := nodes.failed()):
        outcome = Outcome(1, bad.outcome())
    if folder.bag.exists() and not repair.is_complete(folder.bag):
        repair.repair(folder.bag)
    return outcome


@contextmanager
def watchers(folder: RunFolder, namespace: str, live_port: int | None, interrupts: Interrupts) -> Iterator[None]:
    """The nodes that let others watch, there before the run begins; whatever becomes of them later does not touch it."""
    if live_port is None:
        yield
        return
    lockstep = load_scenario(folder.parameters).controller.lockstep
    given = {"live": {"port": live_port, "lockstep": lockstep}, "markers": {"lockstep": lockstep}}
    document = {f"/**/{node}": {"ros__parameters": parameters} for node, parameters in given.items()}
    folder.logs.mkdir(parents=True, exist_ok=True)
    parameters = folder.logs / "watchers.yaml"
    parameters.write_text(yaml.safe_dump(document), encoding="utf-8")
    with NodeGroup(parameters, folder.logs, namespace, tuple(WATCHERS)) as group:
        deadline = time.monotonic() + CONNECT_LIMIT
        while not (_listens(live_port) or group.ended() or interrupts.received or time.monotonic() > deadline):
            time.sleep(0.05)
        yield


def _listens(port: int) -> bool:
    """Whether somebody listens on a port of this machine's."""
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=1.0):
            return True
    except OSError:
        return False


@contextmanager
def exclusive(namespace: str) -> Iterator[None]:
    """Keep a second run of this machine's out of a ROS domain and namespace: the nodes of the two would mix.

    Raises:
        RunError: a run is there already.
    """
    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    name = f"vessel_hsmc_ros_{os.getuid()}_{domain}_{namespace.replace('/', '.')}.lock"
    with (Path(tempfile.gettempdir()) / name).open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise RunError(
                f"another run uses ROS domain {domain} and namespace /{namespace}:"
                " give this one another --namespace in real time, or another ROS_DOMAIN_ID"
            ) from None
        yield


def _watch(nodes: NodeGroup, listener: StatusListener, interrupts: Interrupts, progress: Progress) -> Outcome:
    """Until the plant has finished, a node has failed or fallen silent, or the user has had enough."""
    deadline = time.monotonic() + CONNECT_LIMIT
    while True:
        listener.listen(0.05)
        if interrupts.received:
            name = signal.Signals(interrupts.received).name
            return Outcome(INTERRUPTED + interrupts.received, f"interrupted by {name}")
        if ended := nodes.ended():
            if ended.name == "vessel_sim" and ended.popen.returncode == 0:
                return Outcome(0)
            # Whoever has been silent for as long as another waited for him is the likely cause.
            return Outcome(1, ended.outcome() + _silence(listener, 0.5 * SILENCE_LIMIT))
        if silent := _silence(listener, SILENCE_LIMIT):
            return Outcome(1, f"the run stands still{silent}")
        simulated = float(listener.status.get("vessel_sim", {}).get("simulated_time", 0.0))
        if simulated > 0.0:
            progress(simulated)
        elif time.monotonic() > deadline:
            return Outcome(1, f"the nodes did not find each other within {CONNECT_LIMIT:g} s, see their logs")


def _silence(listener: StatusListener, limit: float) -> str:
    """Which nodes have said nothing for longer than they should, in words."""
    now = time.monotonic()
    return "".join(
        f"; {name} has been silent for {now - at:.1f} s"
        for name, at in listener.heard_at.items()
        if name in MODULES and now - at > limit
    )
