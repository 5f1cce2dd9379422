"""The result of a tuning: the best gains, the front of trade-offs, and what both are worth on held-out runs."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.tuning.cases import Case
from vessel_hsmc_ros.tuning.cost import Cost
from vessel_hsmc_ros.tuning.gains import Gain
from vessel_hsmc_ros.tuning.journal import open_study
from vessel_hsmc_ros.tuning.plan import Evaluation, Tuning
from vessel_hsmc_ros.tuning.search import Search, Trial

EDGE = 0.02
"""A gain is at the edge of its range within this share of it."""

NOTABLE = 1.02
"""A smaller ratio of two costs counts as no difference."""

Report = Callable[[float, str], None]


@dataclass(frozen=True)
class Result:
    """The result of a tuning.

    Attributes:
        tuning: What was tuned.
        trials: All trials by number.
        best: The chosen trial.
        front: The trials that no other one beats in both cost and effort, in the order of their cost.
        present, tuned: The present and the tuned gains on the cases of the tuning.
        held_out: Cases that the search has not seen.
        held_out_present, held_out_tuned: Both sets of gains on these.
    """

    tuning: Tuning
    trials: Sequence[Trial]
    best: Trial
    front: Sequence[Trial]
    present: Evaluation
    tuned: Evaluation
    held_out: Sequence[Case]
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
    """Search the gains with the smallest cost; what a folder already contains is continued.

    Args:
        tuning: What is tuned.
        folder: An existing folder, which records the trials.
        trials: The number of trials, with those that the folder contains.
        held_out: Cases to evaluate the present and the tuned gains on.
        report: Called with the number of evaluated trials, in fractions, and a note on the best so far.

    Returns:
        The result.

    Raises:
        ParameterError: no trial has completed, or no run has a value of a metric.
        ScenarioError: the folder belongs to another tuning.
        RunError: another process is tuning in the folder, or it cannot be written.
    """
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
    """The trials that no other one beats in both cost and effort, in the order of their cost.

    Raises:
        ParameterError: no trial has completed.
    """
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
    lines = [_comparison("runs of the tuning", result.present.cost.cost, result.tuned.cost.cost)]
    before, after = result.held_out_present.cost.cost, result.held_out_tuned.cost.cost
    if not result.differs:
        lines.append("The held-out runs are the same: they contain no noise. Give --held-out other cases to see overfitting.")
    else:
        lines.append(_comparison("held-out runs", before, after))
        if before < NOTABLE * after and result.present.cost.cost > NOTABLE * result.tuned.cost.cost:
            lines.append("The gains are overfitted to the runs of the tuning.")
    if result.best != result.front[0] and (first := result.front[0].cost):
        lines.append(
            "The tuned gains are the best of those without more effort than the present ones; the smallest cost is"
            f" {first.cost:.4g}, with an effort of {first.effort:.3g}: trial {result.front[0].number} in the table of the front."
        )
    if failed := max(result.tuned.cost.failed, result.held_out_tuned.cost.failed):
        lines.append(f"With the tuned gains {failed} runs fail.")
    if edges := [gain.name for gain in result.tuning.gains if result.at_edge(gain)]:
        lines.append(f"At the edge of the range: {', '.join(edges)}; a wider range may give more.")
    return lines


def _comparison(runs: str, before: float, after: float) -> str:
    """The cost of the present and the tuned gains on some runs, as a sentence."""
    change = "falls" if before > NOTABLE * after else "rises" if after > NOTABLE * before else "does not change"
    return f"On the {runs} the cost {change}, from {before:.4g} to {after:.4g} ({before / after:.3g} times smaller)."
