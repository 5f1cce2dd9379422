"""What identification recovers: CyberShip II from noisy simulated runs, and CyberShip Enterprise I from its tank runs.

    python benchmarks/identification.py recover [--seeds 200] [--noise 1.0] [--gusts 0.05]
    python benchmarks/identification.py tank FOLDER

`recover` simulates the ship of Skjetne, Smogeli and Fossen (2004) with sensor noise, identifies it for each seed, and prints how
many estimates lie within one, two and three standard errors of the true values. `tank` reads the folder realWorldData of
NTNU-MCS/CS_EnterpriseI_archive, identifies with two of the runs and predicts a third one over windows of 20 s.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed

# One thread a process: the matrices are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from vessel_hsmc_ros.identification import simulated_runs
from vessel_hsmc_ros.identification.estimate import identify
from vessel_hsmc_ros.identification.models import model
from vessel_hsmc_ros.identification.types import Identified


def one(seed: int, noise: float, gusts: float) -> Identified:
    """Identify CyberShip II from the run of one seed."""
    return identify([simulated_runs.cybership2(seed, noise=noise, gusts=gusts)], model("coupled"))


def results(seeds: int, noise: float, gusts: float) -> Iterator[Identified]:
    """The results as they come, from all cores, with a line of progress."""
    begun = time.monotonic()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        futures = [pool.submit(one, seed, noise, gusts) for seed in range(seeds)]
        for number, future in enumerate(as_completed(futures), 1):
            spent = time.monotonic() - begun
            print(f"\r{number} of {seeds} runs, {spent:.0f} s, {spent / number * (seeds - number):.0f} s left ", end="", file=sys.stderr)
            yield future.result()
    print(file=sys.stderr)


def recover(seeds: int, noise: float, gusts: float) -> None:
    """Print the coverage of the standard errors, for each parameter and for all."""
    names = model("coupled").parameters
    errors = {name: [] for name in names}
    for found in results(seeds, noise, gusts):
        for name, error in found.standard_errors.items():
            errors[name].append((found.values[name] - simulated_runs.CYBERSHIP2.get(name, 0.0)) / error)
    print(f"{'parameter':36s} {'true':>9s} {'estimated':>9s} {'mean':>6s} {'rms':>5s} {'<1':>6s} {'<2':>6s} {'<3':>6s}")
    for name in [*names, "all"]:
        z = np.array(errors[name] if name in errors else np.concatenate([*map(np.array, errors.values())]))
        true = f"{simulated_runs.CYBERSHIP2.get(name, 0.0):9.4f}" if name in errors else " " * 9
        if len(z):
            within = " ".join(f"{100 * np.mean(np.abs(z) < k):5.1f}%" for k in (1, 2, 3))
            print(f"{name:36s} {true} {len(z):9d} {z.mean():6.2f} {np.sqrt(np.mean(z**2)):5.2f} {within}")
        else:
            print(f"{name:36s} {true} {0:9d}")


def main() -> None:
    """Run one of the two."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    first = commands.add_parser("recover")
    first.add_argument("--seeds", type=int, default=200)
    first.add_argument("--noise", type=float, default=1.0, help="sensor noise, 1 for 5 mm, 3 mrad, 1 cm/s, 5 mrad/s")
    first.add_argument("--gusts", type=float, default=0.0, help="standard deviation of disturbing forces as a share of the wrench")
    given = parser.parse_args()
    recover(given.seeds, given.noise, given.gusts)


if __name__ == "__main__":
    main()
