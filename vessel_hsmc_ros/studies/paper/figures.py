"""Figures 1 to 10 of the paper, in its arrangement, each with both forms of its law."""

from collections.abc import Callable, Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vessel_hsmc_ros.core.metrics import heading_error
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.report.style import SHIP
from vessel_hsmc_ros.studies.paper.case_run import CaseResult
from vessel_hsmc_ros.studies.paper.cases import PRINTED, REPAIRED, of_law
from vessel_hsmc_ros.studies.paper.figure_kit import (
    DEGREES,
    DESIRED,
    FORMS,
    LOOKS,
    PD,
    STYLE,
    TRUTH,
    WIDTH,
    Both,
    panels,
    settle,
    unwrapped,
)
from vessel_hsmc_ros.studies.paper.why_figures import why_figures

mpl.use("Agg")

ZOOM, NEAR = 0.2, 0.6
"""Time that the insets of the commands show, s, and distance from the goal that the inset of the stabilisation shows, m."""


def pair(axis: Axes, runs: Both, column: int, name: str, scale: float = 1.0) -> None:
    """Draw one component of the ships and the reference over time.

    `column`: of x, y, psi, u, v, r. `scale`: factor to the unit of the axis.
    """
    reference = runs[REPAIRED]
    desired = unwrapped(reference.reference[:, 2]) if column == 2 else scale * reference.reference[:, column]
    for law, words in FORMS.items():
        run = runs[law]
        values = unwrapped(run.state[:, 2]) if column == 2 else scale * run.state[:, column]
        axis.plot(run.time, values, **LOOKS[law], label=words)
    axis.plot(reference.time, desired, **DESIRED)
    axis.set(ylabel=name)


def commands(first: Axes, axis: Axes, runs: Both, column: int) -> None:
    """Draw commands, held between their samples: those of the first moment, far above all later ones, have a scale of their own.

    `first`: where to draw the first ZOOM seconds. `column`: 0 for the surge force, 1 for the yaw moment.
    """
    for law, words in FORMS.items():
        time, values = runs[law].time, runs[law].wrench[:, column]
        begins = time <= ZOOM
        axis.step(time, values, where="post", **LOOKS[law])
        peak = f"{words}: peak {np.max(np.abs(values)):.2g}"
        first.step(time[begins], values[begins], where="post", **LOOKS[law], label=peak)
    settle(axis, runs[REPAIRED].time, np.array([run.wrench[:, column] for run in runs.values()]))
    for each in (first, axis):
        each.margins(x=0.0)
        each.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
    first.locator_params(axis="x", nbins=3)
    first.legend(fontsize=7, loc="center right")


def track(runs: Both) -> Figure:
    """Draw Figures 3 and 7: ships and reference in the plane."""
    figure = Figure(figsize=(5.2, 4.8), layout="constrained")
    axis = figure.add_subplot()
    reference = runs[REPAIRED].reference
    # A reference at rest is a point, which a line cannot show.
    moves = float(np.ptp(reference[:, :2])) > 0.0
    for law, words in FORMS.items():
        state = runs[law].state
        axis.plot(*state[:, :2].T, **LOOKS[law], label=words)
        axis.plot(*state[-1, :2], "s", color=LOOKS[law]["color"], ms=5)
    axis.plot(*runs[REPAIRED].state[0, :2], "o", color=TRUTH, ms=5, label="start")
    axis.plot([], [], "s", color=TRUTH, ms=5, label=f"after {runs[REPAIRED].time[-1]:g} s")
    axis.plot(*reference[:, :2].T, **(DESIRED if moves else {**DESIRED, "ls": "", "marker": "+", "ms": 9}))
    axis.set(xlabel="x [m]", ylabel="y [m]")
    axis.set_aspect("equal", adjustable="datalim")
    figure.legend(*axis.get_legend_handles_labels(), ncols=3, loc="outside upper center")
    if not moves:
        inset = axis.inset_axes((0.6, 0.45, 0.34, 0.34))
        inset.plot(*runs[REPAIRED].state[:, :2].T, **LOOKS[REPAIRED])
        inset.plot(*reference[0, :2], "+", color=TRUTH, ms=9)
        inset.set(xlim=(-NEAR, NEAR), ylim=(-NEAR, NEAR), aspect="equal", xticks=(-0.5, 0.0, 0.5), yticks=(-0.5, 0.0, 0.5))
        inset.tick_params(labelsize=6)
    return figure


