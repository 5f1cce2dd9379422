"""The files of a tuning: gains as ROS parameters, trials as CSV, summary as JSON, the page with its pictures."""

import csv
import json
import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.report.diagrams import Axis, Figure, draw, layout, level, line, points, spans
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.report.tables import METRICS, label, text
from vessel_hsmc_ros.scenario.parameters_file import dump_parameters
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.studies.tuning.plan import LAW, NODE, PENALTY, Case, Cost, Evaluation, Gain
from vessel_hsmc_ros.studies.tuning.result import Result, verdict

BEST = "best.yaml"


def write(folder: Path, result: Result) -> dict[str, Path]:
    """Write best.yaml, trials.csv, tune.json, two pictures and the page; returns their paths by kind."""
    names = {
        "gains": BEST,
        "page": "tune.html",
        "front": "front.png",
        "search": "search.png",
        "trials": "trials.csv",
        "summary": "tune.json",
    }
    files = {kind: folder / name for kind, name in names.items()}
    with writing(f"results in {folder}"):
        files["gains"].write_text(gains_file(result), encoding="utf-8")
        write_trials(files["trials"], result)
        files["summary"].write_text(json.dumps(summary(result), indent=2) + "\n", encoding="utf-8")
        front, search = (
            [front_figure(result)],
            [course_figure(result), *(gain_figure(each, result) for each in result.tuning.gains)],
        )
        draw(files["front"], front)
        draw(files["search"], search)
        files["page"].write_text(render(result, front, search), encoding="utf-8")
    return files


def gains_file(result: Result) -> str:
    """The tuned gains and their law as a ROS parameters file."""
    gains = {name.removeprefix(NODE): value for name, value in result.best.gains.items()}
    values = {LAW.removeprefix(NODE): result.tuning.law, **gains}
    head = (
        f"# Gains of {result.tuning.law}, tuned by vessel-hsmc {provenance()['version']}: trial {result.best.number} of"
        f" {len(result.trials)}, cost {result.tuned.cost.cost:.4g} against {result.present.cost.cost:.4g} before.\n"
        f"# vessel-hsmc run SCENARIO --set @{BEST}; for the node, a further --params-file after that of the scenario.\n"
    )
    return head + dump_parameters({NODE.removesuffix("."): values})


def write_trials(path: Path, result: Result) -> None:
    """Write a row for each trial: gains, cost, effort, failed runs, the reason why it was pruned, whether it is on the front."""
    names = [gain.parameter for gain in result.tuning.gains]
    front = {trial.number for trial in result.front}
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["trial", *names, "cost", "effort", "failed_runs", "front", "reason"])
        for trial in result.trials:
            cost: Sequence[object] = trial.cost or ("", "", "")
            gains = [trial.gains[name] for name in names]
            writer.writerow([trial.number, *gains, *cost, int(trial.number in front), trial.reason])


def summary(result: Result) -> dict[str, Any]:
    """The content of tune.json."""
    tuning = result.tuning
    return {
        **provenance(),
        "definition": tuning.definition(),
        "trials": len(result.trials),
        "pruned": sum(trial.cost is None for trial in result.trials),
        "gains": {"present": tuning.present, "tuned": result.best.gains},
        "front": [trial.number for trial in result.front],
        "cases": _evaluations([case.name for case in tuning.cases], result.present, result.tuned),
        "held_out": _evaluations([case.name for case in result.held_out], result.held_out_present, result.held_out_tuned),
    }


def _evaluations(names: Sequence[str], present: Evaluation, tuned: Evaluation) -> dict[str, Any]:
    """Costs of both sets of gains, and the metric of every case."""
    sides = {"present": present, "tuned": tuned}
    costs = {side: each.cost._asdict() for side, each in sides.items()}
    # JSON has no NaN.
    values = {
        side: [value if math.isfinite(value) else None for value in each.values[:, 0].tolist()] for side, each in sides.items()
    }
    rows = [{"case": name, **{side: values[side][i] for side in sides}} for i, name in enumerate(names)]
    return {**costs, "runs": rows}


MAX_LISTED_RUNS = 60  # largest number of cases, and of trials of the front, that have a row of their own
Lines = list[list[str]]


