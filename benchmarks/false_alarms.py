"""Every status above OK in the diagnostics of healthy runs: there must be none.

Each scenario of the package runs in lockstep over the real nodes. What a node publishes before it is connected with the others,
`waiting for ...`, does not count.

    python benchmarks/false_alarms.py [--duration 20] [--law guided] [SCENARIO ...]

The exit code is 1 where there was an alarm.
"""

import argparse
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.scenario.scenario import scenario_names

LIMIT = 600.0
"""Longest time of a run, s."""


def main() -> int:
    """Run the scenarios and print a table of their alarms."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=scenario_names(), help="all by default")
    parser.add_argument("--duration", type=float, default=20.0, help="length of a run, s")
    parser.add_argument("--law", default="", help="that of the scenario by default")
    arguments = parser.parse_args()
    table = Table("scenario", "status", "message", "times")
    total = 0
    for scenario in arguments.scenarios:
        found = alarms(scenario, arguments.duration, arguments.law)
        for (name, message), count in sorted(found.items()):
            table.add_row(scenario, name, message, str(count))
        total += len(found)
        if not found:
            table.add_row(scenario, "", "no alarm", "")
    Console().print(table)
    return 1 if total else 0


def alarms(scenario: str, duration: float, law: str) -> Counter[tuple[str, str]]:
    """Number of statuses above OK of a run, by name and message."""
    with tempfile.TemporaryDirectory() as output:
        command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", scenario, "--output", output]
        command += ["--set", f"vessel_sim.duration={duration}", *(["--set", f"controller.law={law}"] if law else [])]
        subprocess.run(command, check=True, timeout=LIMIT, capture_output=True)
        (folder,) = Path(output).iterdir()
        messages = open_bag(folder / "bag").messages("/diagnostics")
        statuses = [status for _, _, message in messages for status in message.status]
    return Counter((s.name, s.message) for s in statuses if s.level and not s.message.startswith("waiting for "))


if __name__ == "__main__":
    sys.exit(main())
