"""What recording costs, how fast and how evenly bags are written, and what is left of one whose recorder is killed.

python benchmarks/bags.py [--kills 20] [--rounds 3] [--only kills cost rate memory]
"""

import argparse
import os
import random
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import rclpy
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import CompressionType, Writer
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rich.console import Console
from rich.table import Table
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bag import BagWriter, Topic
from vessel_hsmc_ros.bag_repair import is_complete, repair
from vessel_hsmc_ros.open_bag import Bag, RawMessage, open_bag
from vessel_hsmc_ros.processes import NodeGroup
from vessel_hsmc_ros.scenario import dump_scenario, for_nodes, load_scenario
from vessel_hsmc_ros.status_listener import StatusListener
from vessel_hsmc_ros.verification import verify

PERIOD = 10_000_000
MILLION = 1_000_000
console = Console()


def main() -> None:
    """Measure what is asked for, print a table of each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20, help="runs whose recorder is killed")
    parser.add_argument("--rounds", type=int, default=5, help="turns of each")
    parser.add_argument("--only", nargs="*", default=["rate", "memory", "cost", "kills"])
    arguments = parser.parse_args()
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(Path(__file__).parents[1] / "config" / "fastdds.xml"))
    with tempfile.TemporaryDirectory() as folder:
        parts = {
            "rate": lambda: rate(Path(folder), arguments.rounds),
            "memory": lambda: memory(Path(folder)),
            "cost": lambda: cost(Path(folder), arguments.rounds),
            "kills": lambda: kills(Path(folder), arguments.kills),
        }
        for name in arguments.only:
            parts[name]()


# -- writing ----------------------------------------------------------------------------------------------------------


def recorded(folder: Path) -> Bag:
    """A recorded run of case 2, 60 s."""
    command = [sys.executable, "-m", "vessel_hsmc_ros.cli", "run", "case2_tracking", "--output", str(folder / "recorded")]
    command += ["--set", "vessel_sim.duration=60"]
    if not (folder / "recorded").exists():
        subprocess.run(command, check=True, timeout=120.0, capture_output=True)
    return open_bag(next((folder / "recorded").glob("*/bag")))


def rate(folder: Path, rounds: int) -> None:
    """Messages a second through our writer and through the bare library, the same messages in turns."""
    bag = recorded(folder)
    messages = list(bag.raw_messages())
    table = Table("messages a second", "recorder's writer", "bare mcap writer", "share")
    for compression in ("none", "zstd"):
        ours, bare = [], []
        for turn in range(rounds + 1):
            ours.append(timed(lambda: write(folder / f"ours_{compression}_{turn}", bag, messages, compression)))  # noqa: B023
            bare.append(timed(lambda: write_bare(folder / f"bare_{compression}_{turn}", bag, messages, compression)))  # noqa: B023
        speeds = [len(messages) / min(taken[1:]) for taken in (ours, bare)]
        table.add_row(compression, *(f"{speed:.0f}" for speed in speeds), f"{100 * speeds[0] / speeds[1]:.0f} %")
    console.print(table)


def timed(work: Callable[[], None]) -> float:
    """Seconds of processor time of some work; other processes do not count."""
    began = time.process_time()
    work()
    return time.process_time() - began


def write(directory: Path, bag: Bag, messages: list[RawMessage], compression: str) -> None:
    """By the writer that the recorder uses."""
    writer = BagWriter(directory, compression)
    topics = {}
    for series in bag.topics.values():
        topics[series.name] = Topic(series.name, series.type, series.definition, series.type_hash, series.qos)
        writer.add_topic(topics[series.name])
    for topic, log_time, publish_time, data in messages:
        writer.write(topics[topic], data, log_time, publish_time)
    writer.close()


def write_bare(path: Path, bag: Bag, messages: list[RawMessage], compression: str) -> None:
    """By the mcap library alone, with its own settings."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType[compression.upper()])
        writer.start(profile="ros2")
        channels = {}
        for series in bag.topics.values():
            schema = writer.register_schema(series.type, "ros2msg", series.definition.encode())
            channels[series.name] = writer.register_channel(series.name, "cdr", schema)
        for topic, log_time, publish_time, data in messages:
            writer.add_message(channels[topic], log_time, data, publish_time)
        writer.finish()


