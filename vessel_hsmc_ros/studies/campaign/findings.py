"""What a campaign shows, in words and tables."""

import itertools
import math
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.report.tables import label, value_text
from vessel_hsmc_ros.studies.campaign.plan import Campaign
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
from vessel_hsmc_ros.studies.campaign.ship_family import SHIP, ShipFamily

SHARES = (0.05, 0.5, 0.95, 0.99)  # the quantiles of the table of metrics
WORST = 10  # number of runs of each law in the table of the worst
NAMED = 3  # largest number of parameters that a sentence names
GRID = "; on a grid of starts these are shares of its points, not probabilities"

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
        return _ship_sentences(ships_of(results))
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
        _what(results),
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
        _what(results),
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


def comparisons(results: Results) -> Table:
    """Every pair of laws on the same draws, for the metrics that are drawn."""
    sure = results.campaign.independent
    share = (_confident("first better, probability"),) if sure else ()
    head = ("metric", f"{_what(results)}s", "first better", "second better", "equal", *share, "median ratio")
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
    return Table(("replay on the nodes", _what(results), label(results.main), *map(short, names)), lines)


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


def _what(results: Results) -> str:
    """What is compared on the same draws."""
    return results.campaign.variant_column


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


Mask = NDArray[np.bool_]
Column = NDArray[Any]

KNOWLEDGE = f"{SHIP}knowledge"


@dataclass(frozen=True)
class Ships:
    """The ships of a campaign with the family, of the draws of which all variants are computed.

    A ship is lost if its run fails: it ends early, or exceeds a limit. Only feasible ones count, those that a law with exact
    knowledge can keep (`feasibility`). All variants of a draw share the ship and its day, so they are compared ship by ship.
    """

    campaign: Campaign
    values: Mapping[str, Column]  # the numbers of the ships that are drawn, (n,) each, by their names without prefix
    feasible: Mask  # whether a law can keep each ship, (n,)
    lost: Mapping[str, Mask]  # whether it is lost, (n,), for each variant


def ships_of(results: Results) -> Ships:
    """The ships of a campaign."""
    found = results.by_variant
    common = reduce(np.intersect1d, (runs.rows["draw"] for runs in found.values()))
    chosen = {variant: np.isin(runs.rows["draw"], common) for variant, runs in found.items()}
    first = next(iter(found))
    rows = {name: column[chosen[first]] for name, column in found[first].rows.items()}
    values = {name.removeprefix(SHIP): rows[name] for name in results.campaign.drawn if name.startswith(SHIP)}
    lost = {variant: runs.failed[chosen[variant]] for variant, runs in found.items()}
    return Ships(results.campaign, values, rows["infeasible"] == "", lost)


def _ship_sentences(ships: Ships) -> list[tuple[str, str]]:
    """The findings in words, each with the variant that it is about; empty for what concerns several."""
    n = int(ships.feasible.sum())
    lines = [
        (variant, f"{(count := int(lost[ships.feasible].sum()))} of {n} feasible ships lost, {_share(count, n, ships.campaign)}.")
        for variant, lost in ships.lost.items()
    ]
    return [*lines, *(("", text) for text in (*_because(ships), _wrong(ships)))]


def _because(ships: Ships) -> list[str]:
    """How many ships are lost because of what is declared of them."""
    named = _by_knowledge(ships.campaign)
    if not {"declared", "nothing"} <= named.keys():
        return []
    lost = {knowledge: ships.lost[variant] & ships.feasible for knowledge, variant in named.items() if variant in ships.lost}
    n, kept = int(ships.feasible.sum()), ships.feasible & ~lost["nothing"]
    because = kept & lost["declared"]
    lines = [f"Because of what was declared {_share(int(because.sum()), n, ships.campaign, counted=True)} are lost."]
    if "true_values" in lost:
        still, true = int((because & lost["true_values"]).sum()), int((kept & lost["true_values"]).sum())
        lines.append(
            f"Of these, {still} are lost with the true values as well; in all, true values lose"
            f" {_share(true, n, ships.campaign, counted=True)} that are kept with nothing declared."
        )
    return lines


def _wrong(ships: Ships) -> str:
    """The cost of a wrong judgement of what is feasible."""
    none = reduce(np.logical_and, ships.lost.values())
    return (
        f"Of {int((~ships.feasible).sum())} infeasible ships some variant keeps {int((~none & ~ships.feasible).sum())};"
        f" of {int(ships.feasible.sum())} feasible ones no variant keeps {int((none & ships.feasible).sum())}."
    )


