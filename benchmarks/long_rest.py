"""What hours at rest under noise leave behind: the position error under way after them, with its spread over seeds.

`python benchmarks/long_rest.py --seeds 5` prints the rms error [m] of the last 400 s of 800 s on the circle of 90 kN and
600 kN·m, after a rest of five minutes, six hours and a day: the guided law on the ship of the paper at 10 Hz, with noise of
0.1 m, 0.01 rad, 0.1 m/s and 0.01 rad/s.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.extend([str(Path(__file__).resolve().parents[1] / folder) for folder in ("test", "test/support")])
from simulation.test_long_rest import SETTLED, error_under_way, rested

RESTS = {"fresh": SETTLED, "6 h": 6.0 * 3600.0, "24 h": 24.0 * 3600.0}
"""Durations of the rest, s."""


def main() -> None:
    """Print a row for each rest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5, help="number of seeds of the noise [default: 5]")
    seeds = range(1, parser.parse_args().seeds + 1)
    print("| rest | mean | smallest | largest | seeds |\n| --- | --- | --- | --- | --- |")
    for name, rest in RESTS.items():
        errors = np.array([error_under_way(rested(rest, seed)) for seed in seeds])
        print(f"| {name} | {errors.mean():.3f} | {errors.min():.3f} | {errors.max():.3f} | {len(errors)} |", flush=True)


if __name__ == "__main__":
    main()