def memory(folder: Path) -> None:
    """Memory of this process while it writes a million messages."""
    bag = recorded(folder)
    messages = list(bag.raw_messages())
    writer = BagWriter(folder / "million")
    topics = {}
    for series in bag.topics.values():
        topics[series.name] = Topic(series.name, series.type, series.definition, series.type_hash, series.qos)
        writer.add_topic(topics[series.name])
    table = Table("messages written", "memory", "file")
    for number, (topic, log_time, _, data) in enumerate(endless(messages)):
        if number in (0, 100_000, MILLION // 2, MILLION):
            size = (folder / "million" / "million_0.mcap").stat().st_size
            table.add_row(str(number), f"{resident():.1f} MB", f"{size / 1e6:.1f} MB")
        if number == MILLION:
            break
        writer.write(topics[topic], data, log_time, log_time)
    writer.close()
    console.print(table)


def endless(messages: list[RawMessage]) -> Iterator[RawMessage]:
    """The same messages again and again, later each time."""
    shift = 0
    while True:
        for message in messages:
            yield message._replace(log_time=message.log_time + shift)
        shift += messages[-1].log_time + PERIOD


def resident() -> float:
    """Memory of this process in MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


# -- recording --------------------------------------------------------------------------------------------------------


def cost(folder: Path, rounds: int) -> None:
    """Pace of the same lockstep run with and without a recorder, in turns, second by second.

    What else the machine does slows a second down and never speeds one up: the fastest tenth of the seconds tell the cost best.
    """
    kinds = {"no recorder": False, "everything recorded": True}
    paces: dict[str, list[float]] = {name: [] for name in kinds}
    processor: dict[str, list[float]] = {name: [] for name in kinds}
    for turn in range(rounds):
        for name, record in kinds.items():
            began = processor_time()
            paces[name] += pace(folder / f"{turn}_{record}", record)
            processor[name].append(processor_time() - began)
    table = Table("100 s of case 2", "seconds seen", "median steps/s", "fastest tenth", "processor time")
    found = {name: (statistics.median(p), statistics.quantiles(p, n=10)[-1], min(processor[name])) for name, p in paces.items()}
    for name, (median, fast, used) in found.items():
        table.add_row(name, str(len(paces[name])), f"{median:.0f}", f"{fast:.0f}", f"{used:.2f} s")
    without, having = found.values()
    costs = [without[0] / having[0], without[1] / having[1], having[2] / without[2]]
    table.add_row("recording costs", "", *(f"{100.0 * (share - 1.0):.0f} %" for share in costs))
    console.print(table)


def processor_time() -> float:
    """Seconds that all processes which were started here, and have ended, have worked."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def pace(folder: Path, record: bool) -> list[float]:
    """Steps in each second of a run, from the plant's own account."""
    folder.mkdir()
    changes = for_nodes(recorded=record, real_time=False) | {
        "vessel_sim.duration": 100.0,
        "recorder.directory": str(folder / "bag"),
    }
    parameters = folder / "params.yaml"
    parameters.write_text(dump_scenario(load_scenario("case2_tracking", changes)), encoding="utf-8")
    names = ["recorder"] * record + ["controller", "reference_ship", "vessel_sim"]
    told: dict[float, float] = {}
    with NodeGroup(parameters, folder / "logs", names=names) as nodes, StatusListener() as listener:
        while nodes.ended() is None:
            listener.listen(0.1)
            if (simulated := float(listener.status.get("vessel_sim", {}).get("simulated_time", 0.0))) > 0.0:
                told.setdefault(simulated, listener.heard_at["vessel_sim"])
    if (failed := nodes.failed()) is not None:
        raise RuntimeError(f"{failed.outcome()}, see {folder}/logs")
    (simulated, heard) = zip(*list(told.items())[:-1], strict=True)  # the last is told when all is over
    return [1e9 / PERIOD * (b - a) / (t - s) for a, b, s, t in zip(simulated, simulated[1:], heard, heard[1:], strict=False)]


# -- being killed -----------------------------------------------------------------------------------------------------


def kills(folder: Path, count: int) -> None:
    """Kill -9 everything at random moments; what readers find, before and after the recovery."""
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
    console.print(f"{good} of {count} readable by every reader, at most 1 s lost, recovered and verified to the last bit")


def kill(folder: Path, moment: float) -> tuple[list[str], bool]:
    """One run, killed with all its processes when it comes to a moment of simulated time."""
    folder.mkdir()
    heard = listen_and_kill(folder, round(moment * 1e9))
    bag = next(folder.glob("runs/*/bag"))
    killed_at, last = heard[-1]
    before = [readable(reader, bag) for reader in (by_stream, by_index, by_rosbags)]
    had = max((stamp for _, stamp in heard if stamp <= min(before)), default=0)
    lost = killed_at - max(at for at, stamp in heard if stamp <= had)
    told = repair(bag)
    after = [readable(reader, bag) for reader in (by_stream, by_index, by_rosbags)]
    opened = open_bag(bag)
    sound = is_complete(bag) and after == before and opened.count == told.messages
    sound = sound and not len(verify(opened, opened.scenario()).differing)
    readers = sum(stamp >= 0 for stamp in before)
    line = [f"{last / 1e9:.2f} s", str(readers), f"{lost:.2f} s", f"{(last - min(before)) / 1e9:.2f} s", "yes" if sound else "NO"]
    return line, sound and readers == 3 and lost <= 1.0


def listen_and_kill(folder: Path, moment: int) -> list[tuple[float, int]]:
    """Run case 2, hear its odometry from outside until a moment, kill all; when each stamp was heard, the kill's time last."""
    command = [sys.executable, "-m", "vessel_hsmc_ros.cli", "run", "case2_tracking", "--output", str(folder / "runs")]
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
            told = (folder / "output.txt").read_text(encoding="utf-8")
            raise RuntimeError(f"the run came to {heard[-1][1] / 1e9:g} s only, exit code {run.poll()}:\n{told}")
        rclpy.spin_once(node, timeout_sec=0.05)
    children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text(encoding="ascii").split()
    for pid in (run.pid, *map(int, children)):
        os.kill(pid, signal.SIGKILL)
    heard.append((time.monotonic(), heard[-1][1]))
    run.wait()
    node.destroy_node()
    return heard


def readable(reader: Callable[[Path], Any], bag: Path) -> int:
    """The last stamp that a reader finds in unbroken odometry, ns; -1 where it finds nothing or fails."""
    try:
        return (int(reader(bag)) - 1) * PERIOD
    except Exception as error:
        console.print(f"{reader.__name__}: {error}")
        return -1


def by_stream(bag: Path) -> int:
    """From front to back, without looking at the end."""
    with (bag / "bag_0.mcap").open("rb") as stream:
        reader = NonSeekingReader(stream, validate_crcs=True)
        return sum(channel.topic == "/odom" for _, channel, _ in reader.iter_messages(log_time_order=False))


def by_index(bag: Path) -> int:
    """By the index at the end."""
    with (bag / "bag_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        if summary is None or not summary.chunk_indexes:
            raise RuntimeError("there is no index")
        return sum(1 for _ in reader.iter_messages(topics=["/odom"]))


def by_rosbags(bag: Path) -> int:
    """By PyPI's rosbags, metadata.yaml included."""
    with AnyReader([bag]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == "/odom"]
        return sum(1 for _ in reader.messages(connections))


if __name__ == "__main__":
    main()
