"""`vessel-hsmc simulate`: a scenario in this process, without ROS."""

import sys
from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import print_result, print_warning, progress_bar
from vessel_hsmc_ros.cli.options import (
    campaign_row_options,
    compare_with_row,
    interpreted_option,
    law_file_option,
    load_checked,
    no_page_option,
    of_row,
    optional_scenario_argument,
    output_option,
    set_option,
)
from vessel_hsmc_ros.scenario.run_folder import check_writable
from vessel_hsmc_ros.scenario.warnings import check_goals
from vessel_hsmc_ros.studies import scenario_run


@click.command()
@optional_scenario_argument
@campaign_row_options
@set_option
@interpreted_option
@law_file_option
@output_option
@no_page_option
@click.option("--no-bag", is_flag=True, help="Write no bag, which a page and a replay would need later.")
def simulate(
    scenario: str | None,
    campaign: Path | None,
    row: int | None,
    changes: dict[str, object],
    output: Path,
    no_page: bool,
    no_bag: bool,
) -> None:
    """Simulate a scenario quickly, without ROS.

    The results are bit-identical to those of `run`, and so are the messages of the bag in the run folder. SCENARIO is one that
    comes with the package, such as case2_tracking, or the path of a YAML file. With --campaign and --run instead of SCENARIO the
    command repeats one run of a campaign and compares the metrics.
    """
    chosen = of_row(scenario, campaign, row, bool(changes))
    loaded = chosen.scenario() if chosen else load_checked(scenario or "", changes)
    for line in check_goals(loaded):
        print_warning(line)
    check_writable(output)
    with progress_bar(f"simulating {loaded.name}", loaded.vessel_sim.duration) as update:
        result = scenario_run.run_offline(loaded, output, update, with_bag=not no_bag, with_page=not no_page)
    print_result(result)
    sys.exit(compare_with_row(chosen, result) if chosen else result.exit_code)
