"""How the operating system schedules the process of a node, by means that take no privileges."""

import ctypes
import gc
import os
import platform
import struct
from contextlib import suppress
from pathlib import Path

SLICE = 100_000
"""The time slice that the nodes of the loop request in real time, ns; Linux allows 0.1 ms to 100 ms."""

RECORDER_NICENESS = 5
"""Niceness of the recorder in real time: its queues hold seconds, the loop's periods are milliseconds."""

_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
_ATTRIBUTES = struct.Struct("IIQiIQQQII")
"""Linux's `struct sched_attr`: size, policy, flags, nice, priority, slice (`sched_runtime`), deadline, period, two clamps."""


def run_promptly() -> None:
    """Request that the threads of this process run soon after they wake, also beside a process that computes all the time.

    Linux (6.12 or later) lets a thread with a shorter slice preempt one with a longer slice. Its share of the processor time
    stays the same. Threads of another policy, such as the timed events of the middleware, and older systems keep theirs.
    """
    number = _SCHED_SETATTR.get(platform.machine())
    if number is None or platform.system() != "Linux":
        return
    libc = ctypes.CDLL(None)
    for thread in _threads():
        with suppress(OSError):  # it has just ended
            if os.sched_getscheduler(thread) == os.SCHED_OTHER:
                nice = os.getpriority(os.PRIO_PROCESS, thread)
                libc.syscall(number, thread, _ATTRIBUTES.pack(_ATTRIBUTES.size, 0, 0, nice, 0, SLICE, 0, 0, 0, 0), 0)


def run_in_batches(niceness: int = 0) -> None:
    """Use the batch policy for all threads: the process gets its share of the cores, but preempts no other.

    Args:
        niceness: Added to that of the process.
    """
    for thread in _threads():
        with suppress(OSError):  # a container may forbid it
            os.sched_setscheduler(thread, os.SCHED_BATCH, os.sched_param(0))
            os.setpriority(os.PRIO_PROCESS, thread, os.getpriority(os.PRIO_PROCESS, thread) + niceness)


def spare_collections() -> None:
    """Leave what was created at the start, hundreds of thousands of objects, out of Python's garbage collections.

    One of them would take longer than a control period.
    """
    gc.collect()
    gc.freeze()


def _threads() -> list[int]:
    return [int(thread.name) for thread in Path("/proc/self/task").iterdir()]
