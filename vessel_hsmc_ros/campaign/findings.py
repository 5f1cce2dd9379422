"""What a campaign shows, in words and tables."""

import itertools
import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from vessel_hsmc_ros.campaign.results import Results
from vessel_hsmc_ros.campaign.sensitivity import FEWEST, Influence, influences
from vessel_hsmc_ros.campaign.statistics import CONFIDENCE, Interval, Quantile, at_most, clopper_pearson, paired, quantile
from vessel_hsmc_ros.report.tables import value_text
from vessel_hsmc_ros.runs.sweep_figure import label, text

SHARES = (0.05, 0.5, 0.95, 0.99)
"""The quantiles of the table of metrics."""

WORST = 10
"""Number of runs of each law in the table of the worst."""

NAMED = 3
"""Largest number of parameters that a sentence names."""

GRID = "; on a grid of starts these are shares of its points, not probabilities"


class Cell(NamedTuple):
    """A number of a table with its bounds below it."""

    value: str
    bounds: str = ""


class Table(NamedTuple):
    """A table: names of its columns, and lines of as many cells."""

    head: tuple[str, ...]
    lines: Sequence[Sequence[Cell]]


def share_text(share: float) -> str:
    """A share in per cent, of two significant digits."""
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.4g} %"


def interval_text(interval: Interval) -> str:
    """A confidence interval of a share, in per cent."""
    return f"{share_text(interval.low)} to {share_text(interval.high)}"


def short(parameter: str) -> str:
    """The last parts of a parameter's name, which are enough in a diagram: `earth_fixed.east_force`."""
    return ".".join(parameter.split(".")[-2:])


def influences_by_law(results: Results) -> dict[str, list[Influence]]:
    """The influences on the main metric for each law; an empty list where there are too few runs."""
    return {law: influences(runs.drawn, runs.cost(results.main)) for law, runs in results.by_law.items()}


def sentences(results: Results, found: dict[str, list[Influence]]) -> list[tuple[str, str]]:
    """The findings in words, each with the law that it is about; empty for the comparison of laws.

    Args:
        results: All runs.
        found: Of `influences_by_law`.
    """
    lines = []
    for law, runs in results.by_law.items():
        lines.append((law, " ".join([_failures(runs), _sizes(runs, results.main), _causes(found[law], len(runs))])))
    for first, second in itertools.combinations(results.by_law, 2):
        lines.append(("", _comparison(results, first, second)))
    return lines


def failures(results: Results) -> Table:
    """The failures of each law with the exact interval of their probability."""
    grid = bool(results.campaign.grids)
    head = ("law", "runs", "failures", "share of the runs", *(() if grid else (_confident("probability at most"),)), "reasons")
    lines = []
    for law, runs in results.by_law.items():
        count, n = int(runs.failed.sum()), len(runs)
        interval = "" if grid else interval_text(clopper_pearson(count, n))
        reasons = "; ".join(f"{number} × {reason}" for reason, number in runs.reasons())
        bound = () if grid else (Cell(share_text(at_most(count, n))),)
        lines.append((Cell(law), Cell(f"{n}"), Cell(f"{count}"), Cell(share_text(count / n), interval), *bound, Cell(reasons)))
    return Table(head, lines)


def quantiles(results: Results) -> Table:
    """Quantiles of every metric with bounds that are order statistics, and the largest value."""
    head = ("metric", "law", *(f"{100.0 * share:g} %" if share != SHARES[1] else "median" for share in SHARES), "largest")
    lines = []
    for metric in results.metrics:
        for law, runs in results.by_law.items():
            cost = runs.cost(metric)
            found = [_quantile(metric, quantile(cost, share), bool(results.campaign.grids)) for share in SHARES]
            lines.append((Cell(label(metric)), Cell(law), *found, Cell(text(metric, float(cost.max())))))
    return Table(head, lines)


def comparisons(results: Results) -> Table:
    """Every pair of laws on the same draws, for the metrics that are drawn."""
    head = ("metric", "laws", "first better", "second better", "equal", _confident("first better, probability"), "median ratio")
    lines = []
    for metric in results.shown:
        for first, second in itertools.combinations(results.by_law, 2):
            found = paired(*results.paired(first, second, metric))
            counts = [Cell(f"{number}") for number in (found.better, found.worse, found.equal)]
            ratio = Cell(value_text(_rounded(found.ratio.value)), _bounds(found.ratio))
            lines.append((Cell(label(metric)), Cell(f"{first}, {second}"), *counts, Cell(interval_text(found.share)), ratio))
    return Table(head, lines)


