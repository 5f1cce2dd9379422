"""Common elements of the paper's figures: size, panels, insets for the initial peaks."""

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.report.style import PLOT, SHIP
from vessel_hsmc_ros.report.style import REFERENCE as DESIRED

mpl.use("Agg")

STYLE: Any = {
    **PLOT,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "lines.linewidth": 1.3,
    "savefig.dpi": 200,
}

START, ZOOM = 1.0, 0.2
"""The first commands are far above all later ones: axes are scaled to the time after START, an inset shows that up to ZOOM, s."""

WIDTH = 6.3
DEGREES = 180.0 / np.pi


def panels(count: int, height: float = 1.75, ratios: Sequence[float] | None = None) -> tuple[Figure, list[Axes]]:
    """Create panels below each other with a common time axis.

    Args:
        count: Number of panels.
        height: Height of a panel, inches.
        ratios: Relative heights; equal if not given.

    Returns:
        The figure and its axes from top to bottom.
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


def pair(axis: Axes, run: Run, column: int, name: str, scale: float = 1.0) -> None:
    """Draw one component of ship and reference over time.

    Args:
        axis: Where to draw.
        run: The run.
        column: Of x, y, psi, u, v, r.
        name: Label of the axis.
        scale: Factor to the unit of the axis.
    """
    values, desired = scale * run.state[:, column], scale * run.reference[:, column]
    if column == 2:
        values, desired = unwrapped(run.state[:, 2]), unwrapped(run.reference[:, 2])
        # Ship and reference may differ by full turns after the unwrapping; they are aligned at the end of the run.
        values -= 360.0 * np.round((values[-1] - desired[-1]) / 360.0)
    axis.plot(run.time, values, color=SHIP, label="ship")
    axis.plot(run.time, desired, color=DESIRED, ls="--", label="desired")
    axis.set(ylabel=name)


def settle(axis: Axes, time: Array, values: Array) -> None:
    """Scale the ordinate to the values after the first second.

    Args:
        axis: Axes to scale.
        time: Times of the samples, (n,) s.
        values: The signal that is drawn, (n,).
    """
    rest = values[time > START] if time[-1] > START else values
    low, high = float(np.min(rest)), float(np.max(rest))
    # A constant signal has no range: one unit instead.
    margin = 0.08 * (high - low) or 1.0
    axis.set_ylim(low - margin, high + margin)


def trimmed(axis: Axes, time: Array, values: Array, unit: str) -> None:
    """Draw a line whose initial peak is shown in an inset with a scale of its own.

    Args:
        axis: Where to draw.
        time, values: The line, held between its points.
        unit: Unit of the values, for the title of the inset.
    """
    axis.step(time, values, where="post", color=SHIP, lw=1.0)
    settle(axis, time, values)
    axis.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
    inset = axis.inset_axes((0.16, 0.42, 0.4, 0.4))
    first = time <= ZOOM
    inset.step(time[first], values[first], where="post", color=SHIP, lw=1.0)
    peak = values[int(np.argmax(np.abs(values)))]
    inset.set_title(f"first {ZOOM:g} s, peak {peak:.3g} {unit}".replace("-", "\u2212"), fontsize=7, pad=3, loc="right")
    inset.tick_params(labelsize=6)
    inset.locator_params(axis="x", nbins=4)
    inset.yaxis.get_offset_text().set_fontsize(6)


def track(run: Run) -> Figure:
    """Draw Figures 3 and 7: ship and reference in the plane."""
    figure = Figure(figsize=(5.0, 4.6), layout="constrained")
    axis = figure.add_subplot()
    # A reference at rest is a point, which a line cannot show.
    moves = float(np.ptp(run.reference[:, :2])) > 0.0
    axis.plot(*run.reference[:, :2].T, color=DESIRED, lw=3.0, alpha=0.6, label="desired" if moves else None)
    axis.plot(*run.state[:, :2].T, color=SHIP, label="ship")
    axis.plot(*run.state[0, :2], "o", color=SHIP, ms=5, label="start")
    axis.plot(*run.state[-1, :2], "s", color=SHIP, ms=5, label=f"after {run.time[-1]:g} s")
    axis.plot(*run.reference[0, :2], "o", color=DESIRED, ms=5)
    axis.plot(*run.reference[-1, :2], "s", color=DESIRED, ms=5, label=None if moves else "desired")
    axis.set(xlabel="x [m]", ylabel="y [m]")
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend()
    return figure
