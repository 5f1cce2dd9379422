"""`vessel-hsmc compare`: all laws over all given scenarios, or over a suite with limits."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
from rich import box
from rich.console import Console, JustifyMethod
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from vessel_hsmc_ros.cli.options import parse_changes, set_option
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.laws import LAWS
from vessel_hsmc_ros.runs import comparison_page
from vessel_hsmc_ros.runs.comparison import Outcome, Task, default_laws
from vessel_hsmc_ros.runs.comparison import compare as compare_laws
from vessel_hsmc_ros.scenario.run_folder import make_run_folder
from vessel_hsmc_ros.scenario.suite import Row, load_suite

PLAIN: Any = {"markup": False, "highlight": False, "soft_wrap": True}


@click.command()
@click.argument("scenarios", nargs=-1, metavar="SCENARIO...")
@click.option("--suite", help="The rows of a suite with limits, such as guided, or a YAML file.")
@click.option("--laws", help="Laws, parted by commas [default: all that follow a position].")
@click.option("--rate", "rate_hz", type=float, help="The laws' rate in Hz [default: the scenario's].")
@click.option("--jobs", type=click.IntRange(min=1), help="Runs at a time [default: one a core].")
@set_option
@click.option(
    "--output", type=click.Path(path_type=Path), default=Path("runs"), show_default=True, help="Folder of the run folders."
)
def compare(
    scenarios: Sequence[str],
    suite: str | None,
    laws: str | None,
    rate_hz: float | None,
    jobs: int | None,
    changes: Sequence[str],
    output: Path,
) -> None:
    """Run all laws over each SCENARIO offline, and put their figures side by side.

    Writes compare.md, compare.json and a figure for each case into a run folder.
    """
    rows = [*(Row(Path(name).stem, name) for name in scenarios), *(load_suite(suite) if suite else ())]
    if not rows:
        raise click.UsageError("give a SCENARIO or --suite")
    rows = [replace(row, changes={**row.changes, **parse_changes(changes)}) for row in rows]
    tasks = [Task(row, law, rate_hz) for row in rows for law in chosen(laws)]
    with progress_bar(len(tasks)) as progress:
        outcomes = compare_laws(tasks, jobs, progress)
    present(outcomes)
    folder = make_run_folder(output, "compare").path
    comparison_page.write(folder, outcomes)
    Console().print(f"tables and figures: {folder}", **PLAIN)


def chosen(laws: str | None) -> list[str]:
    """The laws of `--laws`.

    Raises:
        ParameterError: there is no such law.
    """
    if laws is None:
        return default_laws()
    names = [name.strip() for name in laws.split(",") if name.strip()]
    for name in names:
        if name not in LAWS:
            raise ParameterError(f"--laws {name} is not allowed: it takes any of {', '.join(LAWS)}")
    return names


@contextmanager
def progress_bar(total: int) -> Iterator[Any]:
    """A bar of the runs done; where nobody looks at a terminal, a line for each."""
    console = Console(stderr=True)
    done = 0
    columns = (TextColumn("comparing"), BarColumn(), TextColumn("{task.completed} of {task.total} runs"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        bar = progress.add_task("comparing", total=total)

        def tell(outcome: Outcome) -> None:
            nonlocal done
            done += 1
            progress.update(bar, completed=done)
            if not console.is_terminal:
                console.print(f"{done} of {total}: {outcome.law} on {outcome.row.name}", **PLAIN)

        yield tell


def present(outcomes: Sequence[Outcome]) -> None:
    """The table of each case where there are few; of all cases where there are many; then the notes."""
    out = Console()
    rows = comparison_page.by_row(outcomes)
    if len(rows) <= 3:
        for row, of_row in rows:
            print_table(out, row.name, *comparison_page.table(row, of_row), 1)
    else:
        print_table(out, "rms position error", *comparison_page.overview(outcomes), 3)
    for note in comparison_page.notes(outcomes):
        out.print(note, **PLAIN)


def print_table(out: Console, title: str, head: Sequence[str], lines: Sequence[Sequence[str]], words: int) -> None:
    """A table whose first columns are words and the others numbers; hits and misses in colour."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for i, name in enumerate(head):
        justify: JustifyMethod = "left" if i < words else "right"
        table.add_column(name.replace(" ", "\n"), justify=justify, no_wrap=i >= words, overflow="fold")  # words give way
    for line in lines:
        table.add_row(*(f"[red]{c}[/]" if c.endswith("miss") else f"[green]{c}[/]" if c.endswith("hit") else c for c in line))
    out.print(table)
