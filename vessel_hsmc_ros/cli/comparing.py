"""The verbs that compare simulated runs: `demo`, `compare`, `sweep`, `campaign` and `reproduce`."""

import datetime
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vessel_hsmc_ros.cli.console import (
    print_files,
    print_line,
    print_result,
    print_status,
    print_table,
    print_warning,
    progress_bar,
)
from vessel_hsmc_ros.cli.options import (
    file_option,
    folder_option,
    interpreted_option,
    law_file_option,
    load_checked,
    output_option,
    rate_option,
    refuse_without,
    scenario_argument,
    set_option,
    workers_option,
)
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import meant
from vessel_hsmc_ros.scenario.run_folder import check_writable, folder_for, make_run_folder
from vessel_hsmc_ros.scenario.scenario import scenario_names
from vessel_hsmc_ros.studies.suite import Row, load_suite

if TYPE_CHECKING:
    from vessel_hsmc_ros.report.record import Record
    from vessel_hsmc_ros.studies.comparison import LawRun
    from vessel_hsmc_ros.studies.paper.cases import Results
    from vessel_hsmc_ros.studies.scenario_run import Result


@click.command()
@output_option
def demo(output: Path) -> None:
    """Show three control laws on one example, side by side.

    A ship follows a circle under a disturbance (case 2 of the paper) with the paper's law, repaired, with it as printed,
    and with the law guided. The command prints a table of the runs and writes a page that overlays them. Each run keeps a
    folder of its own with its recording. Two run at the same time where there are two cores. This takes a minute or two.
    """
    from vessel_hsmc_ros.studies.scenario_run import DURATION, LAWS, SCENARIO, conclusions, run_laws

    check_writable(output)
    with progress_bar(f"running {SCENARIO} with the laws {', '.join(LAWS)}", len(LAWS) * DURATION) as update:
        parent = run_laws(output, update, _end_if_failed)
    title = f"{SCENARIO}: {', '.join(LAWS)}"
    compare_runs([parent.path / law / "bag" for law in LAWS], parent.report, title, conclusions)


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
    changes: dict[str, object],
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
        refuse_without("scenarios", "workers", "interpreted")
        from vessel_hsmc_ros.bags.files import bag_path  # imports the libraries of bags

        bags = [bag_path(run) for run in recorded]  # before the folder is created: a wrong path leaves nothing behind
        compare_runs(bags, make_run_folder(output, "compare").report)
        return
    for name in scenarios:  # the law is that of each run
        load_checked(name, {"controller.law": "guided", **changes}, varied=True)
    rows = [*(Row(Path(name).stem, name) for name in scenarios), *(() if suite is None else load_suite(suite))]
    if not rows:
        raise click.UsageError("give a SCENARIO or --suite")
    rows = [replace(row, changes={**row.changes, **changes}) for row in rows]
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


def compare_runs(
    bags: Sequence[Path], page: Path, title: str = "", conclusions: Callable[[Sequence["Record"]], Sequence[str]] = lambda _: ()
) -> None:
    """Print the metrics of recorded runs and what follows from them, and write their common page."""
    with progress_bar("comparing the runs", None):
        from vessel_hsmc_ros.report.page import Options, read, write_files  # imports the libraries of reports
        from vessel_hsmc_ros.report.tables import metrics_table

        records = read(bags)
        notes = tuple(conclusions(records))
        made = write_files(records, Options(page=page, title=title, figures="png", notes=notes))
    head = ["", *(record.name for record in records)]
    print_table(head, [(row.label, *map(row.text, range(len(records)))) for row in metrics_table(records)])
    for note in notes:
        print_line(note)
    print_files(made.files)


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
        for overview in comparison.overviews(outcomes):
            print_table(overview.head, map(coloured, overview.lines), title=overview.title, text_columns=overview.texts)
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
    changes: dict[str, object],
    output: Path,
) -> None:
    """Simulate SCENARIO for each value of one parameter, or for each pair of values of two.

    VALUES are start:stop:count, equally spaced; start:stop:count:log, with equal ratios; or a list such as 0.1,0.2,0.5.
    Writes a picture, a page, and all metrics as CSV and JSON into a run folder. Runs that fail are marked.
    """
    load_checked(scenario, changes, varied=True)
    check_writable(output)
    from vessel_hsmc_ros.studies.campaign import execute, findings, report  # imports the libraries of campaigns
    from vessel_hsmc_ros.studies.campaign.plan import sweep_of
    from vessel_hsmc_ros.studies.campaign.results import of_rows

    plan = sweep_of(scenario, parameters, changes, () if laws is None else chosen(laws), metrics)
    for note in plan.notes:
        print_warning(note)
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


RUN = "run"  # the verb that is left out in `vessel-hsmc campaign FILE`


class CampaignGroup(click.Group):
    """A group whose verb `run` may be left out."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Insert the verb where the first argument is none."""
        if args and args[0] not in self.commands and args[0] not in ctx.help_option_names:
            args = [RUN, *args]
        return super().parse_args(ctx, args)


