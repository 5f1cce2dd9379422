"""Figures of a run, as PNG; colours that the colour-blind can tell apart."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vessel_hsmc_ros.metrics import heading_error, position_error
from vessel_hsmc_ros.run_data import Run

mpl.use("Agg")

SHIP, DESIRED, OTHER = "#0072B2", "#D55E00", "#009E73"
STYLE: Any = {"figure.dpi": 150, "axes.grid": True, "grid.alpha": 0.3, "font.size": 9, "legend.frameon": False}
POINTS = 20_000
"""Points of a line at most: more than the picture can show."""

Array = NDArray[np.float64]


def draw(run: Run, directory: Path) -> list[Path]:
    """Draw track, errors, velocities and wrench, and for real time the timing; returns the files."""
    with mpl.rc_context(STYLE):
        pictures = {
            "track": track(run),
            "errors": errors(run),
            "velocities": velocities(run),
            "wrench": wrench(run),
        }
        if run.control.get("compute_time") is not None:
            pictures["timing"] = timing(run)
        paths = []
        for name, figure in pictures.items():
            paths.append(directory / f"{name}.png")
            figure.savefig(paths[-1], bbox_inches="tight")
        return paths


def _panels(count: int, height: float = 1.9) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(8.0, 0.6 + height * count), layout="constrained")
    axes = [figure.add_subplot(count, 1, 1)]
    axes += [figure.add_subplot(count, 1, i + 1, sharex=axes[0]) for i in range(1, count)]
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    return figure, axes


def _thin(run: Run) -> slice:
    return slice(None, None, max(1, len(run.time) // POINTS))


def track(run: Run) -> Figure:
    """Ship and reference in the plane, with the ship's heading at a dozen instants."""
    figure = Figure(figsize=(6.5, 6.0), layout="constrained")
    axis = figure.add_subplot()
    thin = _thin(run)
    axis.plot(run.reference[thin, 0], run.reference[thin, 1], color=DESIRED, lw=1.5, ls="--", label="reference")
    axis.plot(run.state[thin, 0], run.state[thin, 1], color=SHIP, lw=1.2, label="ship")
    for marker, index, name in (("o", 0, "start"), ("s", -1, "end")):
        axis.plot(*run.reference[index, :2], marker, color=DESIRED, ms=5)
        axis.plot(*run.state[index, :2], marker, color=SHIP, ms=5, label=name)
    picks = np.linspace(0, len(run.time) - 1, 13).astype(int)[1:-1]
    x, y, psi = run.state[picks, 0], run.state[picks, 1], run.state[picks, 2]
    axis.quiver(x, y, np.cos(psi), np.sin(psi), color=SHIP, width=0.004, scale=22, zorder=3)
    axis.set(xlabel="x east [m]", ylabel="y north [m]", title="Track", aspect="equal")
    axis.legend(loc="best")
    return figure


def errors(run: Run) -> Figure:
    """Distance to the reference and heading error over time."""
    figure, (upper, lower) = _panels(2)
    thin = _thin(run)
    upper.plot(run.time[thin], position_error(run.state, run.reference)[thin], color=SHIP)
    upper.set(ylabel="position error [m]", title="Tracking errors", ylim=(0.0, None))
    lower.plot(run.time[thin], np.degrees(heading_error(run.state, run.reference))[thin], color=SHIP)
    lower.set(ylabel="heading error [°]", xlabel="time [s]")
    lower.set_yscale("symlog", linthresh=0.1)
    return figure


def velocities(run: Run) -> Figure:
    """Surge, sway and yaw velocity beside the reference's."""
    figure, axes = _panels(3)
    thin = _thin(run)
    names = ("surge [m/s]", "sway [m/s]", "yaw rate [°/s]")
    for i, (axis, name) in enumerate(zip(axes, names, strict=True)):
        scale = 180.0 / np.pi if i == 2 else 1.0
        axis.plot(run.time[thin], scale * run.state[thin, 3 + i], color=SHIP, label="ship")
        axis.plot(run.time[thin], scale * run.reference[thin, 3 + i], color=DESIRED, ls="--", label="reference")
        axis.set(ylabel=name)
    axes[0].set(title="Velocities in the body frame")
    axes[0].legend(loc="upper left", ncols=2)
    axes[-1].set(xlabel="time [s]")
    return figure


def wrench(run: Run) -> Figure:
    """Applied surge force and yaw moment; a short peak far above the rest is cut off and told in words."""
    figure, axes = _panels(2)
    thin = _thin(run)
    for i, (axis, name, unit) in enumerate(zip(axes, ("surge force", "yaw moment"), ("N", "N·m"), strict=True)):
        values = run.wrench[:, i]
        axis.step(run.time[thin], values[thin], where="post", color=SHIP, lw=1.0)
        axis.set(ylabel=f"{name} [{unit}]")
        low, high = np.percentile(values, [0.5, 99.5])
        margin = 0.15 * (high - low) or 1.0
        peak = int(np.argmax(np.abs(values)))
        if not low - 10.0 * margin < values[peak] < high + 10.0 * margin:
            axis.set_ylim(low - margin, high + margin)
            note = f"peak {values[peak]:.2g} {unit} at {run.time[peak]:.2f} s, beyond this scale"
            axis.text(0.07, 0.9, note, transform=axis.transAxes, va="top")
    axes[0].set(title="Applied wrench")
    axes[-1].set(xlabel="time [s]")
    return figure


def timing(run: Run) -> Figure:
    """How long the law took and, where it is not always the same, the time from one control step to the next."""
    intervals = np.diff(run.control["time"])
    period = round(float(np.median(intervals)), 4) if len(intervals) else 0.0
    histograms = {"time the law took [µs]": 1e6 * np.asarray(run.control["compute_time"])}
    if len(intervals) and np.ptp(intervals) > 1e-6:
        histograms[f"control interval minus {1e3 * period:.4g} ms [ms]"] = 1e3 * (intervals - period)
    figure = Figure(figsize=(4.0 * len(histograms), 2.8), layout="constrained")
    for i, (name, values) in enumerate(histograms.items()):
        axis = figure.add_subplot(1, len(histograms), i + 1)
        low, high = np.percentile(values, [0.1, 99.9])
        pad = 0.1 * (high - low) or 1.0
        axis.hist(np.clip(values, low - pad, high + pad), bins=60, color=OTHER)
        axis.set_title(f"smallest {np.min(values):.4g}, largest {np.max(values):.4g}", fontsize=9)
        axis.set(xlabel=name, ylabel="count", yscale="log")
    return figure
