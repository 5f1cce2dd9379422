"""The search and its result: the best gains, the front of trade-offs, and what both are worth on held-out runs.

Optuna proposes gains by a tree-structured Parzen estimator (TPE), and the runs of all cases give their cost. A search can be
interrupted at any moment and goes on when it is started again. Its trials are a function of its definition alone: each batch is
proposed from the completed batches with random numbers of its own, so that neither an interruption nor the number of worker
processes changes them.
"""

import fcntl
import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import optuna
from optuna.distributions import BaseDistribution, FloatDistribution, IntDistribution
from optuna.samplers import TPESampler
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import FrozenTrial, TrialState
from scipy.stats import qmc

from vessel_hsmc_ros.core.exceptions import ParameterError, RunError, ScenarioError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.report.tables import label, text
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.studies.batch import Outcome
from vessel_hsmc_ros.studies.tuning.plan import FLOOR, Case, Cost, Evaluation, Gain, Tuning

RUNS_OF_A_BATCH = 4  # as many trials are proposed together as have at least this number of runs, which keeps several cores busy
FIRST = 10  # number of trials that do not depend on others
RESULT, REASON = "result", "reason"  # attributes of a trial: its cost, effort and number of failed runs; why it was pruned


class Trial(NamedTuple):
    """One set of gains."""

    number: int  # from 0; the first has the present gains, if they are inside the ranges
    gains: dict[str, float]  # the gains by parameter
    cost: Cost | None = None  # None for a pruned trial
    reason: str = ""  # why it was pruned, such as a gain that is unstable at the rate of the law; empty if it was not


@dataclass(frozen=True)
class Search:
    """The trials of a tuning in a study of Optuna."""

    study: optuna.Study  # the study, which records them
    tuning: Tuning
    scales: Array  # the scales of the metrics of all cases, (n, 2)

    def run(self, trials: int, report: Callable[[float, Sequence[Trial]], None]) -> list[Trial]:
        """Evaluate trials until there are so many, those recorded before included."""
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


NAME = "tuning"

DEFINITION = "definition"  # the attribute of the study that describes the tuning


@contextmanager
def open_study(folder: Path, objectives: int, definition: Mapping[str, Any]) -> Iterator[optuna.Study]:
    """Open the study in a folder, or begin one; no other process can open it meanwhile."""
    path = folder / "journal.log"
    try:
        with (folder / "lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise RunError(f"{folder} is in use: another process is tuning there") from None
            _repair(path)
            yield _study(path, objectives, definition)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror}") from None


def _repair(path: Path) -> None:
    """Remove what a killed process may have left: half a line at the end, and the lock file of Optuna."""
    path.with_name(f"{path.name}.lock").unlink(missing_ok=True)
    if not path.exists():
        return
    content = path.read_bytes()
    if not content.startswith(b"{") and content:
        raise ScenarioError(f"{path} is not the journal of a tuning: choose another folder by --output")
    if len(content) > (end := content.rfind(b"\n") + 1):
        os.truncate(path, end)


def _study(path: Path, objectives: int, definition: Mapping[str, Any]) -> optuna.Study:
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    warnings.filterwarnings("ignore", category=optuna.exceptions.ExperimentalWarning)
    try:
        storage = JournalStorage(JournalFileBackend(str(path)))
        study = optuna.create_study(study_name=NAME, storage=storage, directions=["minimize"] * objectives, load_if_exists=True)
        recorded = study.user_attrs.get(DEFINITION)
    except (ValueError, KeyError, TypeError, AttributeError, AssertionError) as error:
        line = " ".join(str(error).split()) or type(error).__name__
        raise ScenarioError(f"{path} is not the journal of a tuning: {line}; choose another folder by --output") from None
    if recorded is None and not study.trials:
        study.set_user_attr(DEFINITION, dict(definition))
    elif different := _difference(recorded or {}, definition):
        raise ScenarioError(f"{path} belongs to another tuning: {different}; choose another folder by --output")
    return study


def _difference(recorded: Mapping[str, Any], definition: Mapping[str, Any]) -> str:
    """The first entry in which two definitions differ, in words; empty if they are equal."""
    for name, value in definition.items():
        if recorded.get(name) != value:
            there, here = ("is missing" if each is None else f"= {each}" for each in (recorded.get(name), value))
            return f"{name} {there} there and {here} here" if len(there + here) < 120 else f"other {name}"
    return ""


EDGE = 0.02  # a gain is at the edge of its range within this share of it
NOTABLE = 1.02  # a smaller ratio of two costs counts as no difference
Report = Callable[[float, str], None]


@dataclass(frozen=True)
class Result:
    """The result of a tuning."""

    tuning: Tuning
    trials: Sequence[Trial]  # all trials by number
    best: Trial
    front: Sequence[Trial]  # the trials that no other one beats in both cost and effort, in the order of their cost
    # present, tuned: the present and the tuned gains on the cases of the tuning
    present: Evaluation
    tuned: Evaluation
    held_out: Sequence[Case]  # cases that the search has not seen
    # held_out_present, held_out_tuned: both sets of gains on these
    held_out_present: Evaluation
    held_out_tuned: Evaluation

    @property
    def differs(self) -> bool:
        """Whether the held-out runs differ from those of the tuning; without noise, other seeds change nothing."""
        return not np.array_equal(self.present.values, self.held_out_present.values, equal_nan=True)

    def at_edge(self, gain: Gain) -> bool:
        """Whether the best value of a gain is at an edge of its range, beyond which a better one may lie."""
        scale = math.log if gain.logarithmic else float
        low, high, value = (scale(each) for each in (gain.low, gain.high, self.best.gains[gain.parameter]))
        return min(value - low, high - value) <= EDGE * (high - low)


