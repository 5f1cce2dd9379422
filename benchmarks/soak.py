"""Endurance: memory, open files and threads of every node over a long run, with missed periods and lost messages.

The guided law on case 2 over the real nodes, everything recorded. After a warm-up of half the run, no node may grow
by more than the limit; open files and threads must stay as they are, no control period may be missed and no message lost.

    python benchmarks/soak.py                                    # 2 h of ship time in lockstep
    python benchmarks/soak.py --real-time --duration 600         # 10 minutes in real time

In real time a plain timer of the same period runs beside the nodes: the periods that it misses are the machine's.

The exit code is 1 where one of that is violated. The picture of the memory over time is written to soak.png, or to `--picture`.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Column, Table

SAMPLE_PERIOD = 0.5
"""Wall time between two samples, s."""

WARM_UP = 0.5
"""Share of the run before which memory may grow: however slow the machine is, a short run is still starting in its first part."""

PERIOD = 0.01
"""Control period of the run, s."""

START = 10.0
"""Time that the nodes take to start, s, in which a timer of any process is late."""

START_AND_END = 300.0
"""Time that a run may take besides its duration, s."""


class Sample(NamedTuple):
    """A node at one moment: time since the start, s; resident memory and its own part, MB; open files; threads."""

    time: float
    memory: float
    own: float
    files: int
    threads: int


def main() -> int:
    """Run, print the table, draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=7200.0, help="ship time, s")
    parser.add_argument("--real-time", action="store_true", help="at the pace of the clock instead of in lockstep")
    parser.add_argument("--growth", type=float, default=1.0, help="allowed growth of the memory of a node, percent")
    parser.add_argument("--picture", type=Path, default=Path("soak.png"), help="file of the picture")
    parser.add_argument("--timer", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.timer:
        timer(arguments.duration)
        return 0
    with tempfile.TemporaryDirectory() as output:
        samples, summary = run(arguments.duration, arguments.real_time, Path(output))
    beside = f", {summary['timer']} of the timer beside it" if arguments.real_time else ""
    problems = [f"{summary['missed_periods']} missed periods{beside}"] if summary["missed_periods"] else []
    problems += [f"{summary['messages_dropped']} lost messages"] if summary["messages_dropped"] else []
    table = Table(
        Column("node", no_wrap=True), "memory after warm-up", "at the end", "growth", "not shared", "open files", "threads"
    )
    for name, of_node in samples.items():
        kept = settled(of_node)
        first, last = ends([sample.memory for sample in kept])
        files, threads = ({getattr(sample, what) for sample in kept} for what in ("files", "threads"))
        before, after = ends([sample.own for sample in kept])
        own = f"{after - before:+.1f} MB"
        table.add_row(name, f"{first:.1f} MB", f"{last:.1f} MB", f"{growth(kept):+.2f} %", own, span(files), span(threads))
        problems += [f"{name}: {problem}" for problem in found(kept, arguments.growth)]
    Console().print(table)
    draw(samples, arguments.picture)
    print("; ".join(problems) or f"no missed period, no lost message, nothing grows; picture: {arguments.picture}")
    return 1 if problems else 0


def run(duration: float, real_time: bool, output: Path) -> tuple[dict[str, list[Sample]], dict[str, Any]]:
    """Samples of each node, and the summary of the run."""
    command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", "run", "case2_tracking", "--processes"]
    command += ["--output", str(output), "--set", "controller.law=guided", "--set", f"vessel_sim.duration={duration}"]
    # A domain of its own: a node's memory grows with every other participant that it discovers.
    environment = {**os.environ, "ROS_DOMAIN_ID": os.environ.get("ROS_DOMAIN_ID", str(2 + os.getpid() % 98))}
    samples: dict[str, list[Sample]] = defaultdict(list)
    began = time.monotonic()
    command += ["--real-time"] if real_time else []
    plain = [sys.executable, __file__, "--timer", "--duration", str(duration if real_time else 0.0)]
    with (
        subprocess.Popen(plain, stdout=subprocess.PIPE, text=True) as beside,
        subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment) as process,
    ):
        while process.poll() is None:
            if time.monotonic() - began > duration + START_AND_END:
                process.terminate()
            for name, pid in nodes(process.pid).items():
                with suppress(OSError, KeyError):  # a process that has just ended
                    samples[name].append(sample(pid, time.monotonic() - began))
            time.sleep(SAMPLE_PERIOD)
        missed, _ = beside.communicate(timeout=START_AND_END)
    if process.returncode:
        raise SystemExit(f"the run failed with exit code {process.returncode}")
    (folder,) = output.iterdir()
    return dict(samples), {**json.loads((folder / "run.json").read_text(encoding="utf-8")), "timer": int(missed)}