@click.group(cls=CampaignGroup)
def campaign() -> None:
    """Simulate a scenario thousands of times, with parameters drawn from distributions.

    \b
    vessel-hsmc campaign FILE.yaml      compute the runs; the same command goes on
                                        with a campaign that was interrupted
    vessel-hsmc campaign report FOLDER  a page with failures, quantiles, worst
                                        runs and the parameters that matter
    vessel-hsmc run --campaign FOLDER --run 48213
                                        repeat one run by the ROS 2 nodes

    docs/campaigns.md explains the format of FILE.
    """  # noqa: D301 - the escape keeps click from joining the lines


@campaign.command(RUN)
@click.argument("file")
@click.option("--output", type=click.Path(path_type=Path), help="Folder of the dataset [default: runs/<name of FILE>_campaign].")
@workers_option
@click.option(
    "--scheduler", default="", metavar="ADDRESS", help="Dask scheduler, such as tcp://host:8786, whose workers compute."
)
@click.option("--runs", type=click.IntRange(min=1), help="Number of draws [default: that of FILE].")
@click.option("--seed", type=click.IntRange(min=0), help="Seed of all random numbers [default: that of FILE].")
@law_file_option
def run_file(file: str, output: Path | None, workers: int | None, scheduler: str, runs: int | None, seed: int | None) -> None:
    """Compute the runs of a campaign.

    FILE is a YAML file, a campaign that comes with the package, or the folder of a campaign to go on with. The same command
    again goes on with what is missing. Every run can be repeated from FILE and its number, whoever computed it.
    """
    if workers and scheduler:
        raise click.UsageError("give --workers for this machine or --scheduler for a cluster, not both")
    from vessel_hsmc_ros.studies.campaign.execute import default_folder, run_campaign  # imports the libraries of campaigns
    from vessel_hsmc_ros.studies.campaign.plan import Campaign

    plan = Campaign.load(file, runs, seed)
    folder = output or (Path(file) if Path(file).is_dir() else default_folder(plan))
    check_writable(folder)
    for note in plan.notes:
        print_warning(note)
    with progress_bar(f"campaign {plan.name}", plan.runs, "runs") as update:
        show = with_rate(update)
        run_campaign(file, folder, workers=workers, scheduler=scheduler, runs=runs, seed=seed, on_progress=show)
    print_line(f"{plan.runs} runs: {folder}")
    print_line(f"for a page with failures and quantiles: vessel-hsmc campaign report {shlex.quote(str(folder))}")


def with_rate(update: Callable[..., None]) -> Callable[[float, float], None]:
    """A callback for the progress of runs, which shows their rate and the time left beside it."""
    first: list[tuple[float, float]] = []  # time and number of runs at the first call: a campaign may go on

    def show(done: float, total: float) -> None:
        now = time.monotonic()
        if not first:
            first.append((now, done))
        rate = (done - first[0][1]) / max(now - first[0][0], 1e-9)
        left = datetime.timedelta(seconds=round((total - done) / rate)) if rate else "unknown time"
        update(done, note=f"{rate:.3g} runs/s, {left} left")

    return show


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@file_option("Path of the page [default: report.html in FOLDER].")
def report(folder: Path, output: Path | None) -> None:
    """Make a page from the results of a campaign, complete or not.

    It shows failures with the interval of their probability, distributions and quantiles of the metrics, the laws on the same
    draws, which parameters matter, and the worst runs with the commands that repeat them. Its diagrams are saved as PNG files in
    figures/ beside the page, too.
    """
    from vessel_hsmc_ros.studies.campaign.report import make_report  # imports the libraries of campaigns

    words, files = make_report(folder, output)
    for sentence in words:
        print_line(sentence)
    print_files(files)


campaign.add_command(report)


@click.command()
@interpreted_option
@click.option("--ros", is_flag=True, help="Run the cases by ROS 2 nodes where possible: same results, but slower.")
@folder_option("Folder of the results [default: a new one in runs].")
def reproduce(ros: bool, output: Path | None) -> None:
    """Repeat every case and figure of the paper.

    Runs its law as printed (hierarchical_printed) and repaired (hierarchical), compares the paper's claims with the results of
    both, and writes figures, claims.md and results.json.

    Takes one to two minutes on two cores; with --ros, about fifteen. A claim that does not hold is a result, not an error.
    """
    from vessel_hsmc_ros.studies.paper import reproduction  # imports the libraries of figures
    from vessel_hsmc_ros.studies.paper.cases import CASES

    folder = folder_for(output, "reproduce")
    nodes = make_run_folder(folder, "nodes").path if ros else None
    with progress_bar(f"running {len(CASES)} cases", sum(map(reproduction.duration_of, CASES))) as update:
        results = reproduction.run_cases(CASES, nodes, update)
    print_status("drawing the figures ...")
    numbers = reproduction.write(results, folder)
    print_tables(numbers)
    print_line(f"figures, claims.md, results.json: {folder}")


def print_tables(results: "Results") -> None:
    """Print the paper's claims with the results; in yellow what fails for the repaired law."""
    from vessel_hsmc_ros.studies.paper import cases

    own = cases.of_law(cases.REPAIRED, results)
    rows = [(cases.claim_row(claim, results), claim.holds(own)) for claim in cases.CLAIMS]
    claims = [row if holds else tuple(f"[yellow]{cell}[/]" for cell in row) for row, holds in rows]
    print_table(["where", "the paper's claim", *cases.LAWS.values()], claims, title="Claims", text_columns=4)
    for law in cases.LAWS:
        print_line(cases.claims_that_hold(law, results))
    print_line("the measured values are in claims.md")
