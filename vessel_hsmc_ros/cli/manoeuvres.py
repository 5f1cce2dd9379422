"""`vessel-hsmc manoeuvres`: the standard manoeuvres of ships, with a page for each."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vessel_hsmc_ros.cli.console import print_line, print_table, progress_bar
from vessel_hsmc_ros.cli.options import interpreted_option, output_option, parse_changes, set_option
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder
from vessel_hsmc_ros.scenario.vessels import vessel_names
from vessel_hsmc_ros.studies.manoeuvres.run import PLANS

if TYPE_CHECKING:
    from vessel_hsmc_ros.studies.manoeuvres.run import Results


@click.command()
@click.argument("ships", nargs=-1, metavar="[VESSEL|SCENARIO]...")
@click.option(
    "--only",
    "kinds",
    multiple=True,
    type=click.Choice(tuple(PLANS)),
    metavar="MANOEUVRE",
    help=f"One of {', '.join(PLANS)}; may be given several times.",
)
@click.option("--markdown", is_flag=True, help="Print the table of all ships in Markdown, and write no files.")
@set_option
@interpreted_option
@output_option
def manoeuvres(ships: Sequence[str], kinds: Sequence[str], markdown: bool, changes: Sequence[str], output: Path) -> None:
    """Simulate the standard manoeuvres of a ship: turning circle, zig-zags, spiral, crash stop, speed runs, bollard pull.

    The ship is a VESSEL of the library, a vessel file, or the ship of a SCENARIO, whose other parameters are not used. Without an
    argument all vessels of the library are simulated. The water is calm. The run folder receives a page with tracks and metrics,
    the metrics as CSV, and a scenario for each manoeuvre, which `vessel-hsmc run` takes.
    """
    from vessel_hsmc_ros.studies.manoeuvres.page import TITLES, overview
    from vessel_hsmc_ros.studies.manoeuvres.run import (
        run,  # imports the libraries of reports
        ship_named,
    )

    named = list(ships or vessel_names())
    scaled = [ship_named(name, parse_changes(changes)) for name in named]
    if not markdown:
        check_writable(output)
    wanted = list(kinds or PLANS)
    found = []
    with progress_bar("manoeuvres", len(scaled) * len(wanted), "manoeuvres") as update:
        for k, ship in enumerate(scaled):

            def show(name: str, number: int, _total: int, done: int = k * len(wanted), of: str = ship.name) -> None:
                update(done + number, f"{of}: {TITLES[name]} ...")

            found.append(run(ship, wanted, show))
    if markdown:
        head, lines = overview(found)
        for line in (head, ["---"] * len(head), *lines):
            print_line(f"| {' | '.join(line)} |")
        return
    if len(found) > 1:
        print_table(*overview(found))
    for name, results in zip(named, found, strict=True):
        if len(found) == 1:
            print_results(results)
        _write(name, results, output)


def print_results(results: "Results") -> None:
    """Print the metrics of a ship, a table for each manoeuvre, with what one must know to judge them."""
    from vessel_hsmc_ros.studies.manoeuvres.page import APPLIES, SOURCE, TITLES, notes, rows

    for name, done in results.manoeuvres.items():
        lines = [[row.label, row.value, row.lengths, row.limit, row.verdict] for row in rows(results) if row.manoeuvre == name]
        print_table(["metric", "value", "lengths", "criterion", ""], lines, title=TITLES[name])
        for note in notes(done):
            print_line(note)
    print_line(f"Criteria: {SOURCE}; {APPLIES}.")


def _write(name: str, results: "Results", output: Path) -> None:
    from vessel_hsmc_ros.studies.manoeuvres import page  # imports the libraries of reports

    for kind, path in page.write(make_run_folder(output, f"{Path(name).stem}_manoeuvres").path, results).items():
        print_line(f"{kind}: {path}")
