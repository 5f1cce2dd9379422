"""The nodes as processes of the operating system: start them, hear their diagnostics, detect their exit, stop them in order."""

import ctypes
import errno
import gc
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.context import ForkProcess
from pathlib import Path
from typing import BinaryIO

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.install_paths import PROFILES, discovery, discovery_profiles
from vessel_hsmc_ros.core.node_list import CONTROLLER, GROUP, RECORDER, taking_part
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.entry_points import end_on_interrupt
from vessel_hsmc_ros.scenario.law_file import law_file_options

STOP_LIMIT = 8.0  # time limit for a process to exit after SIGINT, s, after which it is killed; generous, for busy machines
LOG_FORMAT = {"RCUTILS_CONSOLE_OUTPUT_FORMAT": "[{severity}] [{time}] [{name}]: {message}", "RCUTILS_COLORIZED_OUTPUT": "0"}
"""The log of a node is searched for its errors, whatever format the user prefers on a terminal."""

OWN_PROCESSES = 4
"""Up to so many vessels, every node has a process of its own; in real time always, so that one does not delay another."""

NODES = "vessel_hsmc_ros.nodes"  # the module that runs a node by its name
LOG_RESERVE = 16 * 1024  # disk space that is reserved for each log, bytes
_PR_SET_PDEATHSIG, _PR_SET_NAME = 1, 15
_FALLOC_FL_KEEP_SIZE = 1
_FATAL_LINE = re.compile(r"^\[FATAL\]", re.MULTILINE)
_ERROR_LINE = re.compile(r"^\[(?:ERROR|FATAL)\] \[[^]]*\] \[([^]]*)\]: (.*)$", re.MULTILINE)


Processes = Mapping[str, Sequence[str]]
"""The nodes of each process, such as `vessel_2/controller`, by its name; in the order of their start."""


def alone(names: Sequence[str]) -> Processes:
    """A process for each node."""
    return {name: (name,) for name in names}


def spread(vessels: Sequence[str], by_thrusters: bool, lockstep: bool, composed: bool = False) -> Processes:
    """Give every node a process; the nodes of a large fleet in lockstep share as many processes as there are cores.

    `vessels`: namespaces of the vessels of a fleet; none for a single vessel. `by_thrusters`: whether thrusters drive the ships,
    so that their allocations take part. `composed`: whether all nodes share one process.
    """
    nodes = taking_part(by_thrusters, vessels)
    if composed:
        return {GROUP: nodes}
    if len(vessels) <= OWN_PROCESSES or not lockstep:
        return alone(nodes)
    count = min(max(1, len(os.sched_getaffinity(0))), len(vessels))
    of_vessels = [taking_part(by_thrusters, vessels[k::count])[1:] for k in range(count)]
    return {RECORDER: (RECORDER,), **{f"group_{k + 1}": names for k, names in enumerate(of_vessels)}}


class Fork(ForkProcess):
    """A fork of this process, with what its supervisor calls of a `subprocess.Popen`; it imports nothing again."""

    def __init__(self, args: Sequence[str], work: Callable[[], int]) -> None:
        self.args = args  # the command that would do the same
        super().__init__(target=lambda: sys.exit(work()), daemon=True)
        with warnings.catch_warnings():  # of threads, which here are those of the progress bar and of NumPy
            warnings.simplefilter("ignore", DeprecationWarning)
            self.start()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self.ident or 0

    @property
    def returncode(self) -> int | None:
        """Its exit code, None while it runs."""
        return self.exitcode

    def poll(self) -> int | None:
        """Its exit code, None while it runs."""
        return self.exitcode

    def wait(self, timeout: float | None = None) -> None:
        """Wait for its end. Raises TimeoutExpired if it takes longer than a limit, s."""
        self.join(timeout)
        if self.exitcode is None:
            raise subprocess.TimeoutExpired("fork", timeout or 0.0)

    def send_signal(self, number: int) -> None:
        """Send a signal to it, if it runs."""
        if self.exitcode is None:
            os.kill(self.pid, number)


RESTART_LIMIT = 15.0  # time for a node that is started again to report, s


