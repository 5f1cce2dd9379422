"""What compiled kernels gain: commands with them and interpreted, and whether they would pay in the nodes.

    python benchmarks/compiled.py [--before] [--bag BAG]

With `--before` the commands are also measured with `--interpreted`, which takes some minutes; with `--bag` the verification of a
recorded run. Each command is run once before, so that its kernels are compiled. The exit code is 1 if a limit is missed.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros import load_scenario, simulate
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.scenario.scenario import make_law
from vessel_hsmc_ros.simulation.compilation import compiled

COMMAND = [sys.executable, "-m", "vessel_hsmc_ros.cli.main"]
STEPS = 2000
LOADING = """
import time
began = time.perf_counter()
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
law = make_controller("{law}", 0.01)
motion, acceleration = Motion(5.0, 1.0, 0.8, 0.1, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0)
interpreted = time.perf_counter()
from vessel_hsmc_ros.simulation.compilation import compiled
compiled(type(law).kernel)(motion, motion, acceleration, law.memory, law.constants)
print(time.perf_counter() - interpreted)
"""
"""Measures what the first step of a compiled law adds to the start of a process."""

console = Console(width=110)


def main() -> int:
    """Measure everything and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", action="store_true", help="also run the commands interpreted")
    parser.add_argument("--bag", type=Path, help="a recorded run of 400 s, to be verified")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        table, missed = commands(Path(folder), arguments.before, arguments.bag)
    console.print(table)
    console.print(nodes())
    return 1 if missed else 0


def commands(folder: Path, before: bool, bag: Path | None) -> tuple[Table, int]:
    """Measure the commands with their limits, s; return the table and the number of missed limits.

    Args:
        folder: Where the commands write.
        before: Whether to measure all of them interpreted too.
        bag: A recorded run to be verified.
    """
    scenario, output = load_scenario("case2_tracking"), ["--output", str(folder)]
    laws = "hierarchical,guided,los_pid"
    rows: list[tuple[str, float | None, Callable[[bool], object]]] = [
        ("simulate case2_tracking, beside start-up", 1.0, lambda interpreted: simulate(scenario, interpreted=interpreted)),
        ("reproduce", 45.0, partial(run, ["reproduce", *output])),
        ("compare --suite guided", 60.0, partial(run, ["compare", "--suite", "guided", "--laws", laws, *output])),
    ]
    if bag:
        rows.append(("replay --verify, relative to interpreted", None, partial(run, ["replay", str(bag), "--verify"])))
    table, missed = Table("s", "compiled", "interpreted", "at most"), 0
    for name, limit, work in rows:
        work(False)
        after = elapsed(work, interpreted=False)
        first = elapsed(work, interpreted=True) if before or limit is None else None
        at_most = first if limit is None else limit
        hit = at_most is None or after <= at_most
        missed += not hit
        table.add_row(name, f"{after:.2f}", f"{first:.2f}" if first else "-", f"{at_most:.2f}{'' if hit else ' MISSED'}")
    return table, missed


def run(words: list[str], interpreted: bool) -> None:
    """Run a command of the package."""
    subprocess.run(
        [*COMMAND, *words, *(["--interpreted"] if interpreted else [])], check=False, capture_output=True
    )  # a missed limit of the suite is an exit code of 1


def elapsed(work: Callable[[bool], object], interpreted: bool) -> float:
    """Return the time that some work takes, s."""
    began = time.perf_counter()
    work(interpreted)
    return time.perf_counter() - began


def nodes() -> Table:
    """Measure what compiled laws would add to the start of the controller node, and what they would save in each step."""
    table = Table("law", "start-up +s", "step µs", "compiled µs", "pays after, steps")
    for law in ("hierarchical", "guided"):
        loads = [float(subprocess.check_output([sys.executable, "-c", LOADING.format(law=law)], text=True)) for _ in range(3)]
        slow, fast = step_times(law)
        table.add_row(law, f"{min(loads):.2f}", f"{1e6 * slow:.0f}", f"{1e6 * fast:.1f}", f"{min(loads) / (slow - fast):.0f}")
    return table


def step_times(name: str) -> tuple[float, float]:
    """Return the processor time of a step of a law, s: interpreted, and compiled but called from Python as in a node."""
    law = make_law(load_scenario("case2_tracking", {"controller.law": name}).controller)
    desired, rate = Motion(5.5, 1.2, 0.8, 2.0, 0.0, 0.1), Acceleration(0.0, 0.0, 0.0)
    motions = [Motion(5.0, 1.0, 0.8, *velocities) for velocities in np.random.default_rng(1).normal(size=(STEPS, 3)).tolist()]
    taken = []
    for kernel in (type(law).kernel, compiled(type(law).kernel)):  # type: ignore[attr-defined]
        turns = []
        for _ in range(4):
            law.reset()
            memory, began = law.memory, time.process_time()  # type: ignore[attr-defined]
            for motion in motions:
                _, _, memory = kernel(motion, desired, rate, memory, law.constants)  # type: ignore[attr-defined]
            turns.append((time.process_time() - began) / STEPS)
        taken.append(min(turns))
    return taken[0], taken[1]


if __name__ == "__main__":
    sys.exit(main())
