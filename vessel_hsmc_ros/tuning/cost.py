"""The cost of a set of gains: a metric over the same runs for every set, each relative to a scale of its own.

For run i the ratio is q_i = |m_i| / s_i, with the metric m_i and its scale s_i: the limit of the case where it has one for this
metric, else the value with the present gains. Ratios are clipped to [0.01, Q] with Q = 1000, and a run that fails or has no value
counts as Q: precision that is not needed does not outweigh the other runs, and a failure is never better than a poor run. With
the share f of runs that fail, the cost is

    J = (1 + Q·f)·exp(mean(log q_i))

or with the worst ratio, max(q_i), in the place of the geometric mean.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.runs.batch import Outcome
from vessel_hsmc_ros.tuning.cases import Case

FLOOR, PENALTY = 0.01, 1000.0
"""The smallest ratio, and the largest, which a run that fails has."""

AGGREGATES = ("geometric_mean", "worst")

SETTLING = "settling_time"
"""The metric that a run has no value of if it has not settled, which counts like a failure."""

ERROR, EFFORTS = "position_error_rms_last_quarter", ("yaw_moment_rms", "surge_force_rms")
"""The metric of the cost by default, and the metrics of the effort, the first of which is drawn beside another cost."""


class Cost(NamedTuple):
    """Cost and effort of a set of gains, dimensionless, and the number of runs that failed."""

    cost: float
    effort: float
    failed: int


@dataclass(frozen=True)
class Objective:
    """What is minimised.

    Attributes:
        metric: The metric of the cost, a name of core.metrics.Metrics.
        second: The metric of the effort.
        two: Whether the effort is minimised too; else it is only evaluated.
        aggregate: One of AGGREGATES.
    """

    metric: str = ERROR
    second: str = EFFORTS[0]
    two: bool = False
    aggregate: str = AGGREGATES[0]

    def __post_init__(self) -> None:
        for option, name in (("--metric", self.metric), ("--second-metric", self.second)):
            if name not in Metrics._fields:
                raise ParameterError(f"{option} {name} is not allowed: it takes one of {', '.join(Metrics._fields)}")
        if self.two and self.metric == self.second:
            raise ParameterError(f"--second-metric {self.second} is not allowed: it is the metric of the cost")

    def values(self, outcomes: Sequence[Outcome]) -> Array:
        """The two metrics of all runs, (n, 2); NaN for a run that failed or has no value."""
        return np.array([[_value(outcome, name) for name in (self.metric, self.second)] for outcome in outcomes], np.float64)

    def check(self, values: Array, failures: Sequence[str]) -> None:
        """Check that there is something to minimise.

        Args:
            values: The metrics of all runs, (n, 2).
            failures: Why a run failed; empty for one that did not.

        Raises:
            ParameterError: no run has a value of a metric, although none failed: a limit that it refers to is not set.
        """
        for name, column in zip((self.metric, self.second), values.T, strict=True):
            if name != SETTLING and np.isnan(column).all() and not any(failures):
                raise ParameterError(f"metric {name} has no value in any run: the scenario sets no limit that it refers to")

    def scales(self, cases: Sequence[Case], present: Array) -> Array:
        """The scales of all runs, (n, 2).

        Args:
            cases: The runs.
            present: The two metrics with the present gains, (n, 2), NaN where they have none.

        Returns:
            The limits of the cases, else the present values, else 1.
        """
        limits = [[case.limits.get(name, np.nan) for name in (self.metric, self.second)] for case in cases]
        scales = np.where(np.isnan(limits), present, np.array(limits))
        return np.where(np.isfinite(scales) & (scales > 0.0), scales, 1.0)

    def cost(self, values: Array, scales: Array) -> Cost:
        """The cost of a set of gains from its metrics and their scales, both (n, 2)."""
        failed = ~np.isfinite(values)
        ratios = np.clip(np.where(failed, PENALTY, values / scales), FLOOR, PENALTY)
        each = np.exp(np.log(ratios).mean(axis=0)) if self.aggregate == AGGREGATES[0] else ratios.max(axis=0)
        cost, effort = (1.0 + PENALTY * failed.mean(axis=0)) * each
        return Cost(float(cost), float(effort), int(np.count_nonzero(failed[:, 0])))


def chosen_objective(metric: str = ERROR, second_metric: str | None = None, aggregate: str = AGGREGATES[0]) -> Objective:
    """The objective by the names of the command line; without a second metric the effort is only evaluated.

    Raises:
        ParameterError: there is no metric of that name, or both are the same.
    """
    second = second_metric or next(name for name in EFFORTS if name != metric)
    return Objective(metric, second, second_metric is not None, aggregate)


def _value(outcome: Outcome, metric: str) -> float:
    """The magnitude of a metric of a run; NaN where it has none."""
    value = getattr(outcome.metrics, metric) if outcome.metrics is not None and not outcome.failure else None
    return float("nan") if value is None else abs(value)
