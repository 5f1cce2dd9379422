"""The effect of each part of the realistic ship on the tracking error and on the observer's estimates.

Runs every row of config/suites/realistic.yaml offline and prints the position error over the last quarter, the rate of the
wrench and the errors of the estimates over the last half. Then the same for pose measurements alone under the paper's
disturbance, the means over the five seeds, and the time of an update of the observer. The exit code is 1 if a row or a mean
misses its limit.

    python benchmarks/realistic.py [--jobs 2]
"""

import argparse
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_hsmc_ros.studies.suite import Row, Verdict, judge, load_suite

UPDATES = 5000
LIMITS = {"complete scenario": 0.25, "straight line": 0.15, "slow actuators": 0.4}
"""Limits of the mean position error over the rows whose names begin so, m."""

POSES = {
    "controller.law": "guided",
    "controller.rate_hz": 50.0,
    "controller.observer.enabled": True,
    "controller.observer.position_noise": 0.1,
    "controller.observer.heading_noise": 0.0017453292519943296,
    **{f"controller.vessel.{name}": value for name, value in INSTANT.items()},
    "vessel_sim.duration": 200.0,
    "vessel_sim.actuators.surge_force_limit": 2e5,
    "vessel_sim.actuators.yaw_moment_limit": 3e6,
    "vessel_sim.sensors.measures_velocity": False,
}
NOISE = {"vessel_sim.sensors.position_noise": 0.1, "vessel_sim.sensors.heading_noise": 0.0017453292519943296}

Metrics = tuple[Verdict, np.ndarray, np.ndarray]


def main() -> int:
    """Run all rows and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at a time")
    arguments = parser.parse_args()
    rows = (*load_suite("realistic"), *more_rows())
    console = Console(width=130)
    with Progress(console=console, transient=True) as progress, ProcessPoolExecutor(arguments.jobs) as pool:
        bar = progress.add_task("rows", total=len(rows))
        found = []
        for metrics in pool.map(measure, rows):
            found.append(metrics)
            progress.advance(bar)
    console.print(table(rows, found))
    mean_errors = means(rows, found)
    for name, mean in mean_errors.items():
        console.print(f"{name}: {mean:.3f} m in the mean over the seeds, at most {LIMITS[name]} m")
    within = all(mean <= LIMITS[name] for name, mean in mean_errors.items())
    console.print(f"an update of the observer takes {1e6 * update_time(0.0):.0f} µs, with waves {1e6 * update_time(6.0):.0f} µs")
    return 0 if all(verdict.hit for verdict, _, _ in found) and within else 1


def more_rows() -> list[Row]:
    """Return the rows for pose measurements alone."""
    return [
        Row("the paper's disturbance, noisy poses only", changes=POSES | NOISE, at_most=0.1),
        Row("the paper's disturbance, exact poses only", changes=POSES),
    ]


def means(rows: tuple[Row, ...], found: list[Metrics]) -> dict[str, float]:
    """Return the mean position error of each group of rows that differ in their seeds."""
    errors = [(row.name, verdict.rms) for row, (verdict, _, _) in zip(rows, found, strict=True)]
    return {group: float(np.mean([error for name, error in errors if name.startswith(group)])) for group in LIMITS}


def measure(row: Row) -> Metrics:
    """Return verdict, rms rates of the wrench [N/s, N·m/s] and rms errors of the estimates, NaN without an observer."""
    run = simulate(load_scenario(row.scenario, row.changes))
    late = slice(len(run.time) // 2, None)
    rates = np.std(np.diff(run.wrench[late], axis=0) / np.diff(run.time)[0], axis=0)
    return judge(row, run), rates, estimate_errors(run)


def estimate_errors(run: Run) -> np.ndarray:
    """Return the rms errors of x and y together, psi, u, v, r over the last half."""
    if "estimate" not in run.control:
        return np.full(5, np.nan)
    at = np.searchsorted(run.time, run.control["time"] - 1e-9)
    error = run.control["estimate"] - run.state[at]
    error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    square = np.mean(error[len(error) // 2 :] ** 2, axis=0)
    return np.sqrt(np.array([square[0] + square[1], *square[2:]]))


def table(rows: tuple[Row, ...], found: list[Metrics]) -> Table:
    """Lay out one row per case."""
    made = Table("", "position rms, m", "largest, m", "force kN/s", "moment kN·m/s", "x, y m", "psi °", "u m/s", "v m/s", "r °/s")
    for row, (verdict, rates, errors) in zip(rows, found, strict=True):
        shown = [f"{verdict.rms:.3f}" + ("" if verdict.hit else " MISSED"), f"{verdict.largest:.2f}"]
        shown += [f"{1e-3 * rate:.0f}" for rate in rates]
        x_y, psi, u, v, r = errors
        estimates = [f"{x_y:.3f}", f"{np.degrees(psi):.3f}", f"{u:.3f}", f"{v:.3f}", f"{np.degrees(r):.3f}"]
        made.add_row(row.name, *shown, *("-" if value == "nan" else value for value in estimates))
    return made


def update_time(wave_period: float) -> float:
    """Return the time of one update in seconds, the smallest of five rounds."""
    observer = Observer(ObserverParameters(wave_period=wave_period), KnownVessel())
    poses = np.random.default_rng(1).normal(size=(UPDATES, 3), scale=0.1)
    turns = []
    for _ in range(5):
        observer.reset()
        began = time.perf_counter()
        for k, pose in enumerate(poses):
            observer.update(k * 20_000_000, pose, (1e4, 1e5))
        turns.append((time.perf_counter() - began) / UPDATES)
    return min(turns)


if __name__ == "__main__":
    sys.exit(main())
