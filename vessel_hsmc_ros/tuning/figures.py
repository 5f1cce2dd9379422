"""The pictures of a tuning: cost against effort with the front of trade-offs, and the course of the search."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.report.style import LIMIT, NEUTRAL, SERIES, figure
from vessel_hsmc_ros.report.tables import METRICS
from vessel_hsmc_ros.tuning.cost import PENALTY, Cost
from vessel_hsmc_ros.tuning.gains import Gain
from vessel_hsmc_ros.tuning.result import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PRESENT, TUNED, FRONT = SERIES[1], SERIES[2], SERIES[0]

COLUMNS = 4
"""Largest number of panels in a row of the gains."""

WIDE = 10.0
"""Ratio of the largest to the smallest value from which on an axis is logarithmic."""

SHOWN = 30.0
"""Trials with more than this multiple of the smallest cost or effort are drawn at the edge."""


def draw_front(path: Path, result: Result) -> None:
    """Draw cost against effort: all trials, the front, the present and the tuned gains.

    Args:
        path: The PNG file.
        result: The result.
    """
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
    """Draw the cost of the trials in their order, and over each gain.

    Args:
        path: The PNG file.
        result: The result.
    """
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
    if end > WIDE * np.nanmin(costs):
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
    if end > WIDE * costs.min():
        panel.set_yscale("log")
    panel.set(xlabel=f"{gain.name} [{gain.unit}]" if gain.unit else gain.name, ylabel="cost")


def _mark(panel: "Axes", point: Any, marker: str, colour: str, label: str = "") -> None:
    size = 13 if marker == "*" else 7
    panel.plot(*point, marker, color=colour, ms=size, mec="white", mew=0.8, zorder=5, label=label or "_")


def _end(values: Sequence[float]) -> float:
    """The largest value to draw: a few trials whose runs fail must not compress all others."""
    return min(max(values), SHOWN * min(values), PENALTY)


def _scale(panel: "Axes", points: NDArray[np.float64]) -> None:
    """Choose logarithmic scales for widely spaced values."""
    for set_scale, values in ((panel.set_xscale, points[0]), (panel.set_yscale, points[1])):
        if values.max() > WIDE * values.min():
            set_scale("log")
