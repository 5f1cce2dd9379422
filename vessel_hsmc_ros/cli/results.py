"""Printed results of a run, common to the verbs: metrics, failure, files."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vessel_hsmc_ros.cli.console import print_error, print_line, print_status, print_table
from vessel_hsmc_ros.cli.interrupts import INTERRUPTED, INTERRUPTED_LINE
from vessel_hsmc_ros.core.exceptions import BagError

if TYPE_CHECKING:
    from vessel_hsmc_ros.runs.fleet import FleetResult
    from vessel_hsmc_ros.runs.scenario_run import Result


def print_result(result: "Result") -> None:
    """Print the metrics of a run, how it failed if it did, and the paths of its files."""
    if result.metrics is not None:
        from vessel_hsmc_ros.report import rows  # imports the report's libraries

        print_metrics([("", rows(result.metrics, result.facts))])
    if result.failure and result.folder.bag.exists():
        print_line(_what_remains(result.folder.bag))
    print_failure(result)
    print_line(f"run folder: {result.folder.path}")


def print_failure(result: "Result | FleetResult") -> None:
    """Print how a run failed if it did; Ctrl-C is no error, and has the line that it has in every command."""
    if result.exit_code == INTERRUPTED:
        print_status(INTERRUPTED_LINE)
    elif result.failure:
        print_error(result.failure)


def _what_remains(bag: Path) -> str:
    """What the bag of a failed run holds, and the command that continues from it."""
    from vessel_hsmc_ros.bags.repair import is_complete  # imports the MCAP library

    try:
        if is_complete(bag):
            return f"the bag is complete up to the failure; for metrics and figures: vessel-hsmc report {shlex.quote(str(bag))}"
    except BagError:
        return f"the bag cannot be read: {bag}"
    return f"the bag lacks what could not be written; to repair the rest: vessel-hsmc recover {shlex.quote(str(bag))}"


def print_metrics(runs: Sequence[tuple[str, Sequence[tuple[str, str]]]]) -> None:
    """Print the metrics of runs side by side.

    `runs`: for each run its name and its metrics, each a label and a value with its unit.
    """
    values = [dict(metrics) for _, metrics in runs]
    # A dict keeps the order of first occurrence, and runs may lack some metrics.
    labels = dict.fromkeys(label for metrics in values for label in metrics)
    print_table(["", *(name for name, _ in runs)], [(label, *(metrics.get(label, "") for metrics in values)) for label in labels])
