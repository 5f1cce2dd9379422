"""`vessel-hsmc sweep`: a scenario for each value of a parameter, with a picture."""

from collections.abc import Sequence
from itertools import count
from pathlib import Path

import click

from vessel_hsmc_ros.cli.compare import chosen
from vessel_hsmc_ros.cli.console import print_line, print_table, progress_bar
from vessel_hsmc_ros.cli.options import (
    interpreted_option,
    law_file_option,
    load_checked,
    output_option,
    parse_changes,
    scenario_argument,
    set_option,
    workers_option,
)
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder

DEFAULT_METRICS = ("position_error_rms_last_quarter", "yaw_moment_rms")

MAX_TABLE_ROWS = 60  # largest number of runs that are printed in a table; those of a larger sweep are in its page and its files


@click.command()
@scenario_argument
@click.argument("parameters", nargs=-1, required=True, metavar="NODE.PARAM=VALUES...")
@click.option("--laws", help="Laws to repeat the sweep with, separated by commas [default: that of the scenario].")
@click.option(
    "--metric",
    "metrics",
    multiple=True,
    default=DEFAULT_METRICS,
    show_default=True,
    help="Metric to draw, as in run.json; may be given several times.",
)
@workers_option
@set_option
@interpreted_option
@law_file_option
@output_option
def sweep(
    scenario: str,
    parameters: Sequence[str],
    laws: str | None,
    metrics: Sequence[str],
    workers: int | None,
    changes: Sequence[str],
    output: Path,
) -> None:
    """Simulate SCENARIO for each value of one parameter, or for each pair of values of two.

    VALUES are start:stop:count, equally spaced; start:stop:count:log, with equal ratios; or a list such as 0.1,0.2,0.5.
    Writes a picture, a page, and all metrics as CSV and JSON into a run folder. Runs that fail are marked.
    """
    given = parse_changes(changes)
    load_checked(scenario, given, varied=True)
    check_writable(output)
    from vessel_hsmc_ros.studies.campaign import sweep as sweeps  # imports the libraries of reports

    axes = [sweeps.parse_axis(text) for text in parameters]
    sweeps.check_metrics(metrics)
    planned = sweeps.points(scenario, axes, given, () if laws is None else chosen(laws))
    with progress_bar(f"sweep of {len(planned)} runs", len(planned), "runs") as update:
        done = count(1)

        def show(outcome: sweeps.Outcome) -> None:
            number, values = next(done), ", ".join(map(str, outcome.point.values))
            update(number, f"{number} of {len(planned)}: {values}")

        outcomes = sweeps.run_all(planned, workers, show)
    head, lines = sweeps.table(axes, outcomes, metrics)
    if len(lines) <= MAX_TABLE_ROWS:
        # The table breaks names at spaces: a long name of a parameter must not displace numbers.
        print_table([name.replace(".", " .") for name in head], lines, text_columns=int(head[0] == "law"))
    for note in sweeps.notes(axes, outcomes):
        print_line(note)
    files = sweeps.write(make_run_folder(output, f"{Path(scenario).stem}_sweep").path, axes, outcomes, metrics)
    for kind, path in files.items():
        print_line(f"{kind}: {path}")