class StatusListener:
    """Collects the latest diagnostics of each node in a namespace, on a ROS context of its own.

    `namespace`: the nodes' namespace, without slashes at its ends. `vessels`: namespaces of the vessels of a fleet, whose nodes
    are named such as `vessel_2/controller`. `status`: the latest diagnostics values of each node. `heard_at`: time of the latest
    status of each node, on the monotonic clock, s.
    """

    created = False  # whether this process has had one, and so the middleware

    def __init__(self, namespace: str = "", vessels: Iterable[str] = ()) -> None:
        StatusListener.created = True
        self._vessels = tuple(f"{vessel}/" for vessel in vessels)
        self._prefix = f"{namespace}/" if namespace else ""
        self.status: dict[str, dict[str, str]] = {}
        self.heard_at: dict[str, float] = {}
        # No signal handlers: rclpy's would end this context at Ctrl-C, before the nodes have reported their shutdown.
        self._context = rclpy.Context()
        rclpy.init(context=self._context, args=[], signal_handler_options=SignalHandlerOptions.NO)
        with discovery():
            self._node = rclpy.create_node("run_monitor", context=self._context, start_parameter_services=False)
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_status, qos.DIAGNOSTICS)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def __enter__(self) -> "StatusListener":
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)

    def listen(self, seconds: float) -> None:
        """Wait at most a time, s, for a message, and process it."""
        self._executor.spin_once(timeout_sec=seconds)

    def on_fault(self, act: Callable[[str], str]) -> None:
        """Call a function with the text of each event of a scripted fault; a node that it names is heard of at that time."""

        def on_event(message: Event) -> None:
            if message.kind == "fault" and (back := act(message.text)):
                self.heard_at[back] = time.monotonic() + RESTART_LIMIT

        self._node.create_subscription(Event, f"/{self._prefix}{EVENTS}", on_event, qos.EVENTS)

    def _on_status(self, message: DiagnosticArray) -> None:
        latest = conversions.read_status(message.status, self._prefix)
        for vessel in self._vessels:
            latest |= {f"{vessel}{node}": status for node, status in conversions.read_status(message.status, vessel).items()}
        self.status.update(latest)
        self.heard_at.update(dict.fromkeys(latest, time.monotonic()))


def can_fork() -> bool:
    """Whether this process can be forked: the middleware, whose threads name themselves, has not run in it."""
    return not StatusListener.created and len({thread.read_text() for thread in Path("/proc/self/task").glob("*/comm")}) == 1


@dataclass(frozen=True)
class NodeProcess:
    """The process of a node, or of several, and the log file of its output."""

    name: str
    popen: subprocess.Popen[bytes] | Fork
    log: Path
    nodes: Sequence[str] = ()

    @property
    def code(self) -> int | None:
        """Its exit code, None while it runs; 0 also where the node had done its work and the middleware did not let it go."""
        code: int | None = self.popen.returncode
        judged = code != -signal.SIGALRM or _FATAL_LINE.search(self._text())
        return code if judged else 0

    def _text(self) -> str:
        return self.log.read_text(encoding="utf-8", errors="replace")

    def describe_exit(self) -> str:
        """How the process ended, as an error message."""
        code = self.code or 0
        if code < 0 and code != -signal.SIGALRM:  # Popen gives the negative number of the signal
            return f"{self.name} was killed by {signal.Signals(-code).name}"
        if code == 0:
            return f"{self.name} exited before the end of the run"
        if not (errors := _ERROR_LINE.findall(self._text())):
            return f"{self.name} failed: exit code {code}, see {self.log}"
        logger, reason = errors[-1]
        node = next((name for name in self.nodes if logger.replace(".", "/").endswith(name)), self.name)
        return f"{node} failed: {reason}"


