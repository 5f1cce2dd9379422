"""`vessel-hsmc reproduce`: every case and figure of the paper, and what became of its claims."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from vessel_hsmc_ros.paper import reproduction
from vessel_hsmc_ros.paper.cases import CASES
from vessel_hsmc_ros.paper.checks import Results
from vessel_hsmc_ros.paper.claims_proof import CLAIMS
from vessel_hsmc_ros.paper.errata import FINDINGS
from vessel_hsmc_ros.paper.parallel import durations
from vessel_hsmc_ros.paper.tables import claim_row, finding_row
from vessel_hsmc_ros.scenario.run_folder import make_run_folder


@click.command()
@click.option("--ros", is_flag=True, help="Through the real nodes, wherever nodes can run it: the same numbers, but slower.")
@click.option(
    "--output", type=click.Path(path_type=Path, file_okay=False), help="Folder of the results [default: a new one in runs]."
)
def reproduce(ros: bool, output: Path | None) -> None:
    """Run every case of the paper, draw its figures, judge its claims.

    Some three minutes on two cores; with --ros, ten. A claim that does not hold is a finding, no failure.
    """
    folder = output or make_run_folder(Path("runs"), "reproduce").path
    nodes = make_run_folder(folder, "nodes").path if ros else None
    with progress_bar(sum(durations(CASES))) as watch:
        outcomes = reproduction.run_cases(CASES, nodes, watch)
    Console(stderr=True).print("drawing the figures ...", highlight=False)
    results = reproduction.write(outcomes, folder)
    present(results)
    click.echo(f"figures, claims.md, results.json: {folder}")


@contextmanager
def progress_bar(total: float) -> Iterator[Callable[[float], None]]:
    """A bar of the simulated time of all cases; where nobody looks at a terminal, a line that says what goes on."""
    console = Console(stderr=True)
    if not console.is_terminal:
        console.print(f"running {len(CASES)} cases, {total:g} s", highlight=False)
    columns = (
        TextColumn(f"running {len(CASES)} cases"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("running", total=total)
        yield lambda time: progress.update(task, completed=time)


def present(results: Results) -> None:
    """Print both tables."""
    console = Console()
    claims = Table("where", "the paper's claim", "holds", title="Claims")
    for claim in CLAIMS:
        place, words, holds = claim_row(claim, results)
        claims.add_row(place, words, holds.strip("*"), style="" if claim.holds(results) else "yellow")
    console.print(claims)
    findings = Table("what", "prototype", "here", "ratio", title="Figures of an independent prototype, and ours")
    for finding in FINDINGS:
        findings.add_row(*finding_row(finding, results)[:4], style="" if finding.alike(results) else "yellow")
    console.print(findings)
    holding = sum(claim.holds(results) for claim in CLAIMS)
    console.print(f"{holding} of {len(CLAIMS)} claims hold; what was measured is in claims.md", highlight=False)
