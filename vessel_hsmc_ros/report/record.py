"""One run as a report shows it: its arrays, its metrics and its provenance.

A report reads everything from a `Run`, simulated or recorded. NaN marks quantities that a bag does not contain.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.metrics import Metrics, evaluate
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.scenario.scenario import Scenario

Array = NDArray[Any]

ORIGIN = ("scenario", "mode", "namespace", "seed", "started", "version", "git_commit", "host", "system", "python")
"""Keys of run.json that describe the origin of a run."""


class Mark(NamedTuple):
    """An event of a run: what happened at a time, s."""

    time: float
    kind: str
    text: str


@dataclass(frozen=True)
class Record:
    """One run in a report.

    Attributes:
        name: Short label of the run.
        run: Its arrays.
        metrics: None where there is no reference or no wrench to evaluate.
        facts: Further measured values by their names in run.json.
        scenario: None where the parameters are not known.
        provenance: Code version, machine and time of the run, by label.
        marks: Events of the run in the order of their times.
        verdict: One to three plain sentences on the result.
    """

    name: str
    run: Run
    metrics: Metrics | None = None
    facts: Mapping[str, Any] = field(default_factory=dict)
    scenario: Scenario | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    marks: tuple[Mark, ...] = ()
    verdict: str = ""

    @property
    def limits(self) -> tuple[float, float]:
        """Saturation limits of surge force [N] and yaw moment [N·m]; infinite where they are not known."""
        if self.scenario is None:
            return float("inf"), float("inf")
        actuators = self.scenario.vessel_sim.actuators
        return actuators.surge_force_limit, actuators.yaw_moment_limit

    @property
    def duration(self) -> float:
        """Time from the first to the last state, s."""
        return float(self.run.time[-1] - self.run.time[0])


def recorded(values: Array | None) -> bool:
    """Whether a quantity of a run was recorded, that is, contains anything but NaN."""
    return values is not None and bool(len(values)) and not np.isnan(values).all()


def held(times: Array, values: Array, at: Array) -> Array:
    """Sample-and-hold: the latest value at each of some times, the first value before that.

    Args:
        times: Sample times in any order, (n,).
        values: (n,) or (n, k).
        at: Times to evaluate at, (m,), in the unit of `times`.

    Returns:
        (m,) or (m, k).
    """
    if np.array_equal(times, at):
        return values
    order = np.argsort(times, kind="stable")  # stable: of equal times the last sample counts
    latest = np.searchsorted(times[order], at, side="right") - 1
    found: Array = values[order[np.clip(latest, 0, None)]]
    return found


def commanded(run: Run) -> tuple[Array, Array] | None:
    """Times and values of the commanded wrench, (m,) and (m, 2); None where it was not recorded."""
    values = run.control.get("commanded")
    return None if values is None or not recorded(values) else (run.control["time"], values)


def measured(run: Run, until: float = np.inf) -> Metrics | None:
    """Evaluate the metrics of a run with the applied wrench, or with the commanded one where no other was recorded.

    Args:
        run: The run.
        until: End of the evaluated interval, s.

    Returns:
        None without a reference or any wrench.
    """
    wrench, command = run.wrench, commanded(run)
    if not recorded(wrench) and command is not None:
        wrench = held(*command, run.time)
    if not recorded(run.reference) or not recorded(wrench):
        return None
    part = run.time <= until
    return evaluate(run.time[part], run.state[part], run.reference[part], wrench[part])


def over_shared_interval(records: Sequence[Record]) -> list[Record]:
    """Evaluate the metrics of runs of different duration over the interval that all of them cover.

    A run that lasts longer has more time to converge or diverge, so metrics over whole runs would not be comparable.

    Returns:
        The records; if their durations differ, with metrics of the shared interval, and the interval among their facts.
    """
    ends = [float(record.run.time[-1]) for record in records]
    if not records or min(ends) == max(ends):
        return list(records)
    shared = min(ends)
    return [
        replace(
            record,
            metrics=measured(record.run, shared) if record.metrics else None,
            facts={**record.facts, "run_duration": record.duration, "metrics_interval": shared},
        )
        for record in records
    ]