def render(result: Result, front: Sequence[Figure], search: Sequence[Figure]) -> str:
    """The page, with everything in it."""
    tuning = result.tuning
    metric = label(tuning.objective.metric)
    sections = [
        Section("Gains", head=GAINS_HEAD, lines=gains_table(result), prose=True),
        Section("Cost against effort", FRONT_TEXT, figures=front),
        _front(result),
        Section("The search", _pruned(result), figures=search),
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
        for trial in result.front[:MAX_LISTED_RUNS]
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
    shown = range(len(cases)) if len(cases) <= MAX_LISTED_RUNS else order[:MAX_LISTED_RUNS]
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
    note = "" if len(cases) <= MAX_LISTED_RUNS else f"The {MAX_LISTED_RUNS} of {len(cases)} runs that have become worst."
    return Section(title, note, head=["case", "limit", "present gains", "tuned gains", "ratio"], lines=lines)


def _cell(evaluation: Evaluation, index: int, metric: str) -> str:
    return "failed" if evaluation.failures[index] else text(metric, float(evaluation.values[index, 0]))


PRESENT, TUNED, FRONT, TRIAL = "--run-1", "--run-2", "--run-0", "--shared"

MAX_SHOWN_RATIO = 30.0  # trials with more than this multiple of the smallest cost or effort are drawn at the edge


def front_figure(result: Result) -> Figure:
    """Cost against effort: all trials, the front, the present and the tuned gains."""
    costs = [trial.cost for trial in result.trials if trial.cost is not None]
    ends = [_end([cost[i] for cost in (*costs, result.present.cost)]) for i in (0, 1)]

    def efforts_and_costs(shown: Sequence[Cost]) -> tuple[Array, Array]:
        cost, effort = np.minimum([cost[:2] for cost in shown], ends).T
        return effort, cost

    front = [trial.cost for trial in result.front[::-1] if trial.cost is not None]
    shown = efforts_and_costs(costs)
    traces = [
        points(*shown, "trials", TRIAL),
        line(*efforts_and_costs(front), "front of trade-offs", FRONT, "lines+markers", shape="hv"),
        points(*efforts_and_costs([result.present.cost]), "present gains", PRESENT, "diamond", 11.0),
        points(*efforts_and_costs([result.tuned.cost]), "tuned gains", TUNED, "star", 16.0),
    ]
    objective = result.tuning.objective
    names = f"effort: {METRICS[objective.second][0]}", f"cost: {METRICS[objective.metric][0]}"
    axes = [Axis(name, logarithmic=spans(values)) for name, values in zip(names, shown, strict=True)]
    return {"title": "Cost against effort", "traces": traces, "layout": layout(axes[0], axes[1], 420, legend=True)}


def course_figure(result: Result) -> Figure:
    """The cost of the trials in their order, and the smallest so far; a cross at the top is a pruned trial."""
    costs = np.array([trial.cost.cost if trial.cost else math.nan for trial in result.trials])
    end = _end([*costs[np.isfinite(costs)], result.present.cost.cost])
    order = np.arange(float(len(costs)))
    pruned = order[np.isnan(costs)]
    traces = [
        points(order, np.minimum(costs, end), "trials", TRIAL),
        line(order, np.fmin.accumulate(costs), "smallest so far", FRONT, shape="hv"),
        *([points(pruned, np.full(len(pruned), end), "pruned", "--limit", "x")] if len(pruned) else []),
    ]
    drawn = layout(Axis("trial"), Axis("cost", logarithmic=spans(np.append(costs, end))), legend=True)
    drawn["shapes"] = [level(min(result.present.cost.cost, end), PRESENT)]
    return {"title": "Cost in the order of the trials; dashed: present gains", "traces": traces, "layout": drawn}


def gain_figure(gain: Gain, result: Result) -> Figure:
    """The cost over one gain, with the present and the tuned value."""
    completed = [(trial.gains[gain.parameter], trial.cost.cost) for trial in result.trials if trial.cost is not None]
    values, costs = np.array(completed).T
    end = _end([*costs, result.present.cost.cost])
    costs = np.minimum(costs, end)
    present = np.array([result.tuning.present[gain.parameter]]), np.array([min(result.present.cost.cost, end)])
    tuned = np.array([result.best.gains[gain.parameter]]), np.array([result.tuned.cost.cost])
    traces = [
        points(values, costs, "trials", TRIAL, size=5.0),
        points(*present, "present gains", PRESENT, "diamond", 11.0),
        points(*tuned, "tuned gains", TUNED, "star", 16.0),
    ]
    name = f"{gain.name} [{gain.unit}]" if gain.unit else gain.name
    axes = Axis(name, gain.logarithmic and spans(np.array([gain.low, gain.high]))), Axis("cost", spans(np.append(costs, end)))
    return {"title": f"Cost over {gain.name}", "traces": traces, "layout": layout(*axes)}


def _end(values: Sequence[float]) -> float:
    """The largest value to draw: a few trials whose runs fail must not compress all others."""
    return min(max(values), MAX_SHOWN_RATIO * min(values), PENALTY)
