"""The speed of batches of runs, relative to scalar C++ of the same arithmetic.

Compiles benchmarks/scalar/case2.cpp, checks that it gives the results of the package, and measures both in turns: on one core by
processor time, on two cores by the time that two at once take. Also the guided law relative to the hierarchical one, and how the
time grows with the number of runs. The exit code is 1 if a limit is missed.

    python benchmarks/batch.py [--runs 20] [--rounds 5] [--growth 100 1000] [--full] [--chart FILE]

With `--full` 10,000 runs of 400 s of the guided law with drawn hull, wind and sensor noise, on all cores. With `--chart` the time
of one run in each form is drawn.
"""

import argparse
import functools
import itertools
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from scalar_program import Scalar, samples  # type: ignore[import-not-found]

from vessel_hsmc_ros import load_scenario, simulate
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.studies.batch import simulate_many

OFFSET = 1e-4
"""Run i starts i times this further east, m, here and in the C++ program."""

AGREEMENT = 1e-9
SHORT = 2
"""Runs in a turn on one core."""

LAW = "hierarchical_printed"
"""The law of the C++ program."""

LARGE = 5
"""On two cores there are so many times more runs in a turn than `--runs`."""

LIMITS = {
    "one core: time of a run, relative to C++": (1.2, True),
    "two cores: speed-up, relative to that of two C++ programs": (0.9, False),
    "guided law, relative to the hierarchical one": (2.5, True),
    "time of a run, many relative to few": (1.1, True),
    "10,000 guided runs, minutes": (10.0, True),
    "peak memory, GB": (1.0, True),
}
"""The limit of each result, and whether it is an upper one."""

console = Console(width=110)


def main() -> int:
    """Measure everything and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=20, help="runs of each in a round")
    parser.add_argument("--rounds", type=int, default=5, help="rounds")
    parser.add_argument("--growth", type=int, nargs=2, default=[100, 1000], help="numbers of runs to compare")
    parser.add_argument("--full", action="store_true", help="also 10,000 runs of the guided law")
    parser.add_argument("--chart", type=Path, help="picture to draw, such as docs/images/speed.png")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scalar = Scalar(Path(folder))
        agree(scalar)
        if arguments.chart:
            draw(forms(scalar, arguments.runs), arguments.chart)
        found = ratios(scalar, arguments.runs, arguments.rounds)
    found["time of a run, many relative to few"] = growth(*arguments.growth)
    if arguments.full:
        found["10,000 guided runs, minutes"] = campaign(10_000)
    found["peak memory, GB"] = peak_memory()
    table = Table("", "measured", "limit")
    missed = 0
    for name, value in found.items():
        limit, upper = LIMITS[name]
        hit = value <= limit if upper else value >= limit
        missed += not hit
        table.add_row(name, f"{value:.2f}", f"{'at most' if upper else 'at least'} {limit:g}{'' if hit else ' MISSED'}")
    console.print(table)
    return 1 if missed else 0


def scenarios(law: str, runs: int) -> Iterator[Scenario]:
    """The runs: case 2 from initial positions of their own."""
    base = load_scenario("case2_tracking", {"controller.law": law})
    x, y, psi = base.vessel_sim.initial_pose
    for i in range(runs):
        yield replace(base, vessel_sim=replace(base.vessel_sim, initial_pose=(x + OFFSET * i, y, psi)))


def agree(scalar: Scalar) -> None:
    """Check that both give the same final state, rms and largest position error."""
    run = simulate(list(scenarios(LAW, 2))[1])
    error = position_error(run.state, run.reference)
    ours = np.array([*run.state[-1], rms(error), error.max()])
    theirs = np.array(scalar.results(2)[1:])
    theirs[2] -= 2.0 * np.pi * np.round((theirs[2] - ours[2]) / (2.0 * np.pi))
    difference = float(np.max(np.abs(ours - theirs) / np.maximum(np.abs(ours), 1.0)))
    console.print(f"largest relative difference between C++ and the package after {run.time[-1]:g} s: {difference:.1e}")
    if difference > AGREEMENT:
        raise SystemExit(f"the programs differ by more than {AGREEMENT:g}")


def ratios(scalar: Scalar, runs: int, rounds: int) -> dict[str, float]:
    """Measure C++ and the package in turns; the medians of the ratios of each turn."""
    found = one_core(scalar, runs * rounds // SHORT), two_cores(scalar, LARGE * runs, rounds)
    first, second, third = itertools.islice(LIMITS, 3)
    (cpp, laws), cores = found
    return {first: cpp, second: cores, third: laws}


def one_core(scalar: Scalar, turns: int) -> tuple[float, float]:
    """The processor time of a run relative to C++, and that of the guided law relative to the hierarchical one.

    The turns are short, so that both share the minute's speed of the machine.
    """
    hierarchical, guided = list(scenarios(LAW, SHORT)), list(scenarios("guided", SHORT))
    for warm in (hierarchical, guided):
        simulate_many(warm)
    steps = SHORT * samples(hierarchical[0])
    taken = []
    with Progress(console=console, transient=True) as progress:
        for _ in progress.track(range(turns), description="one core"):
            theirs = scalar.results(SHORT)[0] * 1e-9 * steps
            taken.append((theirs, *(processor_time(lambda law=law: simulate_many(law)) for law in (hierarchical, guided))))  # type: ignore[misc]
    pace = [f"{1e9 * statistics.median(times) / steps:.0f}" for times in zip(*taken, strict=True)]
    console.print("ns a step: C++ {}, hierarchical law {}, guided law {}".format(*pace))
    return statistics.median(h / c for c, h, _ in taken), statistics.median(g / h for _, h, g in taken)


def two_cores(scalar: Scalar, runs: int, rounds: int) -> float:
    """The speed-up of twice the runs on two cores, relative to that of two C++ programs at once."""
    found = []
    with Progress(console=console, transient=True) as progress:
        for _ in progress.track(range(rounds), description="two cores"):
            single, double = elapsed(lambda: scalar.results(runs)), elapsed(lambda: two_at_once(scalar, runs))
            alone, both = (elapsed(functools.partial(simulate_many, scenarios(LAW, n * runs), workers=n)) for n in (1, 2))
            # A speed-up of 2 takes as long as one core with half of the runs.
            found.append((alone / both) / (single / double))
    return statistics.median(found)


def two_at_once(scalar: Scalar, runs: int) -> None:
    """Run two copies of the C++ program at once."""
    for process in [scalar.start(runs) for _ in range(2)]:
        process.communicate()


def processor_time(work: Callable[[], object]) -> float:
    """Return the processor time of some work of this process, s."""
    began = time.process_time()
    work()
    return time.process_time() - began


def elapsed(work: Callable[[], object]) -> float:
    """Return the time that some work takes, s."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def forms(scalar: Scalar, runs: int) -> dict[str, float]:
    """Measure the processor time of one run of case 2 in each form, s."""
    one, many = next(scenarios(LAW, 1)), list(scenarios(LAW, runs))
    simulate(one), simulate_many(many[:1])
    return {
        "interpreted: simulate, everything recorded": processor_time(lambda: simulate(one, interpreted=True)),
        "compiled: simulate, everything recorded": min(processor_time(lambda: simulate(one)) for _ in range(3)),
        "compiled: one run of a batch, its metrics": processor_time(lambda: simulate_many(many)) / runs,
        "scalar C++ of the same arithmetic": scalar.results(runs)[0] * 1e-9 * samples(one),
    }


