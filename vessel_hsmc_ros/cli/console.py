"""Output of the command: lines, tables, progress bars and the result of a run, in a terminal or in a log file.

The library that prints is imported where it prints: it takes longer than the help text of the command.
"""

from __future__ import annotations

import shlex
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from vessel_hsmc_ros.cli.interrupts import INTERRUPTED, INTERRUPTED_LINE
from vessel_hsmc_ros.core.exceptions import BagError, ScenarioError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from rich.console import Console, JustifyMethod

    from vessel_hsmc_ros.studies.scenario_run import Result

PLAIN: Any = {"markup": False, "highlight": False, "soft_wrap": True}
"""Options of `Console.print` for text that may contain paths, brackets and numbers: printed as it is, never wrapped."""

LINE_PERIODS = 1.0, 4.0  # shortest and longest time between two lines of progress where there is no progress bar, s


def print_line(text: str, style: str = "", stderr: bool = False) -> None:
    """Print a line of results to standard output, or a line to standard error."""
    from rich.console import Console

    Console(stderr=stderr).print(text, style=style, **PLAIN)


def print_status(text: str) -> None:
    """Print a line about the progress of the command to standard error."""
    print_line(text, stderr=True)


def print_warning(text: str) -> None:
    """Print a warning to standard error, in yellow where the terminal has colours."""
    print_line(f"warning: {text}", "yellow", stderr=True)


def print_error(text: str) -> None:
    """Print an error message to standard error, in red where the terminal has colours."""
    print_line(f"error: {text}", "red", stderr=True)


def print_table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    title: str = "",
    text_columns: int = 1,
    console: Console | None = None,
) -> None:
    """Print a table: columns of text on the left, columns of numbers on the right.

    In a narrow terminal the text is wrapped, and columns of numbers that do not fit follow in a further table. `head`: names of
    the columns; no header is printed if all are empty. A name is broken at its spaces. `rows`: the cells of each row, which may
    contain Rich markup such as `[red]miss[/]`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = console or Console()
    lines: list[Sequence[str]] = [[name.replace(" ", "\n") for name in head], *rows]
    for columns in _fitting(lines, text_columns, console):
        table = Table(
            title=title or None,
            title_justify="left",
            show_header=any(head),
            box=box.SIMPLE_HEAD,
            pad_edge=False,
            padding=(0, 1, 0, 0),
        )
        for column in columns:
            is_text = column < text_columns
            justify: JustifyMethod = "left" if is_text else "right"
            cells = [row[column] for row in lines]
            is_name = not any(" " in cell for cell in cells) and max(map(len, cells)) <= console.width // 3
            table.add_column(lines[0][column], justify=justify, no_wrap=is_name or not is_text, overflow="fold")
        for row in lines[1:]:
            table.add_row(*(row[column] for column in columns))
        console.print(table)


def _fitting(lines: Sequence[Sequence[str]], text_columns: int, console: Console) -> list[list[int]]:
    """Distribute the columns of numbers over as few tables as the width requires; each table begins with the columns of text."""
    measured = [[console.measure(cell) for cell in column] for column in zip(*lines, strict=True)]
    texts = list(range(min(text_columns, len(measured))))
    # Text can be wrapped down to its longest word; a number cannot. Two spaces separate columns, one is at either edge.
    used = least = 1 + sum(2 + max(cell.minimum for cell in measured[index]) for index in texts)
    tables = [texts]
    for index in range(len(texts), len(measured)):
        size = 2 + max(cell.maximum for cell in measured[index])
        if used + size > console.width and len(tables[-1]) > len(texts):
            tables.append(texts)
            used = least
        tables[-1] = [*tables[-1], index]
        used += size
    return tables


@contextmanager
def progress_bar(title: str, total: float | None, unit: str = "s") -> Iterator[Callable[..., None]]:
    """Show a progress bar on standard error; where that is no terminal, or one without cursor control, print lines instead.

    `total`: the amount at which it is complete; None for an open end.

    Yields:
        `update(completed, line="", note="")`: move the bar to the completed amount, with a note beside it; instead of a bar,
        print the line if there is one, else how far it is and the note at each tenth of the total, and every four seconds.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    # On standard error, so that the standard output contains results only.
    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        yield _progress_lines(console, title, total, unit)
        return
    amount = "{task.completed:.0f} of {task.total:.0f} " if total else "{task.completed:.0f} "
    note = TextColumn("{task.fields[note]}", markup=False)
    columns = (TextColumn(title, markup=False), BarColumn(), TextColumn(amount + unit), note, TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(title, total=total or None, note="")
        yield lambda completed, _line="", note="": progress.update(task, completed=completed, note=note)


def _progress_lines(console: Console, title: str, total: float | None, unit: str) -> Callable[..., None]:
    """Print the title of a progress bar, and lines of its progress."""
    console.print(title + (f", {total:g} {unit}" if total and unit != "%" else ""), **PLAIN)
    shortest, longest = LINE_PERIODS
    printed, tenths = time.monotonic(), 0

    def update(completed: float, line: str = "", note: str = "") -> None:
        nonlocal tenths, printed
        now = time.monotonic()
        reached = int(10.0 * completed / total) if total else 0
        if line or (now > printed + (shortest if reached > tenths else longest) and completed != total):
            amount = f"{100.0 * completed / total:.0f} %" if total else f"{completed:.0f} {unit}"
            console.print(line or f"{title}: {', '.join(filter(None, (amount, note)))}", **PLAIN)
            tenths, printed = reached, now

    return update


def print_files(files: Mapping[str, Path]) -> None:
    """Print the files that a verb has written, by what they are."""
    for kind, path in files.items():
        print_line(f"{kind}: {path}")


def write_new(path: Path, text: str) -> None:
    """Write a new file. Raises ScenarioError if it exists, or cannot be written."""
    made = False
    try:
        with path.open("x", encoding="utf-8") as file:
            made = True
            file.write(text)
    except FileExistsError:
        raise ScenarioError(f"{path} exists and is not overwritten: choose another name, or delete it") from None
    except OSError as error:
        if made:
            path.unlink()  # a part of a scenario may be read as a whole one
        raise ScenarioError(f"{path} cannot be written: {error.strerror}") from None


def print_result(result: Result) -> None:
    """Print the metrics of a run, how it failed if it did, and the paths of its files."""
    if result.metrics is not None:
        from vessel_hsmc_ros.report import rows  # imports the report's libraries

        print_metrics([("", rows(result.metrics, result.facts))])
    if result.failure and result.folder.bag.exists():
        print_line(_what_remains(result.folder.bag))
    print_failure(result)
    print_line(f"run folder: {result.folder.path}")


def print_failure(result: Result) -> None:
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
