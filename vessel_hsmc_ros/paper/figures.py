"""Figures 1 to 10 of the paper, in its arrangement, and four that explain the behaviour they show."""

from collections.abc import Callable, Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from vessel_hsmc_ros.core.metrics import heading_error, position_error
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.paper.case_run import CaseResult
from vessel_hsmc_ros.paper.drawing import DEGREES, STYLE, pair, panels, settle, track, trimmed
from vessel_hsmc_ros.report.style import INK as TRUTH
from vessel_hsmc_ros.report.style import OTHER, SHIP, THIRD
from vessel_hsmc_ros.report.style import REFERENCE as DESIRED

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
