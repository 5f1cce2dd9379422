"""Four figures that explain what Figures 1 to 10 show."""

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure

from vessel_hsmc_ros.core.metrics import heading_error, position_error
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.report.style import OTHER, SHIP
from vessel_hsmc_ros.studies.paper.case_run import CaseResult
from vessel_hsmc_ros.studies.paper.cases import of_law
from vessel_hsmc_ros.studies.paper.figure_kit import DEGREES, FORMS, LOOKS, TRUTH, Both, panels, settle


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
