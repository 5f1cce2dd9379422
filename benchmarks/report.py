"""Time, memory and size of the report of a long bag, an hour at 100 Hz with every topic of a run, against limits.

The bag is synthetic: smooth series with noise and one peak. Where Chromium is installed, the page is opened as well.

    python benchmarks/report.py [--seconds 3600] [--keep FOLDER]
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

TESTS = Path(__file__).resolve().parents[1] / "test" / "support"
sys.path.insert(0, str(TESTS))

import bag_making  # noqa: E402
import browser  # noqa: E402

from vessel_hsmc_ros.bags.reader import open_bag  # noqa: E402
from vessel_hsmc_ros.bags.topic_columns import MessageDecoder  # noqa: E402
from vessel_hsmc_ros.bags.writer import SCENARIO, BagWriter  # noqa: E402
from vessel_hsmc_ros.messages.topics import definition  # noqa: E402
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario  # noqa: E402

LIMITS = {"time": 90.0, "memory": 1e9, "size": 20e6}
BLOCK = 5000
"""Steps that are generated at a time."""


def main() -> int:
    """Make the bag and the page and print the measurements; returns 1 if a limit is exceeded."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=3600.0, help="length of the recording")
    parser.add_argument("--keep", type=Path, help="folder in which bag and page are kept")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        bag, page = folder / "bag", folder / "report.html"
        console = Console()
        with console.status("writing the bag"):
            count = open_bag(bag).count if bag.exists() else write(bag, round(100.0 * arguments.seconds))
        with console.status("making the page"):
            taken, memory = make(bag, page)
        measured = {"time": taken, "memory": memory, "size": float(page.stat().st_size)}
        table = Table("a report", "measured", "limit", title=f"{count} messages, {size(bag) / 1e6:.0f} MB")
        table.add_row("time", f"{taken:.1f} s", f"{LIMITS['time']:.0f} s")
        table.add_row("memory, peak", f"{memory / 1e6:.0f} MB", f"{LIMITS['memory'] / 1e6:.0f} MB")
        table.add_row("page", f"{measured['size'] / 1e6:.1f} MB", f"{LIMITS['size'] / 1e6:.0f} MB")
        if browser.CHROMIUM and browser.DRIVER:
            for name, value in look_at(page).items():
                table.add_row(name, f"{value:.1f} ms", "")
        console.print(table)
    return int(any(measured[name] > limit for name, limit in LIMITS.items()))


def write(bag: Path, steps: int) -> int:
    """Write a bag with every topic of a run at 100 Hz; returns the number of its messages."""
    writer = BagWriter(bag)
    writer.attach(SCENARIO, dump_scenario(load_scenario("case2_tracking")))
    kinds = bag_making.TYPES
    topics = {name: bag_making.topic(name if name.startswith("/") else f"/{name}", kind) for name, kind in kinds.items()}
    for topic in topics.values():
        writer.add_topic(topic)
    rng = np.random.default_rng(1)
    for first in range(0, steps + 1, BLOCK):
        stamps = bag_making.PERIOD * np.arange(first, min(first + BLOCK, steps + 1))
        rows = {name: messages(topic.kind, stamps, rng) for name, topic in topics.items()}
        for k, stamp in enumerate(stamps.tolist()):
            for name, topic in topics.items():
                writer.write(topic, rows[name][k], stamp, stamp)
    writer.close()
    return writer.message_count


def messages(kind: str, stamps: np.ndarray, rng: np.random.Generator) -> list[bytes]:
    """Serialise messages of a type: every number is a slow wave with noise, and has a peak at the start.

    Args:
        kind: Message type, such as `nav_msgs/msg/Odometry`.
        stamps: ns, (n,).
        rng: Source of the noise.
    """
    example = bag_making.serialized(bag_making.message(kind, 0, np.random.default_rng(0)), kind)
    places = MessageDecoder(kind, kind, definition(kind)).layout(example).fields
    rows = np.tile(np.frombuffer(example, np.uint8), (len(stamps), 1))

    def put(name: str, values: np.ndarray) -> None:
        place = places[name]
        columns = np.ascontiguousarray(values, place.dtype).view(np.uint8).reshape(len(stamps), -1)
        rows[:, place.offset : place.offset + place.size] = columns

    stamp = "header.stamp" if "header.stamp.sec" in places else "clock"
    put(f"{stamp}.sec", stamps // 10**9)
    put(f"{stamp}.nanosec", stamps % 10**9)
    for number, (name, place) in enumerate(places.items()):
        if place.dtype.endswith("f8") and "covariance" not in name:
            wave = np.sin(stamps * (1e-11 * (number % 7 + 1)))[:, None]
            values = wave + 0.05 * rng.standard_normal((len(stamps), max(1, int(np.prod(place.shape)))))
            values[stamps == 0] *= 1e3
            put(name, values)
    return [row.tobytes() for row in rows]


def make(bag: Path, page: Path) -> tuple[float, float]:
    """Run the command; returns wall time in s and peak memory in bytes."""
    command = [str(Path(sys.executable).parent / "vessel-hsmc"), "report", str(bag), "--file", str(page)]
    began = time.monotonic()
    process = os.posix_spawn(command[0], command, os.environ, file_actions=[(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)])
    _, status, usage = os.wait4(process, 0)
    if status:
        raise SystemExit(f"{' '.join(command)} failed")
    return time.monotonic() - began, 1024.0 * usage.ru_maxrss


def look_at(page: Path) -> dict[str, float]:
    """Measure the page in a browser, in ms: loading, and the medians of moving the slider and of zooming."""
    timed = (
        "const done = arguments[0], times = [], { clock, charts } = report; let k = 0, began = 0;"
        "const settled = () => !charts.some((chart) => chart.onScreen && chart.stale);"
        "const step = () => { if (!settled()) return requestAnimationFrame(step);"
        " if (k) times.push(performance.now() - began);"
        " if (k === 20) return done(times.sort((a, b) => a - b)[10]);"
        " k += 1; began = performance.now(); %s; step(); };"
        "step();"
    )
    with browser.browser() as window:
        began = time.monotonic()
        window.open(page)
        window.show_diagram(0)
        opened = 1e3 * (time.monotonic() - began)
        move = window.driver.execute_async_script(timed % "clock.setTime(clock.begin + k / 20 * (clock.end - clock.begin))")
        zoom = window.driver.execute_async_script(timed % "clock.setWindow(clock.begin + k, clock.end - 20 * k)")
    return {"opening the page": opened, "a move of the slider": move, "a zoom": zoom}


def size(folder: Path) -> int:
    """Size of the files of a folder, bytes."""
    return sum(path.stat().st_size for path in folder.iterdir())


if __name__ == "__main__":
    sys.exit(main())
