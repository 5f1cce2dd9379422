"""The files of a tuning: gains as ROS parameters, trials as CSV, summary as JSON, the page with its pictures."""

import csv
import json
import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.report.diagrams import LIMIT, NEUTRAL, SERIES, figure
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.report.tables import METRICS, label, text
from vessel_hsmc_ros.scenario.parameters_file import dump_parameters
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.studies.tuning.plan import LAW, NODE, PENALTY, Case, Cost, Evaluation, Gain
from vessel_hsmc_ros.studies.tuning.result import Result, verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
        draw_front(files["front"], result)
        draw_search(files["search"], result)
        files["page"].write_text(render(result, [files["front"], files["search"]]), encoding="utf-8")
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
    rows = [
        {"case": name, **{side: _finite(float(each.values[i, 0])) for side, each in sides.items()}}
        for i, name in enumerate(names)
    ]
    return {**costs, "runs": rows}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None  # JSON has no NaN


MAX_LISTED_RUNS = 60  # largest number of cases, and of trials of the front, that have a row of their own
Lines = list[list[str]]


def render(result: Result, pictures: Sequence[Path]) -> str:
    """The page, with everything in it."""
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


PRESENT, TUNED, FRONT = SERIES[1], SERIES[2], SERIES[0]

COLUMNS = 4  # largest number of panels in a row of the gains
LOGARITHMIC_RATIO = 10.0  # ratio of the largest to the smallest value from which on an axis is logarithmic
MAX_SHOWN_RATIO = 30.0  # trials with more than this multiple of the smallest cost or effort are drawn at the edge


def draw_front(path: Path, result: Result) -> None:
    """Draw cost against effort: all trials, the front, the present and the tuned gains."""
    with figure(path, 7.2, 4.8) as picture:
        panel = picture.subplots()
        costs = [trial.cost for trial in result.trials if trial.cost is not None]
        ends = [_end([cost[i] for cost in (*costs, result.present.cost)]) for i in (0, 1)]

        def points(shown: Sequence[Cost]) -> NDArray[np.float64]:
            """Effort and cost, (2, n)."""
            return np.minimum([cost[:2] for cost in shown], ends).T[::-1]

        panel.plot(*points(costs), ".", color=NEUTRAL, ms=5, label="trials")
        front = [trial.cost for trial in result.front[::-1] if trial.cost is not None]
        panel.step(*points(front), "o-", where="post", color=FRONT, ms=5, lw=1.2, label="front of trade-offs")
        _mark(panel, points([result.present.cost]), "D", PRESENT, "present gains")
        _mark(panel, points([result.tuned.cost]), "*", TUNED, "tuned gains")
        _scale(panel, points(costs))
        objective = result.tuning.objective
        panel.set(xlabel=f"effort: {METRICS[objective.second][0]}", ylabel=f"cost: {METRICS[objective.metric][0]}")
        panel.legend(loc="best")


def draw_search(path: Path, result: Result) -> None:
    """Draw the cost of the trials in their order, and over each gain."""
    gains = result.tuning.gains
    columns = min(COLUMNS, len(gains))
    rows = math.ceil(len(gains) / columns)
    with figure(path, 10.0, 2.8 + 2.4 * rows) as picture:
        grid = picture.add_gridspec(1 + rows, columns)
        _course(picture.add_subplot(grid[0, :]), result)
        for i, gain in enumerate(gains):
            _over_gain(picture.add_subplot(grid[1 + i // columns, i % columns]), gain, result)


def _course(panel: "Axes", result: Result) -> None:
    """The cost of the trials in their order, and the smallest so far; a cross marks a pruned trial."""
    costs = np.array([trial.cost.cost if trial.cost else math.nan for trial in result.trials])
    end = _end([*costs[np.isfinite(costs)], result.present.cost.cost])
    numbers = np.arange(len(costs))
    panel.plot(numbers, np.minimum(costs, end), ".", color=NEUTRAL, ms=5, label="trials")
    best = np.fmin.accumulate(costs)
    panel.step(numbers, best, where="post", color=FRONT, lw=1.4, label="smallest so far")
    panel.axhline(min(result.present.cost.cost, end), color=PRESENT, lw=1.0, ls="--", label="present gains")
    if len(pruned := numbers[np.isnan(costs)]):
        panel.plot(pruned, [0.97] * len(pruned), "x", color=LIMIT, ms=5, transform=panel.get_xaxis_transform(), label="pruned")
    if end > LOGARITHMIC_RATIO * np.nanmin(costs):
        panel.set_yscale("log")
    panel.set(xlabel="trial", ylabel="cost")
    panel.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4)


def _over_gain(panel: "Axes", gain: Gain, result: Result) -> None:
    """The cost over one gain, with the present and the tuned value."""
    completed = [(trial.gains[gain.parameter], trial.cost.cost) for trial in result.trials if trial.cost is not None]
    values, costs = np.array(completed).T
    end = _end([*costs, result.present.cost.cost])
    costs = np.minimum(costs, end)
    panel.plot(values, costs, ".", color=NEUTRAL, ms=4)
    _mark(panel, (result.tuning.present[gain.parameter], min(result.present.cost.cost, end)), "D", PRESENT)
    _mark(panel, (result.best.gains[gain.parameter], result.tuned.cost.cost), "*", TUNED)
    middle = math.sqrt(gain.low * gain.high) if gain.logarithmic else 0.5 * (gain.low + gain.high)
    if gain.logarithmic:
        panel.set_xscale("log")
    panel.set_xticks([], minor=True)
    panel.set_xticks([gain.low, middle, gain.high], [f"{tick:.2g}" for tick in (gain.low, middle, gain.high)])
    if end > LOGARITHMIC_RATIO * costs.min():
        panel.set_yscale("log")
    panel.set(xlabel=f"{gain.name} [{gain.unit}]" if gain.unit else gain.name, ylabel="cost")


def _mark(panel: "Axes", point: Any, marker: str, colour: str, label: str = "") -> None:
    size = 13 if marker == "*" else 7
    panel.plot(*point, marker, color=colour, ms=size, mec="white", mew=0.8, zorder=5, label=label or "_")


def _end(values: Sequence[float]) -> float:
    """The largest value to draw: a few trials whose runs fail must not compress all others."""
    return min(max(values), MAX_SHOWN_RATIO * min(values), PENALTY)


def _scale(panel: "Axes", points: NDArray[np.float64]) -> None:
    """Choose logarithmic scales for widely spaced values."""
    for set_scale, values in ((panel.set_xscale, points[0]), (panel.set_yscale, points[1])):
        if values.max() > LOGARITHMIC_RATIO * values.min():
            set_scale("log")
