"""Measure the start-up of `vessel-hsmc run`: from the command to the first control step, beside the start of one bare rclpy node.

The nodes start in one process, or each in its own. The three take turns, so that other load on the machine affects all.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROUNDS = 5
BARE_NODE = "import rclpy; rclpy.init(); rclpy.create_node('bare')"


def bare_node() -> float:
    """Time to start one rclpy node in a process of its own, s."""
    started = time.monotonic()
    subprocess.run([sys.executable, "-c", BARE_NODE], check=True, timeout=60.0)
    return time.monotonic() - started


def start_up(form: str) -> float:
    """Start-up time of a run, s; `form`: an option of `vessel-hsmc run`."""
    command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", form, "--no-page"]
    with tempfile.TemporaryDirectory() as folder:
        command += ["--set", "vessel_sim.duration=1", "--output", folder]
        subprocess.run(command, check=True, timeout=60.0, capture_output=True)
        summary: dict[str, float] = json.loads((next(Path(folder).iterdir()) / "run.json").read_text())
    return summary["start_up"]


def main() -> None:
    """Print the best and the worst of several rounds."""
    rounds = [(start_up("--composed"), start_up("--processes"), bare_node()) for _ in range(ROUNDS)]
    runs, apart, bare = map(sorted, zip(*rounds, strict=True))
    print(f"start-up of a run: {runs[0]:.2f} to {runs[-1]:.2f} s")
    print(f"start-up of a run in four processes: {apart[0]:.2f} to {apart[-1]:.2f} s")
    print(f"start of a bare node: {bare[0]:.2f} to {bare[-1]:.2f} s")
    print(f"ratio of the best: {runs[0] / bare[0]:.1f}, in four processes {apart[0] / bare[0]:.1f}")


if __name__ == "__main__":
    main()
