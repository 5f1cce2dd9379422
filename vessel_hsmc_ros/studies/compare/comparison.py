"""Comparison of control laws: every law on every case, simulated offline on all cores; and of recorded runs."""

import importlib.util
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core.exceptions import ControlError, InstabilityError, SimulationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import heading_error, position_error, reversals_per_second, rms, travel
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.report.making import Options, read, write
from vessel_hsmc_ros.report.record import bounds, planned
from vessel_hsmc_ros.report.tables import metrics_table
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.scenario.suite import WINDOWS, Row, Verdict, judge
from vessel_hsmc_ros.simulation.compile import ensure_compiled
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.runs import worker_pool

FALLBACK_RATE_HZ = 100.0  # rate of a law that is unstable at the requested one; the notes of the comparison mention it
POINTS = 3000  # approximate number of points of a line in a figure
SETTLED = 100.0  # reversals of the wrench are counted after this transient, or over the last quarter of a shorter run, s


class LawMetrics(NamedTuple):
    """Tracking errors over the row's window and at the end, and the control effort of the whole run."""

    # position_rms, position_largest: over the row's window, m
    position_rms: float
    position_largest: float
    position_final: float  # m
    heading_rms_deg: float  # over the row's window
    # surge_force_rms, yaw_moment_rms: N, N·m
    surge_force_rms: float
    yaw_moment_rms: float
    reversals: float  # sign changes of the rate of force or moment, whichever has more, 1/s; a measure of chattering
    travel: float = math.nan  # actuator travel, the sum for force and moment, 1/min; NaN without limits
    legs: float | None = None  # cross-track error on the planned legs of the whole run, rms, m; None without legs


@dataclass(frozen=True)
class LawRun:
    """The outcome of one law on one row."""

    # row, law, rate_hz: the case, the law and its rate
    row: Row
    law: str
    rate_hz: float
    fell_back: bool = False  # whether the rate is FALLBACK_RATE_HZ because the law is unstable at the requested one
    failure: str = ""  # why the run ended early, in one line; empty if it did not
    # metrics, verdict: None for a run that ended early
    metrics: LawMetrics | None = None
    verdict: Verdict | None = None
    # decimated time, ship and reference positions and position error, (m, 6), for the figures
    lines: Array = field(default_factory=lambda: np.empty((0, 6)))

    @property
    def hit(self) -> bool:
        """Whether the run meets the row's limits."""
        return self.verdict is not None and self.verdict.hit


class Task(NamedTuple):
    """One run of a comparison: a row, a law, and the law's rate, Hz; None for the rate of the row's scenario."""

    row: Row
    law: str
    rate_hz: float | None


def default_laws() -> list[str]:
    """The laws that track the position of the reference; model predictive control only if CasADi is installed."""
    tracking = [name for name, kind in LAWS.items() if kind.controller.tracks]
    return [name for name in tracking if name != "nmpc" or importlib.util.find_spec("casadi")]


def prepare(task: Task) -> tuple[Scenario, bool]:
    """Load the scenario of a task; a law that is unstable at the requested rate falls back to FALLBACK_RATE_HZ.

    Returns the scenario, and whether the rate fell back. Raises ScenarioError if the scenario does not exist or cannot be read;
    ParameterError if a changed parameter is unknown or out of range.
    """
    changes = {**task.row.changes, "controller.law": task.law}
    if task.rate_hz is not None:
        changes["controller.rate_hz"] = task.rate_hz
    try:
        return load_scenario(task.row.scenario, changes), False
    except InstabilityError:
        return load_scenario(task.row.scenario, changes | {"controller.rate_hz": FALLBACK_RATE_HZ}), True


def run_task(task: Task, progress: Callable[[float], None] | None = None) -> LawRun:
    """Simulate and evaluate one law on one row; a simulation that fails is an outcome, not an error.

    `progress`: called with the completed fraction, from 0 to 1; may raise an exception to cancel the run.
    """
    scenario, fell_back = prepare(task)
    outcome = LawRun(task.row, task.law, scenario.controller.rate_hz, fell_back)
    try:
        run = simulate(scenario, (lambda done, total: progress(done / total)) if progress else None)
    except (ControlError, SimulationError) as error:
        return replace(outcome, failure=str(error))
    verdict = judge(task.row, run, planned(scenario))
    return replace(outcome, metrics=measure(task.row, run, scenario, verdict.legs), verdict=verdict, lines=_lines(run))


def measure(row: Row, run: Run, scenario: Scenario, legs: float = math.inf) -> LawMetrics:
    """Evaluate the metrics of a run over the window of its row.

    `legs`: cross-track error on the planned legs, rms, m; infinite where there are none.
    """
    span = run.time[-1] - run.time[0]
    window = run.time >= run.time[0] + WINDOWS[row.over] * span
    distance = position_error(run.state, run.reference)
    angle = np.degrees(heading_error(run.state, run.reference))
    # Chattering is a property of the steady state: reversals during the transient would hide it.
    settled = run.time[0] + (SETTLED if span > 2.0 * SETTLED else 0.75 * span)
    travels = [travel(run.time, run.wrench[:, i], bound) for i, bound in enumerate(bounds(scenario))]
    return LawMetrics(
        rms(distance[window]),
        float(distance[window].max()),
        float(distance[-1]),
        rms(angle[window]),
        rms(run.wrench[:, 0]),
        rms(run.wrench[:, 1]),
        max(reversals_per_second(run.time, run.wrench[:, i], settled) for i in (0, 1)),
        sum(math.nan if each is None else each for each in travels),
        legs if math.isfinite(legs) else None,
    )


def _lines(run: Run) -> Array:
    thin = slice(None, None, max(1, len(run.time) // POINTS))
    columns = (run.time[:, None], run.state[:, :2], run.reference[:, :2], position_error(run.state, run.reference)[:, None])
    return np.hstack(columns)[thin]


def compare(tasks: Sequence[Task], jobs: int | None = None, progress: Callable[[LawRun], None] | None = None) -> list[LawRun]:
    """Run all tasks in parallel processes.

    `jobs`: number of processes; None for one per core.

    Raises:
        ScenarioError: a scenario does not exist or cannot be read.
        ParameterError: a law or a changed parameter is unknown or out of range. All tasks are checked before the first one runs.
        RunError: a worker process was killed.
    """
    # All are prepared before the first one runs: a wrong name is reported at once and not after minutes of simulation.
    ensure_compiled([prepare(task)[0] for task in tasks])
    return worker_pool.run_all(run_task, tasks, workers=jobs, on_result=progress)


class Compared(NamedTuple):
    """Recorded runs side by side."""

    head: list[str]  # the names of the runs, after an empty one for the labels
    table: list[list[str]]  # label and value for each run; MISSING where a run lacks it
    files: dict[str, Path]  # the written files by kind


def compare_bags(bags: Sequence[Path], folder: RunFolder) -> Compared:
    """Compare the metrics of recorded runs, and write their common page and figures into a run folder.

    Raises BagError if a bag cannot be read or has no odometry; ReportError if the page or a figure cannot be written.
    """
    records = read(bags)
    made = write(records, Options(page=folder.report, figures="png"))
    table = [[row.label, *(row.text(run) for run in range(len(records)))] for row in metrics_table(records)]
    return Compared(["", *(record.name for record in records)], table, made.files)
