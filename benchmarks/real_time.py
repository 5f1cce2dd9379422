"""How well the nodes keep the pace of the clock: scatter of the control period, and time from odometry to command.

Four processes, everything recorded, the guided law at 100 Hz; each run is followed by bare rclpy round trips of the same length
and rate, between two processes that publish nav_msgs/Odometry and answer with geometry_msgs/WrenchStamped. Both on the machine as
it is, and beside processes that are always busy.

The control periods begin half a period after the odometry, by design; the latency is counted from there to the publication of the
command. On an idle machine the periods scatter by some tenths of a millisecond and none is missed.

The controller's share of a core is that of its process, the middleware's threads and its black box included.

    python benchmarks/real_time.py [--rounds 1] [--duration 20] [--busy 0 1] [--set controller.rate_hz=50]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil  # type: ignore[import-untyped]
import rclpy
from geometry_msgs.msg import WrenchStamped
from loop import echo  # type: ignore[import-not-found]
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from rclpy.executors import SingleThreadedExecutor
from rich.console import Console
from rich.table import Column, Table

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.install_paths import PROFILES, discovery_profiles

PERIOD = 0.01
START_AND_END = 60.0
"""Time that a run may take besides its duration, s."""

Array = NDArray[np.float64]


def main() -> None:
    """Run, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=1, help="number of runs of each kind")
    parser.add_argument("--duration", type=float, default=20.0, help="length of a run, s")
    parser.add_argument("--busy", type=int, nargs="+", default=[0, 1], help="numbers of busy processes beside the run")
    parser.add_argument("--set", action="append", default=[], dest="changes", help="a parameter of the run, such as an option")
    parser.add_argument("--echo", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.echo:
        echo()
        return
    os.environ.setdefault(PROFILES, discovery_profiles())
    # One unit in the head, and short words: the table fits a terminal of 80 columns.
    table = Table("ms", *(Column(name, justify="right") for name in ("p50", "p99", "largest", "missed", "lost")), box=None)
    for _ in range(arguments.rounds):
        for busy in arguments.busy:
            with load(busy):
                summary, share, deviations, latencies = real_time_run(arguments.duration, arguments.changes)
                bare = round_trips(arguments.duration)
            counts = str(summary["missed_periods"]), str(summary["messages_dropped"])
            table.add_row(f"[bold]beside {busy} busy processes")
            table.add_row("deviation of the control period", *shown(deviations), *counts)
            table.add_row("from odometry to command", *shown(latencies))
            table.add_row("bare round trip", *shown(bare))
            more = np.percentile(latencies, 99) - np.percentile(bare, 99)
            table.add_row("more than bare at p99", "", f"{1e3 * more:+.3f}")
            table.add_row("controller's share of a core", "", f"{share:.0%}")
    Console().print(table)


@contextmanager
def load(processes: int) -> Iterator[None]:
    """Load some cores, one process each."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def shown(values: Array) -> tuple[str, ...]:
    """Median, 99th percentile and largest value in milliseconds."""
    return tuple(f"{1e3 * value:.3f}" for value in (*np.percentile(values, (50, 99)), np.max(values)))


def real_time_run(duration: float, changes: list[str]) -> tuple[dict[str, Any], float, Array, Array]:
    """A run of case 2: its summary, the controller's share of a core, deviations of its control periods, s, and latencies, s."""
    with tempfile.TemporaryDirectory() as output:
        command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", "--real-time", "--output", output]
        for change in ("controller.law=guided", f"vessel_sim.duration={duration}", *changes):
            command += ["--set", change]
        share = controllers_share(command, duration)
        (folder,) = Path(output).iterdir()
        summary = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        bag = open_bag(folder / "bag")
        intervals = 1e-9 * np.diff(np.sort(bag["controller/state"].stamp))
        sent = {topic: published(bag, topic) for topic in ("/odom", "/cmd_wrench")}
        odometry, commands = sent["/odom"], sent["/cmd_wrench"]
        # The controller begins later than the plant and ends after it: only commands that answer odometry are counted.
        commands = commands[(commands > odometry[0]) & (commands < odometry[-1])]
        measured = odometry[np.searchsorted(odometry, commands) - 1]
        nominal = PERIOD * round(np.median(intervals) / PERIOD)  # the rate may be among the changes
        return summary, share, np.abs(intervals - nominal), 1e-9 * (commands - measured) - 0.5 * nominal % PERIOD


def controllers_share(command: list[str], duration: float) -> float:
    """Run a command that starts nodes; the share of a core that its controller takes in the middle half of a time, s."""
    end = time.monotonic() + duration + START_AND_END
    used: list[tuple[float, float]] = []
    with psutil.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        while run.poll() is None:
            if time.monotonic() > end:
                run.kill()
            for child in run.children():
                with suppress(psutil.NoSuchProcess):
                    if child.name() == "controller":
                        used.append((time.monotonic(), sum(child.cpu_times()[:2])))
            time.sleep(0.2)
        if run.returncode:
            sys.exit(f"the run has failed ({run.returncode})")
    at, seconds = np.array(used).T
    first, last = np.searchsorted(at, at[-1] - np.array((0.75, 0.25)) * duration)
    return float((seconds[last] - seconds[first]) / (at[last] - at[first]))


def published(bag: Any, topic: str) -> NDArray[np.int64]:
    """Times at which the messages of a topic were published, without those of the first and the last second, ns."""
    times = np.array([message.publish_time for message in bag.raw_messages(topic)])
    return np.asarray(times[round(1.0 / PERIOD) : -round(1.0 / PERIOD)])


def round_trips(duration: float) -> Array:
    """Times of plain round trips at the rate of the control law, s."""
    other = subprocess.Popen([sys.executable, __file__, "--echo"])
    try:
        return measure(round(duration / PERIOD))
    finally:
        other.kill()
        other.wait()


def measure(count: int) -> Array:
    """Publish odometry once a period, and take the time until the wrench comes, s; (count,)."""
    rclpy.init()
    node = rclpy.create_node("bare_plant")
    publisher = node.create_publisher(Odometry, "bare_odom", 10)
    times: list[float] = []
    began = 0.0

    def send() -> None:
        nonlocal began
        began = time.perf_counter()
        publisher.publish(Odometry())

    def answer(_message: WrenchStamped) -> None:
        times.append(time.perf_counter() - began)

    subscription = node.create_subscription(WrenchStamped, "bare_wrench", answer, 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    end = time.monotonic() + START_AND_END + count * PERIOD
    while not (publisher.get_subscription_count() and subscription.get_publisher_count()):
        executor.spin_once(timeout_sec=0.1)
    node.create_timer(PERIOD, send)
    while len(times) < count and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.5)
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown()
    return np.array(times[round(1.0 / PERIOD) :])


if __name__ == "__main__":
    main()
