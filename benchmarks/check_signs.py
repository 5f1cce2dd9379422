"""The verdicts of `vessel-hsmc check` on drawn boats under way: none is wrong about a sign, or about a motion that is right.

The boats are those of the library and that of benchmarks/boats.py, driven by hand in nine ways, by loops of force and moment, and
by velocities that a stack's own loops follow; with lags to 2 s, noise that is declared or not, current, wind and gusts; wired
right, or with force, moment or both reversed. The boats and their records are drawn by test/support/drawn_drives.py without the
simulator of the package. A further row has the package's own law on the boats of the suite `boats`.

    python benchmarks/check_signs.py [--seed 1] [--count 1000]

The exit code is 1 if a verdict is wrong.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Connection
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_hsmc_ros.studies.suite import load_suite

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "support"))

import drawn_drives

BATCH = 100
OWN_LAW = "the package's own law"


class Verdict(NamedTuple):
    """A verdict on a sign: how the boat was driven, about what, whether it is wired right, and the level."""

    drive: str
    about: str
    right: bool
    level: str

    @property
    def false(self) -> bool:
        """Whether it is wrong."""
        return self.level == (WRONG if self.right else OK)


def main() -> int:
    """Judge the boats and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1000, help="number of drawn boats")
    arguments = parser.parse_args()
    boats = drawn_drives.draw(arguments.seed, arguments.count)
    verdicts, others = [], Counter[str]()
    for first in range(0, len(boats), BATCH):
        batch = boats[first : first + BATCH]
        for boat, connection in zip(batch, drawn_drives.sail(batch), strict=True):
            found, wrong = drawn_drives.judged(boat, connection)
            verdicts += [Verdict(boat.drive, *each) for each in found]
            others.update(wrong)
            if any(verdict.false for verdict in verdicts[-len(found) :]) or wrong:
                print(boat, found, wrong, flush=True)
    for connection in own_runs():
        found, wrong = drawn_drives.judged_right(connection)
        verdicts += [Verdict(OWN_LAW, *each) for each in found]
        others.update(wrong)
    console = Console(width=130)
    console.print(table(verdicts))
    false, shown = sum(verdict.false for verdict in verdicts), sum(verdict.level != TODO for verdict in verdicts)
    console.print(
        f"{false} of {len(verdicts)} signs are false; {shown / len(verdicts):.0%} are shown; other mistakes: {dict(others)}"
    )
    return 1 if false or others else 0


def own_runs() -> list[Connection]:
    """Records of the package's law on boats of which main data are declared, with noise of satellite fixes, wind and current."""
    found = []
    for row in load_suite("boats"):
        scenario = load_scenario(row.scenario, row.changes)
        run, controller = simulate(scenario), scenario.controller
        ship = controller.vessel.length, controller.vessel.surge_inertia, controller.vessel.yaw_inertia
        noise = controller.observer.position_noise, controller.observer.heading_noise
        at = 1e3 + run.time
        found.append(drawn_drives.recorded(ship, (at, run.measured), (at, run.control["commanded"], None), noise, 1))
    return found


def table(verdicts: list[Verdict]) -> Table:
    """The verdicts by way of driving, for signs that are right and for reversed ones."""
    made = Table(
        "driven by", *(f"{about}, {side}: ok/not shown/wrong" for about in ("force", "moment") for side in ("right", "reversed"))
    )
    counts = Counter(verdicts)
    for drive in dict.fromkeys(verdict.drive for verdict in verdicts):
        cells = [
            "/".join(str(counts[Verdict(drive, about, right, level)]) for level in (OK, TODO, WRONG))
            for about in ("force", "moment")
            for right in (True, False)
        ]
        made.add_row(drive, *cells)
    return made


if __name__ == "__main__":
    sys.exit(main())