def causes(found: dict[str, list[Influence]]) -> Table:
    """The influence of every drawn parameter, strongest first."""
    lines = []
    for law, entries in found.items():
        for entry in entries:
            index = Cell(share_text(max(entry.first_order, 0.0)), f"± {share_text(entry.uncertainty)}")
            correlation = "–" if math.isnan(entry.correlation) else f"{entry.correlation:+.2f}"
            clear = "clear" if entry.clear else "within the uncertainty"
            lines.append((Cell(law), Cell(entry.parameter), index, Cell(correlation), Cell(clear)))
    return Table(("law", "parameter", "explains of the variance", "rank correlation", ""), lines)


def worst(results: Results, folder: Path) -> Table:
    """The worst runs of each law with their drawn values, and the command that runs each again on the nodes."""
    names = list(results.campaign.drawn)
    lines = []
    for law, runs in results.by_law.items():
        for i in runs.worst(WORST):
            cost = float(runs.cost(results.main)[i])
            shown = "ended early" if runs.ended_early[i] else text(results.main, cost)
            values = [Cell(value_text(_rounded(runs.rows[name][i].item()))) for name in names]
            reason, command = str(runs.rows["failure"][i]), replay_command(folder, int(runs.rows["run"][i]))
            lines.append((Cell(command), Cell(law), Cell(shown, reason), *values))
    return Table(("replay on the nodes", "law", label(results.main), *map(short, names)), lines)


def replay_command(folder: Path, run: int) -> str:
    """The command that runs a row again through the ROS nodes."""
    return f"vessel-hsmc run --campaign {shlex.quote(str(folder))} --run {run}"


def _failures(runs: Results) -> str:
    count, n = int(runs.failed.sum()), len(runs)
    said = f"{count} of {n} runs failed"
    if runs.campaign.grids:
        return f"{said}, {share_text(count / n)}{GRID}."
    bound = share_text(at_most(count, n))
    if not count:
        return f"{said}: a run fails with a probability of at most {bound}, at {100.0 * CONFIDENCE:g} % confidence."
    interval = interval_text(clopper_pearson(count, n))
    return f"{said}: a run fails with a probability of {share_text(count / n)}, interval {interval} at {100.0 * CONFIDENCE:g} %."


def _sizes(runs: Results, metric: str) -> str:
    """Median, 99 % quantile and largest value of the main metric."""
    cost = runs.cost(metric)
    median, far = quantile(cost, 0.5), quantile(cost, 0.99)
    parts = [f"median {_value(metric, median.value)}", f"99 % of the runs below {_value(metric, far.value)}"]
    if not runs.campaign.grids:
        bound = f"below {text(metric, far.high)}" if math.isfinite(far.high) else "not bounded by so few runs"
        parts[-1] += f" (the true 99 % quantile is {bound})"
    return f"The {label(metric)}: {', '.join(parts)}, largest {_value(metric, float(cost.max()))}."


def _causes(found: list[Influence], runs: int) -> str:
    if not found:
        few = f"Too few runs for sensitivities: they take {FEWEST}."
        return few if runs < FEWEST else "No drawn parameter makes a difference."
    clear = [entry for entry in found if entry.clear][:NAMED]
    if not clear:
        return "No parameter has a clear influence alone."
    return "It depends most on " + ", ".join(f"{entry.parameter} ({share_text(entry.first_order)})" for entry in clear) + "."


def _comparison(results: Results, first: str, second: str) -> str:
    found = paired(*results.paired(first, second, results.main))
    n = found.better + found.worse + found.equal
    said = f"{first} has the smaller {label(results.main)} than {second} in {found.better} of {n} draws"
    if not results.campaign.grids:
        said += f" (probability {interval_text(found.share)})"
    ratio = f"; the median ratio is {found.ratio.value:.2g}" if math.isfinite(found.ratio.value) else ""
    return f"{said}{ratio}."


def _quantile(metric: str, found: Quantile, grid: bool) -> Cell:
    if grid:
        return Cell(_value(metric, found.value))
    ends = [text(metric, end) if math.isfinite(end) else "?" for end in (found.low, found.high)]
    return Cell(_value(metric, found.value), " to ".join(ends))


def _value(metric: str, value: float) -> str:
    if math.isinf(value):
        return "none: ended early or not settled" if metric == "settling_time" else "none: ended early"
    return text(metric, value)


def _bounds(found: Quantile) -> str:
    return f"{found.low:.2g} to {found.high:.2g}" if math.isfinite(found.low) and math.isfinite(found.high) else ""


def _rounded(value: object) -> object:
    return float(f"{value:.4g}") if isinstance(value, float) else value


def _confident(what: str) -> str:
    return f"{what} ({100.0 * CONFIDENCE:g} %)"
