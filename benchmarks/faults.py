"""The fault matrix over the real nodes: scripted faults, and what the loop commands meanwhile and afterwards.

python benchmarks/faults.py [--page docs/faults.md] [--law guided] [--mode lockstep] [--target odometry]

Each run carries out the faults of one target, one after the other, with time to recover in between. The undisturbed error is that
of the same scenario without faults.
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import yaml
from fault_judge import (  # type: ignore[import-not-found]
    LASTS,
    LAWS,
    LEAD,
    MODES,
    SCENARIO,
    SPACING,
    TOPICS,
    Cell,
    Recording,
    judge,
)
from fault_page import write_page  # type: ignore[import-not-found]

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.faults import Fault, FaultScript
from vessel_hsmc_ros.nodes.runs import supervisor
from vessel_hsmc_ros.nodes.runs.supervisor import Injection, exclusive, supervise
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario, check_script, dump_scenario, for_nodes, load_scenario


def main() -> int:
    """Run the matrix, print each cell, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", type=Path, help="page to write, such as docs/faults.md")
    parser.add_argument("--law", choices=LAWS, action="append", help="only this law")
    parser.add_argument("--mode", choices=MODES, action="append", help="only this mode")
    parser.add_argument("--target", choices=TOPICS, action="append", help="only this target")
    parser.add_argument("--only", help="only the cells of this name")
    parser.add_argument("--bags", type=Path, help="folder that keeps the runs; those that are there are not repeated")
    chosen = parser.parse_args()
    os.environ.setdefault("ROS_DOMAIN_ID", "88")
    supervisor.SILENCE_LIMIT = 30.0  # the machine may be busy; whether a node hangs is not what is examined here
    began = time.monotonic()
    cells: list[Cell] = []
    for law in chosen.law or LAWS:
        for mode in chosen.mode or MODES:
            for target in chosen.target or TOPICS:
                planned = [cell for cell in plan(target, law, mode) if chosen.only in (None, cell.name)]
                for cell in run(planned, chosen.bags) if planned else []:
                    cells.append(cell)
                    print(line(cell), flush=True)
    minutes = (time.monotonic() - began) / 60.0
    bad = sum(bool(cell.problems) for cell in cells)
    print(f"{len(cells)} cells, {bad} not as expected, {minutes:.1f} minutes")
    if chosen.page:
        write_page(chosen.page, cells)
    return 1 if bad else 0


def line(cell: Cell) -> str:
    """A cell in one line."""
    back = "" if cell.recovery is None else f", back after {cell.recovery:.1f} s"
    result = "; ".join(cell.problems) or f"as expected{back}"
    return f"{cell.mode:9} {cell.law:12} {cell.target:10} {cell.name:22} {cell.expect:6} {result}"


def plan(target: str, law: str, mode: str) -> list[Cell]:
    """The cells of a target with their faults one after the other."""
    matrix = yaml.safe_load((Path(__file__).parent / "fault_matrix.yaml").read_text(encoding="utf-8"))
    cells = []
    for row in matrix[target]:
        if mode not in row.get("modes", MODES):
            continue
        at = LEAD[mode] + SPACING[mode] * len(cells)
        values = {"at": at, "duration": LASTS[mode], **row["fault"]}
        if TOPICS[target]:
            values["topic"] = TOPICS[target]
        fault = build(Fault, values, row["name"])
        cells.append(Cell(target, str(row["name"]), law, mode, row["expect"], row["reason"], row.get("same", False), fault))
    return cells


def scenario_of(cells: Sequence[Cell]) -> Scenario:
    """The scenario in which cells are carried out: the circle of case 2, the same for all laws."""
    mode, law = cells[0].mode, cells[0].law
    duration = max(cell.fault.at for cell in cells) + SPACING[mode]
    chosen = {**SCENARIO, "controller.law": law, "vessel_sim.duration": duration}
    return load_scenario("case2_tracking", chosen | for_nodes(True, mode == "real time"))


def run(planned: Sequence[Cell], bags: Path | None) -> Iterator[Cell]:
    """Carry out the faults of some cells in one run, and judge each."""
    # In one run the faults follow each other, whatever other cells were left out.
    mode = planned[0].mode
    cells = [replace(c, fault=replace(c.fault, at=LEAD[mode] + SPACING[mode] * i)) for i, c in enumerate(planned)]
    scenario = scenario_of(cells)
    with tempfile.TemporaryDirectory() as temporary:
        first = cells[0]
        folder = RunFolder((bags or Path(temporary)) / f"{first.target}_{first.law}_{mode}_{len(cells)}".replace(" ", "_"))
        failure = folder.read_summary()["failure"] if folder.summary.exists() else carry_out(cells, scenario, folder)
        try:
            recording = Recording(open_bag(folder.bag), scenario)
        except VesselHsmcError as error:
            yield from (replace(cell, problems=(f"no recording: {error}; {failure}",)) for cell in cells)
            return
        if failure:
            print(f"  the run ended after {recording.end:.1f} s: {failure}", file=sys.stderr)
        for cell in cells:
            yield judge(cell, recording, failure)


def carry_out(cells: Sequence[Cell], scenario: Scenario, folder: RunFolder) -> str:
    """Run the nodes with the faults of some cells, recorded into a folder; returns how the run failed, if it did."""
    script = FaultScript(tuple(cell.fault for cell in cells), seed=1)
    check_script(script, scenario)
    injection = Injection(script, scenario)
    folder.path.mkdir(parents=True, exist_ok=True)
    recorded = scenario.with_bag(folder.bag.absolute(), folder.parameters.absolute())
    folder.write_parameters(dump_scenario(injection.relayed(recorded)))
    with exclusive("", scenario.controller.lockstep):
        status = supervise(folder, scenario, "", lambda _: None, injection=injection)
    folder.write_summary({"failure": status.failure})
    return status.failure


if __name__ == "__main__":
    sys.exit(main())
