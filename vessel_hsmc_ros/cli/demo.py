"""`vessel-hsmc demo`: case 2 under the paper's law, repaired and as printed, and under guided, over real nodes, in one page."""

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
    """Show three control laws on one example, side by side.

    A ship follows a circle under a disturbance (case 2 of the paper) with the paper's law, repaired, with it as printed,
    and with the law guided. The command prints a table of the runs and writes a page that overlays them. Each run keeps a
    folder of its own with its recording. Two run at the same time where there are two cores. This takes a minute or two.
    """
    from vessel_hsmc_ros.studies.runs.demonstration import DURATION, LAWS, SCENARIO, compare_bags, run_laws

    check_writable(output)
    with progress_bar(f"running {SCENARIO} with the laws {', '.join(LAWS)}", len(LAWS) * DURATION) as update:
        parent = run_laws(output, update, _end_if_failed)
    with progress_bar("comparing the runs", None):  # outside of the lock: another run may start meanwhile
        from vessel_hsmc_ros.report.tables import metrics_table  # imports the report's libraries

        found = compare_bags([parent.path / law / "bag" for law in LAWS], parent.report)
    head = ["", *(record.name for record in found.records)]
    print_table(head, [(row.label, *map(row.text, range(len(LAWS)))) for row in metrics_table(found.records)])
    for note in found.conclusions:
        print_line(note)
    for kind, path in found.files.items():
        print_line(f"{kind}: {path}")


def _end_if_failed(result: "Result") -> None:
    """End the command with the exit code of a run that has failed."""
    if result.exit_code:
        print_result(result)
        sys.exit(result.exit_code)
