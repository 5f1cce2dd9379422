"""What a campaign shows, in words and tables."""

import itertools
import math
import shlex
from pathlib import Path

from vessel_hsmc_ros.report.tables import label, value_text
from vessel_hsmc_ros.studies.campaign.results import (
    CONFIDENCE,
    FEWEST,
    Cell,
    Influence,
    Quantile,
    Results,
    Table,
    at_most,
    clopper_pearson,
    influences,
    interval_text,
    paired,
    quantile,
    share_text,
)

SHARES = (0.05, 0.5, 0.95, 0.99)  # the quantiles of the table of metrics
WORST = 10  # number of runs of each law in the table of the worst
NAMED = 3  # largest number of parameters that a sentence names
GRID = "; on a grid these are shares of its points, not probabilities"

EVEN = "; no confidence interval is stated, because {} draws are not independent"


def short(parameter: str) -> str:
    """The last parts of a parameter's name, which are enough in a diagram: `earth_fixed.east_force`."""
    return ".".join(parameter.split(".")[-2:])


def influences_by_variant(results: Results) -> dict[str, list[Influence]]:
    """The influences on the main metric for each law; an empty list where there are too few runs."""
    return {law: influences(runs.drawn, runs.cost(results.main)) for law, runs in results.by_variant.items()}


def sentences(results: Results, found: dict[str, list[Influence]]) -> list[tuple[str, str]]:
    """The findings in words, each with the law that it is about; empty for the comparison of laws."""
    if results.campaign.has_ships:
        return [(variant, _lost(runs)) for variant, runs in results.by_variant.items()]
    lines = []
    for law, runs in results.by_variant.items():
        lines.append((law, " ".join([_failures(runs), _sizes(runs, results.main), _causes(found[law], len(runs))])))
    for first, second in itertools.combinations(results.by_variant, 2):
        lines.append(("", _comparison(results, first, second)))
    return lines


def failures(results: Results) -> Table:
    """The failures of each law with the exact interval of their probability."""
    sure = results.campaign.independent
    head = (
        results.campaign.variant_column,
        "runs",
        "failures",
        "share of the runs",
        *((_confident("probability at most"),) if sure else ()),
        "reasons",
    )
    lines = []
    for law, runs in results.by_variant.items():
        count, n = int(runs.failed.sum()), len(runs)
        interval = interval_text(clopper_pearson(count, n)) if sure else ""
        reasons = "; ".join(f"{number} × {reason}" for reason, number in runs.reasons())
        bound = (Cell(share_text(at_most(count, n))),) if sure else ()
        lines.append((Cell(law), Cell(f"{n}"), Cell(f"{count}"), Cell(share_text(count / n), interval), *bound, Cell(reasons)))
    return Table(head, lines)


def quantiles(results: Results) -> Table:
    """Quantiles of every metric with bounds that are order statistics, and the largest value."""
    head = (
        "metric",
        results.campaign.variant_column,
        *(f"{100.0 * share:g} %" if share != SHARES[1] else "median" for share in SHARES),
        "largest",
    )
    lines = []
    for metric in results.metrics:
        for law, runs in results.by_variant.items():
            cost = runs.cost(metric)
            found = [_quantile(results, metric, quantile(cost, share)) for share in SHARES]
            lines.append((Cell(label(metric)), Cell(law), *found, Cell(results.text(metric, float(cost.max())))))
    return Table(head, lines)


def points(results: Results) -> Table:
    """Every run, with its drawn values and the metrics that are drawn."""
    names, what = [*results.drawn], results.campaign.variant_column
    lines = []
    for i in range(len(results)):
        values = [Cell(value_text(_rounded(results.rows[name][i].item()))) for name in names]
        metrics = [Cell(_value(results, metric, float(results.cost(metric)[i]))) for metric in results.shown]
        lines.append((Cell(str(results.rows["run"][i])), Cell(str(results.rows[what][i])), *values, *metrics))
    return Table(("run", what, *names, *map(label, results.shown)), lines)


def comparisons(results: Results) -> Table:
    """Every pair of laws on the same draws, for the metrics that are drawn."""
    sure = results.campaign.independent
    share = (_confident("first better, probability"),) if sure else ()
    head = ("metric", f"{results.campaign.variant_column}s", "first better", "second better", "equal", *share, "median ratio")
    lines = []
    for metric in results.shown:
        for first, second in itertools.combinations(results.by_variant, 2):
            found = paired(*results.paired(first, second, metric))
            counts = [Cell(f"{number}") for number in (found.better, found.worse, found.equal)]
            ratio = Cell(value_text(_rounded(found.ratio.value)), _bounds(found.ratio) if sure else "")
            interval = (Cell(interval_text(found.share)),) if sure else ()
            lines.append((Cell(label(metric)), Cell(f"{first}, {second}"), *counts, *interval, ratio))
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
    return Table(("runs of", "parameter", "explains of the variance", "rank correlation", ""), lines)


