"""Readability of bags after SIGKILL: lockstep runs at full speed, all processes killed at random moments.

python benchmarks/kills.py [--runs 20]
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from mcap.reader import NonSeekingReader, make_reader
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rich.console import Console
from rich.table import Table
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import is_complete, repair
from vessel_hsmc_ros.studies.verification import verify

PERIOD = 10_000_000
console = Console()


def main() -> None:
    """Kill the given number of runs and print the result of each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=20, help="runs to kill")
    arguments = parser.parse_args()
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(Path(__file__).parents[1] / "config" / "fastdds.xml"))
    with tempfile.TemporaryDirectory() as folder:
        kills(Path(folder), arguments.runs)


def kills(folder: Path, count: int) -> None:
    """Kill runs at random moments and tabulate the result of every reader before and after the recovery."""
    table = Table("run", "killed at", "readable by", "lost", "lost", "recovered")
    table.add_row("", "simulated", "of 3 readers", "wall", "simulated", "")
    good = 0
    rclpy.init(args=[])
    for turn in range(count):
        line, passed = kill(folder / f"kill_{turn}", random.Random(turn).uniform(1.0, 100.0))  # noqa: S311
        good += passed
        table.add_row(str(turn + 1), *line)
        print(f"run {turn + 1} of {count}: {good} good", file=sys.stderr)
    rclpy.shutdown()
    console.print(table)
    console.print(f"{good} of {count} readable by every reader, at most 1 s lost, recovered and verified as bit-identical")


def kill(folder: Path, moment: float) -> tuple[list[str], bool]:
    """Kill one run with all its processes at a moment of simulated time; return its row, and whether it met the limits."""
    folder.mkdir()
    heard = listen_and_kill(folder, round(moment * 1e9))
    bag = next(folder.glob("runs/*/bag"))
    killed_at, last = heard[-1]
    before = [readable(reader, bag) for reader in (by_stream, by_index, by_rosbags)]
    had = max((stamp for _, stamp in heard if stamp <= min(before)), default=0)
    lost = killed_at - max(at for at, stamp in heard if stamp <= had)
    repaired = repair(bag)
    after = [readable(reader, bag) for reader in (by_stream, by_index, by_rosbags)]
    opened = open_bag(bag)
    sound = is_complete(bag) and after == before and opened.count == repaired.messages
    sound = sound and not len(verify(opened, opened.scenario()).differing)
    readers = sum(stamp >= 0 for stamp in before)
    line = [f"{last / 1e9:.2f} s", str(readers), f"{lost:.2f} s", f"{(last - min(before)) / 1e9:.2f} s", "yes" if sound else "NO"]
    return line, sound and readers == 3 and lost <= 1.0


def listen_and_kill(folder: Path, moment: int) -> list[tuple[float, int]]:
    """Run case 2 and kill it at a moment of its odometry; return (time of receipt, stamp) pairs, the time of the kill last."""
    command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", "--output", str(folder / "runs")]
    with (folder / "output.txt").open("wb") as output:
        run = subprocess.Popen(command, stdout=output, stderr=output)
    node = rclpy.create_node("witness")
    heard: list[tuple[float, int]] = [(time.monotonic(), -1)]

    def on_odometry(message: Odometry) -> None:
        heard.append((time.monotonic(), message.header.stamp.sec * 10**9 + message.header.stamp.nanosec))

    node.create_subscription(Odometry, "odom", on_odometry, QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    end = time.monotonic() + 120.0
    while heard[-1][1] < moment:
        if run.poll() is not None or time.monotonic() > end:
            printed = (folder / "output.txt").read_text(encoding="utf-8")
            raise RuntimeError(f"the run reached {heard[-1][1] / 1e9:g} s only, exit code {run.poll()}:\n{printed}")
        rclpy.spin_once(node, timeout_sec=0.05)
    children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text(encoding="ascii").split()
    for pid in (run.pid, *map(int, children)):
        os.kill(pid, signal.SIGKILL)
    heard.append((time.monotonic(), heard[-1][1]))
    run.wait()
    node.destroy_node()
    return heard


def readable(reader: Callable[[Path], Any], bag: Path) -> int:
    """Return the stamp of the last odometry that a reader finds, in ns; -1 if it finds none or fails."""
    try:
        return (int(reader(bag)) - 1) * PERIOD
    except Exception as error:
        console.print(f"{reader.__name__}: {error}")
        return -1


def by_stream(bag: Path) -> int:
    """Read sequentially, without the index."""
    with (bag / "bag_0.mcap").open("rb") as stream:
        reader = NonSeekingReader(stream, validate_crcs=True)
        return sum(channel.topic == "/odom" for _, channel, _ in reader.iter_messages(log_time_order=False))


def by_index(bag: Path) -> int:
    """Read by the index at the end."""
    with (bag / "bag_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        if summary is None or not summary.chunk_indexes:
            raise RuntimeError("there is no index")
        return sum(1 for _ in reader.iter_messages(topics=["/odom"]))


def by_rosbags(bag: Path) -> int:
    """Read with PyPI's rosbags, metadata.yaml included."""
    with AnyReader([bag]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == "/odom"]
        return sum(1 for _ in reader.messages(connections))


if __name__ == "__main__":
    main()