def draw(times: dict[str, float], path: Path) -> None:
    """Draw the time of a run in each form on a logarithmic axis."""
    figure, axes = plt.subplots(figsize=(8.0, 2.4), layout="constrained")
    bars = axes.barh(list(times), list(times.values()), color=["#9aa5b1", "#1f77b4", "#1f77b4", "#9aa5b1"])
    labels = [f"{value:.1f} s" if value >= 1.0 else f"{1e3 * value:.0f} ms" for value in times.values()]
    axes.bar_label(bars, labels, padding=4)
    axes.set(xscale="log", xlabel="processor time of 400 s of case 2 at 100 Hz, 27 neurons [s]")
    axes.set_xlim(0.3 * min(times.values()), 3.0 * max(times.values()))
    axes.invert_yaxis()
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)


def growth(few: int, many: int) -> float:
    """Measure the processor time of a run among many, relative to that among few."""
    of_few, of_many = (processor_time(lambda n=n: simulate_many(scenarios("guided", n))) / n for n in (few, many))  # type: ignore[misc]
    return of_many / of_few


def drawn(runs: int) -> Iterator[Scenario]:
    """Guided runs with a hull, wind and noise of their own."""
    noise = {"vessel_sim.sensors.position_noise": 0.01, "vessel_sim.sensors.heading_noise": 0.001}
    base = load_scenario("case2_tracking", {"controller.law": "guided", **noise})
    sim, random = base.vessel_sim, np.random.default_rng(1)
    for seed in range(runs):
        surge, sway, yaw = random.uniform(0.8, 1.2, 3)
        vessel = replace(
            sim.vessel,
            surge_inertia=surge * sim.vessel.surge_inertia,
            sway_inertia=sway * sim.vessel.sway_inertia,
            yaw_inertia=yaw * sim.vessel.yaw_inertia,
        )
        east, north = random.normal(0.0, 2000.0, 2)
        wind = replace(sim.disturbance.earth_fixed, east_force=east, north_force=north, gust_deviation=500.0)
        changed = replace(sim, seed=seed, vessel=vessel, disturbance=replace(sim.disturbance, earth_fixed=wind))
        yield replace(base, vessel_sim=changed)


def campaign(runs: int) -> float:
    """Simulate drawn runs on all cores; return the minutes."""
    with Progress(console=console, transient=True) as progress:
        bar = progress.add_task(f"{runs} runs", total=runs)
        took = elapsed(lambda: simulate_many(drawn(runs), workers=None, on_result=lambda _: progress.advance(bar)))
    return took / 60.0


def peak_memory() -> float:
    """Return the largest resident memory of this process, whose threads simulate, GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1e-6


if __name__ == "__main__":
    sys.exit(main())
