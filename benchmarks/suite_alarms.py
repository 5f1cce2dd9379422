"""Alarms of the safety layer in healthy runs, with every guard on: each row of every suite, offline.

    python benchmarks/suite_alarms.py [--suites guided,realistic,sea,tuning] [--laws guided,los_pid] [--scenarios]

The messages of each run pass freshness, plausibility, monitors, output guard and supervision (test/support/supervised_runs.py),
whose commands must be bit-identical to those of the run. `--scenarios` adds those of the package. A run that ends early, as the
law is undefined or the motion not finite, is listed and not counted. benchmarks/false_alarms.py does the same over the nodes.
The exit code is 1 where there was an alarm.
"""

import argparse
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.core.exceptions import ControlError, SimulationError
from vessel_hsmc_ros.scenario.named_files import SUITES
from vessel_hsmc_ros.scenario.scenario import scenario_names
from vessel_hsmc_ros.simulation.compile import ensure_compiled
from vessel_hsmc_ros.studies import batch
from vessel_hsmc_ros.studies.comparison import Task, prepare
from vessel_hsmc_ros.studies.suite import Row, load_suite

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "support"))

from supervised_runs import Supervised, supervise


class Case(NamedTuple):
    """A row of a suite with a law; the suite is empty for a scenario of the package."""

    suite: str
    task: Task


class Outcome(NamedTuple):
    """What the checks have found; or why the run ended early."""

    case: Case
    found: Supervised | None
    failure: str = ""


def check(case: Case, progress: batch.Progress) -> Outcome:
    """Run a case and check its messages."""
    scenario, _ = prepare(case.task)
    try:
        return Outcome(case, supervise(scenario, lambda done, total: progress(done / total)))
    except (ControlError, SimulationError) as error:
        return Outcome(case, None, str(error))


def cases(arguments: argparse.Namespace) -> list[Case]:
    """All rows, with every law."""
    shorter = {} if arguments.duration is None else {"vessel_sim.duration": arguments.duration}
    rows = [(name, row) for name in arguments.suites.split(",") for row in load_suite(name)]
    if arguments.scenarios:
        rows += [("", Row(name, name)) for name in scenario_names()]
    return [
        Case(suite, Task(replace(row, changes={**row.changes, **shorter}), law, None))
        for suite, row in rows
        for law in arguments.laws.split(",")
    ]


def main() -> int:
    """Check all cases and print a table of those with an alarm."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--suites", default=",".join(SUITES.names()))
    parser.add_argument("--laws", default="guided,los_pid", help="those that keep to the limits of the vessel")
    parser.add_argument("--duration", type=float, help="length of a run, s; that of the row by default")
    parser.add_argument("--scenarios", action="store_true", help="the scenarios of the package too")
    parser.add_argument("--workers", type=int, help="processes; one a core by default")
    chosen = cases(arguments := parser.parse_args())
    ensure_compiled([prepare(case.task)[0] for case in chosen])
    done = []
    outcomes = batch.run_all(check, chosen, workers=arguments.workers, on_result=partial(_report, done, len(chosen)))
    Console().print(_table(outcomes))
    periods = sum(each.found.steps for each in outcomes if each.found)
    bad = [each for each in outcomes if each.found and (each.found.alarms or each.found.differing)]
    ended = sum(each.found is None for each in outcomes)
    print(f"{len(outcomes)} runs, {periods} control periods, {ended} ended early: {len(bad)} with an alarm or another command")
    return int(bool(bad))


def _report(done: list[Outcome], total: int, outcome: Outcome) -> None:
    done.append(outcome)
    found = outcome.found
    text = outcome.failure if found is None else f"{found.alarms} {found.differing}" if found.alarms or found.differing else "ok"
    sys.stderr.write(f"{len(done)}/{total} {outcome.case.suite} {outcome.case.task.row.name} {outcome.case.task.law}: {text}\n")


def _table(outcomes: list[Outcome]) -> Table:
    table = Table("suite", "row", "law", "alarms", "other commands")
    for (suite, task), found, failure in outcomes:
        if failure:
            table.add_row(suite, task.row.name, task.law, f"ended early: {failure}", "")
        elif found and (found.alarms or found.differing):
            alarms = ", ".join(f"{name} {count}" for name, count in found.alarms.items())
            table.add_row(suite, task.row.name, task.law, alarms, str(found.differing))
    return table


if __name__ == "__main__":
    sys.exit(main())
