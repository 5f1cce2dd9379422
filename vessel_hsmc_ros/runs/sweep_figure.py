"""The picture of a sweep: metrics over one parameter as lines, over two as heat maps; runs that failed are marked."""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.report.style import LIMIT, NEUTRAL, PLOT, SERIES
from vessel_hsmc_ros.report.tables import METRICS, MISSING
from vessel_hsmc_ros.runs.sweep import Axis, Outcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.ticker import Formatter

Array = NDArray[Any]

WIDE = 30.0
"""Ratio of the largest to the smallest value from which on a scale is logarithmic."""

FEW = 8
"""Largest number of cells in a row of a heat map that have their value written into them."""


def label(metric: str) -> str:
    """A metric in words."""
    return METRICS[metric][0]


def text(metric: str, value: float) -> str:
    """A value of a metric with its unit; a dash where there is none."""
    unit = METRICS[metric][1]
    return quantity(100.0 * value if unit == "%" else value, unit) if math.isfinite(value) else MISSING


def shown(value: object) -> str:
    """A value of a parameter as text."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def draw(path: Path, axes: Sequence[Axis], outcomes: Sequence[Outcome], metrics: Sequence[str]) -> None:
    """Draw the metrics of all runs.

    Args:
        path: The PNG file.
        axes: The swept parameters, one or two.
        outcomes: The runs, in the order of `sweep.points`.
        metrics: The metrics to draw; with two parameters each law has a row of heat maps.
    """
    import matplotlib as mpl  # imported here: it takes longer than simulating a minute
    from matplotlib.figure import Figure

    laws = list(dict.fromkeys(outcome.point.law for outcome in outcomes))
    rows, columns = (len(metrics), 1) if len(axes) == 1 else (len(laws), len(metrics))
    size = (8.0, 3.0 * rows + 0.6) if len(axes) == 1 else (5.2 * columns + 0.6, 4.2 * rows)
    with mpl.rc_context(PLOT):
        picture = Figure(figsize=size, layout="constrained")
        panels = picture.subplots(rows, columns, squeeze=False)
        if len(axes) == 1:
            for panel, metric in zip(panels[:, 0], metrics, strict=True):
                _lines(panel, axes[0], outcomes, metric, laws)
        else:
            for i, law in enumerate(laws):
                of_law = [outcome for outcome in outcomes if outcome.point.law == law]
                for panel, metric in zip(panels[i], metrics, strict=True):
                    _heat_map(panel, axes, of_law, metric, law)
        picture.savefig(path)


def _lines(panel: "Axes", axis: Axis, outcomes: Sequence[Outcome], metric: str, laws: Sequence[str]) -> None:
    """A metric over one parameter, a line for each law; a cross at the top marks a run that failed."""
    positions = _positions(axis)
    all_values = np.array([outcome.value(metric) for outcome in outcomes])
    if _spans(all_values):
        panel.set_yscale("log")
    for i, law in enumerate(laws):
        of_law = [outcome for outcome in outcomes if outcome.point.law == law]
        colour = SERIES[i % len(SERIES)]
        panel.plot(positions, [outcome.value(metric) for outcome in of_law], "o-", color=colour, ms=4, lw=1.2, label=law)
        failed = [x for x, outcome in zip(positions, of_law, strict=True) if outcome.failure]
        if failed:  # marked at the top edge, whatever the scale: there is no value to draw them at
            look: Any = {"color": colour if len(laws) > 1 else LIMIT, "ms": 8, "mew": 2, "label": f"{law} failed".strip()}
            panel.plot(failed, [0.96] * len(failed), "x", transform=panel.get_xaxis_transform(), **look)
    _label_axis(panel.xaxis, panel.set_xscale, axis)
    panel.yaxis.set_major_formatter(_formatter(metric))
    panel.set(xlabel=axis.parameter, ylabel="\n".join(textwrap.wrap(label(metric), 24)))
    if len(laws) > 1 or any(outcome.failure for outcome in outcomes):
        panel.legend(loc="best")


def _heat_map(panel: "Axes", axes: Sequence[Axis], outcomes: Sequence[Outcome], metric: str, law: str) -> None:
    """A metric over two parameters; a cross marks a run that failed."""
    from matplotlib.colors import LogNorm

    shape = len(axes[0].values), len(axes[1].values)
    values = np.array([outcome.value(metric) for outcome in outcomes]).reshape(shape)
    failed = np.array([bool(outcome.failure) for outcome in outcomes]).reshape(shape)
    # In cells of equal size, whatever the spacing of the values.
    norm = LogNorm() if _spans(values) else None
    image = panel.imshow(np.ma.masked_invalid(values), origin="lower", aspect="auto", cmap="viridis_r", norm=norm)
    panel.set_facecolor("#e3e6e9")
    panel.grid(visible=False)
    for row, column in zip(*np.nonzero(failed), strict=True):
        panel.plot(column, row, "x", color=LIMIT, ms=8, mew=2)
    if max(shape) <= FEW:
        for (row, column), value in np.ndenumerate(values):
            if not failed[row, column]:
                panel.text(column, row, text(metric, value), ha="center", va="center", fontsize=7, bbox=_PLATE)
    for scale, axis in ((panel.yaxis, axes[0]), (panel.xaxis, axes[1])):
        every = max(1, -(-len(axis.values) // FEW))
        ticks = range(0, len(axis.values), every)
        scale.set_ticks(list(ticks), [shown(axis.values[i]) for i in ticks])
    panel.set(xlabel=axes[1].parameter, ylabel=axes[0].parameter, title=": ".join(filter(None, (law, label(metric)))))
    if np.isfinite(values).any():
        panel.figure.colorbar(image, ax=panel, format=_formatter(metric))


_PLATE = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": NEUTRAL, "lw": 0.3, "alpha": 0.8}


def _formatter(metric: str) -> "Formatter":
    from matplotlib.ticker import FuncFormatter

    return FuncFormatter(lambda value, _: text(metric, value))


def _positions(axis: Axis) -> Array:
    """The values of a numeric parameter; the numbers from 0 for one of texts or lists."""
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in axis.values)
    return np.array(axis.values, float) if numeric else np.arange(float(len(axis.values)))


def _label_axis(scale: Any, set_scale: Any, axis: Axis) -> None:
    """Choose a logarithmic scale for widely spaced numbers, and name the values that are not numbers."""
    positions = _positions(axis)
    if any(not isinstance(value, int | float) or isinstance(value, bool) for value in axis.values):
        scale.set_ticks(positions, [shown(value) for value in axis.values])
    elif _spans(positions):
        set_scale("log")


def _spans(values: Array) -> bool:
    """Whether positive values span so much that a linear scale would hide the small ones."""
    finite = values[np.isfinite(values)]
    return bool(len(finite)) and bool(finite.min() > 0.0) and bool(finite.max() / finite.min() > WIDE)
