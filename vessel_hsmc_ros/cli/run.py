"""`vessel-hsmc run`: one scenario by the real nodes, over ROS 2; with `--vessels`, a fleet of them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vessel_hsmc_ros.cli.console import print_failure, print_line, print_result, print_status, print_table, progress_bar
from vessel_hsmc_ros.cli.options import (
    campaign_row_options,
    checked_namespace,
    compare_with_row,
    law_file_option,
    load_checked,
    no_page_option,
    of_row,
    optional_scenario_argument,
    output_option,
    refuse_without,
    set_option,
    vessel_option,
)
from vessel_hsmc_ros.scenario.fault_script import load_script
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder
from vessel_hsmc_ros.scenario.scenario import MAX_VESSELS, SPACING, check_script, for_nodes, make_fleet
from vessel_hsmc_ros.studies import scenario_run
from vessel_hsmc_ros.studies.scenario_run import reserve_namespaces, run_fleet

if TYPE_CHECKING:
    from vessel_hsmc_ros.scenario.scenario import Scenario

TABLE_METRICS = (
    "position_error_rms_last_quarter",
    "position_error_rms",
    "position_error_final",
    "settling_time",
    "heading_error_rms_deg",
)
"""Metrics of each vessel in the printed table; run.json and the page have all."""

COUNTED = ("missed_periods", "messages_recorded", "messages_dropped")  # facts of each vessel in the printed table


def run_vessels(base: Scenario, output: Path, with_page: bool, namespace: str, count: int, spacing: float) -> int:
    """Run a scenario with several vessels and print the result; returns the exit code.

    `namespace`: what their namespaces begin with; empty for the default. Raises ParameterError if a vessel would start outside
    the allowed positions; RunError if ROS is not installed, another run uses a namespace, or files cannot be written.
    """
    fleet = make_fleet(base, count, namespace, spacing)
    check_writable(output)
    with reserve_namespaces(fleet):
        folder = make_run_folder(output, base.name)
        with progress_bar(f"running {base.name} with {count} vessels", base.vessel_sim.duration) as update:
            result = run_fleet(fleet, folder, update, with_page)
    _print(result)
    return result.exit_code


def _print(result: scenario_run.Result) -> None:
    """Print a row for each vessel, how the run failed if it did, and the path of its files."""
    if result.records:
        from vessel_hsmc_ros.report.tables import FACTS, METRICS, quantities  # imports the report's libraries

        labels = [(METRICS | FACTS)[name][0] for name in (*TABLE_METRICS, *COUNTED)]
        rows = []
        for record in result.records:
            texts = {each.label: each.text for each in quantities(record.metrics, record.facts)}
            rows.append((record.name, *(texts.get(label, "") for label in labels)))
        print_table(["vessel", *labels], rows)
    print_failure(result)
    print_line(f"run folder: {result.folder.path}")


@click.command()
@optional_scenario_argument
@campaign_row_options
@set_option
@law_file_option
@output_option
@no_page_option
@click.option("--real-time", is_flag=True, help="Run in real time instead of in lockstep, as fast as possible.")
@click.option(
    "--composed/--processes",
    default=None,
    help="Run all nodes in one process, or each in a process of its own. Default: one process in lockstep without faults.",
)
@vessel_option
@click.option(
    "--vessels",
    type=click.IntRange(1, MAX_VESSELS),
    metavar="N",
    help="Run N vessels at once, in the namespaces vessel_1 to vessel_N (with --namespace NAME: NAME_1 to NAME_N), recorded"
    " in one bag. Their random seeds are that of the scenario and the N - 1 numbers after it.",
)
@click.option(
    "--spacing",
    type=click.FloatRange(-1e5, 1e5),
    default=SPACING,
    show_default=True,
    help="With --vessels: distance in y between neighbouring vessels, and between their references, m.",
)
@click.option(
    "--faults",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Script of faults to inject between the nodes, instead of that of the scenario.",
)
@click.option("--live", is_flag=True, help="Serve a live view for Foxglove, which then needs no ROS installation.")
@click.option("--live-port", type=click.IntRange(1, 65535), default=8765, show_default=True, help="Port of the live view.")
def run(
    scenario: str | None,
    campaign: Path | None,
    row: int | None,
    changes: dict[str, object],
    output: Path,
    real_time: bool,
    composed: bool | None,
    namespace: str,
    vessels: int | None,
    faults: Path | None,
    **given: Any,
) -> None:
    """Simulate a scenario by ROS 2 nodes and record it.

    SCENARIO is one that comes with the package, such as case2_tracking, or the path of a YAML file: a ROS parameters file. The
    nodes take turns, as fast as the machine allows (lockstep), or keep to the wall clock (--real-time). The run folder receives
    the recording, all parameters, a page with diagrams, and the metrics. With --campaign and --run instead of SCENARIO the
    command repeats one run of a campaign and compares the metrics. With --vessels it runs several vessels at once.
    """
    if not vessels:
        refuse_without("--vessels", "spacing")
    with_page, live, live_port = not given["no_page"], given["live"], given["live_port"]
    if not live:
        refuse_without("--live", "live_port")
    if vessels and (campaign or faults or live or composed is not None):
        raise click.UsageError("--vessels cannot be given with --campaign, --faults, --live, --composed or --processes")
    namespace = checked_namespace(namespace)
    of_nodes = for_nodes(True, real_time, "" if vessels else namespace)
    if chosen := of_row(scenario, campaign, row, real_time or bool(changes or faults)):
        loaded = chosen.scenario(of_nodes)
    else:
        loaded = load_checked(scenario or "", of_nodes | changes)
    if vessels and loaded.faults:
        raise click.UsageError("--vessels cannot be given with a scenario that has faults")
    if vessels:
        sys.exit(run_vessels(loaded, output, with_page, namespace, vessels, given["spacing"]))
    script = load_script(faults) if faults else loaded.faults
    if script is not None:
        check_script(script, loaded)
    if composed and not scenario_run.may_share(loaded, script):
        raise click.UsageError("--composed must be in lockstep and without faults: those need a process for each node")
    check_writable(output)
    if live:
        scenario_run.check_live_port(live_port)
        print_status(f"live view: ws://localhost:{live_port}, layout config/live/foxglove.json")
    # Before the folder is created: a run that is refused leaves nothing behind.
    with scenario_run.reserve_namespace(namespace, loaded.controller.lockstep):
        folder = make_run_folder(output, loaded.name)
        with progress_bar(f"running {loaded.name}", loaded.vessel_sim.duration) as update:
            result = scenario_run.run_nodes(
                loaded,
                folder,
                namespace,
                update,
                live_port if live else None,
                faults=script,
                with_page=with_page,
                composed=composed is not False,
            )
    print_result(result)
    sys.exit(compare_with_row(chosen, result) if chosen else result.exit_code)
