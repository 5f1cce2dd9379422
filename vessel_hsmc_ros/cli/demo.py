"""`vessel-hsmc demo`: the paper's case 2 under its law, repaired and as printed, over real nodes, in one page and one table."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vessel_hsmc_ros.cli.console import print_line, print_result, print_table, progress_bar
from vessel_hsmc_ros.cli.options import output_option
from vessel_hsmc_ros.scenario.run_folder import check_writable

if TYPE_CHECKING:
    from vessel_hsmc_ros.studies.runs.scenario_run import Result


@click.command()
@output_option
def demo(output: Path) -> None:
    """Show two control laws on one example, side by side.

    A ship follows a circle under a disturbance (case 2 of the paper), once with the paper's law, repaired, and once
    with it as printed.
    The command prints a table of both runs and writes a page that overlays them. Each run keeps a folder of its own with its
    recording. Both run at the same time where there are two cores. This takes a minute or two.
    """
    from vessel_hsmc_ros.studies.runs.demonstration import DURATION, LAWS, SCENARIO, compare_bags, run_laws

    check_writable(output)
    with progress_bar(f"running {SCENARIO} with the laws {' and '.join(LAWS)}", len(LAWS) * DURATION) as update:
        parent = run_laws(output, update, _end_if_failed)
    with progress_bar("comparing both runs", None):  # outside of the lock: another run may start meanwhile
        from vessel_hsmc_ros.report.tables import metrics_table  # imports the report's libraries

        found = compare_bags([parent.path / law / "bag" for law in LAWS], parent.report)
    head = ["", *(record.name for record in found.records), "difference"]
    rows = [(row.label, row.text(0), row.text(1), row.difference(1)) for row in metrics_table(found.records)]
    print_table(head, rows)
    for note in found.conclusions:
        print_line(note)
    for kind, path in found.files.items():
        print_line(f"{kind}: {path}")


def _end_if_failed(result: "Result") -> None:
    """End the command with the exit code of a run that has failed."""
    if result.exit_code:
        print_result(result)
        sys.exit(result.exit_code)
