"""Output of the command: lines, tables and progress bars, in a terminal or in a log file."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich import box
from rich.console import Console, JustifyMethod
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

PLAIN: Any = {"markup": False, "highlight": False, "soft_wrap": True}
"""Options of `Console.print` for text that may contain paths, brackets and numbers: printed as it is, never wrapped."""


def print_line(text: str) -> None:
    """Print a line of results to standard output."""
    Console().print(text, **PLAIN)


def print_status(text: str) -> None:
    """Print a line about the progress of the command to standard error."""
    Console(stderr=True).print(text, **PLAIN)


def print_warning(text: str) -> None:
    """Print a warning to standard error, in yellow where the terminal has colours."""
    Console(stderr=True).print(f"warning: {text}", style="yellow", **PLAIN)


def print_error(text: str) -> None:
    """Print an error message to standard error, in red where the terminal has colours."""
    Console(stderr=True).print(f"error: {text}", style="red", **PLAIN)


def print_table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    title: str = "",
    text_columns: int = 1,
    console: Console | None = None,
) -> None:
    """Print a table: columns of text on the left, columns of numbers on the right.

    In a narrow terminal the text is wrapped and the numbers stay in one piece.

    Args:
        head: Names of the columns; no header is printed if all are empty. A name is broken at its spaces.
        rows: The cells of each row, which may contain Rich markup such as `[red]miss[/]`.
        title: Printed above the table.
        text_columns: How many of the columns hold text.
        console: Where to print; standard output by default.
    """
    table = Table(
        title=title or None,
        title_justify="left",
        show_header=any(head),
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for index, name in enumerate(head):
        is_text = index < text_columns
        justify: JustifyMethod = "left" if is_text else "right"
        table.add_column(name.replace(" ", "\n"), justify=justify, no_wrap=not is_text, overflow="fold")
    for row in rows:
        table.add_row(*row)
    (console or Console()).print(table)


@contextmanager
def progress_bar(title: str, total: float | None, unit: str = "s") -> Iterator[Callable[..., None]]:
    """Show a progress bar on standard error; where that is no terminal, print lines instead.

    Args:
        title: What is in progress.
        total: The amount at which it is complete; None for an open end.
        unit: Unit of the amounts.

    Yields:
        `update(completed, line="")`: move the bar to the completed amount; without a terminal, print the line if there is one.
    """
    # On standard error, so that the standard output contains results only.
    console = Console(stderr=True)
    if not console.is_terminal:
        console.print(title + (f", {total:g} {unit}" if total else ""), **PLAIN)
    amount = "{task.completed:.0f} of {task.total:.0f} " if total else "{task.completed:.0f} "
    columns = (TextColumn(title, markup=False), BarColumn(), TextColumn(amount + unit), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(title, total=total or None)

        def update(completed: float, line: str = "") -> None:
            progress.update(task, completed=completed)
            if line and not console.is_terminal:
                console.print(line, **PLAIN)

        yield update
