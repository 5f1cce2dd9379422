"""The options `--campaign FOLDER --run N`, by which a verb repeats a row of a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vessel_hsmc_ros.cli.console import print_error, print_line

if TYPE_CHECKING:
    from collections.abc import Callable

    from vessel_hsmc_ros.campaign.dataset import Row
    from vessel_hsmc_ros.runs.scenario_run import Result

DIFFERENT = 1
"""Exit code of a run that differs from its row."""


def campaign_row_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a verb, which takes them as `campaign` and `row`."""
    folder = click.option(
        "--campaign",
        type=click.Path(path_type=Path),
        help="Folder of a campaign of which --run selects a run, instead of SCENARIO.",
    )
    number = click.option("--run", "row", type=click.IntRange(min=0), metavar="N", help="Number of the run in the campaign.")
    return folder(number(command))


def of_row(scenario: str | None, folder: Path | None, number: int | None, changed: bool) -> Row | None:
    """The row that the options select; None where they are not given.

    `changed`: whether other options would change the run.

    Raises:
        click.UsageError: neither a scenario nor a row is selected, or more than a row.
        ParameterError, CampaignError: as `Row.read`.
    """
    if folder is None and number is None:
        if scenario is None:
            raise click.UsageError("Missing argument 'SCENARIO'; or give --campaign and --run")
        return None
    if folder is None or number is None or scenario is not None or changed:
        without = "SCENARIO, --set, --real-time and --faults"
        raise click.UsageError(f"to repeat a run of a campaign give --campaign and --run, without {without}")
    from vessel_hsmc_ros.campaign.dataset import Row  # imports the libraries of campaigns

    return Row.read(folder, number)


def compare_with_row(row: Row, result: Result) -> int:
    """Print whether a run has the metrics of its row; returns the exit code."""
    if not row.values:
        print_line(f"row {row.run} of the campaign is not computed yet: nothing to compare with")
        return result.exit_code
    differences = row.differences(result.metrics, result.failure)
    for line in differences:
        print_error(f"row {row.run}: {line}")
    if not differences:
        what = "the run ended early as" if row.values["ended_early"] else "all metrics are bit-identical to those of"
        print_line(f"{what} row {row.run} of the campaign")
    return DIFFERENT if differences else 0
