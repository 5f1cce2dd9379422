"""The search: Optuna proposes gains by a tree-structured Parzen estimator (TPE), and the runs of all cases give their cost.

A search can be interrupted at any moment and goes on when it is started again. Its trials are a function of its definition alone:
each batch is proposed from the completed batches with random numbers of its own, so that neither an interruption nor the number
of worker processes changes them.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import optuna
from optuna.distributions import BaseDistribution, FloatDistribution, IntDistribution
from optuna.samplers import TPESampler
from optuna.trial import FrozenTrial, TrialState
from scipy.stats import qmc

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.runs.batch import Outcome
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.tuning.gains import Gain
from vessel_hsmc_ros.tuning.plan import Cost, Tuning

RUNS_OF_A_BATCH = 4
"""As many trials are proposed together as have at least this number of runs, which keeps several cores busy."""

FIRST = 10
"""Number of trials that do not depend on others."""

RESULT, REASON = "result", "reason"
"""Attributes of a trial: its cost, effort and number of failed runs; why it was pruned."""


class Trial(NamedTuple):
    """One set of gains.

    Attributes:
        number: From 0; the first has the present gains, if they are inside the ranges.
        gains: The gains by parameter.
        cost: None for a pruned trial.
        reason: Why it was pruned, such as a gain that is unstable at the rate of the law; empty if it was not.
    """

    number: int
    gains: dict[str, float]
    cost: Cost | None = None
    reason: str = ""


@dataclass(frozen=True)
class Search:
    """The trials of a tuning in a study of Optuna.

    Attributes:
        study: The study, which records them.
        scales: The scales of the metrics of all cases, (n, 2).
    """

    study: optuna.Study
    tuning: Tuning
    scales: Array

    def run(self, trials: int, report: Callable[[float, Sequence[Trial]], None]) -> list[Trial]:
        """Evaluate trials until there are so many, those recorded before included.

        `report`: called with the number of evaluated trials, in fractions, and those that are complete.
        """
        while True:
            done = self.done()
            report(len(done), done)
            if len(done) >= trials:
                return done
            batch = self._proposed(len(done))[: trials - len(done)]
            self._evaluate(batch, lambda more, done=done: report(len(done) + more, done))  # type: ignore[misc]

    def done(self) -> list[Trial]:
        """The trials that are complete or pruned."""
        finished = self.study.get_trials(deepcopy=False, states=(TrialState.COMPLETE, TrialState.PRUNED))
        return [_trial(number, each) for number, each in enumerate(finished)]

    def _proposed(self, done: int) -> list[FrozenTrial]:
        """The trials of the current batch that are not done; the batch is filled up."""
        size = math.ceil(RUNS_OF_A_BATCH / len(self.tuning.cases))
        waiting = []
        for each in self.study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
            if len(each.params) == len(self.tuning.gains):
                waiting.append(each)
            else:  # the process was killed while it was proposed
                self.study.tell(each.number, state=TrialState.FAIL)
        for number in range(done + len(waiting), (done // size + 1) * size):
            waiting.append(self._propose(number))
        return waiting

    def _propose(self, number: int) -> FrozenTrial:
        """Propose a trial: the present gains, then an even spread over the ranges, then what the finished trials suggest."""
        state = np.random.SeedSequence((self.tuning.seed, number)).generate_state(1)
        self.study.sampler = TPESampler(seed=int(state[0]), n_startup_trials=FIRST)
        # One waits already if the process was killed between these two steps; one that had begun has failed.
        if number < FIRST and not self.study.get_trials(deepcopy=False, states=(TrialState.WAITING,)):
            self.study.enqueue_trial(_first(self.tuning, number))
        proposed = self.study.ask({gain.parameter: _distribution(gain) for gain in self.tuning.gains})
        return self.study.get_trials(deepcopy=False)[proposed.number]

    def _evaluate(self, batch: Sequence[FrozenTrial], report: Callable[[float], None]) -> None:
        """Simulate the runs of a batch in one call, then record its trials in their order."""
        planned = [_scenarios(self.tuning, each.params) for each in batch]
        runs, finished = len(self.tuning.cases), 0

        def count(_: Outcome) -> None:
            nonlocal finished
            finished += 1
            report(finished / runs)

        every = [scenario for scenarios, _ in planned for scenario in scenarios]
        outcomes = iter(self.tuning.simulate(every, count))
        for each, (scenarios, reason) in zip(batch, planned, strict=True):
            values = self.tuning.objective.values([next(outcomes) for _ in scenarios])
            self._record(each, None if reason else self.tuning.objective.cost(values, self.scales), reason)

    def _record(self, each: FrozenTrial, cost: Cost | None, reason: str) -> None:
        """Record the result of a trial; a pruned one has no cost."""
        name, value = (REASON, reason) if cost is None else (RESULT, list(cost))
        # By the storage: an optuna.Trial of a trial that an earlier process proposed would be proposed again.
        self.study._storage.set_trial_user_attr(each._trial_id, name, value)
        if cost is None:
            self.study.tell(each.number, state=TrialState.PRUNED)
        else:
            # As logarithms: with two objectives the estimator weighs trials by volumes, which equal ratios should leave alone.
            self.study.tell(each.number, [math.log(value) for value in cost[: len(self.study.directions)]])


def _scenarios(tuning: Tuning, gains: dict[str, float]) -> tuple[list[Scenario], str]:
    """The scenarios of a trial, or the reason why there are none."""
    try:
        return tuning.scenarios(gains), ""
    except ParameterError as error:  # unstable at the rate of the law, or two gains that do not fit each other
        return [], str(error)


def _first(tuning: Tuning, number: int) -> dict[str, float]:
    """One of the first trials: the present gains, if they are inside the ranges, then points of a scrambled Halton sequence."""
    present = tuning.present
    if number == 0 and all(gain.low <= present[gain.parameter] <= gain.high for gain in tuning.gains):
        return present
    shares = qmc.Halton(len(tuning.gains), seed=tuning.seed).random(FIRST)[number]
    return {gain.parameter: gain.at(share) for gain, share in zip(tuning.gains, shares, strict=True)}


def _distribution(gain: Gain) -> BaseDistribution:
    if gain.whole:
        return IntDistribution(int(gain.low), int(gain.high), log=gain.logarithmic)
    return FloatDistribution(gain.low, gain.high, log=gain.logarithmic)


def _trial(number: int, each: FrozenTrial) -> Trial:
    if RESULT not in each.user_attrs:
        return Trial(number, each.params, reason=each.user_attrs.get(REASON, ""))
    cost, effort, failed = each.user_attrs[RESULT]
    return Trial(number, each.params, Cost(cost, effort, failed))
