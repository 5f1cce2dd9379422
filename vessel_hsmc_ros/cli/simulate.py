"""`vessel-hsmc simulate`: a scenario in this process, without ROS."""

from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import progress_bar
from vessel_hsmc_ros.cli.options import output_option, parse_changes, scenario_argument, set_option
from vessel_hsmc_ros.cli.results import print_result
from vessel_hsmc_ros.runs import scenario_run
from vessel_hsmc_ros.scenario.run_folder import check_writable
from vessel_hsmc_ros.scenario.scenario import load_scenario


@click.command()
@scenario_argument
@set_option
@output_option
def simulate(scenario: str, changes: tuple[str, ...], output: Path) -> None:
    """Simulate a scenario quickly, without ROS.

    The results are bit-identical to those of `run`. SCENARIO is one that comes with the package, such as case2_tracking, or the
    path of a YAML file.
    """
    loaded = load_scenario(scenario, parse_changes(changes))
    check_writable(output)
    with progress_bar(f"simulating {loaded.name}", loaded.vessel_sim.duration) as update:
        result = scenario_run.run_offline(loaded, output, update)
    print_result(result)
