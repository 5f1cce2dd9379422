"""The cost of a step against the number of vessels in lockstep, and the periods that a fleet misses in real time.

Two runs of different length are compared, so that the processor time of the start-up cancels out. Wall time depends on what else
the machine does, so the load is printed beside it.

    python benchmarks/fleet.py [--vessels 1 2 4 8 20] [--steps 400] [--real-time 4] [--seconds 60] [--picture FILE.png]
"""

import argparse
import os
import resource
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.nodes.runs.supervisor import supervise
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import dump_fleet, for_nodes, load_scenario, make_fleet
from vessel_hsmc_ros.studies.scenario_run import reserve_namespaces

RATE = 50.0
SHORT = 10
"""The shorter of two runs has one of so many steps."""


SAMPLE_PERIOD, SETTLED = 1.0, 0.2
"""Time between two samples of the processor time, s; share of a run after which it is in the steady state."""


class Cost(NamedTuple):
    """Wall time of the loop and processor time of all processes of a run [s], its steps, lost messages and missed periods.

    `cores` is the processor time a second in the steady state, without start-up and end.
    """

    wall: float
    processor: float
    steps: int
    lost: int
    missed: int
    cores: float


class Usage:
    """Processor time of this process and its children in the steady state of a run.

    Args:
        begin: Simulated time at which that begins, s.
    """

    def __init__(self, begin: float) -> None:
        self._begin = begin
        self._samples: list[tuple[float, float]] = []

    def sample(self, simulated: float) -> None:
        """Take a sample, at most one in SAMPLE_PERIOD."""
        now = time.monotonic()
        if simulated >= self._begin and not (self._samples and now - self._samples[-1][0] < SAMPLE_PERIOD):
            self._samples.append((now, processor_time()))

    @property
    def cores(self) -> float:
        """Processor time a second; NaN for a run that is too short."""
        if len(self._samples) < 2:
            return float("nan")
        (begin, before), (end, after) = self._samples[0], self._samples[-1]
        return (after - before) / (end - begin)


def processor_time() -> float:
    """Processor time of this process and of its running children so far, s."""
    spent = time.process_time()
    for child in Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="ascii").split():
        with suppress(OSError):  # it has just ended
            fields = Path(f"/proc/{child}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            spent += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return spent


def run(vessels: int, duration: float, real_time: bool) -> Cost:
    """Run a fleet in a temporary folder, without its page."""
    changes = {f"{node}.rate_hz": RATE for node in ("vessel_sim", "reference_ship", "controller")}
    fixed = {"controller.law": "guided", "vessel_sim.duration": duration}
    fleet = make_fleet(load_scenario("case2_tracking", for_nodes(True, real_time) | changes | fixed), vessels)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as name, reserve_namespaces(fleet):
        folder = RunFolder(Path(name))
        folder.write_parameters(dump_fleet(fleet.with_bag(folder.bag, folder.parameters)))
        names = tuple(fleet.vessels)
        usage = Usage(SETTLED * duration)
        status = supervise(folder, fleet.base, "", usage.sample, vessels=names)
        if status.failure:
            raise RunError(f"{vessels} vessels: {status.failure}")
        bag = open_bag(folder.bag)
        found = [bag.diagnostics(namespace) for namespace in bag.namespaces]
        lost = int(bag.recording["messages_dropped"])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    wall = max(float(nodes["vessel_sim"]["wall_time"]) for nodes in found)
    missed = sum(int(nodes["controller"]["missed_periods"]) for nodes in found)
    return Cost(wall, processor, int(found[0]["vessel_sim"]["steps"]), lost, missed, usage.cores)


def lockstep(numbers: list[int], steps: int, console: Console) -> list[tuple[int, float, float]]:
    """Print the cost of a step for each number of vessels; returns the number, wall and processor time of a step [ms]."""
    table = Table("vessels", "wall time of a step, ms", "processor time of a step, ms", "lost messages", "load", box=None)
    costs = []
    for number in numbers:
        try:
            short, long = (run(number, count / RATE, real_time=False) for count in (max(1, steps // SHORT), steps))
        except RunError as error:  # the other numbers of vessels count all the same
            console.print(f"[red]{error}", soft_wrap=True)
            continue
        wall, processor = (
            1e3 * (getattr(long, name) - getattr(short, name)) / (long.steps - short.steps) for name in ("wall", "processor")
        )
        costs.append((number, wall, processor))
        table.add_row(str(number), f"{wall:.2f}", f"{processor:.2f}", str(short.lost + long.lost), f"{os.getloadavg()[0]:.1f}")
    console.print(table)
    return costs


def draw(costs: list[tuple[int, float, float]], path: Path) -> None:
    """Draw the cost of a step against the number of vessels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 3.6), layout="constrained")
    axis = figure.add_subplot(xlabel="vessels", ylabel="time of a step, ms")
    numbers, wall, processor = zip(*costs, strict=True)
    axis.plot(numbers, wall, "o-", label="wall")
    axis.plot(numbers, processor, "s--", label="processor, all processes")
    axis.set_ylim(0.0)
    axis.legend()
    figure.savefig(path)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--vessels", type=int, nargs="*", default=[1, 2, 4, 8, 20])
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--real-time", type=int, default=4, help="vessels in real time; 0 for none")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    console = Console()
    if arguments.vessels:
        costs = lockstep(arguments.vessels, arguments.steps, console)
        if arguments.picture:
            draw(costs, arguments.picture)
    if arguments.real_time:
        cost = run(arguments.real_time, arguments.seconds, real_time=True)
        console.print(
            f"{arguments.real_time} vessels at {RATE:g} Hz for {arguments.seconds:g} s in real time: {cost.missed} missed"
            f" periods, {cost.lost} lost messages, {cost.cores:.2f} cores in the steady state, {cost.processor:.1f} s of"
            f" processor time with start and end, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores",
            soft_wrap=True,
        )


if __name__ == "__main__":
    main()
