"""What a tuning consists of: cases, gains and objective; and the evaluation of one set of gains."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.version import __version__
from vessel_hsmc_ros.runs.batch import Outcome, simulate_many
from vessel_hsmc_ros.scenario.control import values_in_use
from vessel_hsmc_ros.scenario.scenario import Scenario, dump_scenario
from vessel_hsmc_ros.tuning.cases import Case
from vessel_hsmc_ros.tuning.cost import Cost, Objective
from vessel_hsmc_ros.tuning.gains import NODE, Gain, with_gains

MANY = 100
"""From this number of runs on, parallel processes save more time than their start takes."""


class Evaluation(NamedTuple):
    """A set of gains on a list of cases.

    Attributes:
        values: The metrics of cost and effort of every case, (n, 2); NaN for a run that failed.
        scales: Their scales, (n, 2).
        failures: Why a run ended early, in one line each; empty for one that did not.
        cost: The cost.
    """

    values: Array
    scales: Array
    failures: tuple[str, ...]
    cost: Cost


@dataclass(frozen=True)
class Tuning:
    """What is tuned.

    Attributes:
        cases: The runs of every trial; all have the same law.
        gains: The gains and their ranges.
        objective: The cost.
        seed: Seed of the search; the noise of the runs has its own.
        workers: Number of processes for the runs, which the results do not depend on; None for one per core if a trial has MANY
            runs, else one.
    """

    cases: Sequence[Case]
    gains: Sequence[Gain]
    objective: Objective
    seed: int = 1
    workers: int | None = None

    def __post_init__(self) -> None:
        if not self.gains:
            raise ParameterError("a tuning without gains is not allowed: it takes --gain controller.law.name")

    def simulate(self, scenarios: Sequence[Scenario], on_run: Callable[[Outcome], None] | None = None) -> list[Outcome]:
        """Simulate scenarios; `on_run` is called with each outcome as soon as it is known."""
        workers = self.workers or (None if len(self.cases) >= MANY else 1)
        return simulate_many(scenarios, workers=workers, on_result=on_run)

    @property
    def law(self) -> str:
        """The law that is tuned."""
        return self.cases[0].scenario.controller.law

    @cached_property
    def present(self) -> dict[str, float]:
        """The present gains: those of the first case."""
        values: dict[str, Any] = values_in_use(self.cases[0].scenario, "controller")
        return {gain.parameter: values[gain.parameter.removeprefix(NODE)] for gain in self.gains}

    def definition(self) -> dict[str, Any]:
        """What the trials depend on, in JSON types."""
        text = "".join(f"{dump_scenario(case.scenario)}{sorted(case.limits.items())}" for case in self.cases)
        names = [self.objective.metric, self.objective.second]
        return {
            "version": __version__,
            "law": self.law,
            "gains": {gain.parameter: [gain.low, gain.high, "log" if gain.logarithmic else "linear"] for gain in self.gains},
            "objectives": names[: 1 + self.objective.two],
            "effort": self.objective.second,
            "aggregate": self.objective.aggregate,
            "seed": self.seed,
            "runs": len(self.cases),
            "cases": hashlib.sha256(text.encode()).hexdigest()[:16],
        }

    def scenarios(self, gains: Mapping[str, float]) -> list[Scenario]:
        """The scenarios of all cases with other gains.

        Raises:
            InstabilityError: a gain is unstable at the rate of the law.
            ParameterError: a gain does not fit another one.
        """
        return [with_gains(case.scenario, gains) for case in self.cases]

    def evaluate(self, cases: Sequence[Case], gains: Mapping[str, float], scales: Array | None = None) -> Evaluation:
        """Simulate cases with a set of gains.

        Args:
            cases: The cases.
            gains: The gains by parameter; those that are left out keep their value.
            scales: The scales of the metrics; None for the limits of the cases, else the values of these runs.
        """
        outcomes = self.simulate([with_gains(case.scenario, gains) for case in cases])
        values = self.objective.values(outcomes)
        if scales is None:
            scales = self.objective.scales(cases, values)
        return Evaluation(values, scales, tuple(each.failure for each in outcomes), self.objective.cost(values, scales))
