"""Many runs at a time: any function over many tasks in worker processes or threads, and scenarios with their metrics.

Runs that have the same reference, rates and duration share it and the schedule; every run draws its own noise from its own seed.
Memory is bounded: the arrays of a run that is not kept are overwritten by the next one.
"""

import contextlib
import ctypes
import itertools
import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from vessel_hsmc_ros.core.exceptions import ControlError, InstabilityError, RunError, SimulationError
from vessel_hsmc_ros.core.metrics import Metrics, Run, evaluate_errors
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.report.record import bounds, has_legs, hull_length, measured
from vessel_hsmc_ros.scenario.law_file import load_law_file, loaded_law_files
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.compilation import uninterrupted
from vessel_hsmc_ros.simulation.compile import is_compiled
from vessel_hsmc_ros.simulation.compiled_loop import make_loop
from vessel_hsmc_ros.simulation.loop import BRIEF
from vessel_hsmc_ros.simulation.offline import sample_count, simulate

T = TypeVar("T")
R = TypeVar("R")
Progress = Callable[[float], None]

POLL = 0.2  # period at which the progress of all tasks is reported, s
AHEAD = 2  # of a stream, so many tasks are taken for each worker
_shared: list[Any] = []  # in a worker process: the progress of every task, and the flag that cancels them


def run_all(
    function: Callable[[T, Progress], R],
    tasks: Sequence[T],
    *,
    workers: int | None = None,
    on_result: Callable[[R], None] | None = None,
    on_progress: Progress | None = None,
) -> list[R]:
    """Call a function with every task, in worker processes, or in this process if one worker is sufficient.

    `function` stands at the top level of a module; it is called with a task and a callback for the progress of that task, whose
    sum `on_progress` gets several times a second. The first error of a task cancels the others, as does an interrupt (Ctrl-C):
    each ends at its next report of progress. The results have the order of the tasks; the longest first keeps all workers busy.
    """
    results: dict[int, R] = {}

    def note(index: int, result: R) -> None:
        results[index] = result
        if on_result is not None:
            on_result(result)

    workers = min(workers or len(os.sched_getaffinity(0)), len(tasks))
    _perform(function, tasks, workers, False, note, len(tasks), on_progress)
    return [results[index] for index in range(len(tasks))]


def stream(
    function: Callable[[T, Progress], R],
    tasks: Iterable[T],
    *,
    workers: int | None = None,
    threads: bool = False,
    on_result: Callable[[R], None],
) -> None:
    """Call a function with every task as `run_all`; an iterator makes each task when its turn comes.

    `threads` are for functions that spend their time outside of the interpreter.
    """
    workers = workers or len(os.sched_getaffinity(0))
    _perform(function, tasks, workers, threads, lambda _, result: on_result(result), AHEAD * workers)


