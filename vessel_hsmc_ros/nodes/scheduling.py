"""How the operating system schedules a node's process: in batches, or with the options of real time that it grants."""

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from vessel_hsmc_ros.scenario.parameter_groups import RealTimeParameters

_MCL_CURRENT, _MCL_FUTURE = 1, 2  # flags of mlockall


class Outcome(NamedTuple):
    """What the operating system granted of the options, and what it refused, in words."""

    granted: list[str]
    refused: list[str]

    def __str__(self) -> str:
        parts = [f"{verb} {', '.join(each)}" for verb, each in (("granted", self.granted), ("refused", self.refused)) if each]
        return f"real-time options: {'; '.join(parts)}"


def claim(wanted: "RealTimeParameters") -> Outcome:
    """Ask for the options of real time, one after the other; those that are off are not mentioned."""
    outcome = Outcome([], [])
    for name, ask, remedy in _options(wanted):
        try:
            ask()
        except OSError as error:
            outcome.refused.append(f"{name} ({error.strerror}: {remedy})")
        else:
            outcome.granted.append(name)
    return outcome


def _options(wanted: "RealTimeParameters") -> Iterator[tuple[str, Callable[[], None], str]]:
    """Each option that is not off: its name, how to ask for it, and what to do where it is refused."""
    if cores := {core for core in wanted.cpu_affinity if core >= 0}:
        yield f"cpu_affinity {sorted(cores)}", lambda: _bind(cores), f"there are {os.cpu_count()} cores, from 0 on"
    if wanted.lock_memory:
        yield "lock_memory", _lock_memory, "give the process CAP_IPC_LOCK, or set LimitMEMLOCK=infinity"
    if priority := wanted.thread_priority:
        remedy = f"give the process CAP_SYS_NICE, or set LimitRTPRIO={priority}"
        yield f"thread_priority {priority} (SCHED_FIFO)", lambda: _use_fifo(priority), remedy


def _bind(cores: set[int]) -> None:
    _for_all_threads(os.sched_setaffinity, cores)
    if cores - os.sched_getaffinity(0):  # the kernel leaves out those that do not exist
        raise OSError(0, f"bound to {sorted(os.sched_getaffinity(0))} only")


def _lock_memory() -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def _use_fifo(priority: int) -> None:
    # What the node starts later, such as the process that writes the black box, must not have this priority.
    _for_all_threads(os.sched_setscheduler, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))


def run_in_batches() -> None:
    """Use the batch policy for all threads: the process gets its share of the cores, but preempts no other."""
    # Not a larger niceness: the threads of the middleware must answer in time too.
    with suppress(OSError):  # a container may forbid it
        _for_all_threads(os.sched_setscheduler, os.SCHED_BATCH, os.sched_param(0))


def _for_all_threads(setting: Callable[..., None], *arguments: Any) -> None:
    """Apply a setting to all threads, those of the middleware included; others that they start inherit it."""
    for thread in Path("/proc/self/task").iterdir():
        with suppress(ProcessLookupError):  # it has ended
            setting(int(thread.name), *arguments)
