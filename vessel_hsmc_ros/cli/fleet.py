"""The option `--vessels N`, by which `run` takes a scenario for several vessels."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import click

from vessel_hsmc_ros.cli.console import print_error, print_line, print_table, progress_bar
from vessel_hsmc_ros.runs.fleet import FleetResult, reserve_namespaces, run_fleet
from vessel_hsmc_ros.scenario.fleet import LARGEST, SPACING, make_fleet
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from vessel_hsmc_ros.scenario.scenario import Scenario

SHOWN = ("position_error_rms", "position_error_final", "settling_time", "heading_error_rms_deg")
"""Metrics of each vessel in the printed table; run.json and the page have all."""

COUNTED = ("missed_periods", "messages_recorded", "messages_dropped")
"""Facts of each vessel in the printed table."""


def fleet_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a verb, which takes them as `fleet`: the number and the distance of the vessels, or None."""
    number = click.option(
        "--vessels",
        type=click.IntRange(1, LARGEST),
        metavar="N",
        help="Run N vessels at once, in the namespaces vessel_1 to vessel_N (with --namespace NAME: NAME_1 to NAME_N), recorded"
        " in one bag. Their random seeds are that of the scenario and the N - 1 numbers after it.",
    )
    spacing = click.option(
        "--spacing",
        type=click.FloatRange(-1e5, 1e5),
        default=SPACING,
        show_default=True,
        help="With --vessels: distance in y between neighbouring vessels, and between their references, m.",
    )

    @functools.wraps(command)
    def taking(vessels: int | None, spacing: float, **options: Any) -> Any:
        return command(fleet=(vessels, spacing) if vessels else None, **options)

    return number(spacing(taking))


def run_vessels(base: Scenario, output: Path, namespace: str, count: int, spacing: float) -> int:
    """Run a scenario with several vessels and print the result; returns the exit code.

    Args:
        base: The scenario of the first vessel.
        output: Folder in which the run folder is created.
        namespace: What their namespaces begin with; empty for the default.
        count: Number of vessels.
        spacing: Distance in y between two neighbours, m.

    Raises:
        ParameterError: a vessel would start outside the allowed positions.
        RunError: ROS is not installed, another run uses a namespace, or files cannot be written.
    """
    fleet = make_fleet(base, count, namespace, spacing)
    check_writable(output)
    with reserve_namespaces(fleet):
        folder = make_run_folder(output, base.name)
        with progress_bar(f"running {base.name} with {count} vessels", base.vessel_sim.duration) as update:
            result = run_fleet(fleet, folder, update)
    _print(result)
    return result.exit_code


def _print(result: FleetResult) -> None:
    """Print a row for each vessel, how the run failed if it did, and the path of its files."""
    if result.records:
        from vessel_hsmc_ros.report.tables import FACTS, METRICS, quantities  # imports the report's libraries

        labels = [(METRICS | FACTS)[name][0] for name in (*SHOWN, *COUNTED)]
        rows = []
        for record in result.records:
            texts = {each.label: each.text for each in quantities(record.metrics, record.facts)}
            rows.append((record.name, *(texts.get(label, "") for label in labels)))
        print_table(["vessel", *labels], rows)
    if result.failure:
        print_error(result.failure)
    print_line(f"run folder: {result.folder.path}")
