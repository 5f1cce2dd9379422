"""The executables, started as a user would, each with a deadline."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

BIN = Path(sys.executable).parent


class Command:
    """A running `vessel-hsmc`, or any other executable, and what it prints."""

    def __init__(self, arguments, folder, environment):
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
    def text(self):
        return self.output.read_text(encoding="utf-8", errors="replace")

    def wait(self, deadline):
        """The exit code; a command that does not end in time is a failure and leaves nothing behind."""
        try:
            return self.popen.wait(deadline)
        except subprocess.TimeoutExpired:
            self.kill()
            pytest.fail(f"still running after {deadline} s:\n{self.text}")

    def until(self, condition, deadline):
        """Wait for a condition while the command runs."""
        end = time.monotonic() + deadline
        while not (result := condition()):
            assert self.popen.poll() is None, f"ended with {self.popen.returncode}:\n{self.text}"
            assert time.monotonic() < end, f"it did not come to that in {deadline} s:\n{self.text}"
            time.sleep(0.02)
        return result

    def kill(self):
        for pid in (*children(self.popen.pid), self.popen.pid):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self.popen.wait(10.0)


def children(pid):
    """Process ids of all children, by /proc."""
    found = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            found += [int(child) for child in path.read_text().split()]
        except OSError:
            continue
    return found


def command_line(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
    except OSError:
        return []


def run_folder(output):
    """The one run folder below an output folder, once it is there."""
    folders = sorted(output.glob("*_*")) if output.exists() else []
    return folders[0] if folders else None
