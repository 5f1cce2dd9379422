"""Measure the start-up of `vessel-hsmc run`: from the command to the first control step, beside the start of one bare rclpy node.

The four nodes, the recorder and the supervisor start side by side, so on an idle machine the ratio shows what they add to rclpy.
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


def start_up(folder: Path) -> float:
    """Start-up time of a run, s."""
    command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", "--set", "vessel_sim.duration=1"]
    subprocess.run([*command, "--output", str(folder)], check=True, timeout=60.0, capture_output=True)
    summary: dict[str, float] = json.loads((next(folder.iterdir()) / "run.json").read_text())
    return summary["start_up"]


def main() -> None:
    """Print the best and the worst of several rounds."""
    with tempfile.TemporaryDirectory() as folder:
        runs = sorted(start_up(Path(folder) / str(k)) for k in range(ROUNDS))
    bare = sorted(bare_node() for _ in range(ROUNDS))
    print(f"start-up of a run: {runs[0]:.2f} to {runs[-1]:.2f} s")
    print(f"start of a bare node: {bare[0]:.2f} to {bare[-1]:.2f} s")
    print(f"ratio of the best: {runs[0] / bare[0]:.1f}")


if __name__ == "__main__":
    main()
