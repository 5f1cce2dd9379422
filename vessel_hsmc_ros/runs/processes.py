"""The nodes as processes of the operating system: started, watched, stopped, none left behind."""

import ctypes
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vessel_hsmc_ros.core import node_list
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.node_list import LOOP, START_ORDER

MODULES = {name: LOOP[name].module for name in START_ORDER}
"""In the order of their start; the recorder is the last to be stopped, so that it has the final messages of all others."""

WATCHERS = {name: program.module for name, program in node_list.WATCHERS.items()}
"""Nodes that only watch a run: they may fail without harm to it."""

STOP_LIMIT = 8.0
"""Time a process gets to end by itself, s; then it is killed. It is much, because a busy machine is no reason to fail."""

PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
LOG_FORMAT = {"RCUTILS_CONSOLE_OUTPUT_FORMAT": "[{severity}] [{time}] [{name}]: {message}", "RCUTILS_COLORIZED_OUTPUT": "0"}
"""The log of a node is searched for its errors, whatever format the user prefers on a terminal."""

_PR_SET_PDEATHSIG = 1
_ERROR_LINE = re.compile(r"^\[(?:ERROR|FATAL)\].*?\]: (.*)$", re.MULTILINE)


@dataclass(frozen=True)
class NodeProcess:
    """One node's process and the file that takes what it prints."""

    name: str
    popen: subprocess.Popen[bytes]
    log: Path

    def outcome(self) -> str:
        """How an ended process ended, in words."""
        code = self.popen.returncode
        if code < 0:
            return f"{self.name} was killed by {signal.Signals(-code).name}"
        if code == 0:
            return f"{self.name} left before the run was over"
        errors = _ERROR_LINE.findall(self.log.read_text(encoding="utf-8", errors="replace"))
        return f"{self.name} failed: {errors[-1] if errors else f'exit code {code}, see {self.log}'}"


class NodeGroup:
    """The processes of one closed loop; leaving the context stops them all.

    Args:
        parameters: The ROS parameters file of all nodes.
        logs: Folder for what they print.
        namespace: Their namespace, without slashes at its ends.
        names: The nodes to start, of MODULES or WATCHERS.
    """

    def __init__(self, parameters: Path, logs: Path, namespace: str = "", names: Sequence[str] = tuple(MODULES)) -> None:
        logs.mkdir(parents=True, exist_ok=True)
        arguments = ["--ros-args", "--params-file", str(parameters)]
        if namespace:
            arguments += ["-r", f"__ns:=/{namespace}"]
        environment = {PROFILES: str(share_directory() / "config" / "fastdds.xml"), **os.environ, **LOG_FORMAT}
        self.processes: list[NodeProcess] = []
        for name in names:
            self._start(name, [sys.executable, "-m", (MODULES | WATCHERS)[name], *arguments], logs / f"{name}.log", environment)

    def _start(self, name: str, command: list[str], log: Path, environment: dict[str, str]) -> None:
        with log.open("wb") as output:
            popen = subprocess.Popen(  # noqa: S603 - our own modules
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,  # a Ctrl-C meant for the whole run must not reach the nodes by itself
                preexec_fn=_die_with_parent,
            )
        self.processes.append(NodeProcess(name, popen, log))

    def __enter__(self) -> "NodeGroup":
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def ended(self) -> NodeProcess | None:
        """The first process found to have ended, if any."""
        return next((process for process in self.processes if process.popen.poll() is not None), None)

    def failed(self) -> NodeProcess | None:
        """The first process that ended otherwise than well, if any."""
        return next((process for process in self.processes if process.popen.returncode), None)

    def stop(self) -> None:
        """Ask all but the recorder to end, then the recorder; kill whoever does not."""
        self._stop([process for process in self.processes if process.name != "recorder"])
        self._stop([process for process in self.processes if process.name == "recorder"])

    def _stop(self, processes: Sequence[NodeProcess]) -> None:
        for process in processes:
            process.popen.send_signal(signal.SIGINT)
        deadline = time.monotonic() + STOP_LIMIT
        for process in processes:
            try:
                process.popen.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                process.popen.kill()
                process.popen.wait()


def _die_with_parent() -> None:
    """Runs in the child before it becomes a node: end in an orderly way even if the command that started it is killed."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGINT)
