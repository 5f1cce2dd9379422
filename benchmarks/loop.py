"""The time of a lockstep step, relative to plain rclpy round trips of the same two message types.

A step is that of plant, reference ship, controller and recorder, everything recorded: in one process, and in four. A round trip
is two processes: one publishes nav_msgs/Odometry, the other answers with geometry_msgs/WrenchStamped, both with rclpy's own
executor and default quality of service. They take turns, so that other load on the machine affects all. Processor time is that
of all their processes; of a run it is the difference between a long one and a short one.

    python benchmarks/loop.py [--rounds 5]
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import rclpy
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rich.console import Console
from rich.table import Table

ROUND_TRIPS = 5000
WARM_UP = 500
DURATION, SHORT, PERIOD = 100.0, 1.0, 0.01
LIMIT = 120.0
FORMS = {"one process": "--composed", "four processes": "--processes"}


class Cost(NamedTuple):
    """Wall time and processor time, s."""

    wall: float
    processor: float


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
    found: dict[str, list[Cost]] = {name: [] for name in ("bare round trip", *FORMS)}
    console = Console()
    with console.status("measuring") as status:
        for turn in range(arguments.rounds):
            for name in found:
                status.update(f"turn {turn + 1} of {arguments.rounds}: {name}")
                found[name].append(lockstep_step(FORMS[name]) if name in FORMS else round_trip())
    table = Table("", "median", "smallest", "largest")
    for name, costs in found.items():
        add_row(table, f"{name}: wall time", "{:.3f} ms", [1e3 * cost.wall for cost in costs])
        add_row(table, f"{name}: processor time", "{:.3f} ms", [1e3 * cost.processor for cost in costs])
    bare = found["bare round trip"]
    for name in FORMS:
        pairs = list(zip(found[name], bare, strict=True))
        add_row(table, f"{name}: round trips a step", "{:.2f}", [a.wall / b.wall for a, b in pairs])
        add_row(table, f"{name}: by processor time", "{:.2f}", [a.processor / b.processor for a, b in pairs])
        add_row(table, f"{name}: times real time", "{:.1f}", [PERIOD / cost.wall for cost in found[name]])
    console.print(table)


def add_row(table: Table, name: str, form: str, values: list[float]) -> None:
    """Add median, smallest and largest of some values."""
    table.add_row(name, *(form.format(f(values)) for f in (statistics.median, min, max)))


def round_trip() -> Cost:
    """The cost of one plain round trip."""
    other = subprocess.Popen([sys.executable, __file__, "--echo"])
    try:
        return measure(other.pid)
    finally:
        other.kill()
        other.wait()


def processor_time(pid: int) -> float:
    """Processor time of a process so far, s."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(other: int) -> Cost:
    """Publish odometry and wait for the wrench, repeatedly; `other` is the process that answers."""
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
    pids = os.getpid(), other
    began, used = time.perf_counter(), sum(map(processor_time, pids))
    spin(lambda: count >= WARM_UP + ROUND_TRIPS)
    taken, used = time.perf_counter() - began, sum(map(processor_time, pids)) - used
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown()
    return Cost(taken / ROUND_TRIPS, used / ROUND_TRIPS)


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


def lockstep_step(form: str) -> Cost:
    """The cost of one step of case 2 in one of FORMS."""
    (wall, used), (_, start) = run(form, DURATION), run(form, SHORT)
    return Cost(wall, (used - start) / ((DURATION - SHORT) / PERIOD))


def run(form: str, duration: float) -> tuple[float, float]:
    """The wall time of a step from the run's summary, and the processor time of the whole run with its start, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", form, "--no-page"]
        command += ["--output", folder, "--set", f"vessel_sim.duration={duration}"]
        subprocess.run(command, check=True, timeout=LIMIT, capture_output=True)
        (summary,) = Path(folder).glob("*/run.json")
        result = json.loads(summary.read_text(encoding="utf-8"))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return result["loop_time"] / result["steps"], sum(after[:2]) - sum(before[:2])


if __name__ == "__main__":
    main()
