"""Figures 1 to 10 of the paper, in its arrangement, each with both forms of its law, and four that explain what they show."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Run, heading_error, position_error
from vessel_hsmc_ros.report.diagrams import INK, LAW_COLOURS, OTHER, PLOT, SHIP
from vessel_hsmc_ros.studies.paper.cases import PRINTED, REPAIRED, of_law
from vessel_hsmc_ros.studies.paper.measure import CaseResult

STYLE: Any = {**PLOT, "axes.spines.right": False, "axes.spines.top": False, "lines.linewidth": 1.3, "savefig.dpi": 200}

START = 1.0  # the first commands of the printed law are far above all later ones: axes are scaled to the time after START, s
WIDTH = 6.3
DEGREES = 180.0 / np.pi

FORMS = {REPAIRED: "repaired", PRINTED: "as printed"}
"""Both forms of the law in the order of their colours, and what the legends call them."""

LOOKS: dict[str, dict[str, Any]] = {
    REPAIRED: {"color": LAW_COLOURS[REPAIRED], "lw": 1.3},
    PRINTED: {"color": LAW_COLOURS[PRINTED], "lw": 1.1, "ls": "-."},
}
DESIRED: dict[str, Any] = {"color": INK, "ls": "--", "lw": 1.0, "label": "desired"}
PD, TRUTH = OTHER, INK

Both = Mapping[str, Run]  # a run of each form of the law, by the law


def panels(count: int, height: float = 1.75, ratios: Sequence[float] | None = None) -> tuple[Figure, list[Axes]]:
    """Create panels below each other with a common time axis. Returns the figure and its axes from top to bottom."""
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


mpl.use("Agg")

ZOOM, NEAR = 0.2, 0.6
"""Time that the insets of the commands show, s, and distance from the goal that the inset of the stabilisation shows, m."""


def pair(axis: Axes, runs: Both, column: int, name: str, scale: float = 1.0) -> None:
    """Draw one component of the ships and the reference over time."""
    reference = runs[REPAIRED]
    desired = unwrapped(reference.reference[:, 2]) if column == 2 else scale * reference.reference[:, column]
    for law, words in FORMS.items():
        run = runs[law]
        values = unwrapped(run.state[:, 2]) if column == 2 else scale * run.state[:, column]
        axis.plot(run.time, values, **LOOKS[law], label=words)
    axis.plot(reference.time, desired, **DESIRED)
    axis.set(ylabel=name)


def commands(first: Axes, axis: Axes, runs: Both, column: int) -> None:
    """Draw commands, held between their samples: those of the first moment, far above all later ones, have their own scale."""
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
    """Draw every figure as PNG, 200 dpi. Returns the files."""
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


def errors(runs: Mapping[str, Both]) -> Figure:
    """Draw position and heading errors for the three references."""
    figure, (upper, lower) = panels(2, height=2.2)
    for (name, both), dashes in zip(runs.items(), ("-", "--", ":"), strict=True):
        for law, run in both.items():
            colour = LOOKS[law]["color"]
            upper.plot(run.time, position_error(run.state, run.reference), color=colour, ls=dashes, lw=1.1)
            angle = np.abs(DEGREES * heading_error(run.state, run.reference))
            lower.plot(run.time, angle, color=colour, ls=dashes, lw=0.8)
        upper.plot([], [], color=TRUTH, ls=dashes, label=name)
    for law, words in FORMS.items():
        lower.plot([], [], color=LOOKS[law]["color"], label=words)
    upper.set(ylabel="position error [m]", yscale="log", ylim=(3e-4, 1e3))
    upper.legend(ncols=3)
    lower.set(ylabel="heading error, absolute [°]", yscale="log", ylim=(1e-5, 200.0))
    lower.legend(ncols=2)
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

    `sway_weight`, `heading_weight`: weights a [rad/m] and b of (20) in this run. Returns the figure.
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


def networks(runs: Both) -> Figure:
    """Draw network outputs and true dynamics, which include the disturbance: the adaptation cannot distinguish the two."""
    figure, axes = panels(3)
    names = (("surge", "f_u", "m/s²"), ("sway", "f_v", "m/s²"), ("yaw", "f_r", "rad/s²"))
    for i, (axis, (name, symbol, unit)) in enumerate(zip(axes, names, strict=True)):
        low = high = 0.0
        for law, words in FORMS.items():
            run, colour = runs[law], LOOKS[law]["color"]
            truth = run.unforced_acceleration[:, i] + run.disturbance[:, i]
            axis.plot(run.time, truth, color=colour, lw=3.5, alpha=0.3, label=f"{words}: truth, with the disturbance")
            axis.plot(run.control["time"], run.control[f"{name}_estimate"], color=colour, lw=0.9, ls="--", label="network")
            settled = truth[run.time > 20.0] if run.time[-1] > 20.0 else truth
            low, high = min(low, float(np.min(settled))), max(high, float(np.max(settled)))
        # Scaled to the settled signals, including zero; the transient of the networks is cut off.
        margin = 0.15 * (high - low) or 1.0
        axis.set(ylabel=f"${symbol}$ [{unit}]", ylim=(low - margin, high + margin))
    figure.legend(*axes[0].get_legend_handles_labels(), ncols=2, loc="outside upper center")
    return figure


def why_figures(outcomes: Mapping[str, CaseResult]) -> dict[str, Callable[[], Figure]]:
    """What draws each of these figures, by the name of its file."""

    def both(name: str) -> Both:
        return {law: of_law(law, outcomes)[name].run for law in FORMS}

    shown = {"circle": "circle", "straight line": "straight", "slalom": "slalom_long"}
    pairs = (
        ("circle", "circle", "circle_exact"),
        ("straight line", "straight", "straight_exact"),
        ("slalom", "slalom", "slalom_exact"),
    )
    return {
        "why_1_errors": lambda: errors({words: both(name) for words, name in shown.items()}),
        "why_2_reduced_dynamics": lambda: reduced({words: (outcomes[one], outcomes[other]) for words, one, other in pairs}),
        "why_3_surfaces": lambda: surfaces(outcomes["circle_exact_calm"].run, 0.001, 100.0),
        "why_4_networks": lambda: networks(both("circle")),
    }
