"""What the figures of the paper share: the style, panels with a common time axis, and the lines of both forms of the law."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.report.style import INK, OTHER, PLOT
from vessel_hsmc_ros.studies.compare.comparison_page import COLOURS
from vessel_hsmc_ros.studies.paper.cases import PRINTED, REPAIRED

STYLE: Any = {
    **PLOT,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "lines.linewidth": 1.3,
    "savefig.dpi": 200,
}

START = 1.0  # the first commands of the printed law are far above all later ones: axes are scaled to the time after START, s
WIDTH = 6.3
DEGREES = 180.0 / np.pi

FORMS = {REPAIRED: "repaired", PRINTED: "as printed"}
"""Both forms of the law in the order of their colours, and what the legends call them."""

LOOKS: dict[str, dict[str, Any]] = {
    REPAIRED: {"color": COLOURS[REPAIRED], "lw": 1.3},
    PRINTED: {"color": COLOURS[PRINTED], "lw": 1.1, "ls": "-."},
}
DESIRED: dict[str, Any] = {"color": INK, "ls": "--", "lw": 1.0, "label": "desired"}
PD, TRUTH = OTHER, INK

Both = Mapping[str, Run]  # a run of each form of the law, by the law


def panels(count: int, height: float = 1.75, ratios: Sequence[float] | None = None) -> tuple[Figure, list[Axes]]:
    """Create panels below each other with a common time axis.

    `count`: number of panels. `height`: height of a panel, inches. `ratios`: relative heights; equal if not given. Returns the
    figure and its axes from top to bottom.
    """
    figure = Figure(figsize=(WIDTH, 0.5 + height * count), layout="constrained")
    grid = figure.add_gridspec(count, 1, height_ratios=ratios)
    axes = [figure.add_subplot(grid[0])]
    axes += [figure.add_subplot(grid[i], sharex=axes[0]) for i in range(1, count)]
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    for axis in axes:
        axis.margins(x=0.0)
    axes[-1].set(xlabel="time [s]")
    return figure, axes


def unwrapped(angle: Array) -> Array:
    """A heading without jumps, in degrees."""
    return DEGREES * np.unwrap(angle)


def settle(axis: Axes, time: Array, values: Array) -> None:
    """Scale the ordinate to the values after the first second.

    `time`: times of the samples, (n,) s. `values`: the signals that are drawn, (n,) or (m, n).
    """
    rest = values[..., time > START] if time[-1] > START else values
    low, high = float(np.min(rest)), float(np.max(rest))
    # A constant signal has no range: one unit instead.
    margin = 0.08 * (high - low) or 1.0
    axis.set_ylim(low - margin, high + margin)
