"""The page of a tuning: what it has gained, the front of trade-offs, the gains, every case before and after."""

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from vessel_hsmc_ros.report.page_kit import Section, render_sections
from vessel_hsmc_ros.runs.sweep_figure import label, text
from vessel_hsmc_ros.tuning.cases import Case
from vessel_hsmc_ros.tuning.gains import NODE
from vessel_hsmc_ros.tuning.plan import Evaluation
from vessel_hsmc_ros.tuning.result import Result, verdict

FEW = 60
"""Largest number of cases, and of trials of the front, that have a row of their own."""

Lines = list[list[str]]


def render(result: Result, pictures: Sequence[Path]) -> str:
    """The page, with everything in it.

    Args:
        result: The result.
        pictures: Those of the front and of the search.
    """
    front, search = (path.read_bytes() for path in pictures)
    tuning = result.tuning
    metric = label(tuning.objective.metric)
    sections = [
        Section("Gains", head=GAINS_HEAD, lines=gains_table(result), prose=True),
        Section("Cost against effort", FRONT_TEXT, front),
        _front(result),
        Section("The search", _pruned(result), search),
        _cases(f"Cases: {metric}", result, tuning.cases, result.present, result.tuned),
    ]
    if result.differs:
        held_out = result.held_out_present, result.held_out_tuned
        sections.append(_cases(f"Held-out runs: {metric}", result, result.held_out, *held_out))
    return render_sections(f"Tuning of {tuning.law}", [_about(result)], sections, verdict(result))


GAINS_HEAD = ["gain", "present", "tuned", "range", ""]

FRONT_TEXT = (
    "A point is a trial. A trial on the front has no other below it and to its left: less error costs effort. Where the present"
    " gains lie on the front, only the trade-off can be changed; where they lie above it, tuning improves both."
)


def gains_table(result: Result) -> Lines:
    """A line for each gain: present and tuned value, range, and a note where the tuned one is at its edge."""
    return [
        [
            gain.parameter.removeprefix(NODE),
            f"{result.tuning.present[gain.parameter]:.4g} {gain.unit}".strip(),
            f"{result.best.gains[gain.parameter]:.4g} {gain.unit}".strip(),
            f"{gain.low:.3g} to {gain.high:.3g}",
            "at the edge" if result.at_edge(gain) else "",
        ]
        for gain in result.tuning.gains
    ]


def _about(result: Result) -> str:
    objective, trials = result.tuning.objective, result.trials
    runs = "1 run" if len(result.tuning.cases) == 1 else f"{len(result.tuning.cases)} runs"
    return (
        f"{len(trials)} trials of {runs}, offline. The cost is the {objective.aggregate.replace('_', ' ')} over the runs of"
        f" {objective.metric}, divided by its limit or, without one, by its value with the present gains; the effort is the same"
        f" of {objective.second}."
    )


def _front(result: Result) -> Section:
    """The trials of the front with their gains; the chosen one is marked."""
    head = ["trial", "cost", "effort", *(gain.name for gain in result.tuning.gains)]
    lines = [
        [
            str(trial.number),
            f"{trial.cost.cost:.4g}",
            f"{trial.cost.effort:.4g}",
            *(f"{value:.4g}" for value in trial.gains.values()),
        ]
        for trial in result.front[:FEW]
        if trial.cost is not None
    ]
    return Section("Front of trade-offs", head=head, lines=lines, marked=[str(result.best.number)])


def _pruned(result: Result) -> str:
    """How many trials were pruned, with their most frequent reason."""
    reasons = Counter(trial.reason for trial in result.trials if trial.cost is None)
    if not reasons:
        return ""
    first = next(trial.reason for trial in result.trials if trial.cost is None)
    return f"{reasons.total()} trials were pruned, because their gains are not allowed together; the first: {first}"


def _cases(title: str, result: Result, cases: Sequence[Case], present: Evaluation, tuned: Evaluation) -> Section:
    """The metric of every case before and after, those with the largest ratio first if there are many."""
    metric = result.tuning.objective.metric
    ratios = tuned.values[:, 0] / present.values[:, 0]
    order = sorted(range(len(cases)), key=lambda i: -ratios[i] if math.isfinite(ratios[i]) else -math.inf)
    shown = range(len(cases)) if len(cases) <= FEW else order[:FEW]
    lines = [
        [
            cases[i].name,
            text(metric, cases[i].limits.get(metric, math.nan)),
            _cell(present, i, metric),
            _cell(tuned, i, metric),
            f"{ratios[i]:.3g}" if math.isfinite(ratios[i]) else "",
        ]
        for i in shown
    ]
    note = "" if len(cases) <= FEW else f"The {FEW} of {len(cases)} runs that have become worst."
    return Section(title, note, head=["case", "limit", "present gains", "tuned gains", "ratio"], lines=lines)


def _cell(evaluation: Evaluation, index: int, metric: str) -> str:
    return "failed" if evaluation.failures[index] else text(metric, float(evaluation.values[index, 0]))
