"""Speed and memory of writing bags.

python benchmarks/bags.py [--rounds 5]
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from mcap.writer import CompressionType, Writer
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.bags.reader import Bag, RawMessage, open_bag
from vessel_hsmc_ros.bags.writer import BagWriter, Topic

PERIOD = 10_000_000
MILLION = 1_000_000
console = Console()


def main() -> None:
    """Measure both and print a table of each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5, help="turns of each writer")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rate(Path(folder), arguments.rounds)
        memory(Path(folder))


def recorded(folder: Path) -> Bag:
    """Record case 2 for 60 s, once, and open the bag."""
    command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", "--output", str(folder / "recorded")]
    command += ["--set", "vessel_sim.duration=60"]
    if not (folder / "recorded").exists():
        subprocess.run(command, check=True, timeout=120.0, capture_output=True)
    return open_bag(next((folder / "recorded").glob("*/bag")))


def rate(folder: Path, rounds: int) -> None:
    """Measure messages per second of the recorder's writer and of the mcap library's, on the same messages in turns."""
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
    """Return the processor time of some work in seconds; other processes do not count."""
    began = time.process_time()
    work()
    return time.process_time() - began


def write(directory: Path, bag: Bag, messages: list[RawMessage], compression: str) -> None:
    """Write with the recorder's writer."""
    writer = BagWriter(directory, compression)
    topics = {}
    for series in bag.topics.values():
        topics[series.name] = Topic(series.name, series.type, series.definition, series.type_hash, series.qos)
        writer.add_topic(topics[series.name])
    for topic, log_time, publish_time, data in messages:
        writer.write(topics[topic], data, log_time, publish_time)
    writer.close()


def write_bare(path: Path, bag: Bag, messages: list[RawMessage], compression: str) -> None:
    """Write with the mcap library's writer and its default settings."""
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
    """Measure the memory of this process while it writes a million messages."""
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
    """Repeat the messages endlessly, with later times in each round."""
    shift = 0
    while True:
        for message in messages:
            yield message._replace(log_time=message.log_time + shift)
        shift += messages[-1].log_time + PERIOD


def resident() -> float:
    """Return the resident memory of this process in MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


if __name__ == "__main__":
    main()
