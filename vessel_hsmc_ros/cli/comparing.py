"""The verbs that compare simulated runs: `demo`, `compare` and `sweep`."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vessel_hsmc_ros.cli.console import print_files, print_line, print_result, print_table, progress_bar
from vessel_hsmc_ros.cli.options import (
    interpreted_option,
    law_file_option,
    load_checked,
    output_option,
    parse_changes,
    rate_option,
    refuse_without,
    scenario_argument,
    set_option,
    workers_option,
)
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import meant
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder
from vessel_hsmc_ros.scenario.scenario import scenario_names
from vessel_hsmc_ros.scenario.suite import Row, load_suite

if TYPE_CHECKING:
    from vessel_hsmc_ros.studies.comparison import LawRun
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
    print_files(found.files)


def _end_if_failed(result: "Result") -> None:
    """End the command with the exit code of a run that has failed."""
    if result.exit_code:
        print_result(result)
        sys.exit(result.exit_code)


MAX_DETAILED_ROWS = 3  # largest number of rows that are printed in a table each; more are printed in one overview


@click.command()
@click.argument("scenarios", nargs=-1, metavar="SCENARIO|RUN...")
@click.option("--suite", help="A suite of cases with limits, such as guided, or the path of a YAML file.")
@click.option("--laws", help="Laws, separated by commas [default: all that track a position].")
@rate_option
@workers_option
@set_option
@interpreted_option
@law_file_option
@output_option
def compare(
    scenarios: Sequence[str],
    suite: str | None,
    laws: str | None,
    rate_hz: float | None,
    workers: int | None,
    changes: Sequence[str],
    output: Path,
) -> None:
    """Compare control laws on the same scenarios, or recorded runs.

    Simulates every law on every SCENARIO, without ROS, and prints their errors and forces side by side. Writes a page
    (compare.html), tables (compare.md, compare.json) and a figure for each case into a run folder. If run folders or bags are
    given instead of scenarios, nothing is simulated: the command prints their metrics and writes one page that overlays them,
    as `report` does.
    """
    from vessel_hsmc_ros.studies import comparison  # imports the libraries of reports

    if recorded := [Path(name) for name in scenarios if is_recorded(name)]:
        if len(recorded) < len(scenarios) or changes or any(each is not None for each in (suite, laws, rate_hz)):
            raise click.UsageError(
                "recorded runs cannot be compared with scenarios: give run folders or bags alone, without options"
            )
        refuse_without("scenarios", "workers", "jobs", "interpreted")
        compare_runs(recorded, output)
        return
    for name in scenarios:  # the law is that of each run
        load_checked(name, {"controller.law": "guided", **parse_changes(changes)}, varied=True)
    rows = [*(Row(Path(name).stem, name) for name in scenarios), *(() if suite is None else load_suite(suite))]
    if not rows:
        raise click.UsageError("give a SCENARIO or --suite")
    rows = [replace(row, changes={**row.changes, **parse_changes(changes)}) for row in rows]
    check_writable(output)
    tasks = [comparison.Task(row, law, rate_hz) for row in rows for law in chosen(laws)]
    with progress_bar("comparing laws", len(tasks), "runs") as update:
        done = count(1)

        def show(run: "LawRun") -> None:
            number = next(done)
            update(number, f"{number} of {len(tasks)}: {run.law} on {run.row.name}")

        outcomes = comparison.compare(tasks, workers, show)
    print_outcomes(outcomes)  # before the files: a full disk must not lose the results of a long comparison
    folder = make_run_folder(output, "compare").path
    comparison.write(folder, outcomes)
    print_line(f"page: {folder / 'compare.html'}")
    print_line(f"tables and figures: {folder}")


def is_recorded(name: str) -> bool:
    """Whether an argument is a folder or an MCAP file and not a scenario, which has a name or is a YAML file."""
    return (Path(name).is_dir() and name not in scenario_names()) or Path(name).suffix == ".mcap"


def compare_runs(runs: Sequence[Path], output: Path) -> None:
    """Print the metrics of recorded runs, and write their common page."""
    from vessel_hsmc_ros.bags.files import bag_path  # imports the libraries of bags
    from vessel_hsmc_ros.studies.comparison import compare_bags

    bags = [bag_path(run) for run in runs]  # before the folder is created: a wrong path leaves nothing behind
    done = compare_bags(bags, make_run_folder(output, "compare"))
    print_table(done.head, done.table)
    print_files(done.files)


def chosen(laws: str | None) -> list[str]:
    """Parse the names of `--laws`. Raises ParameterError if a name is not the name of a law, or is there twice."""
    if laws is None:
        from vessel_hsmc_ros.studies.comparison import default_laws

        return default_laws()
    names = [name.strip() for name in laws.split(",") if name.strip()]
    for name in names or [laws]:
        if name not in LAWS:
            raise ParameterError(f"--laws must be any of {', '.join(LAWS)} (got {name}){meant(name, LAWS)}")
        if names.count(name) > 1:
            raise ParameterError(f"--laws must name each law once (got {laws})")
    return names


def print_outcomes(outcomes: Sequence["LawRun"]) -> None:
    """Print a table for each row, or one overview of many rows, and the notes."""
    from vessel_hsmc_ros.studies import comparison

    rows = comparison.by_row(outcomes)
    if len(rows) <= MAX_DETAILED_ROWS:
        for row, of_row in rows:
            head, lines = comparison.table(row, of_row)
            print_table(head, map(coloured, lines), title=row.name)
    else:
        for title, head, lines, texts in comparison.overviews(outcomes):
            print_table(head, map(coloured, lines), title=title, text_columns=texts)
    for note in comparison.notes(outcomes):
        print_line(note)


def coloured(cells: Sequence[str]) -> list[str]:
    """Cells of a table with misses in red and hits in green."""
    colours = {"miss": "red", "hit": "green"}
    words = [cell.rsplit(" ", 1)[-1] for cell in cells]
    return [f"[{colours[word]}]{cell}[/]" if word in colours else cell for cell, word in zip(cells, words, strict=True)]


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
    from vessel_hsmc_ros.studies.campaign import execute, findings, report  # imports the libraries of campaigns
    from vessel_hsmc_ros.studies.campaign.plan import sweep_of
    from vessel_hsmc_ros.studies.campaign.results import of_rows

    plan = sweep_of(scenario, parameters, given, () if laws is None else chosen(laws), metrics)
    with progress_bar(f"sweep of {plan.runs} runs", plan.runs, "runs") as update:
        rows = execute.compute_rows(plan, range(plan.runs), workers, lambda done: update(done * plan.runs))
    results = of_rows(plan, rows)
    table = findings.points(results)
    if len(rows) <= MAX_TABLE_ROWS:
        # The table breaks names at spaces: a long name of a parameter must not displace numbers.
        head = [name.replace(".", " .") for name in table.head]
        print_table(head, [[cell.value for cell in line] for line in table.lines], text_columns=2)
    for row in rows:
        if row["failure"]:
            print_line(f"run {row['run']}: {row['failure']}")
    folder = make_run_folder(output, plan.name).path
    print_files(report.write_sweep(results, rows, folder))
