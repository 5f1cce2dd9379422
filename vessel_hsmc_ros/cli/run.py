"""`vessel-hsmc run`: a scenario by the real nodes over ROS 2, recorded."""

import sys
from pathlib import Path

import click

from vessel_hsmc_ros.cli.campaign_row import campaign_row_options, compare_with_row, of_row
from vessel_hsmc_ros.cli.console import print_status, progress_bar
from vessel_hsmc_ros.cli.fleet import fleet_options, run_vessels
from vessel_hsmc_ros.cli.options import (
    checked_namespace,
    law_file_option,
    live_options,
    load_checked,
    optional_scenario_argument,
    output_option,
    parse_changes,
    set_option,
    vessel_option,
)
from vessel_hsmc_ros.cli.results import print_result
from vessel_hsmc_ros.runs import scenario_run
from vessel_hsmc_ros.scenario.faults import check_script, load_script
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder
from vessel_hsmc_ros.scenario.scenario import for_nodes


@click.command()
@optional_scenario_argument
@campaign_row_options
@set_option
@law_file_option
@output_option
@click.option("--real-time", is_flag=True, help="Run in real time instead of in lockstep, as fast as possible.")
@vessel_option
@fleet_options
@click.option(
    "--faults",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Script of faults to inject between the nodes, instead of that of the scenario.",
)
@live_options
def run(
    scenario: str | None,
    campaign: Path | None,
    row: int | None,
    changes: tuple[str, ...],
    output: Path,
    real_time: bool,
    namespace: str,
    fleet: tuple[int, float] | None,
    faults: Path | None,
    live_port: int | None,
) -> None:
    """Simulate a scenario by ROS 2 nodes and record it.

    SCENARIO is one that comes with the package, such as case2_tracking, or the path of a YAML file: a ROS parameters file. The
    nodes take turns, as fast as the machine allows (lockstep), or keep to the wall clock (--real-time). The run folder receives
    the recording, all parameters, a page with diagrams, and the metrics. With --campaign and --run instead of SCENARIO the
    command repeats one run of a campaign and compares the metrics. With --vessels it runs several vessels at once.
    """
    if fleet and (campaign or faults or live_port):
        raise click.UsageError("--vessels takes no --campaign, no --faults and no --live")
    namespace = checked_namespace(namespace)
    of_nodes = for_nodes(True, real_time, "" if fleet else namespace)
    if chosen := of_row(scenario, campaign, row, real_time or bool(changes)):
        loaded = chosen.scenario(of_nodes)
    else:
        loaded = load_checked(scenario or "", of_nodes | parse_changes(changes))
    if fleet and loaded.faults:
        raise click.UsageError("--vessels takes no scenario with faults")
    if fleet:
        sys.exit(run_vessels(loaded, output, namespace, *fleet))
    script = load_script(faults) if faults else loaded.faults
    if script is not None:
        check_script(script, loaded)
    check_writable(output)
    if live_port is not None:
        scenario_run.check_live_port(live_port)
        print_status(f"live view: ws://localhost:{live_port}, layout config/live/foxglove.json")
    # Before the folder is created: a run that is refused leaves nothing behind.
    with scenario_run.reserve_namespace(namespace, loaded.controller.lockstep):
        folder = make_run_folder(output, loaded.name)
        with progress_bar(f"running {loaded.name}", loaded.vessel_sim.duration) as update:
            result = scenario_run.run_nodes(loaded, folder, namespace, update, live_port, faults=script)
    print_result(result)
    sys.exit(compare_with_row(chosen, result) if chosen else result.exit_code)
