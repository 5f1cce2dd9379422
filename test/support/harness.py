"""The executables, started as a user would, each with a deadline."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import pytest

from vessel_hsmc_ros.cli.command import execute
from vessel_hsmc_ros.core.install_paths import PACKAGE, prefixes

Found = TypeVar("Found")


def _executables() -> Path:
    """The folder of the package's executables: lib/<package> in a colcon workspace, bin in a Python environment."""
    folders = [*(prefix / "lib" / PACKAGE for prefix in prefixes()), Path(sys.executable).parent]
    return next((folder for folder in folders if (folder / "vessel-hsmc").exists()), folders[-1])


BIN = _executables()


def executable(name: str) -> Path:
    """The path of an executable of the package, or of the Python interpreter; skips the test if it is not installed."""
    if name == "python":
        return Path(sys.executable)
    if not (BIN / name).exists():
        pytest.skip(f"{name} is not installed in lib/{PACKAGE} of a sourced workspace, nor beside {sys.executable}")
    return BIN / name


def exit_code() -> int:
    """Carry out the command of sys.argv in this process: each of its own would import and load everything again."""
    try:
        return execute()
    except SystemExit as end:
        return int(end.code or 0)


DEADLINE = 120.0
"""Time limit of a wait, s: on a busy machine a process may take half a minute to start."""


class Command:
    """A running command, by default `vessel-hsmc`, and its output.

    Args:
        arguments: The executable and its arguments.
        folder: Its working directory, where `output.txt` takes what it prints.
        environment: Variables added to the environment of this process.
    """

    def __init__(self, arguments: Sequence[object], folder: Path, environment: Mapping[str, str]) -> None:
        self.output = folder / "output.txt"
        with self.output.open("wb") as stream:
            self.popen = subprocess.Popen(
                [str(a) for a in arguments],
                cwd=folder,
                stdout=stream,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                env={**os.environ, **environment},
                start_new_session=True,
            )

    @property
    def text(self) -> str:
        """The output so far."""
        return self.output.read_text(encoding="utf-8", errors="replace")

    def wait(self, deadline: float = DEADLINE) -> int:
        """The exit code; a command that does not end within the deadline, s, is killed and fails the test."""
        try:
            return self.popen.wait(deadline)
        except subprocess.TimeoutExpired:
            self.kill()
            pytest.fail(f"still running after {deadline} s:\n{self.text}")

    def until(self, condition: Callable[[], Found], deadline: float = DEADLINE) -> Found:
        """Wait for a condition while the command runs; the test fails after the deadline, s, or if the command ends."""
        end = time.monotonic() + deadline
        while not (result := condition()):
            assert self.popen.poll() is None, f"ended with {self.popen.returncode}:\n{self.text}"
            assert time.monotonic() < end, f"the condition was not met within {deadline} s:\n{self.text}"
            time.sleep(0.02)
        return result

    def kill(self) -> None:
        """Kill the command and its children."""
        for pid in (*children(self.popen.pid), self.popen.pid):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self.popen.wait(10.0)


def children(pid: int) -> list[int]:
    """Process ids of all children, from /proc."""
    found: list[int] = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            found += [int(child) for child in path.read_text().split()]
        except OSError:
            continue
    return found


def command_line(pid: int) -> list[str]:
    """The arguments of a process; none if it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
    except OSError:
        return []


def process_name(pid: int) -> str:
    """The name of a process, of at most 15 characters: of a run, that of its node; empty if it has ended."""
    try:
        return Path(f"/proc/{pid}/comm").read_text().strip()
    except OSError:
        return ""


def run_folder(output: Path) -> Path | None:
    """The first run folder below an output folder; None if there is none yet."""
    folders = sorted(output.glob("*_*")) if output.exists() else []
    return folders[0] if folders else None
