"""`vessel-hsmc manoeuvres`: the standard manoeuvres of a ship, and a page."""

from collections.abc import Sequence
from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import print_line, print_table, progress_bar
from vessel_hsmc_ros.cli.options import interpreted_option, output_option, parse_changes, set_option
from vessel_hsmc_ros.manoeuvres.criteria import APPLIES, SOURCE
from vessel_hsmc_ros.manoeuvres.plan import PLANS
from vessel_hsmc_ros.manoeuvres.run import run
from vessel_hsmc_ros.manoeuvres.ship import ship_named
from vessel_hsmc_ros.manoeuvres.tables import TITLES, notes, rows
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder


@click.command()
@click.argument("ship", metavar="VESSEL|SCENARIO")
@click.option("--only", "kinds", multiple=True, type=click.Choice(tuple(PLANS)), help="A manoeuvre; may be given several times.")
@set_option
@interpreted_option
@output_option
def manoeuvres(ship: str, kinds: Sequence[str], changes: Sequence[str], output: Path) -> None:
    """Simulate the standard manoeuvres of a ship: turning circle, zig-zags, spiral, crash stop, speed runs, bollard pull.

    The ship is a VESSEL of the library, a vessel file, or that of a SCENARIO, of which nothing else is taken. It sails in still
    water. Writes a page with tracks and metrics, the metrics as CSV, and a scenario for each manoeuvre, which
    `vessel-hsmc run` takes, into a run folder.
    """
    scaled = ship_named(ship, parse_changes(changes))
    check_writable(output)
    with progress_bar(f"manoeuvres of {scaled.name}", len(kinds or PLANS), "manoeuvres") as update:
        results = run(scaled, kinds or PLANS, lambda name, number, _total: update(number, f"{TITLES[name]} ..."))
    from vessel_hsmc_ros.manoeuvres import page  # imports the libraries of reports

    for name, done in results.manoeuvres.items():
        lines = [[row.label, row.value, row.lengths, row.limit, row.verdict] for row in rows(results) if row.manoeuvre == name]
        print_table(["metric", "value", "lengths", "criterion", ""], lines, title=TITLES[name])
        for note in notes(done):
            print_line(note)
    print_line(f"Criteria: {SOURCE}; {APPLIES}.")
    for kind, path in page.write(make_run_folder(output, f"{Path(ship).stem}_manoeuvres").path, results).items():
        print_line(f"{kind}: {path}")
