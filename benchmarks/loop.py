"""The time of a lockstep step, relative to plain rclpy round trips of the same two message types.

A step is four processes: plant, reference ship, controller and recorder, everything recorded. A round trip is two: one
publishes nav_msgs/Odometry, the other answers with geometry_msgs/WrenchStamped, both with rclpy's own executor and default
quality of service. The two take turns, so that other load on the machine affects both.

    python benchmarks/loop.py [--rounds 5]
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rclpy
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rich.console import Console
from rich.table import Table

ROUND_TRIPS = 5000
WARM_UP = 500
DURATION = 100.0
LIMIT = 60.0


def main() -> None:
    """Measure both in turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5, help="turns of each")
    parser.add_argument("--echo", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.echo:
        echo()
        return
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(Path(__file__).parents[1] / "config" / "fastdds.xml"))
    bare, loop = [], []
    console = Console()
    with console.status("measuring") as status:
        for turn in range(arguments.rounds):
            status.update(f"turn {turn + 1} of {arguments.rounds}: bare round trips")
            bare.append(round_trip())
            status.update(f"turn {turn + 1} of {arguments.rounds}: case 2 in lockstep")
            loop.append(lockstep_step())
    table = Table("", "median", "smallest", "largest")
    for name, values in (("bare round trip", bare), ("lockstep step", loop)):
        table.add_row(name, *(f"{1e3 * f(values):.3f} ms" for f in (statistics.median, min, max)))
    ratios = [step / trip for step, trip in zip(loop, bare, strict=True)]
    table.add_row("round trips a step costs", *(f"{f(ratios):.2f}" for f in (statistics.median, min, max)))
    speeds = [0.01 / step for step in loop]
    table.add_row("times faster than real time", *(f"{f(speeds):.1f}" for f in (statistics.median, min, max)))
    console.print(table)


def round_trip() -> float:
    """Return the time of one plain round trip in seconds."""
    other = subprocess.Popen([sys.executable, __file__, "--echo"])
    try:
        return measure()
    finally:
        other.kill()
        other.wait()


def measure() -> float:
    """Publish odometry and wait for the wrench, repeatedly."""
    rclpy.init()
    node = rclpy.create_node("bare_plant")
    publisher = node.create_publisher(Odometry, "bare_odom", 10)
    count = 0

    def answer(_message: WrenchStamped) -> None:
        nonlocal count
        count += 1
        publisher.publish(Odometry())

    subscription = node.create_subscription(WrenchStamped, "bare_wrench", answer, 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    end = time.monotonic() + LIMIT

    def spin(condition: object) -> None:
        while not condition():  # type: ignore[operator]
            if time.monotonic() > end:
                raise TimeoutError("no round trips: the two processes have not discovered each other, or a message was lost")
            executor.spin_once(timeout_sec=0.5)

    spin(lambda: publisher.get_subscription_count() and subscription.get_publisher_count())
    publisher.publish(Odometry())
    spin(lambda: count >= WARM_UP)
    began = time.perf_counter()
    spin(lambda: count >= WARM_UP + ROUND_TRIPS)
    taken = time.perf_counter() - began
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown()
    return taken / ROUND_TRIPS


def echo() -> None:
    """Run the other process: answer every odometry message."""
    rclpy.init()
    node = rclpy.create_node("bare_controller")
    publisher = node.create_publisher(WrenchStamped, "bare_wrench", 10)

    def answer(message: Odometry) -> None:
        wrench = WrenchStamped()
        wrench.header.stamp = message.header.stamp
        publisher.publish(wrench)

    node.create_subscription(Odometry, "bare_odom", answer, 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.spin()


def lockstep_step() -> float:
    """Return the time of one step of case 2 in seconds, from the run's summary."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", "--output", folder]
        command += ["--set", f"vessel_sim.duration={DURATION}"]
        subprocess.run(command, check=True, timeout=LIMIT, capture_output=True)
        (summary,) = Path(folder).glob("*/run.json")
        result = json.loads(summary.read_text(encoding="utf-8"))
    return float(result["loop_time"] / result["steps"])


if __name__ == "__main__":
    main()
