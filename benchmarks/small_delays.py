"""The guided law with small lags and dead times, declared exactly, too small and too large: see docs/guided.md.

The paper's ship, Froude-scaled to three lengths, on a circle and on a straight line in calm water, with the law at three rates.
Lag and dead time of both inputs are shares of T = sqrt(yaw inertia / largest yaw moment). The tables have the larger rms position
error of the last quarter of the two references, in thousandths of the length; a star marks those above the limit.

    python benchmarks/small_delays.py [--references circle straight]
"""

import argparse
import itertools
import math
import sys
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from rich.console import Console
from rich.progress import track
from rich.table import Table

from vessel_hsmc_ros.campaign.ship_expansion import expand
from vessel_hsmc_ros.campaign.ship_family import ShipFamily
from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.runs.batch import simulate_one
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario

SHARES = (0.0, 0.005, 0.02, 0.05, 0.1, 0.3)
"""Lags and dead times in T; both are not zero at once."""

RATES, LENGTHS = (10.0, 50.0, 100.0), (1.2, 32.0, 300.0)
"""Rates of the law, Hz, and lengths of the ship, m."""

ERRORS = {"exactly": 1.0, "50 % too small": 0.5, "50 % too large": 1.5}
"""Declared lag and dead time relative to the true ones."""

LIMIT = 0.002
"""Largest rms position error of the last quarter with an exact declaration, in lengths."""


class Case(NamedTuple):
    """A ship: lag and dead time in T, rate in Hz, length in m, and the declaration, one of ERRORS."""

    lag: float
    dead_time: float
    rate: float
    length: float
    declared: str


def cases(shares: Iterable[float] = SHARES, declarations: Iterable[str] = ERRORS) -> Iterator[Case]:
    """The grid, declaration by declaration."""
    delays = [pair for pair in itertools.product(tuple(shares), repeat=2) if any(pair)]
    for declared, (lag, dead), length, rate in itertools.product(declarations, delays, LENGTHS, RATES):
        yield Case(lag, dead, rate, length, declared)


def scenario_of(case: Case, reference: str) -> Scenario:
    """The scenario of a ship on a reference."""
    error = ERRORS[case.declared]
    family = ShipFamily(
        length=case.length,
        has_lag=case.lag > 0.0,
        lag=case.lag,
        has_dead_time=case.dead_time > 0.0,
        dead_time=case.dead_time,
        declares_lag=True,
        declares_rate=True,
        declares_dead_time=True,
        declared_lag=error,
        declared_dead_time=error,
        reference=reference,
        radius=4.0,
        control_rate_hz=case.rate,
        start_heading=0.3,
    )
    return load_scenario("case2_tracking", {"controller.law": "guided", **expand(family)})


def error_of(case: Case, reference: str) -> float:
    """The rms position error of the last quarter in lengths; infinite for a run that ends early or is refused."""
    try:
        metrics = simulate_one(scenario_of(case, reference)).metrics
    except VesselHsmcError:
        return math.inf
    return metrics.position_error_rms_last_quarter / case.length if metrics else math.inf


def main() -> int:
    """Run the grid and print the tables; returns 1 if an exact declaration misses the limit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--references", nargs="+", default=["circle", "straight"])
    arguments = parser.parse_args()
    console = Console(width=140)
    worst = {
        case: max(error_of(case, reference) for reference in arguments.references)
        for case in track(list(cases()), "ships", console=console, transient=True)
    }
    for declared in ERRORS:
        console.print(table(declared, worst))
        found = [error for case, error in worst.items() if case.declared == declared]
        console.print(f"{sum(error <= LIMIT for error in found)} of {len(found)} within {LIMIT:g} L")
    return int(any(error > LIMIT for case, error in worst.items() if case.declared == "exactly"))


def table(declared: str, worst: dict[Case, float]) -> Table:
    """The errors with one declaration, a line for each lag and dead time."""
    heads = [f"{length:g} m\n{rate:g} Hz" for length in LENGTHS for rate in RATES]
    found = Table("lag [T]", "dead time [T]", *heads, title=f"declared {declared}: rms position error [L/1000]")
    own = {case: error for case, error in worst.items() if case.declared == declared}
    for (lag, dead), group in itertools.groupby(own.items(), key=lambda item: item[0][:2]):
        cells = [_cell(error) for _, error in group]
        found.add_row(f"{lag:g}", f"{dead:g}", *cells)
    return found


def _cell(error: float) -> str:
    """An error in thousandths, with three decimals where it is small."""
    text = f"{1e3 * error:.3f}" if error < LIMIT else f"{1e3 * error:.0f}" if error > 0.01 else f"{1e3 * error:.1f}"
    return f"{text}{' *' if error > LIMIT else ''}"


if __name__ == "__main__":
    sys.exit(main())
