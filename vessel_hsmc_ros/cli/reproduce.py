"""`vessel-hsmc reproduce`: every case and figure of the paper, and its claims compared with the results."""

from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import print_line, print_status, print_table, progress_bar
from vessel_hsmc_ros.cli.options import interpreted_option
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder
from vessel_hsmc_ros.studies.paper import reproduction
from vessel_hsmc_ros.studies.paper.cases import CASES, LAWS, REPAIRED, of_law
from vessel_hsmc_ros.studies.paper.claims import CLAIMS, FINDINGS, Results, claim_row, claims_that_hold, finding_row
from vessel_hsmc_ros.studies.paper.reproduction import duration_of


@click.command()
@interpreted_option
@click.option("--ros", is_flag=True, help="Run the cases by ROS 2 nodes where possible: same results, but slower.")
@click.option(
    "--output", type=click.Path(path_type=Path, file_okay=False), help="Folder of the results [default: a new one in runs]."
)
def reproduce(ros: bool, output: Path | None) -> None:
    """Repeat every case and figure of the paper.

    Runs its law as printed (hierarchical_printed) and repaired (hierarchical), compares the paper's claims with the results of
    both, and writes figures, claims.md and results.json.

    Takes one to two minutes on two cores; with --ros, about fifteen. A claim that does not hold is a result, not an error.
    """
    folder = output or make_run_folder(Path("runs"), "reproduce").path
    check_writable(folder)
    nodes = make_run_folder(folder, "nodes").path if ros else None
    with progress_bar(f"running {len(CASES)} cases", sum(map(duration_of, CASES))) as update:
        results = reproduction.run_cases(CASES, nodes, update)
    print_status("drawing the figures ...")
    numbers = reproduction.write(results, folder)
    print_tables(numbers)
    print_line(f"figures, claims.md, results.json: {folder}")


def print_tables(results: Results) -> None:
    """Print the paper's claims and the prototype's findings with the results; in yellow what fails for the repaired law."""
    own = of_law(REPAIRED, results)
    claims = [highlighted(claim_row(claim, results), claim.holds(own)) for claim in CLAIMS]
    print_table(["where", "the paper's claim", *LAWS.values()], claims, title="Claims", text_columns=4)
    findings = [highlighted(finding_row(finding, results)[:4], finding.agrees(results)) for finding in FINDINGS]
    print_table(["what", "prototype", "here", "ratio"], findings, title="Results of an independent prototype, and ours")
    for law in LAWS:
        print_line(claims_that_hold(law, results))
    print_line("the measured values are in claims.md")


def highlighted(row: tuple[str, ...], agrees: bool) -> tuple[str, ...]:
    """The cells of a row for the terminal, in yellow unless it agrees."""
    cells = tuple(cell.strip("*") for cell in row)
    return cells if agrees else tuple(f"[yellow]{cell}[/]" for cell in cells)