def _by_knowledge(campaign: Campaign) -> dict[str, str]:
    """The first variant with each knowledge of the first law."""
    default = ShipFamily().knowledge
    found: dict[str, str] = {}
    for (variant, changes), law in zip(campaign.variants.items(), campaign.laws, strict=True):
        if law == campaign.laws[0]:
            found.setdefault(str(changes.get(KNOWLEDGE, campaign.changes.get(KNOWLEDGE, default))), variant)
    return found


def lost(ships: Ships) -> Table:
    """The ships that each variant loses: in all, and by what distinguishes them."""
    every = ("all", np.full(len(ships.feasible), ""))
    groups = [every, *((name, of(ships.values)) for name, of in GROUPS.items() if _known(of, ships.values))]
    lines = []
    for name, labels in groups:
        for i, group in enumerate(dict.fromkeys(sorted(labels.tolist(), key=_order))):
            among = ships.feasible & (labels == group)
            n = int(among.sum())
            counts = [int((each & among).sum()) for each in ships.lost.values()]
            shares = [Cell(f"{count}", share_text(count / n) if n else "") for count in counts]
            lines.append((Cell(name if i == 0 else ""), Cell(str(group)), Cell(f"{n}"), *shares))
    return Table(("ships", "", "feasible", *ships.lost), lines)


def _order(label: str) -> tuple[float, str]:
    """What is not there first, then numbers by their size, then texts."""
    number = label.split(" ")[0]
    if label in ("none", "no"):
        return -1.0, label
    return (float(number), label) if number.replace(".", "").isdigit() else (float("inf"), label)


Values = Mapping[str, Column]


def _known(of: Callable[[Values], Column], values: Values) -> bool:
    """Whether the numbers that a group needs are drawn."""
    try:
        of(values)
    except KeyError:
        return False
    return True


def _names(values: Values, switches: Mapping[str, str], none: str) -> Column:
    """Which of several switches are on, in words."""
    columns = [np.where(values[name].astype(bool), f"{word}, ", "") for name, word in switches.items()]
    joined = [("".join(parts).removesuffix(", ") or none) for parts in zip(*columns, strict=True)]
    return np.array(joined)


def _classes(column: Column, bounds: tuple[float, ...], unit: str = "") -> Column:
    """The interval between bounds that each number is in, in words."""
    names = np.array([f"{low:g} to {high:g}{unit}" for low, high in pairwise(bounds)])
    return names[np.clip(np.searchsorted(bounds, column.astype(float), side="right") - 1, 0, len(names) - 1)]


DELAYS = {"declares_lag": "lag", "declares_rate": "rate", "declares_dead_time": "dead time"}

GROUPS: dict[str, Callable[[Values], Column]] = {
    "delays declared": lambda v: _names(v, DELAYS, "none"),
    "coupling declared": lambda v: _names(v, {"declares_coupling": "yes"}, "no"),
    "sway damping declared": lambda v: _names(v, {"declares_sway_damping": "yes"}, "no"),
    "delays": lambda v: _names(v, {"has_lag": "lag", "has_rate": "rate", "has_dead_time": "dead time"}, "none"),
    "reference": lambda v: v["reference"],
    "loads": lambda v: _names(v, {"has_current": "current", "has_wind": "wind"}, "none"),
    "sensors": lambda v: _names(v, {"noisy": "noise"}, "perfect"),
    "control rate": lambda v: np.array([f"{rate:g} Hz" for rate in v["control_rate_hz"]]),
    "length": lambda v: _classes(v["length"], (0.0, 3.0, 10.0, 30.0, 100.0, 1000.0), " m"),
    "m11/m22": lambda v: _classes(v["surge_to_sway_inertia"], (0.0, 0.7, 0.85, 1.0, 2.0)),
}
"""What distinguishes ships, as a label for each."""


def _share(count: int, n: int, campaign: Campaign, counted: bool = False) -> str:
    """A share of the feasible ships, with its interval where draws are independent."""
    if not n:
        return "none"
    share = f"{count} of {n}, {share_text(count / n)}" if counted else share_text(count / n)
    return f"{share} ({interval_text(clopper_pearson(count, n))} at 95 %)" if campaign.independent else share