def worst(results: Results, folder: Path) -> Table:
    """The worst runs of each law with their drawn values, and the command that runs each again on the nodes."""
    names = list(results.campaign.drawn)
    lines = []
    for law, runs in results.by_variant.items():
        for i in runs.worst(WORST):
            cost = float(runs.cost(results.main)[i])
            shown = "ended early" if runs.ended_early[i] else results.text(results.main, cost)
            values = [Cell(value_text(_rounded(runs.rows[name][i].item()))) for name in names]
            reason, command = str(runs.rows["failure"][i]), replay_command(folder, int(runs.rows["run"][i]))
            lines.append((Cell(command), Cell(law), Cell(shown, reason), *values))
    return Table(("replay on the nodes", results.campaign.variant_column, label(results.main), *map(short, names)), lines)


def replay_command(folder: Path, run: int) -> str:
    """The command that runs a row again through the ROS nodes."""
    return f"vessel-hsmc run --campaign {shlex.quote(str(folder))} --run {run}"


def _failures(runs: Results) -> str:
    count, n = int(runs.failed.sum()), len(runs)
    statement = f"{count} of {n} runs failed"
    if not runs.campaign.independent:  # and so without an interval
        why = GRID if runs.campaign.grids else EVEN.format(runs.campaign.sampling.replace("_", " "))
        return f"{statement}, {share_text(count / n)}{why}."
    bound = share_text(at_most(count, n))
    if not count:
        return f"{statement}: a run fails with a probability of at most {bound}, at {100.0 * CONFIDENCE:g} % confidence."
    interval = interval_text(clopper_pearson(count, n))
    return f"{statement}: a run fails with a probability of {share_text(count / n)} ({interval} at {100.0 * CONFIDENCE:g} %)."


def _lost(runs: Results) -> str:
    """How many ships of the family are lost: their runs fail, although a law with exact knowledge can keep them."""
    feasible = runs.rows["infeasible"] == ""
    count, n = int((runs.failed & feasible).sum()), int(feasible.sum())
    share = share_text(count / n) if n else "none"
    interval = f" ({interval_text(clopper_pearson(count, n))} at {100.0 * CONFIDENCE:g} %)" if runs.campaign.independent else ""
    return f"{count} of {n} feasible ships lost, {share}{interval}."


def _sizes(runs: Results, metric: str) -> str:
    """Median, 99 % quantile and largest value of the main metric."""
    cost = runs.cost(metric)
    median, far = quantile(cost, 0.5), quantile(cost, 0.99)
    parts = [f"median {_value(runs, metric, median.value)}", f"99 % of the runs below {_value(runs, metric, far.value)}"]
    if runs.campaign.independent:
        bound = f"below {runs.text(metric, far.high)}" if math.isfinite(far.high) else "not bounded by so few runs"
        parts[-1] += f" (the true 99 % quantile is {bound})"
    largest = float(cost.max())
    parts.append(f"largest {runs.text(metric, largest)}" if math.isfinite(largest) else "none in the worst run")
    return f"The {label(metric)}: {', '.join(parts)}."


def _causes(found: list[Influence], runs: int) -> str:
    if not found:
        few = f"Too few runs for sensitivities, which need at least {FEWEST}."
        return few if runs < FEWEST else "No drawn parameter makes a difference."
    clear = [entry for entry in found if entry.clear][:NAMED]
    if not clear:
        return "No parameter has a clear influence alone."
    return "It depends most on " + ", ".join(f"{entry.parameter} ({share_text(entry.first_order)})" for entry in clear) + "."


def _comparison(results: Results, first: str, second: str) -> str:
    found = paired(*results.paired(first, second, results.main))
    n = found.better + found.worse + found.equal
    statement = f"{first} has the smaller {label(results.main)} than {second} in {found.better} of {n} draws"
    if results.campaign.independent:
        statement += f" (probability {interval_text(found.share)})"
    ratio = f"; the median ratio is {found.ratio.value:.2g}" if math.isfinite(found.ratio.value) else ""
    return f"{statement}{ratio}."


def _quantile(results: Results, metric: str, found: Quantile) -> Cell:
    value = _value(results, metric, found.value)
    if not results.campaign.independent:
        return Cell(value)
    ends = [results.text(metric, end) if math.isfinite(end) else "?" for end in (found.low, found.high)]
    return Cell(value, " to ".join(ends))


def _value(results: Results, metric: str, value: float) -> str:
    if math.isinf(value):
        return "none: ended early or not settled" if metric == "settling_time" else "none: ended early"
    return results.text(metric, value)


def _bounds(found: Quantile) -> str:
    return f"{found.low:.2g} to {found.high:.2g}" if math.isfinite(found.low) and math.isfinite(found.high) else ""


def _rounded(value: object) -> object:
    return float(f"{value:.4g}") if isinstance(value, float) else value


def _confident(what: str) -> str:
    return f"{what} ({100.0 * CONFIDENCE:g} %)"
