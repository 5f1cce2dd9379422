"""Random sequences of messages through the safety checks, and what these cost.

Drives sequences of messages, law values and operator commands, drawn by hypothesis, through the controller's own code without
rclpy; the assertions of test/support/safety_sequences.py state what must hold in each. Then prints the time of one call
of each check. The exit code is 1 if the output guard takes more than its limit.

    python benchmarks/safety.py [--sequences 100000]
"""

import argparse
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.samples import Freshness, Jumps, Sample
from vessel_hsmc_ros.control.safety.supervision import Authority, Supervision, violation
from vessel_hsmc_ros.core.kinematics import Motion

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "support"))

from safety_sequences import drive

GUARD_LIMIT = 20.0
"""Longest time of a call of the output guard, µs."""

CALLS, BATCHES = 2000, 50
LIMITS = (2e5, 3e6)


def costs() -> dict[str, Callable[[int], object]]:
    """A call of each check, with a number that increases from call to call."""
    fresh = Freshness(0.5, FreshnessParameters(), "odom", "base_link")
    jumps = Jumps(SafetyParameters(), 32.0)
    healthy, faulty = (Supervision(SafetyParameters(), Authority(LIMITS, (1.2e5, 6.4e7))) for _ in range(2))
    motion, free = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0), (math.inf, math.inf)
    return {
        "output guard": lambda _: violation((1e5, -2e6), (1e5, -2e6), LIMITS, free, 0.01),
        "freshness of a sample": lambda k: fresh.accept(Sample(k, "odom", "base_link", motion), k, k),
        "plausibility of a sample": lambda k: jumps.check(k, motion),
        "supervision, law": lambda _: healthy.step((1e5, -2e6), Reason.NONE, 0.01),
        "supervision, safe action": lambda _: faulty.step(None, Reason.OVERDUE, 0.01),
    }


def times(call: Callable[[int], object]) -> list[float]:
    """Mean times of a call over batches, in rising order, µs."""
    found = []
    for batch in range(BATCHES):
        began = time.perf_counter()
        for k in range(CALLS):
            call(batch * CALLS + k)
        found.append((time.perf_counter() - began) / CALLS * 1e6)
    return sorted(found)


def main() -> int:
    """Drive the sequences and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sequences", type=int, default=100_000)
    count = parser.parse_args().sequences
    driven = periods = 0

    @settings(max_examples=count, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(st.binary(min_size=21, max_size=81))
    def sequences(data: bytes) -> None:
        nonlocal driven, periods
        drive(data)
        driven += 1
        periods += len(data) // 4

    began = time.perf_counter()
    sequences()
    elapsed = time.perf_counter() - began
    table = Table("check", "median [µs]", "worst batch [µs]")
    medians = {}
    for name, call in costs().items():
        found = times(call)
        medians[name] = found[len(found) // 2]
        table.add_row(name, f"{medians[name]:.2f}", f"{found[-1]:.2f}")
    Console(width=130).print(f"{driven} sequences with {periods} control periods in {elapsed:.0f} s: every property holds", table)
    return 0 if medians["output guard"] <= GUARD_LIMIT else 1


if __name__ == "__main__":
    sys.exit(main())
