"""Every law over every case, offline, on all cores: figures of merit side by side."""

import importlib.util
import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError, SimulationError
from vessel_hsmc_ros.core.metrics import heading_error, position_error, reversals_per_second, rms
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.laws import LAWS
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.scenario.suite import WINDOWS, Row, Verdict, judge

Array = NDArray[np.float64]

TRACKING_LAWS = ("hierarchical", "guided", "los_pid", "nmpc")
"""The laws that follow a position; the others steer a heading."""

FALLBACK_RATE_HZ = 100.0
"""A law that is unstable at the rate asked for runs at this one, and the table says so."""

POINTS = 3000
"""Points of a line in a figure."""

SETTLED = 100.0
"""Reversals of the wrench are counted from this time on, or over the last quarter of a shorter run, s."""


class Figures(NamedTuple):
    """What a law achieved: over the row's window, in the end, and the effort of the whole run.

    Attributes:
        position_rms, position_largest: Over the row's window, m.
        position_final: m.
        heading_rms_deg: Over the row's window.
        surge_force_rms, yaw_moment_rms: N, N·m.
        reversals: How often force or moment, whichever does more, reverses the sign of its rate, 1/s.
    """

    position_rms: float
    position_largest: float
    position_final: float
    heading_rms_deg: float
    surge_force_rms: float
    yaw_moment_rms: float
    reversals: float


@dataclass(frozen=True)
class Outcome:
    """A law's run of a row.

    Attributes:
        row, law, rate_hz: What ran, and the law's rate.
        fell_back: Whether the rate is FALLBACK_RATE_HZ because the law is unstable at the one asked for.
        failure: Why there is nothing else, in one line; empty when all went well.
        figures, verdict: What came of it.
        lines: Thinned time, ship and reference positions and position error, (m, 6), for the pictures.
    """

    row: Row
    law: str
    rate_hz: float
    fell_back: bool = False
    failure: str = ""
    figures: Figures | None = None
    verdict: Verdict | None = None
    lines: Array = field(default_factory=lambda: np.empty((0, 6)))

    @property
    def hit(self) -> bool:
        """Whether the row's limits hold."""
        return self.verdict is not None and self.verdict.hit


class Task(NamedTuple):
    """One run to do: a row, a law, the law's rate (None for the row's own), and how the rate is limited."""

    row: Row
    law: str
    rate_hz: float | None


def default_laws() -> list[str]:
    """The laws that follow a position, predictive control only where CasADi is installed."""
    usable = [law for law in TRACKING_LAWS if law in LAWS]
    return [law for law in usable if law != "nmpc" or importlib.util.find_spec("casadi")]


def prepare(task: Task) -> tuple[Scenario, bool]:
    """The scenario of a task; a law that is unstable at the rate asked for falls back to FALLBACK_RATE_HZ.

    Raises:
        ScenarioError, ParameterError: the scenario or a change is wrong.
    """
    changes = {**task.row.changes, "controller.law": task.law}
    if task.rate_hz is not None:
        changes["controller.rate_hz"] = task.rate_hz
    try:
        return load_scenario(task.row.scenario, changes), False
    except ParameterError as error:
        if "unstable" not in str(error):
            raise
        return load_scenario(task.row.scenario, changes | {"controller.rate_hz": FALLBACK_RATE_HZ}), True


def run_task(task: Task) -> Outcome:
    """Run and measure one law on one row; a loop that cannot go on is an outcome too."""
    scenario, fell_back = prepare(task)
    outcome = Outcome(task.row, task.law, scenario.controller.rate_hz, fell_back)
    try:
        run = simulate(scenario)
    except (ControlError, SimulationError) as error:
        return replace(outcome, failure=str(error))
    return replace(outcome, figures=measure(task.row, run), verdict=judge(task.row, run), lines=_lines(run))


def measure(row: Row, run: Run) -> Figures:
    """The figures of a run."""
    span = run.time[-1] - run.time[0]
    late = run.time >= run.time[0] + WINDOWS[row.over] * span
    distance = position_error(run.state, run.reference)
    angle = np.degrees(heading_error(run.state, run.reference))
    after = run.time[0] + (SETTLED if span > 2.0 * SETTLED else 0.75 * span)
    return Figures(
        rms(distance[late]),
        float(distance[late].max()),
        float(distance[-1]),
        rms(angle[late]),
        rms(run.wrench[:, 0]),
        rms(run.wrench[:, 1]),
        max(reversals_per_second(run.time, run.wrench[:, i], after) for i in (0, 1)),
    )


def _lines(run: Run) -> Array:
    thin = slice(None, None, max(1, len(run.time) // POINTS))
    columns = (run.time[:, None], run.state[:, :2], run.reference[:, :2], position_error(run.state, run.reference)[:, None])
    return np.hstack(columns)[thin]


def compare(tasks: Sequence[Task], jobs: int | None = None, progress: Callable[[Outcome], None] | None = None) -> list[Outcome]:
    """Run all tasks, in processes of their own.

    Args:
        tasks: What to run.
        jobs: Processes at a time; None for one a core.
        progress: Called with each outcome as it comes.

    Returns:
        The outcomes in the order of the tasks.

    Raises:
        ScenarioError, ParameterError: a scenario, a law or a change is wrong; known before anything runs.
    """
    for task in tasks:
        prepare(task)
    workers = max(1, min(jobs or os.cpu_count() or 1, len(tasks)))
    if workers == 1:
        return [_told(run_task(task), progress) for task in tasks]
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, _end_at_interrupt) as pool:
        futures = [pool.submit(run_task, task) for task in tasks]
        for future in as_completed(futures):
            _told(future.result(), progress)
        return [future.result() for future in futures]


def _told(outcome: Outcome, progress: Callable[[Outcome], None] | None) -> Outcome:
    if progress is not None:
        progress(outcome)
    return outcome


def _end_at_interrupt() -> None:
    """A worker ends without a word when the user interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
