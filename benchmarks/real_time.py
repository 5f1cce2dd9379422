"""How well the nodes keep the pace of the clock: intervals of the control law and missed periods in real-time runs.

Four processes, everything recorded, the guided law at 100 Hz. On an idle machine the intervals scatter by some tenths of a
millisecond and no period is missed; whatever else the machine does shows here.

    python benchmarks/real_time.py [--rounds 3] [--duration 20]
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.bags.reader import open_bag

PERIOD = 0.01
START_AND_END = 60.0
"""Time that a run may take besides its duration, s."""


def main() -> None:
    """Run, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3, help="number of runs")
    parser.add_argument("--duration", type=float, default=20.0, help="length of a run, s")
    arguments = parser.parse_args()
    table = Table("run", "real-time factor", "median interval", "99 % within", "longest", "missed periods", "dropped messages")
    for number in range(arguments.rounds):
        summary, intervals = real_time_run(arguments.duration)
        deviations = np.abs(intervals - PERIOD)
        table.add_row(
            str(number + 1),
            f"{summary['real_time_factor']:.3f}",
            f"{1e3 * np.median(intervals):.3f} ms",
            f"{1e3 * np.percentile(deviations, 99):.3f} ms",
            f"{1e3 * np.max(intervals):.3f} ms",
            str(summary["missed_periods"]),
            str(summary["messages_dropped"]),
        )
    Console().print(table)


def real_time_run(duration: float) -> tuple[dict[str, Any], Any]:
    """The summary of a run of case 2, and the intervals between two updates of the law, s."""
    with tempfile.TemporaryDirectory() as output:
        command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", "--real-time", "--output", output]
        command += ["--set", "controller.law=guided", "--set", f"vessel_sim.duration={duration}"]
        subprocess.run(command, check=True, timeout=duration + START_AND_END, capture_output=True)
        (folder,) = Path(output).iterdir()
        summary = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        stamps = open_bag(folder / "bag")["controller/state"].stamp
        return summary, 1e-9 * np.diff(np.sort(stamps))


if __name__ == "__main__":
    main()
