"""From where the guided law reaches its reference: maps of the time to settle for three ships, for docs/guided.md.

Each ship runs the scenario of `vessel-hsmc init` with its own actuators and the gains of the rule, in calm water. Positions are
in lengths of the ship, times in T = sqrt(m33/tau_2max), speeds in top speeds. The upper maps start at rest around the start of
the circle, with a heading drawn for each; the lower maps start eight lengths abeam, at any heading and speed, also astern. A run
lasts 300 T, or 25 time constants of the position loop if that is longer, and has about 90 updates of the law in T.

    python benchmarks/attraction.py [--points 21] [--output docs/images/attraction.png]
"""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vessel_hsmc_ros.report.style import LIMIT, PLOT
from vessel_hsmc_ros.runs.batch import Outcome, simulate_many
from vessel_hsmc_ros.scenario.own_ship import scenario_for, ship_of
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.scenario.vessels import read_vessel

SHIPS = ("cybership2", "paper_ship", "supply_vessel")

DURATION, UPDATES = 300.0, 90.0
"""Least duration of a run, in T, and updates of the law in T."""

REACH, ABEAM, SPEEDS = 10.0, 8.0, (-0.3, 0.9)
"""Largest distance of a start along each axis and its distance in the lower maps, in lengths; speeds, in top speeds."""


class Map(NamedTuple):
    """A map: names and values of its axes, and the outcomes, (n, n), row by row.

    Attributes:
        time: The time to settle, in T; infinite for a ship that has not settled.
        error: The largest error of the last quarter, in lengths; infinite for a run that ended early.
    """

    axes: tuple[str, str]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    time: NDArray[np.float64]
    error: NDArray[np.float64]


def maps(name: str, points: int) -> tuple[Map, Map]:
    """The maps of start positions and of start headings and speeds of a vessel of the library."""
    values = read_vessel(name).values
    scale = scale_of(ship_of(values))
    rate = max(1.0, float(round(UPDATES / scale.T)))
    own = parse_scenario(scenario_for(values, name), name)
    duration = float(math.ceil(max(DURATION * scale.T, own.vessel_sim.duration)))
    rates = {f"{node}.rate_hz": rate for node in ("vessel_sim", "reference_ship", "controller")}
    base = own.changed({**rates, "vessel_sim.duration": duration})

    def found(axes: tuple[str, str], x: Any, y: Any, starts: Sequence[tuple[float, float, float, float]]) -> Map:
        runs = (
            base.changed(
                {
                    "vessel_sim.initial_pose": [ahead * scale.L, abeam * scale.L, heading],
                    "vessel_sim.initial_velocity": [speed * scale.U, 0.0, 0.0],
                }
            )
            for ahead, abeam, heading, speed in starts
        )
        outcomes = simulate_many(runs, workers=1)
        times, errors = np.array([result(each) for each in outcomes]).T.reshape(2, len(y), len(x))
        return Map(axes, x, y, times / scale.T, errors / scale.L)

    grid = np.linspace(-REACH, REACH, points)
    headings, speeds = np.linspace(-180.0, 180.0, points), np.linspace(*SPEEDS, points)
    drawn = np.random.default_rng(1).uniform(-math.pi, math.pi, points * points)
    places = [(x, y, heading, 0.0) for (y, x), heading in zip(((y, x) for y in grid for x in grid), drawn, strict=True)]
    moving = [(0.0, -ABEAM, math.radians(heading), speed) for speed in speeds for heading in headings]
    return (
        found(("ahead of the reference [lengths]", "to port of it [lengths]"), grid, grid, places),
        found(("heading [°]", "surge speed [top speed]"), headings, speeds, moving),
    )


def result(outcome: Outcome) -> tuple[float, float]:
    """Time to settle, s, and largest error of the last quarter, m; infinite where there is none."""
    metrics = outcome.metrics
    if metrics is None:
        return math.inf, math.inf
    return math.inf if metrics.settling_time is None else metrics.settling_time, metrics.position_error_peak_last_quarter


def draw(found: dict[str, tuple[Map, Map]], path: Path) -> None:
    """Draw the maps, a column for each ship; starts from which the ship has not settled are crosses."""
    with mpl.rc_context({**PLOT, "axes.grid": False}):
        picture = Figure(figsize=(11.0, 7.2), layout="constrained")
        panels: Any = picture.subplots(2, len(found), squeeze=False)
        for column, (name, pair) in zip(panels.T, found.items(), strict=True):
            highest = max(float(np.max(each.time[np.isfinite(each.time)], initial=1.0)) for each in pair)
            for panel, each in zip(column, pair, strict=True):
                settled = np.isfinite(each.time)
                shown = panel.pcolormesh(each.x, each.y, np.where(settled, each.time, np.nan), vmin=0.0, vmax=highest)
                x, y = np.meshgrid(each.x, each.y)
                panel.plot(x[~settled], y[~settled], "x", color=LIMIT, ms=4)
                panel.set(xlabel=each.axes[0], ylabel=each.axes[1])
            column[0].set(title=f"{name}, {read_vessel(name).values['vessel.length']:g} m", aspect="equal")
            picture.colorbar(shown, ax=column, label="time to settle [T]", orientation="horizontal", shrink=0.9)
        picture.savefig(path)


def main() -> None:
    """Simulate, print a line for each map, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=21, help="points of each axis")
    parser.add_argument("--output", type=Path, default=Path("docs/images/attraction.png"), help="the picture")
    given = parser.parse_args()
    found = {}
    print(
        "| ship | map | settled | time to settle, median and largest [T] | largest error at the end [lengths] |\n|" + " --- |" * 5
    )
    for name in SHIPS:
        found[name] = maps(name, given.points)
        for kind, each in zip(("position", "heading and speed"), found[name], strict=True):
            times = each.time[np.isfinite(each.time)]
            summary = f"{np.median(times):.0f}, {times.max():.0f}" if len(times) else ""
            print(f"| {name} | {kind} | {len(times)} of {each.time.size} | {summary} | {each.error.max():.2g} |", flush=True)
    draw(found, given.output)


if __name__ == "__main__":
    main()
