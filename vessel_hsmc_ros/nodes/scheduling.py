"""How the operating system schedules the process of a node, by means that take no privileges."""

import gc
import os
from contextlib import suppress
from pathlib import Path


def run_in_batches() -> None:
    """Use the batch policy for all threads: the process gets its share of the cores, but preempts no other."""
    # Not a larger niceness: the threads of the middleware must answer in time too.
    with suppress(OSError):  # a container may forbid it
        for thread in Path("/proc/self/task").iterdir():
            os.sched_setscheduler(int(thread.name), os.SCHED_BATCH, os.sched_param(0))


def spare_collections() -> None:
    """Leave what was created at the start, hundreds of thousands of objects, out of Python's garbage collections.

    One of them would take longer than a control period.
    """
    gc.collect()
    gc.freeze()
