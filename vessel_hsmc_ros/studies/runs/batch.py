"""Many runs in one call: their metrics always, their trajectories where they are kept.

Runs that have the same reference, rates and duration share it and the schedule; every run draws its own noise from its own seed.
Memory is bounded: the arrays of a run that is not kept are overwritten by the next one.
"""

import itertools
import threading
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ControlError, InstabilityError, SimulationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Metrics, evaluate_errors
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.report.record import bounds, has_legs, hull_length, measured
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.compile import is_compiled
from vessel_hsmc_ros.simulation.compiled_loop import make_loop
from vessel_hsmc_ros.simulation.loop import BRIEF
from vessel_hsmc_ros.simulation.offline import sample_count, simulate
from vessel_hsmc_ros.studies.runs import worker_pool

Progress = Callable[[float], None]

_own = threading.local()


@dataclass(frozen=True)
class Outcome:
    """The result of one run."""

    index: int  # number of the run among those of the call
    failure: str = ""  # why it ended early, in one line; empty if it did not
    metrics: Metrics | None = None  # None for a run that ended early
    run: Run | None = None  # its arrays, where they are kept; None for a run that ended early


class Task(NamedTuple):
    """A run: its number, its scenario, and how to thin its arrays, 0 to keep none."""

    number: int
    scenario: Scenario
    every: int


def simulate_many(
    scenarios: Iterable[Scenario],
    *,
    keep: Collection[int] = (),
    every: int = 1,
    workers: int | None = 1,
    on_result: Callable[[Outcome], None] | None = None,
) -> list[Outcome]:
    """Simulate and evaluate scenarios; a run that is unstable or fails is an outcome, not an error.

    `scenarios`: one for each run, with its own seed; an iterator may make each when its turn comes. `every`: of the kept
    arrays, keep every k-th row only. `workers`: number of runs at a time, in threads if the first scenario is compiled,
    otherwise in processes; None for one per core. `on_result`: called with each outcome as soon as it is known. Raises RunError
    if a worker process was killed.
    """
    outcomes: list[Outcome] = []

    def note(outcome: Outcome) -> None:
        outcomes.append(outcome)
        if on_result is not None:
            on_result(outcome)

    rest = iter(scenarios)
    first = list(itertools.islice(rest, 1))
    tasks = (Task(index, each, every if index in keep else 0) for index, each in enumerate(itertools.chain(first, rest)))
    # Machine code runs without the lock of the interpreter, so threads need not start, load and copy what processes do.
    worker_pool.stream(run_task, tasks, workers=workers, threads=all(map(is_compiled, first)), on_result=note)
    return sorted(outcomes, key=lambda outcome: outcome.index)


def run_task(task: Task, progress: Progress) -> Outcome:
    """Simulate and evaluate the run of a task."""
    return simulate_one(task.scenario, task.number, bool(task.every), task.every or 1, progress)


def simulate_one(
    scenario: Scenario, index: int = 0, keep: bool = False, every: int = 1, progress: Progress | None = None
) -> Outcome:
    """Simulate and evaluate one scenario.

    `every`: of the kept arrays, keep every k-th row only. `progress`: called now and then with the completed fraction, from 0
    to 1; may raise an exception to cancel the run.
    """
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
    loop = make_loop(scenario, samples, brief=_brief(samples))
    while loop.done < samples:
        loop.advance(min(loop.done + loop.block, samples))
        if progress:
            progress(loop.done / samples)
    found = loop.evaluated()
    return evaluate_errors(
        found.time,
        found.error,
        found.wrench,
        commanded=found.command,
        limits=bounds(scenario),
        hull_length=hull_length(scenario),
    )


def _brief(samples: int) -> Array:
    """An array for the metrics of one run of this thread after the other."""
    found: Array | None = getattr(_own, "brief", None)
    if found is None or found.shape[1] != samples:
        found = _own.brief = np.empty((BRIEF, samples))
    return found