def timer(duration: float) -> None:
    """Wake up once a control period for a time, s, and print how many periods had passed without that."""
    time.sleep(min(START, duration))
    begin = time.monotonic()
    missed = done = 0
    while done < round((duration - START) / PERIOD):
        time.sleep(max(0.0, begin + (done + 1) * PERIOD - time.monotonic()))
        passed = int((time.monotonic() - begin) / PERIOD)
        missed += max(0, passed - done - 1)
        done = max(passed, done + 1)
    print(missed)


def nodes(parent: int) -> dict[str, int]:
    """Process ids of the nodes that a process has started, by name."""
    found: dict[str, int] = {}
    with suppress(OSError):
        for child in Path(f"/proc/{parent}/task/{parent}/children").read_text(encoding="ascii").split():
            found[Path(f"/proc/{child}/comm").read_text(encoding="utf-8").strip()] = int(child)
    return found


def sample(pid: int, at: float) -> Sample:
    """The present state of a process."""
    lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    status = dict(line.split(":", 1) for line in lines if ":" in line)
    return Sample(
        at,
        int(status["VmRSS"].split()[0]) / 1024,
        int(status["RssAnon"].split()[0]) / 1024,
        len(list(Path(f"/proc/{pid}/fd").iterdir())),
        int(status["Threads"]),
    )


def settled(samples: list[Sample]) -> list[Sample]:
    """The samples after the warm-up, without the last two: a node that ends opens and closes files."""
    begin = samples[0].time + WARM_UP * (samples[-1].time - samples[0].time)
    return [each for each in samples if each.time >= begin][:-2] or samples


def ends(values: list[float]) -> tuple[float, float]:
    """Medians of the first and of the last tenth."""
    count = max(1, len(values) // 10)
    return statistics.median(values[:count]), statistics.median(values[-count:])


def growth(samples: list[Sample]) -> float:
    """Growth of the memory, percent."""
    first, last = ends([each.memory for each in samples])
    return 100.0 * (last / first - 1.0)


def found(samples: list[Sample], allowed: float) -> list[str]:
    """What is wrong with the samples of a node after its warm-up; the allowed growth of its memory in percent."""
    problems = [f"memory grows by {growth(samples):.2f} %"] if growth(samples) > allowed else []
    for what in ("files", "threads"):
        first, last = ends([float(getattr(each, what)) for each in samples])
        problems += [f"{what} grow from {first:g} to {last:g}"] if last > first else []
    return problems


def span(values: set[int]) -> str:
    """The smallest and the largest value."""
    return str(min(values)) if len(values) == 1 else f"{min(values)} to {max(values)}"


def draw(samples: dict[str, list[Sample]], path: Path) -> None:
    """Draw the memory of every node over time."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 4))
    for name, of_node in samples.items():
        axes.plot([each.time for each in of_node], [each.memory for each in of_node], label=name)
    axes.set(xlabel="wall time [s]", ylabel="resident memory [MB]", ylim=(0.0, None))
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=120, bbox_inches="tight")


if __name__ == "__main__":
    sys.exit(main())
