"""`vessel-hsmc demo`: the paper's case 2 under two control laws, over real nodes, in one page and one table."""

import sys
import time
from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import print_line, print_status, print_table, progress_bar
from vessel_hsmc_ros.cli.options import output_option
from vessel_hsmc_ros.cli.results import print_result
from vessel_hsmc_ros.runs import scenario_run
from vessel_hsmc_ros.scenario.run_folder import RunFolder, check_writable, make_run_folder
from vessel_hsmc_ros.scenario.scenario import for_nodes, load_scenario


@click.command()
@output_option
def demo(output: Path) -> None:
    """Show two control laws on one example, side by side.

    A ship follows a circle under a disturbance (case 2 of the paper), once with the paper's law and once with the guided law.
    The command prints a table of both runs and writes a page that overlays them. Each run keeps a folder of its own with its
    recording. This takes a minute or two.
    """
    from vessel_hsmc_ros.report.tables import metrics_table  # imports the report's libraries
    from vessel_hsmc_ros.runs.demonstration import DURATION, LAWS, SCENARIO, compare_bags

    check_writable(output)
    with scenario_run.free_domain() as domain:
        if domain != "0":
            print_status(f"in ROS domain {domain}")
        parent = make_run_folder(output, "demo")
        folders = [RunFolder(parent.path / law) for law in LAWS]
        for law, folder in zip(LAWS, folders, strict=True):
            _run(SCENARIO, DURATION, law, folder)
    print_status("comparing both runs")  # outside of the lock: another run may start meanwhile
    found = compare_bags([folder.bag for folder in folders], parent.report)
    head = ["", *(record.name for record in found.records), "difference"]
    rows = [(row.label, row.text(0), row.text(1), row.difference(1)) for row in metrics_table(found.records)]
    print_table(head, rows)
    for note in found.conclusions:
        print_line(note)
    for kind, path in found.files.items():
        print_line(f"{kind}: {path}")


def _run(name: str, duration: float, law: str, folder: RunFolder) -> None:
    """Run a scenario with a law into a folder; end the command if that fails."""
    settings = {"controller.law": law, "vessel_sim.duration": duration}
    scenario = load_scenario(name, {**for_nodes(recorded=True, real_time=False), **settings})
    folder.path.mkdir()
    with progress_bar(f"running {name} with law {law}", scenario.vessel_sim.duration) as update:
        result = scenario_run.run_nodes(scenario, folder, "", update, requested_at=time.time())
    if result.exit_code:
        print_result(result)
        sys.exit(result.exit_code)