def _perform(
    function: Callable[[T, Progress], R],
    tasks: Iterable[T],
    workers: int,
    threads: bool,
    note: Callable[[int, R], None],
    ahead: int,
    on_progress: Progress | None = None,
) -> None:
    """Call a function with every task, so many ahead of those that run, and note the results with their numbers."""
    if workers <= 1:
        _run_here(function, tasks, note, on_progress)
        return
    pending: dict[Future[R], int] = {}

    def take() -> None:
        done, _ = wait(pending, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in done:
            try:
                note(pending.pop(future), future.result())
            except BrokenProcessPool as error:
                raise RunError(f"a worker process has died: {error}") from None
        if on_progress is not None:
            on_progress(sum(progress))

    with _threads(workers) if threads else _processes(workers, ahead) as (submit, progress):
        for index, task in enumerate(tasks):
            pending[submit(function, index % ahead, task)] = index
            while len(pending) >= ahead:
                take()
        while pending:
            take()


def _run_here(
    function: Callable[[T, Progress], R], tasks: Iterable[T], note: Callable[[int, R], None], on_progress: Progress | None
) -> None:
    """Call a function with every task in this process."""
    progress: dict[int, float] = {}
    for index, task in enumerate(tasks):

        def report(value: float, index: int = index) -> None:
            if on_progress is not None:
                progress[index] = value
                on_progress(sum(progress.values()))

        note(index, function(task, report))


Submit = Callable[[Callable[[Any, Progress], Any], int, Any], Future[Any]]


@contextlib.contextmanager
def _processes(workers: int, slots: int) -> Iterator[tuple[Submit, Any]]:
    """A context with worker processes and the progress of so many tasks; an exception in it cancels them."""
    context = multiprocessing.get_context("spawn")  # a forked copy of a process with threads may deadlock
    # Shared memory without locks: each worker writes its own element, and a stale value is harmless.
    progress: Any = context.RawArray(ctypes.c_double, slots)
    cancelled: Any = context.RawValue(ctypes.c_bool, False)
    with ProcessPoolExecutor(workers, context, _prepare_worker, (progress, cancelled, loaded_law_files())) as pool:
        try:
            resource_tracker.ensure_running()  # as it unblocks the signal when the first worker needs it
            yield partial(_submit, pool), progress
        except BaseException:  # KeyboardInterrupt too
            # Wait for the workers: one that still reports progress would write into memory that a later pool may own by then.
            cancelled.value = True
            pool.shutdown(wait=True, cancel_futures=True)
            raise


@contextlib.contextmanager
def _threads(workers: int) -> Iterator[tuple[Submit, Sequence[float]]]:
    """A context with threads, whose tasks an exception in it cancels."""
    cancelled = threading.Event()

    def report(_: float) -> None:
        if cancelled.is_set():
            raise RunError("cancelled")

    with ThreadPoolExecutor(workers) as pool:
        try:
            yield lambda function, _, task: pool.submit(function, task, report), ()
        except BaseException:
            cancelled.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _submit(pool: Executor, function: Callable[[Any, Progress], R], index: int, task: Any) -> Future[R]:
    """Submit a task to worker processes, some of which the pool starts here; an interrupt waits meanwhile.

    It would leave a worker half started, which prints a traceback. A worker inherits the blocked signal and ignores it as soon as
    it runs; blocked alone, the signal could still reach this process through another thread.
    """

    def start() -> Future[R]:
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return pool.submit(_run_task, function, index, task)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    submitted: Future[R] = uninterrupted(start, ())
    return submitted


def _prepare_worker(progress: Any, cancelled: Any, law_files: Sequence[Path]) -> None:
    """Initialise a worker process, in which the laws of the parent's files are needed too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent cancels the tasks
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # which a process that a task starts would inherit
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    _shared[:] = progress, cancelled
    logging.disable(logging.WARNING)  # of installed laws that are left out: the parent has logged it
    for file in law_files:
        load_law_file(file)


def _exit_with_parent() -> None:
    """End this worker when its parent ends, even if the parent was killed."""
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)


def _run_task(function: Callable[[Any, Progress], R], index: int, task: Any) -> R:
    progress, cancelled = _shared

    def report(value: float) -> None:
        progress[index] = value
        if cancelled.value:
            raise RunError("cancelled")

    return function(task, report)


_own = threading.local()


@dataclass(frozen=True)
class Outcome:
    """The result of one run."""

    index: int  # number of the run among those of the call
    failure: str = ""  # why it ended early, in one line; empty if it did not
    metrics: Metrics | None = None  # None for a run that ended early
    run: Run | None = None  # its arrays, where they are kept; None for a run that ended early


def simulate_many(
    scenarios: Iterable[Scenario],
    *,
    keep: Collection[int] = (),
    every: int = 1,
    workers: int | None = 1,
    on_result: Callable[[Outcome], None] | None = None,
) -> list[Outcome]:
    """Simulate and evaluate scenarios; a run that is unstable or fails is an outcome, not an error.

    `workers`: number of runs at a time, in threads if the first scenario is compiled, otherwise in processes; None for one per
    core.
    """
    outcomes: list[Outcome] = []

    def note(outcome: Outcome) -> None:
        outcomes.append(outcome)
        if on_result is not None:
            on_result(outcome)

    rest = iter(scenarios)
    first = list(itertools.islice(rest, 1))
    tasks = ((each, index, index in keep, every) for index, each in enumerate(itertools.chain(first, rest)))
    # Machine code runs without the lock of the interpreter, so threads need not start, load and copy what processes do.
    stream(_simulate_task, tasks, workers=workers, threads=all(map(is_compiled, first)), on_result=note)
    return sorted(outcomes, key=lambda outcome: outcome.index)


def _simulate_task(task: tuple[Scenario, int, bool, int], progress: Progress) -> Outcome:
    return simulate_one(*task, progress)


def simulate_one(
    scenario: Scenario, index: int = 0, keep: bool = False, every: int = 1, progress: Progress | None = None
) -> Outcome:
    """Simulate and evaluate one scenario."""
    try:
        # The legs are judged by the positions, which a run that is only to be evaluated does not keep.
        if not keep and not has_legs(scenario):
            return Outcome(index, metrics=_metrics(scenario, progress))
        run = simulate(scenario, (lambda done, total: progress(done / total)) if progress else None)
    except (ControlError, SimulationError, InstabilityError) as error:
        return Outcome(index, str(error))
    kept = (run if every == 1 else thinned(run, every)) if keep else None
    return Outcome(index, metrics=measured(run, scenario), run=kept)


def thinned(run: Run, every: int) -> Run:
    """Every k-th row of the arrays of a run."""
    names = [name for name in run.__dataclass_fields__ if name != "control"]
    arrays = {name: getattr(run, name)[::every].copy() for name in names}
    return replace(run, **arrays, control={name: values[::every].copy() for name, values in run.control.items()})


def _metrics(scenario: Scenario, progress: Progress | None) -> Metrics:
    """The metrics of a run, as `report.record.measured` gives them, without keeping more than they need."""
    grid = RateGrid(scenario.vessel_sim.rate_hz)
    samples = sample_count(scenario.vessel_sim.duration, grid)
    # An array for the metrics of one run of this thread after the other.
    brief = getattr(_own, "brief", None)
    if brief is None or brief.shape[1] != samples:
        brief = _own.brief = np.empty((BRIEF, samples))
    loop = make_loop(scenario, samples, brief=brief)
    while loop.done < samples:
        loop.advance(min(loop.done + loop.block, samples))
        if progress:
            progress(loop.done / samples)
    found = loop.evaluated()
    return evaluate_errors(
        found.time, found.error, found.wrench, commanded=found.command, limits=bounds(scenario), hull_length=hull_length(scenario)
    )
