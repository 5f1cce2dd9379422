"""A sweep: one scenario simulated for each value of a parameter, or for each pair of values of two, on all cores.

`points` plans the runs, and `run_all` executes them; what executes a point may change without the plan.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import yaml

from vessel_hsmc_ros.core.exceptions import InstabilityError, ParameterError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.ros_yaml import read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compile import ensure_compiled
from vessel_hsmc_ros.studies.runs import batch, worker_pool

LAW = "controller.law"

MAX_SWEEP_POINTS = 100_000  # largest number of values of an axis
FORM = "node.param=start:stop:count, start:stop:count:log or a list such as 0.1,0.2,0.5"


class Axis(NamedTuple):
    """A swept parameter, as `node.parameter`, and its values."""

    parameter: str
    values: tuple[Any, ...]


class Point(NamedTuple):
    """One run of a sweep."""

    scenario: str
    values: tuple[Any, ...]  # its values of the swept parameters
    changes: Mapping[str, object]  # all changes to the scenario by `node.parameter`
    law: str = ""  # the law that the sweep sets; empty where the scenario selects it


@dataclass(frozen=True)
class Outcome:
    """The result of one run."""

    point: Point
    failure: str = ""  # why it has no metrics, in one line; empty if it has
    # by the names of core.metrics.Metrics; empty for a run that failed
    metrics: Mapping[str, float | None] = field(default_factory=dict)

    def value(self, metric: str) -> float:
        """A metric; NaN where the run has none."""
        found = self.metrics.get(metric)
        return math.nan if found is None else float(found)


def parse_axis(text: str) -> Axis:
    """Parse a swept parameter: `node.param=` and a range `start:stop:count`, with `:log` if spaced logarithmically, or a list.

    Raises:
        ParameterError: the text has another form, or the range is empty.
    """
    name, equals, given = text.partition("=")
    if not (equals and name.strip() and given.strip()):
        raise ParameterError(f"sweep must be {FORM} (got {text})")
    if ":" in given:
        return Axis(name.strip(), _range(text, given.split(":")))
    try:  # as a YAML list, so that values may be numbers, texts or lists themselves
        values = tuple(read_yaml(f"[{given}]"))
    except yaml.YAMLError:
        raise ParameterError(f"sweep must be {FORM} (got {text})") from None
    return Axis(name.strip(), values)


def _range(text: str, parts: Sequence[str]) -> tuple[float, ...]:
    """The values of a range: equally spaced, or with equal ratios."""
    logarithmic = parts[3:] == ["log"]
    try:
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (IndexError, ValueError):
        raise ParameterError(f"sweep must be {FORM} (got {text})") from None
    if (parts[3:] and not logarithmic) or not (math.isfinite(start) and math.isfinite(stop)):
        raise ParameterError(f"sweep must be {FORM} (got {text})")
    if not 2 <= count <= MAX_SWEEP_POINTS:
        raise ParameterError(f"count of the sweep must be an integer from 2 to {MAX_SWEEP_POINTS} (got {text})")
    if logarithmic and not start * stop > 0.0:
        raise ParameterError(f"start and stop of a sweep with log must be numbers of the same sign, not 0 (got {text})")
    space = np.geomspace if logarithmic else np.linspace
    # Rounded to 12 digits: 0.3 instead of 0.30000000000000004.
    values = tuple(float(f"{value:.12g}") for value in space(start, stop, count))
    whole = all(value.is_integer() for value in values) and not any(c in parts[0] + parts[1] for c in ".eE")
    return tuple(map(int, values)) if whole else values


def points(
    scenario: str, axes: Sequence[Axis], changes: Mapping[str, object] | None = None, laws: Sequence[str] = ()
) -> list[Point]:
    """Plan the runs of a sweep.

    Args:
        scenario: Name or path of the scenario.
        axes: The swept parameters, one or two.
        changes: Further changes by `node.parameter`.
        laws: Control laws to repeat the sweep with; none for that of the scenario.

    Returns:
        The runs, law by law; the last parameter changes fastest.

    Raises:
        ParameterError: there are not one or two different parameters.
    """
    names = [axis.parameter for axis in axes]
    if not 1 <= len(set(names)) == len(names) <= 2:
        raise ParameterError(f"sweep must have one or two different parameters (got {' and '.join(names) or 'nothing'})")
    combinations = list(itertools.product(*(axis.values for axis in axes)))
    return [
        Point(scenario, values, {**(changes or {}), **selected, **dict(zip(names, values, strict=True))}, law)
        for law, selected in [(law, {LAW: law}) for law in laws] or [("", {})]
        for values in combinations
    ]


def run_point(point: Point, progress: Callable[[float], None] | None = None) -> Outcome:
    """Simulate and evaluate one point; a run that is unstable or fails is an outcome, not an error.

    `progress`: called with the completed fraction, from 0 to 1; may raise an exception to cancel the run.
    """
    try:
        found = batch.simulate_one(load_scenario(point.scenario, point.changes), progress=progress)
    except InstabilityError as error:
        return Outcome(point, str(error))
    return Outcome(point, found.failure, found.metrics._asdict() if found.metrics else {})


def run_all(
    planned: Sequence[Point], jobs: int | None = None, on_result: Callable[[Outcome], None] | None = None
) -> list[Outcome]:
    """Run all points in parallel processes.

    Args:
        jobs: Number of processes; None for one per core.
        on_result: Called with each outcome as soon as it is known.

    Returns:
        The outcomes in the order of the runs.

    Raises:
        ScenarioError: the scenario does not exist or cannot be read.
        ParameterError: a parameter is unknown or a value is out of range. All points are checked before the first one runs.
        RunError: a worker process was killed.
    """
    ensure_compiled(filter(None, [check(point) for point in planned]))
    return worker_pool.run_all(run_point, planned, workers=jobs, on_result=on_result)


def check(point: Point) -> Scenario | None:
    """Check the scenario and the values of a point; an unstable gain is allowed, because a sweep shows where it begins.

    Returns its scenario; None if a gain is unstable. Raises ScenarioError if the scenario does not exist or cannot be read;
    ParameterError if a parameter is unknown or a value is out of range.
    """
    try:
        return load_scenario(point.scenario, point.changes)
    except InstabilityError:
        return None


def check_metrics(names: Sequence[str]) -> None:
    """Check names of metrics. Raises ParameterError if there is no metric of that name."""
    for name in names:
        if name not in Metrics._fields:
            raise ParameterError(f"--metric must be any of {', '.join(Metrics._fields)} (got {name})")
