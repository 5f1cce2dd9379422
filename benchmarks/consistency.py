"""Whether the observer's errors are as large as it states, over many runs of the realistic ship.

Runs the realistic scenario, on its circle and on a straight line, with one seed after the other, and prints the normalised
estimation error squared (NEES) after the approach: its mean over time and runs, and the share of the time in which the mean over
the runs lies within the 95 % bounds of the chi-square distribution. The exit code is 1 if a mean is above the upper bound.

    python benchmarks/consistency.py [--runs 200] [--jobs 2]
"""

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "support"))

from observer_consistency import bounds, normalised_errors

CASES = {"circle": {}, "straight line": {"reference_ship.yaw_moment": 0.0}}
SETTLED = 100.0
"""The time from which on it counts, s: the observer takes the approach to learn damping and current."""


def errors(case: str, seed: int) -> np.ndarray:
    """Return the NEES of one run at every tenth control period."""
    scenario = load_scenario("realistic", CASES[case] | {"vessel_sim.seed": seed})
    nees, time = normalised_errors(simulate(scenario), scenario)
    return nees[time >= SETTLED][::10]


def main() -> int:
    """Run all seeds and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at a time")
    arguments = parser.parse_args()
    low, high = bounds(arguments.runs)
    table = Table("", "mean NEES", "share of the time within the bounds", "above them", "largest mean over the runs")
    means = []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for case in CASES:
            over_runs = np.mean(list(pool.map(partial(errors, case), range(1, arguments.runs + 1))), axis=0)
            inside = np.mean((over_runs >= low) & (over_runs <= high))
            means.append(over_runs.mean())
            shares = f"{100 * inside:.0f} %", f"{100 * np.mean(over_runs > high):.0f} %"
            table.add_row(case, f"{means[-1]:.2f}", *shares, f"{over_runs.max():.2f}")
    Console(width=130).print(table, f"95 % bounds of the mean over {arguments.runs} runs at one time: {low:.2f} to {high:.2f}")
    return 0 if max(means) <= high else 1


if __name__ == "__main__":
    sys.exit(main())
