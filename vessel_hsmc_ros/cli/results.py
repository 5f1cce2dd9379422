"""Printed results of a run, common to the verbs: metrics, failure, files."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from vessel_hsmc_ros.cli.console import print_error, print_line, print_table

if TYPE_CHECKING:
    from vessel_hsmc_ros.runs.scenario_run import Result


def print_result(result: "Result") -> None:
    """Print the metrics of a run, how it failed if it did, and the paths of its files."""
    if result.metrics is not None:
        from vessel_hsmc_ros.report import rows  # imports the report's libraries

        print_metrics([("", rows(result.metrics, result.facts))])
    if result.failure and result.folder.bag.exists():
        print_line(f"the bag is complete; for metrics and figures: vessel-hsmc report {result.folder.bag}")
    if result.failure:
        print_error(result.failure)
    print_line(f"run folder: {result.folder.path}")


def print_metrics(runs: Sequence[tuple[str, Sequence[tuple[str, str]]]]) -> None:
    """Print the metrics of runs side by side.

    Args:
        runs: For each run its name and its metrics, each a label and a value with its unit.
    """
    values = [dict(metrics) for _, metrics in runs]
    # A dict keeps the order of first occurrence, and runs may lack some metrics.
    labels = dict.fromkeys(label for metrics in values for label in metrics)
    print_table(["", *(name for name, _ in runs)], [(label, *(metrics.get(label, "") for metrics in values)) for label in labels])
