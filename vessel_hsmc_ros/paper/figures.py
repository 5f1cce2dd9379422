"""Figures 1 to 10 of the paper, in its arrangement, and four that explain the behaviour they show."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.metrics import heading_error, position_error
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.paper.case_run import CaseResult
from vessel_hsmc_ros.report.style import INK as TRUTH
from vessel_hsmc_ros.report.style import OTHER, PLOT, SHIP, THIRD
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


Outcomes = Mapping[str, CaseResult]


def course(sliding: Run, pd: Run) -> Figure:
    """Draw Figures 1 and 2: the course under both controllers, and below it the course errors."""
    figure, (upper, lower) = panels(2, ratios=(1.6, 1.0))
    lines = ((pd, "PD", OTHER, "-."), (sliding, "sliding mode and network", SHIP, "-"))
    for run, name, color, dashes in lines:
        upper.plot(run.time, DEGREES * run.state[:, 2], color=color, ls=dashes, label=name)
        error = np.abs(DEGREES * heading_error(run.state, run.reference))
        lower.plot(run.time, error, color=color, ls=dashes)
    upper.plot(sliding.time, DEGREES * sliding.reference[:, 2], color=DESIRED, ls="--", label="desired")
    upper.set(ylabel="course [°]", ylim=(-35.0, 45.0))
    upper.legend(ncols=3, loc="upper right")
    lower.set(ylabel="error, absolute [°]", yscale="log", ylim=(1e-4, 50.0))
    lower.axhline(1.0, color=TRUTH, lw=0.6, ls=":")
    return figure


def velocities(run: Run) -> Figure:
    """Draw Figures 4 and 8: surge and sway velocity."""
    figure, (upper, lower) = panels(2)
    pair(upper, run, 3, "surge u [m/s]")
    pair(lower, run, 4, "sway v [m/s]")
    upper.legend(ncols=2)
    return figure


def yaw(run: Run) -> Figure:
    """Draw Figures 5 and 9: yaw angle and yaw rate."""
    figure, (upper, lower) = panels(2)
    pair(upper, run, 2, "yaw angle ψ [°]")
    pair(lower, run, 5, "yaw rate r [°/s]", DEGREES)
    upper.legend(ncols=2)
    return figure


def wrench(run: Run) -> Figure:
    """Draw Figures 6 and 10: surge force and yaw moment."""
    figure, (upper, lower) = panels(2, height=2.0)
    trimmed(upper, run.time, run.wrench[:, 0], "N")
    trimmed(lower, run.time, run.wrench[:, 1], "N·m")
    upper.set(ylabel="surge force τ₁ [N]")
    lower.set(ylabel="yaw moment τ₂ [N·m]")
    return figure


def errors(runs: Mapping[str, Run]) -> Figure:
    """Draw position and heading errors for the three references."""
    figure, (upper, lower) = panels(2, height=2.0)
    for (name, run), color, dashes in zip(runs.items(), (SHIP, DESIRED, OTHER), ("-", "--", "-."), strict=True):
        upper.plot(run.time, position_error(run.state, run.reference), color=color, ls=dashes, label=name)
        angle = np.abs(DEGREES * heading_error(run.state, run.reference))
        lower.plot(run.time, angle, color=color, ls=dashes, lw=0.9)
    upper.set(ylabel="position error [m]", yscale="log", ylim=(0.05, 100.0))
    upper.legend(ncols=3)
    lower.set(ylabel="heading error, absolute [°]", yscale="log", ylim=(1e-5, 100.0))
    return figure


def reduced(outcomes: Mapping[str, tuple[CaseResult, CaseResult]]) -> Figure:
    """Draw the lateral error with networks and with exact ship dynamics, and the reduced dynamics from 20 s on."""
    figure, axes = panels(len(outcomes), height=1.6)
    for axis, (name, (learnt, known)) in zip(axes, outcomes.items(), strict=True):
        for outcome, color, width, dashes, words in (
            (learnt, OTHER, 1.0, "-.", "networks"),
            (known, SHIP, 3.0, "-", "exact ship dynamics"),
        ):
            control = outcome.run.control
            axis.plot(control["time"], control["sway_error"], color=color, lw=width, ls=dashes, alpha=0.8, label=words)
        axis.plot(*known.reduced, color=TRUTH, ls="--", lw=1.0, label="reduced dynamics (without input)")
        axis.set(ylabel=f"{name}\nz₂ₑ [m]")
    axes[0].legend(loc="lower left")
    return figure


def surfaces(run: Run, sway_weight: float, heading_weight: float) -> Figure:
    """Draw equation (46): the two terms of S1 cancel, and neither is zero.

    Args:
        run: A run of the paper's law.
        sway_weight, heading_weight: Weights a [rad/m] and b of (20) in this run.

    Returns:
        The figure.
    """
    figure, (upper, lower) = panels(2)
    control = run.control
    time, first, second = control["time"], sway_weight * control["sway_surface"], -heading_weight * control["heading_surface"]
    upper.plot(time, first, color=SHIP, lw=3.0, alpha=0.6, label="a·σ₁")
    upper.plot(time, second, color=TRUTH, ls="--", lw=1.0, label="−b·σ₂")
    settle(upper, time, first)
    upper.set(ylabel="[rad/s]")
    upper.legend(ncols=2, loc="lower left")
    lower.plot(time, np.abs(control["yaw_surface"]), color=SHIP, lw=0.7, label="|S₁| = |a·σ₁ + b·σ₂| [rad/s]")
    lower.plot(time, np.abs(control["surge_surface"]), color=OTHER, lw=0.7, ls="-.", label="|S₂| [m/s]")
    lower.set(ylabel="surfaces", yscale="log", ylim=(1e-7, 1e2))
    lower.legend(ncols=2, loc="upper right")
    return figure


def networks(run: Run) -> Figure:
    """Draw network outputs and true dynamics, which include the disturbance: the adaptation cannot distinguish the two."""
    figure, axes = panels(3)
    truth = run.unforced_acceleration + run.disturbance
    names = (("surge", "f_u", "m/s²"), ("sway", "f_v", "m/s²"), ("yaw", "f_r", "rad/s²"))
    for i, (axis, (name, symbol, unit)) in enumerate(zip(axes, names, strict=True)):
        axis.plot(run.time, truth[:, i], color=TRUTH, lw=1.0, label="truth, including the disturbance")
        axis.plot(run.control["time"], run.control[f"{name}_estimate"], color=THIRD, ls="--", label="network")
        # Scaled to the settled signal, including zero, with room for the legend; the transient of the network is cut off.
        settled = truth[run.time > 20.0, i] if run.time[-1] > 20.0 else truth[:, i]
        low, high = min(float(np.min(settled)), 0.0), max(float(np.max(settled)), 0.0)
        axis.set(ylabel=f"${symbol}$ [{unit}]", ylim=(low - 0.4 * (high - low), high + 0.6 * (high - low)))
    axes[0].legend(ncols=2, loc="lower left")
    return figure


def draw_all(outcomes: Outcomes, folder: Path) -> list[Path]:
    """Draw every figure as PNG, 200 dpi.

    Args:
        outcomes: The runs of the paper's cases, by name.
        folder: An existing folder.

    Returns:
        The files.
    """
    run = {name: outcome.run for name, outcome in outcomes.items()}
    shown = {"circle": "circle", "straight line": "straight", "slalom": "slalom_long"}
    pairs = (
        ("circle", "circle", "circle_exact"),
        ("straight line", "straight", "straight_exact"),
        ("slalom", "slalom", "slalom_exact"),
    )
    figures: dict[str, Callable[[], Figure]] = {
        "figure_01_course": lambda: course(run["course"], run["course_pd"]),
        "figure_02_course_disturbed": lambda: course(run["course_disturbed"], run["course_pd_disturbed"]),
        "figure_03_track": lambda: track(run["circle"]),
        "figure_04_velocities": lambda: velocities(run["circle"]),
        "figure_05_yaw": lambda: yaw(run["circle"]),
        "figure_06_wrench": lambda: wrench(run["circle"]),
        "figure_07_stabilisation": lambda: track(run["stabilisation"]),
        "figure_08_stabilisation_velocities": lambda: velocities(run["stabilisation"]),
        "figure_09_stabilisation_yaw": lambda: yaw(run["stabilisation"]),
        "figure_10_stabilisation_wrench": lambda: wrench(run["stabilisation"]),
        "why_1_errors": lambda: errors({words: run[name] for words, name in shown.items()}),
        "why_2_reduced_dynamics": lambda: reduced({words: (outcomes[one], outcomes[other]) for words, one, other in pairs}),
        "why_3_surfaces": lambda: surfaces(run["circle_exact_calm"], 0.001, 100.0),
        "why_4_networks": lambda: networks(run["circle"]),
    }
    paths = []
    # A context, so that importing this module leaves the caller's Matplotlib settings unchanged.
    with mpl.rc_context(STYLE):
        for name, make in figures.items():
            paths.append(folder / f"{name}.png")
            make().savefig(paths[-1])
    return paths
