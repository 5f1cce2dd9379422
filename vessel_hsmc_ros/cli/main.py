"""The command `vessel-hsmc`."""

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from vessel_hsmc_ros.cli.compare import compare
from vessel_hsmc_ros.cli.options import parse_changes, set_option
from vessel_hsmc_ros.cli.recover import recover
from vessel_hsmc_ros.cli.replay import replay
from vessel_hsmc_ros.cli.reproduce import reproduce
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError, VesselHsmcError
from vessel_hsmc_ros.core.version import __version__
from vessel_hsmc_ros.runs import scenario_run
from vessel_hsmc_ros.scenario.parameter_page import parameter_page
from vessel_hsmc_ros.scenario.run_folder import make_run_folder
from vessel_hsmc_ros.scenario.scenario import Scenario, for_nodes, load_scenario

console = Console(stderr=True)

NAMESPACE = re.compile(r"([A-Za-z_]\w*(/[A-Za-z_]\w*)*)?", re.ASCII)
PLAIN: Any = {"markup": False, "highlight": False, "soft_wrap": True}

scenario_argument = click.argument("scenario")
output_option = click.option(
    "--output", type=click.Path(path_type=Path), default=Path("runs"), show_default=True, help="Folder of the run folders."
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def cli() -> None:
    """Hierarchical sliding-mode control of underactuated ships: run it, record it, explain it."""


for verb in (compare, recover, replay, reproduce):
    cli.add_command(verb)


@cli.command()
@scenario_argument
@set_option
@output_option
@click.option("--real-time", is_flag=True, help="At the pace of the clock instead of as fast as possible.")
@click.option("--namespace", default="", help="ROS namespace of the vessel.")
@click.option("--live", is_flag=True, help="Let Foxglove watch, without a ROS install on its side.")
@click.option("--live-port", type=click.IntRange(1, 65535), default=8765, show_default=True, help="Where.")
def run(
    scenario: str, changes: tuple[str, ...], output: Path, real_time: bool, namespace: str, live: bool, live_port: int
) -> None:
    """Run SCENARIO with real nodes over ROS 2 and record it.

    SCENARIO is one that comes with the package, such as case2_tracking, or a ROS parameters file.
    """
    namespace = namespace.strip("/")
    loaded = load_scenario(scenario, for_nodes(True, real_time, namespace) | parse_changes(changes))
    if not NAMESPACE.fullmatch(namespace):
        raise ParameterError(f"namespace {namespace} is not allowed: it takes names of letters, digits and _, parted by /")
    if live:
        scenario_run.check_live_port(live_port)
        console.print(f"live view: ws://localhost:{live_port}, layout config/live/foxglove.json", **PLAIN)
    with scenario_run.place_for_nodes(namespace):
        folder = make_run_folder(output, loaded.name)
        with progress_bar("running", loaded) as progress:
            result = scenario_run.run_nodes(loaded, folder, namespace, progress, live_port if live else None)
    present(result)
    sys.exit(result.exit_code)


@cli.command()
@scenario_argument
@set_option
@output_option
def simulate(scenario: str, changes: tuple[str, ...], output: Path) -> None:
    """Run SCENARIO in this process, without ROS: the same numbers to the last bit."""
    loaded = load_scenario(scenario, parse_changes(changes))
    with progress_bar("simulating", loaded) as progress:
        result = scenario_run.run_offline(loaded, output, progress)
    present(result)


@cli.command("report")
@click.argument("bags", nargs=-1, required=True, metavar="BAG...", type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(path_type=Path, dir_okay=False), help="The page; else report.html beside the bag.")
@click.option("--title", help="Title of the page.")
@click.option("--namespace", help="The vessel's ROS namespace, where a bag holds several.")
@click.option("--figures", type=click.Choice(["png", "svg"]), help="The diagrams as files too, in figures/ beside the page.")
@click.option("--csv", is_flag=True, help="All signals as CSV too, in csv/ beside the page.")
@click.option("--parquet", is_flag=True, help="The same as Parquet, if pyarrow is installed.")
@click.option("--hull-length", type=float, default=32.0, show_default=True, help="Length of the ship that is drawn, m.")
@click.option("--hull-beam", type=float, default=8.0, show_default=True, help="Its beam, m.")
def report_command(bags: tuple[Path, ...], hull_length: float, hull_beam: float, output: Path | None, **options: Any) -> None:
    """One page of one or several recorded runs, that needs nothing but itself.

    It shows the ship on its track beside its reference, linked diagrams of all signals, key figures, parameters and versions.
    Several bags lie over each other, with a table of differences from the first.
    """
    from vessel_hsmc_ros.report import Hull, rows  # what a report needs takes a while to load
    from vessel_hsmc_ros.report.making import Wanted, make

    hull = schema.build(Hull, {"length": hull_length, "beam": hull_beam}, "hull")
    made = make(bags, Wanted(page=output, hull=hull, **options))
    print_table([(record.name, rows(record.metrics, record.facts)) for record in made.records])
    for what, path in made.files.items():
        Console().print(f"{what}: {path}", **PLAIN)


@cli.command("parameters")
def parameters_command() -> None:
    """Every parameter of every node, as a Markdown page."""
    click.echo(parameter_page(), nl=False)


@contextmanager
def progress_bar(what: str, scenario: Scenario) -> Iterator[Callable[[float], None]]:
    """A bar of simulated time; where nobody looks at a terminal, a line that says what goes on."""
    duration = scenario.vessel_sim.duration
    if not console.is_terminal:
        console.print(f"{what} {scenario.name}" + (f", {duration:g} s" if duration else ""), **PLAIN)
    columns = (
        TextColumn(f"{what} {scenario.name}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} s" if duration else "{task.completed:.0f} s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(what, total=duration or None)
        yield lambda time: progress.update(task, completed=time)


def present(result: scenario_run.Result) -> None:
    """Print a run's table and where everything is."""
    out = Console()
    if result.metrics is not None:
        from vessel_hsmc_ros.report import rows

        print_table([("", rows(result.metrics, result.facts))])
    if result.failure and result.folder.bag.exists():
        out.print(f"the bag is complete; for a table and figures: vessel-hsmc report {result.folder.bag}", **PLAIN)
    if result.failure:
        console.print(f"error: {result.failure}", style="red", **PLAIN)
    out.print(f"run folder: {result.folder.path}", **PLAIN)


def print_table(columns: Sequence[tuple[str, Sequence[tuple[str, str]]]]) -> None:
    """Key figures, a column for each run."""
    table = Table(show_header=len(columns) > 1)
    table.add_column()
    for name, _ in columns:
        table.add_column(name, justify="right")
    values = [dict(found) for _, found in columns]
    for label in dict.fromkeys(label for column in values for label in column):
        table.add_row(label, *(column.get(label, "") for column in values))
    Console().print(table)


def main() -> int:
    """Entry point: every error of this package becomes one line; wrong use exits with 2, a failed run with 1."""
    try:
        cli(standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except click.Abort:
        return 130
    except VesselHsmcError as error:
        console.print(f"error: {error}", style="red", **PLAIN)
        return 2 if isinstance(error, ParameterError | ScenarioError) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