class NodeGroup:
    """The processes of one closed loop; leaving the context stops them all.

    Args:
        namespace: Their namespace, without leading and trailing slashes.
        nodes: The nodes of each process to start, from PROGRAMS; those of a fleet with the namespaces of their vessels,
            such as `vessel_2/controller`.
        extra: Further ROS arguments of processes, by their names.

    Raises:
        RunError: a node cannot be started, for instance because the disk is full.
    """

    def __init__(
        self,
        parameters: Path,
        logs: Path,
        namespace: str,
        nodes: Processes,
        extra: Mapping[str, Sequence[str]] | None = None,
    ) -> None:
        logs.mkdir(parents=True, exist_ok=True)
        # A profile that the user has set takes precedence over that of the package; the log format must not.
        self._environment = {**os.environ, PROFILES: discovery_profiles(), **LOG_FORMAT}
        self.processes: list[NodeProcess] = []
        try:
            for name, members in nodes.items():
                command = [*node_command(members, parameters, namespace), *(extra or {}).get(name, ())]
                self._start(name, command, logs / f"{name.replace('/', '_')}.log", members)
        except OSError as error:
            self.stop()
            raise RunError(f"{name} cannot be started with its log in {logs}: {error.strerror}") from None

    def _start(self, name: str, command: list[str], log: Path, nodes: Sequence[str]) -> None:
        with log.open("ab") as output:  # the log of a node that is restarted goes on
            _reserve(output.fileno())
            popen = self._fork(name, command, output.fileno()) if can_fork() else self._execute(command, output)
        self.processes.append(NodeProcess(name, popen, log, nodes))

    def _execute(self, command: list[str], output: BinaryIO) -> subprocess.Popen[bytes]:
        """Start a command whose output goes to a file."""
        return subprocess.Popen(  # noqa: S603 - our own modules
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=self._environment,
            start_new_session=True,  # Ctrl-C must reach only the supervisor, which stops the nodes in order
            preexec_fn=_die_with_parent,
        )

    def _fork(self, name: str, command: list[str], output: int) -> Fork:
        """Run what the command of a node, or of a group of nodes, would run in a fork, whose output goes to a file."""
        from vessel_hsmc_ros.nodes import __main__, node_group  # takes as long to import as everything else

        arguments = command[command.index(NODES) + 1 :]
        node_group.import_nodes(arguments)
        gc.freeze()  # else a collection in the fork visits, and so copies, all that has been imported

        def work() -> int:
            end_on_interrupt()
            os.setsid()
            ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode())  # the first 15 characters, which `ps` and `top` show
            _die_with_parent()
            os.dup2(output, 1)
            os.dup2(output, 2)
            sys.stdout, sys.stderr = (open(number, "w", errors="replace", closefd=False) for number in (1, 2))  # noqa: SIM115
            os.environ.update(self._environment)
            sys.argv[1:] = arguments
            return __main__.main()

        return Fork(command, work)

    def __enter__(self) -> "NodeGroup":
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def send_signal(self, name: str, number: int) -> None:
        """Send a signal to the process of a node."""
        self._named(name).popen.send_signal(number)

    def restart(self, name: str) -> None:
        """Start a node that has ended once more, with the arguments of its first start."""
        old = self._named(name)
        old.popen.wait()
        self.processes.remove(old)
        command = [*map(str, old.popen.args)]  # type: ignore[arg-type] # a list, as `_start` gives it
        self._start(name, command, old.log, old.nodes)

    def _named(self, name: str) -> NodeProcess:
        return next(process for process in self.processes if process.name == name)

    def ended(self) -> bool:
        """Whether a process has ended."""
        return any(process.popen.poll() is not None for process in self.processes)

    def failed(self, but: Collection[str] = ()) -> NodeProcess | None:
        """The first process that ended with an error, if any, except those of some nodes."""
        return next((p for p in self.processes if p.code and p.name not in but), None)

    def stop(self) -> None:
        """Send SIGINT to all nodes but the recorder, then to the recorder; kill those that do not end in time."""
        self._stop([process for process in self.processes if process.name != "recorder"])
        self._stop([process for process in self.processes if process.name == "recorder"])

    def _stop(self, processes: Sequence[NodeProcess]) -> None:
        for process in processes:
            process.popen.send_signal(signal.SIGCONT)  # one that is suspended could not end
            process.popen.send_signal(signal.SIGINT)
        deadline = time.monotonic() + STOP_LIMIT
        for process in processes:
            try:
                process.popen.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                process.popen.kill()
                process.popen.wait()


def node_command(nodes: Sequence[str], parameters: Path, namespace: str) -> list[str]:
    """The command line of a node, or of a group of nodes that share a process."""
    full = ["/".join(part for part in (namespace, name) if part) for name in nodes]
    within, _, node = full[0].rpartition("/")
    grouped = len(full) > 1
    options = law_file_options() if grouped or node == CONTROLLER else []
    arguments = ["--ros-args", "--params-file", str(parameters)]
    if within and not grouped:
        arguments += ["-r", f"__ns:=/{within}"]
    return [sys.executable, "-m", NODES, *((GROUP, *full) if grouped else (node,)), *options, *arguments]


def _reserve(file: int) -> None:
    """Reserve disk space for the log of a node, so that it can still report that the disk is full."""
    libc = ctypes.CDLL(None, use_errno=True)
    size = ctypes.c_long(LOG_RESERVE)
    if libc.fallocate(file, _FALLOC_FL_KEEP_SIZE, ctypes.c_long(0), size) and ctypes.get_errno() != errno.EOPNOTSUPP:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def _die_with_parent() -> None:
    """Request that the kernel sends SIGINT to this child when its parent dies, even if the parent is killed."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGINT)
