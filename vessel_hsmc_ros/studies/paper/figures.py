"""Figures 1 to 10 of the paper, each with both forms of its law, and four that explain what they show."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Run, heading_error, position_error
from vessel_hsmc_ros.report.diagrams import Axis, Figure, draw, layout, level, line, points, run_colour, signal
from vessel_hsmc_ros.studies.paper.cases import PRINTED, REPAIRED, of_law
from vessel_hsmc_ros.studies.paper.measure import CaseResult

START, ZOOM, SETTLED = 1.0, 0.2, 20.0
"""The first commands of the printed law are far above all later ones: axes are scaled to the time after START, and the first ZOOM
has a figure of its own; from SETTLED on the networks follow, s."""

NEAR = 0.6  # distance from the goal that the figure of the stabilisation shows enlarged, m
STRIP, PLANE = (8.0, 2.1), (6.5, 5.6)  # width and height of a figure over time and in the plane, inches

FORMS = {REPAIRED: "repaired", PRINTED: "as printed"}
"""Both forms of the law in the order of their colours, and what the legends call them."""

LOOKS: dict[str, dict[str, Any]] = {
    REPAIRED: {"colour": run_colour(0), "width": 1.8},
    PRINTED: {"colour": run_colour(1), "width": 1.5, "dash": "dashdot"},
}
DESIRED: dict[str, Any] = {"colour": "--ink", "width": 1.4, "dash": "dash"}

Both = Mapping[str, Run]  # a run of each form of the law, by the law
Span = tuple[float, float]


def draw_all(outcomes: Mapping[str, CaseResult], folder: Path) -> list[Path]:
    """Draw every figure as PNG. Returns the files."""
    figures, tracks = over_time(outcomes), {"figure_03_track": "circle", "figure_07_stabilisation": "stabilisation"}
    paths = [draw(folder / f"{name}.png", found, STRIP, stacked=True) for name, found in figures.items()]
    paths += [draw(folder / f"{name}.png", track(both(case, outcomes)), PLANE) for name, case in tracks.items()]
    commanded = {"figure_06_wrench": "circle", "figure_10_stabilisation_wrench": "stabilisation"}
    return paths + [draw(folder / f"{name}.png", wrench(both(case, outcomes))) for name, case in commanded.items()]


def over_time(outcomes: Mapping[str, CaseResult]) -> dict[str, list[Figure]]:
    """The figures below each other over time, by the name of their file."""
    printed = {name: found.run for name, found in of_law(PRINTED, outcomes).items()}
    circle, rest = both("circle", outcomes), both("stabilisation", outcomes)
    followed = {"circle": "circle", "straight line": "straight", "slalom": "slalom_long"}
    exact = {"circle": "circle", "straight line": "straight", "slalom": "slalom"}
    return {
        "figure_01_course": course(printed["course"], printed["course_pd"]),
        "figure_02_course_disturbed": course(printed["course_disturbed"], printed["course_pd_disturbed"]),
        "figure_04_velocities": velocities(circle),
        "figure_05_yaw": yaw(circle),
        "figure_08_stabilisation_velocities": velocities(rest),
        "figure_09_stabilisation_yaw": yaw(rest),
        "why_1_errors": errors({words: both(name, outcomes) for words, name in followed.items()}),
        "why_2_reduced_dynamics": [reduced(words, outcomes[name], outcomes[f"{name}_exact"]) for words, name in exact.items()],
        "why_3_surfaces": surfaces(outcomes["circle_exact_calm"].run, 0.001, 100.0),
        "why_4_networks": networks(circle),
    }


def both(case: str, outcomes: Mapping[str, CaseResult]) -> Both:
    """The runs of a case with both forms of the law."""
    return {law: of_law(law, outcomes)[case].run for law in FORMS}


def strip(name: str, traces: Sequence[Figure], span: Span | None = None, logarithmic: bool = False) -> Figure:
    """A figure over time with a range of its ordinate."""
    drawn = layout(Axis("time [s]"), Axis(name, logarithmic), legend=any(trace["name"] for trace in traces))
    if span is not None:
        drawn["yaxis"]["range"] = [*(np.log10(span) if logarithmic else span)]
    return {"title": "", "traces": [*traces], "layout": drawn}


def unwrapped(angle: Array) -> Array:
    """A heading without jumps, in degrees."""
    return np.degrees(np.unwrap(angle))


def span_after(start: float, time: Array, values: Array, room: float = 0.08) -> Span:
    """The range of values (n,) or (m, n) after a time, with room around it; one unit for a constant."""
    rest = values[..., time > start] if time[-1] > start else values
    low, high = float(np.min(rest)), float(np.max(rest))
    margin = room * (high - low) or 1.0
    return low - margin, high + margin


def pair(runs: Both, column: int, name: str, scale: float = 1.0) -> Figure:
    """One component of the ships and the reference over time."""

    def component(poses: Array) -> Array:
        return unwrapped(poses[:, 2]) if column == 2 else scale * poses[:, column]

    traces = [signal(runs[law].time, component(runs[law].state), words, **LOOKS[law]) for law, words in FORMS.items()]
    reference = runs[REPAIRED]
    return strip(name, [*traces, signal(reference.time, component(reference.reference), "desired", **DESIRED)])


def xy(poses: Array) -> tuple[Array, Array]:
    """Both coordinates of poses."""
    return poses[:, 0], poses[:, 1]


def track(runs: Both) -> list[Figure]:
    """Figures 3 and 7: ships and reference in the plane, and enlarged where the reference rests."""
    reference = runs[REPAIRED].reference
    moves = float(np.ptp(reference[:, :2])) > 0.0
    rest = points(*xy(reference[:1]), "desired", "--ink", "cross", 9.0)
    goal = line(*xy(reference), "desired", **DESIRED) if moves else rest
    ways = {law: line(*xy(runs[law].state), words, **LOOKS[law]) for law, words in FORMS.items()}
    ends = [points(*xy(runs[law].state[-1:]), "", LOOKS[law]["colour"], "square", 7.0) for law in FORMS]
    start = points(*xy(runs[REPAIRED].state[:1]), "start", "--ink", size=7.0)
    whole = in_plane(f"Track to {runs[REPAIRED].time[-1]:g} s (square)", [*ways.values(), *ends, start, goal])
    return [whole] if moves else [whole, in_plane("Near the goal, repaired", [ways[REPAIRED], goal], NEAR)]


def in_plane(title: str, traces: Sequence[Figure], near: float | None = None) -> Figure:
    """A figure in the plane, of what is near the origin or of everything."""
    drawn = layout(Axis("x [m]"), Axis("y [m]"), legend=True)
    drawn["yaxis"] |= {"scaleanchor": "x"}
    if near is not None:
        for axis in ("xaxis", "yaxis"):
            drawn[axis]["range"] = [-near, near]
    return {"title": title, "traces": [*traces], "layout": drawn}


def course(sliding: Run, pd: Run) -> list[Figure]:
    """Figures 1 and 2: the course under both controllers, and below it the course errors."""
    lines = (
        (pd, "PD", {"colour": "--other", "dash": "dashdot"}),
        (sliding, "sliding mode and network", {"colour": "--ship"}),
    )
    courses = [signal(run.time, np.degrees(run.state[:, 2]), name, **look) for run, name, look in lines]
    desired = signal(sliding.time, np.degrees(sliding.reference[:, 2]), "desired", **DESIRED)
    off = [signal(run.time, np.abs(np.degrees(heading_error(run.state, run.reference))), "", **look) for run, _, look in lines]
    lower = strip("error, absolute [°]", off, (1e-4, 50.0), logarithmic=True)
    lower["layout"]["shapes"] = [level(1.0, "--ink", "dot")]
    return [strip("course [°]", [*courses, desired], (-35.0, 45.0)), lower]


def velocities(runs: Both) -> list[Figure]:
    """Figures 4 and 8: surge and sway velocity."""
    return [pair(runs, 3, "surge u [m/s]"), pair(runs, 4, "sway v [m/s]")]


def yaw(runs: Both) -> list[Figure]:
    """Figures 5 and 9: yaw angle and yaw rate."""
    return [pair(runs, 2, "yaw angle ψ [°]"), pair(runs, 5, "yaw rate r [°/s]", 180.0 / np.pi)]


def wrench(runs: Both) -> list[Figure]:
    """Figures 6 and 10: surge force and yaw moment; the first moment, far above all later ones, has its own figure."""
    figures = []
    for column, name in enumerate(("surge force τ₁ [N]", "yaw moment τ₂ [N·m]")):
        first, whole = [], []
        for law, words in FORMS.items():
            time, values = runs[law].time, runs[law].wrench[:, column]
            begins = time <= ZOOM
            peak = f"{words}: peak {np.max(np.abs(values)):.2g}"
            first.append(signal(time[begins], values[begins], peak, shape="hv", **LOOKS[law]))
            whole.append(signal(time, values, "", shape="hv", **LOOKS[law]))
        span = span_after(START, runs[REPAIRED].time, np.array([run.wrench[:, column] for run in runs.values()]))
        figures += [strip(name, first), strip(name, whole, span)]
    return figures


def errors(runs: Mapping[str, Both]) -> list[Figure]:
    """Position and heading errors for the three references."""
    away, turned = [], []
    for (name, pair_of_runs), dash in zip(runs.items(), ("solid", "dash", "dot"), strict=True):
        for law, run in pair_of_runs.items():
            look = {"colour": LOOKS[law]["colour"], "dash": dash, "width": 1.4}
            away.append(signal(run.time, position_error(run.state, run.reference), f"{name}, {FORMS[law]}", **look))
            turned.append(signal(run.time, np.abs(np.degrees(heading_error(run.state, run.reference))), "", **look))
    upper = strip("position error [m]", away, (3e-4, 1e3), logarithmic=True)
    return [upper, strip("heading error, absolute [°]", turned, (1e-5, 200.0), logarithmic=True)]


def reduced(name: str, learnt: CaseResult, known: CaseResult) -> Figure:
    """The lateral error with networks and with exact ship dynamics, and the reduced dynamics from 20 s on."""
    looks: tuple[tuple[CaseResult, str, dict[str, Any]], ...] = (
        (learnt, "networks", {"colour": "--other", "width": 1.4, "dash": "dashdot"}),
        (known, "exact ship dynamics", {"colour": "--ship/0.6", "width": 4.0}),
    )
    traces = [signal(found.run.control["time"], found.run.control["sway_error"], words, **look) for found, words, look in looks]
    return strip(f"{name} z₂ₑ [m]", [*traces, signal(*known.reduced, "reduced dynamics (without input)", **DESIRED)])


def surfaces(run: Run, sway_weight: float, heading_weight: float) -> list[Figure]:
    """Equation (46): the two terms of S1 cancel, and neither is zero.

    `sway_weight`, `heading_weight`: weights a [rad/m] and b of (20) in this run.
    """
    control = run.control
    time, first, second = control["time"], sway_weight * control["sway_surface"], -heading_weight * control["heading_surface"]
    terms = [signal(time, first, "a·σ₁", "--ship/0.6", width=4.0), signal(time, second, "−b·σ₂", **DESIRED)]
    sizes = [
        signal(time, np.abs(control["yaw_surface"]), "|S₁| = |a·σ₁ + b·σ₂| [rad/s]", "--ship", width=1.0),
        signal(time, np.abs(control["surge_surface"]), "|S₂| [m/s]", "--other", width=1.0, dash="dashdot"),
    ]
    upper = strip("terms of S₁ [rad/s]", terms, span_after(START, time, first))
    return [upper, strip("surfaces", sizes, (1e-7, 1e2), logarithmic=True)]


def networks(runs: Both) -> list[Figure]:
    """Network outputs and true dynamics, which include the disturbance: the adaptation cannot distinguish the two."""
    figures = []
    for i, (name, symbol, unit) in enumerate((("surge", "f_u", "m/s²"), ("sway", "f_v", "m/s²"), ("yaw", "f_r", "rad/s²"))):
        traces: list[Figure] = []
        settled = [0.0, 0.0]  # the transient of the networks is cut off, and zero is shown
        for law, words in FORMS.items():
            run, colour = runs[law], LOOKS[law]["colour"]
            truth = run.unforced_acceleration[:, i] + run.disturbance[:, i]
            traces.append(signal(run.time, truth, f"{words}: truth, with the disturbance", f"{colour}/0.3", width=4.5))
            traces.append(signal(run.control["time"], run.control[f"{name}_estimate"], f"{words}: network", colour, dash="dash"))
            settled += [*span_after(SETTLED, run.time, truth, room=0.15)]
        figures.append(strip(f"{symbol} [{unit}]", traces, (min(settled), max(settled))))
    return figures
