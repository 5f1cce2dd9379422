"""The guided law on its whole suite, and its computation time.

Runs every row of config/suites/guided.yaml with the law at 10, 50 and 100 Hz; the law knows that the actuators are instant.
Measures the time of an update in turns with the hierarchical law, and the rate of the wrench with noisy sensors for both. The
exit code is 1 if a row misses its limit or an update takes more than 2.5 times the time.

    python benchmarks/guided.py [--rates 10 50 100] [--jobs 2]
"""

import argparse
import sys
import time
from dataclasses import replace
from itertools import product

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.metrics import rms
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_hsmc_ros.studies.comparison import LawRun, Task, compare
from vessel_hsmc_ros.studies.suite import Row, load_suite

RATES = (10.0, 50.0, 100.0)
LAWS = ("hierarchical", "guided")
ROUNDS, UPDATES = 200, 200
AT_MOST = 2.5
"""Largest permitted update time, as a multiple of the hierarchical law's."""

NOISY = {"vessel_sim.duration": 200.0}
SETTLED = 100.0


def main() -> int:
    """Run everything and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rates", type=float, nargs="+", default=list(RATES), help="rates of the law, Hz")
    parser.add_argument("--jobs", type=int, default=None, help="processes at a time (default: one per core)")
    arguments = parser.parse_args()
    console = Console(width=110)
    rows = load_suite("guided")
    outcomes = run_all(rows, arguments.rates, arguments.jobs, console)
    console.print(accuracy(rows, arguments.rates, outcomes))
    missed = sum(not outcome.hit for outcome in outcomes)
    console.print(f"{len(outcomes) - missed} of {len(outcomes)} hit")
    table, factor = update_times()
    console.print(table)
    console.print(wrench_rates())
    return 1 if missed or factor > AT_MOST else 0


def run_all(rows: tuple[Row, ...], rates: list[float], jobs: int | None, console: Console) -> list[LawRun]:
    """Run every row at every rate, rate by rate."""
    tasks = [Task(row, "guided", rate) for rate in rates for row in rows]
    with Progress(console=console, transient=True) as progress:
        bar = progress.add_task("rows", total=len(tasks))
        return compare(tasks, jobs, lambda _: progress.advance(bar))


def accuracy(rows: tuple[Row, ...], rates: list[float], outcomes: list[LawRun]) -> Table:
    """Tabulate the rms position error of each row at each rate; a missed limit is marked by a star."""
    table = Table("row", "at most [m]", *(f"{rate:g} Hz [m]" for rate in rates), "largest [m]", "excursion")
    for i, row in enumerate(rows):
        of_row = outcomes[i :: len(rows)]
        verdicts = [o.verdict for o in of_row if o.verdict]
        cells = [f"{o.verdict.rms:.4f}{'' if o.hit else ' *'}" if o.verdict else o.failure for o in of_row]
        largest = max((v.largest for v in verdicts), default=np.nan)
        excursion = max((v.excursion for v in verdicts), default=np.nan)
        table.add_row(row.name, f"{row.at_most:g}", *cells, f"{largest:.3f}", f"{excursion:.2f}")
    return table


def update_times() -> tuple[Table, float]:
    """Measure one update of each law on the same inputs in turns; return the table and the ratio guided / hierarchical."""
    random = np.random.default_rng(0)
    states, references = random.normal(size=(UPDATES, 6)), random.normal(size=(UPDATES, 6))
    acceleration = np.zeros(3)
    laws = {name: make_controller(name, 0.01) for name in LAWS}
    times: dict[str, list[float]] = {name: [] for name in LAWS}
    for _ in range(ROUNDS):
        for name, law in laws.items():
            began = time.process_time()
            for state, reference in zip(states, references, strict=True):
                law.update(0.0, state, reference, acceleration)
            times[name].append((time.process_time() - began) / UPDATES)
    table = Table("law", "fastest update [µs]", "median [µs]")
    for name in LAWS:
        table.add_row(name, f"{1e6 * min(times[name]):.1f}", f"{1e6 * float(np.median(times[name])):.1f}")
    factor = min(times["guided"]) / min(times["hierarchical"])
    table.add_row("guided / hierarchical", f"{factor:.2f}", "")
    return table, factor


def wrench_rates() -> Table:
    """Tabulate the rms rate of the applied wrench with noisy sensors from 100 s to 200 s."""
    (row,) = (row for row in load_suite("guided") if row.name == "noise")
    table = Table("law, with noise", "rate [Hz]", "surge force [N/s rms]", "yaw moment [N·m/s rms]")
    for name, rate_hz in product(LAWS, (50.0, 100.0)):
        quick = replace(row, changes={**row.changes, **NOISY, "controller.law": name, "controller.rate_hz": rate_hz})
        run = simulate(load_scenario(quick.scenario, quick.changes))
        late = run.time >= SETTLED
        rates = np.diff(run.wrench[late], axis=0) / np.diff(run.time[late])[:, None]
        table.add_row(name, f"{rate_hz:g}", f"{rms(rates[:, 0]):.2g}", f"{rms(rates[:, 1]):.2g}")
    return table


if __name__ == "__main__":
    sys.exit(main())
