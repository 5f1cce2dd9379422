"""What identification recovers: CyberShip II from noisy simulated runs, and CyberShip Enterprise I from its tank runs.

    python benchmarks/identification.py recover [--seeds 200] [--noise 1.0] [--gusts 0.05]
    python benchmarks/identification.py coverage [--seeds 100] [--each]
    python benchmarks/identification.py tank

`recover` simulates the ship of Skjetne, Smogeli and Fossen (2004) with sensor noise, identifies it for each seed, and prints how
many estimates lie within one, two and three standard errors of the true values. `coverage` does the same with the Otter at 10 and
25 Hz under much excitation and little, with a force that is held from sample to sample or changes in between, and prints how many
95 % intervals contain the true values. `tank` identifies CyberShip Enterprise I from one
of the runs in test/data/enterprise1 and predicts the other one over windows of 20 s, beside the published hull data.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

# One thread a process: the matrices are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.studies.identification.estimate import identify
from vessel_hsmc_ros.studies.identification.types import DIAGONAL_INERTIA, Identified, model, predict

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "support"))

import cybership2_runs
import otter_runs
import tank_runs

DURATION = 240.0
"""Length of a run, s."""


def one(seed: int, noise: float, gusts: float) -> Identified:
    """Identify CyberShip II from the run of one seed."""
    return identify([cybership2_runs.cybership2(seed, duration=DURATION, noise=noise, gusts=gusts)], model("coupled"))


def results(seeds: int, noise: float, gusts: float) -> Iterator[Identified]:
    """The results as they come, from all cores, with a line of progress."""
    begun = time.monotonic()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        futures = [pool.submit(one, seed, noise, gusts) for seed in range(seeds)]
        for number, future in enumerate(as_completed(futures), 1):
            spent = time.monotonic() - begun
            print(
                f"\r{number} of {seeds} runs, {spent:.0f} s, {spent / number * (seeds - number):.0f} s left ",
                end="",
                file=sys.stderr,
            )
            yield future.result()
    print(file=sys.stderr)


def recover(seeds: int, noise: float, gusts: float) -> None:
    """Print the coverage of the standard errors, for each parameter and for all."""
    errors: dict[str, list[float]] = {name: [] for name in model("coupled").parameters}
    for found in results(seeds, noise, gusts):
        for name, error in found.standard_errors.items():
            errors[name].append((found.values[name] - cybership2_runs.CYBERSHIP2.get(name, 0.0)) / error)
        inside = np.mean(np.abs(np.concatenate([*map(np.array, errors.values())])) < 3.0)
        print(f"{inside:.1%} within 3 standard errors ", end="", file=sys.stderr, flush=True)
    table(errors)


def table(errors: dict[str, list[float]]) -> None:
    """Print how the errors in units of their standard error are distributed, by parameter."""
    print(f"{'parameter':36s} {'true':>9s} {'estimated':>9s} {'mean':>6s} {'rms':>5s} {'<1':>6s} {'<2':>6s} {'<3':>6s}")
    for name in [*errors, "all"]:
        z = np.array(errors[name] if name in errors else np.concatenate([*map(np.array, errors.values())]))
        true = f"{cybership2_runs.CYBERSHIP2.get(name, 0.0):9.4f}" if name in errors else " " * 9
        if len(z):
            within = " ".join(f"{100 * np.mean(np.abs(z) < k):5.1f}%" for k in (1, 2, 3))
            print(f"{name:36s} {true} {len(z):9d} {z.mean():6.2f} {np.sqrt(np.mean(z**2)):5.2f} {within}")
        else:
            print(f"{name:36s} {true} {0:9d}")


def covered(seed: int, rate_hz: float, rich: bool, held: bool) -> Identified | None:
    """Identify the Otter from the run of one seed; None if that fails."""
    try:
        return identify([otter_runs.otter(seed, rate_hz, rich, held)], model("coupled"))
    except VesselHsmcError:
        return None


def coverage(seeds: int, each: bool) -> None:
    """Print how many 95 % intervals contain the true values, by excitation, wrench and rate; for each parameter on request."""
    print("excitation force    Hz    m11    m22    m33     all  rms error of m33  failed  warned of residuals")
    cases = [(rich, held, rate) for rich in (False, True) for held in (False, True) for rate in (10.0, 25.0)]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for rich, held, rate in cases:
            futures = [pool.submit(covered, seed, rate, rich, held) for seed in range(seeds)]
            found = [one for future in futures if (one := future.result())]
            doubted = sum(any("the residuals of" in text for text in one.warnings) for one in found)
            name = f"{'rich' if rich else 'poor':10s} {'held' if held else 'sampled':7s} {rate:3.0f}"
            print(f"{name} {line(found)}           {seeds - len(found):6d}  {doubted:6d}", flush=True)
            if each:
                by_parameter(found)


def line(found: list[Identified]) -> str:
    """Coverage of each inertia and of all parameters, and the rms error of the yaw inertia."""
    inertias = [inside(found, name) for name in DIAGONAL_INERTIA]
    everything = np.concatenate([inside(found, name) for name in model("coupled").parameters])
    shares = "  ".join(f"{100.0 * np.mean(values):4.0f}%" for values in (*inertias, everything))
    errors = np.array([one.values["yaw_inertia"] / otter_runs.OTTER["yaw_inertia"] - 1.0 for one in found])
    return f"{shares}  {100.0 * np.sqrt(np.mean(errors**2)):6.1f}%"


def inside(found: list[Identified], name: str) -> np.ndarray:
    """Whether the true value lies in the 95 % interval of a parameter, for each run that has estimated it."""
    errors = [
        (one.values[name] - otter_runs.OTTER[name]) / one.standard_errors[name] for one in found if name in one.standard_errors
    ]
    return np.abs(np.array(errors)) < 1.96


def by_parameter(found: list[Identified]) -> None:
    """Print the coverage of each parameter, and how often it was estimated."""
    for name in model("coupled").parameters:
        if len(covers := inside(found, name)):
            print(f"    {name:36s} {len(covers):4d} estimated {100.0 * np.mean(covers):4.0f}% covered")


def tank() -> None:
    """Print the estimates from one tank run, and the errors on the other one beside those of the published hull data."""
    used, held_out = tank_runs.tank_run(tank_runs.USED), tank_runs.tank_run(tank_runs.HELD_OUT)
    inputs = tank_runs.calibrated(used)
    found = identify([used.measurements(inputs)], model("linear", tank_runs.OFFSET))
    for name, value in found.parameters.items():
        print(
            f"{name:24s} {value:8.3f} +- {found.standard_errors[name]:.3f}   published {tank_runs.PUBLISHED.get(name, 0.0):8.3f}"
        )
    for name, reason in found.unidentifiable:
        print(f"{name:24s} held: {reason}")
    rows = {
        "published, geometric inputs": predict(tank_runs.PUBLISHED, held_out.measurements(tank_runs.GEOMETRY)),
        "published, calibrated inputs": predict(tank_runs.PUBLISHED, held_out.measurements(inputs)),
        "identified": predict(found.values, held_out.measurements(inputs), inputs=found.inputs),
    }
    print(f"\n{tank_runs.HELD_OUT}: rms errors over {len(rows['identified'].starts)} windows of 20 s, m, rad, m/s, m/s, rad/s")
    for name, prediction in rows.items():
        print(f"{name:28s} " + "  ".join(f"{what} {error:.3f}" for what, error in prediction.rms().items()))


def main() -> None:
    """Run one of the three."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    first = commands.add_parser("recover")
    first.add_argument("--seeds", type=int, default=200)
    first.add_argument("--noise", type=float, default=1.0, help="sensor noise, 1 for 5 mm, 3 mrad, 1 cm/s, 5 mrad/s")
    first.add_argument(
        "--gusts", type=float, default=0.0, help="standard deviation of disturbing forces as a share of the wrench"
    )
    second = commands.add_parser("coverage")
    second.add_argument("--seeds", type=int, default=100)
    second.add_argument("--each", action="store_true", help="each parameter too")
    commands.add_parser("tank")
    given = parser.parse_args()
    if given.command == "tank":
        tank()
        return
    if given.command == "coverage":
        coverage(given.seeds, given.each)
        return
    recover(given.seeds, given.noise, given.gusts)


if __name__ == "__main__":
    main()