def tune(tuning: Tuning, folder: Path, trials: int, held_out: Sequence[Case], report: Report) -> Result:
    """Search the gains with the smallest cost; what a folder already contains is continued."""
    with open_study(folder, 1 + tuning.objective.two, tuning.definition()) as study:
        present = tuning.evaluate(tuning.cases, {})
        tuning.objective.check(present.values, present.failures)
        done = Search(study, tuning, present.scales).run(
            trials, lambda number, finished: report(number, _note(finished, present.cost))
        )
    front = front_of(done)
    best = best_of(front, present.cost, tuning.objective.two)
    tuned = tuning.evaluate(tuning.cases, best.gains, present.scales)
    unseen = tuning.evaluate(held_out, {})
    return Result(
        tuning, done, best, front, present, tuned, held_out, unseen, tuning.evaluate(held_out, best.gains, unseen.scales)
    )


def _note(trials: Sequence[Trial], present: Cost) -> str:
    """The smallest cost so far, beside that of the present gains."""
    costs = [trial.cost.cost for trial in trials if trial.cost is not None]
    return f"smallest cost {min(costs):.4g}, present {present.cost:.4g}" if costs else ""


def front_of(trials: Sequence[Trial]) -> list[Trial]:
    """The trials that no other one beats in both cost and effort, in the order of their cost."""
    completed = sorted((trial for trial in trials if trial.cost is not None), key=_cost)
    if not completed:
        raise ParameterError(f"no trial of {len(trials)} has completed; the last one: {trials[-1].reason}")
    front: list[Trial] = []
    for trial in completed:
        if not front or _cost(trial).effort < _cost(front[-1]).effort:
            front.append(trial)
    return front


def best_of(front: Sequence[Trial], present: Cost, two: bool) -> Trial:
    """The trial of the front with the smallest cost; with two objectives, of those without more effort than the present gains."""
    economical = [trial for trial in front if _cost(trial).effort <= present.effort] if two else []
    return economical[0] if economical else front[0]


def _cost(trial: Trial) -> Cost:
    assert trial.cost is not None  # noqa: S101 - completed
    return trial.cost


def verdict(result: Result) -> list[str]:
    """The result in one to four sentences."""
    metric = result.tuning.objective.metric
    lines = [_comparison("runs of the tuning", metric, result.present, result.tuned)]
    lines += advice(result.present.cost.cost, result.tuned.cost.cost)
    before, after = result.held_out_present.cost.cost, result.held_out_tuned.cost.cost
    if not result.differs:
        lines.append("The held-out runs are the same: they contain no noise. Give --held-out other cases to see overfitting.")
    else:
        lines.append(_comparison("held-out runs", metric, result.held_out_present, result.held_out_tuned))
        if before < NOTABLE * after and result.present.cost.cost > NOTABLE * result.tuned.cost.cost:
            lines.append("The gains are overfitted to the runs of the tuning.")
    if result.best != result.front[0] and (first := result.front[0].cost):
        lines.append(
            "The tuned gains are the best of those without more effort than the present ones; the smallest cost is"
            f" {first.cost:.4g}, with an effort of {first.effort:.3g}: trial {result.front[0].number} in the table of the front."
        )
    if failed := max(result.tuned.cost.failed, result.held_out_tuned.cost.failed):
        lines.append(f"With the tuned gains {failed} {'run fails' if failed == 1 else 'runs fail'}.")
    if edges := [gain.name for gain in result.tuning.gains if result.at_edge(gain)]:
        lines.append(f"At the edge of its range: {', '.join(edges)}. A wider range may give a smaller cost.")
    return lines


def advice(present: float, tuned: float) -> list[str]:
    """What to do where no trial is better than the present gains, whose costs are given; empty where one is."""
    if tuned <= NOTABLE * present:
        return []
    return ["No trial is better: keep the present gains."]


def _comparison(runs: str, metric: str, before: Evaluation, after: Evaluation) -> str:
    """The cost and the metric of the present and the tuned gains on some runs, as a sentence."""
    old, new = before.cost.cost, after.cost.cost
    change = "falls" if old > NOTABLE * new else "rises" if new > NOTABLE * old else "does not change"
    floor = ", its floor" if bool(np.any(after.values[:, 0] < FLOOR * after.scales[:, 0])) else ""
    cost = f"On the {runs} the cost {change}, from {old:.4g} to {new:.4g}{floor} (factor {new / old:.3g})"
    both = np.isfinite(before.values[:, 0]) & np.isfinite(after.values[:, 0])
    if not both.any():
        return f"{cost}."
    mean = " in the mean" if np.count_nonzero(both) > 1 else ""
    values = (text(metric, float(np.mean(each.values[both, 0]))) for each in (before, after))
    return f"{cost}; {label(metric)}: {' before, '.join(values)} after{mean}."