def course(sliding: Run, pd: Run) -> Figure:
    """Draw Figures 1 and 2: the course under both controllers, and below it the course errors."""
    figure, (upper, lower) = panels(2, ratios=(1.6, 1.0))
    lines = ((pd, "PD", PD, "-."), (sliding, "sliding mode and network", SHIP, "-"))
    for run, name, color, dashes in lines:
        upper.plot(run.time, DEGREES * run.state[:, 2], color=color, ls=dashes, label=name)
        error = np.abs(DEGREES * heading_error(run.state, run.reference))
        lower.plot(run.time, error, color=color, ls=dashes)
    upper.plot(sliding.time, DEGREES * sliding.reference[:, 2], **DESIRED)
    upper.set(ylabel="course [°]", ylim=(-35.0, 45.0))
    upper.legend(ncols=3, loc="upper right")
    lower.set(ylabel="error, absolute [°]", yscale="log", ylim=(1e-4, 50.0))
    lower.axhline(1.0, color=TRUTH, lw=0.6, ls=":")
    return figure


def velocities(runs: Both) -> Figure:
    """Draw Figures 4 and 8: surge and sway velocity."""
    figure, (upper, lower) = panels(2)
    pair(upper, runs, 3, "surge u [m/s]")
    pair(lower, runs, 4, "sway v [m/s]")
    upper.legend(ncols=3)
    return figure


def yaw(runs: Both) -> Figure:
    """Draw Figures 5 and 9: yaw angle and yaw rate."""
    figure, (upper, lower) = panels(2)
    pair(upper, runs, 2, "yaw angle ψ [°]")
    pair(lower, runs, 5, "yaw rate r [°/s]", DEGREES)
    upper.legend(ncols=3)
    return figure


def wrench(runs: Both) -> Figure:
    """Draw Figures 6 and 10: surge force and yaw moment."""
    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    axes = figure.subplots(2, 2, width_ratios=(1.0, 1.6))
    for column, ((first, axis), name) in enumerate(zip(axes, ("surge force τ₁ [N]", "yaw moment τ₂ [N·m]"), strict=True)):
        commands(first, axis, runs, column)
        first.set(ylabel=name)
    axes[1, 0].set(xlabel="time [s]")
    axes[1, 1].set(xlabel="time [s]")
    return figure


def draw_all(outcomes: Mapping[str, CaseResult], folder: Path) -> list[Path]:
    """Draw every figure as PNG, 200 dpi.

    `folder`: an existing folder. Returns the files.
    """
    runs = {law: {name: found.run for name, found in of_law(law, outcomes).items()} for law in FORMS}
    shared = runs[PRINTED]
    circle, rest = ({law: runs[law][name] for law in FORMS} for name in ("circle", "stabilisation"))
    figures: dict[str, Callable[[], Figure]] = {
        "figure_01_course": lambda: course(shared["course"], shared["course_pd"]),
        "figure_02_course_disturbed": lambda: course(shared["course_disturbed"], shared["course_pd_disturbed"]),
        "figure_03_track": lambda: track(circle),
        "figure_04_velocities": lambda: velocities(circle),
        "figure_05_yaw": lambda: yaw(circle),
        "figure_06_wrench": lambda: wrench(circle),
        "figure_07_stabilisation": lambda: track(rest),
        "figure_08_stabilisation_velocities": lambda: velocities(rest),
        "figure_09_stabilisation_yaw": lambda: yaw(rest),
        "figure_10_stabilisation_wrench": lambda: wrench(rest),
        **why_figures(outcomes),
    }
    paths = []
    # A context, so that importing this module leaves the caller's Matplotlib settings unchanged.
    with mpl.rc_context(STYLE):
        for name, make in figures.items():
            paths.append(folder / f"{name}.png")
            make().savefig(paths[-1])
    return paths
