"""Many cases at once, offline, on as many processes as there are cores."""

import ctypes
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ProcessPoolExecutor, wait
from typing import Any

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.paper.case_run import Outcome, run_offline, scenario_of
from vessel_hsmc_ros.paper.cases import Case

POLL = 0.2
"""How often progress is told, s."""

_shared: list[Any] = []
"""In a worker: the simulated time of every case, and whether to stop."""


def durations(cases: Sequence[Case]) -> list[float]:
    """How long each case lasts in simulated time, s."""
    return [scenario_of(case).vessel_sim.duration for case in cases]


def run_all(cases: Sequence[Case], watch: Callable[[float], None]) -> dict[str, Outcome]:
    """Run cases offline, the long ones first.

    Args:
        cases: Which.
        watch: Called a few times a second with the simulated time of all cases together, s.

    Raises:
        SimulationError, ControlError: a case ended early that should not have.
        RunError: a worker was killed.
    """
    context = multiprocessing.get_context("spawn")
    done: Any = context.RawArray(ctypes.c_double, len(cases))
    stop: Any = context.RawValue(ctypes.c_bool, False)
    long_first = sorted(range(len(cases)), key=durations(cases).__getitem__, reverse=True)
    workers = min(len(os.sched_getaffinity(0)), max(len(cases), 1))
    with ProcessPoolExecutor(workers, context, _begin, (done, stop)) as pool:
        futures = {index: pool.submit(_run, index, cases[index]) for index in long_first}
        try:
            _await(list(futures.values()), lambda: watch(sum(done)))
        except BaseException:
            stop.value = True
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        return {cases[index].name: futures[index].result() for index in range(len(cases))}


def _await(futures: list[Future[Outcome]], tell: Callable[[], None]) -> None:
    """Until all are done; the first error of one is raised."""
    pending = set(futures)
    while pending:
        finished, pending = wait(pending, timeout=POLL, return_when=FIRST_EXCEPTION)
        tell()
        for future in finished:
            if isinstance(error := future.exception(), multiprocessing.ProcessError | OSError | RuntimeError):
                raise RunError(f"a worker process has ended: {error}") from None
            future.result()


def _begin(done: Any, stop: Any) -> None:
    """In a worker, before its first case: Ctrl-C is the parent's affair, and without a parent there is nothing to do."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _shared[:] = done, stop


def _end_with_parent() -> None:
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)


def _run(index: int, case: Case) -> Outcome:
    done, stop = _shared

    def progress(time: float) -> None:
        done[index] = time
        if stop.value:
            raise RunError("stopped")

    return run_offline(case, progress)
