"""`vessel-hsmc init`: a commented scenario for a ship of one's own, or for a vessel of the library, checked at once."""

import os
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from vessel_hsmc_ros.boats.interfaces import interface, interface_text
from vessel_hsmc_ros.cli.console import print_line, print_warning
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import shell_command
from vessel_hsmc_ros.scenario.own_ship import (
    OVERRIDES,
    MainData,
    scenario_for,
    scenario_text,
    survey_of,
    thruster_layout,
    with_survey,
)
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel


def main_data_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add an option for each of the ship's main data, from their declarations."""
    for name, entry in reversed(schema.entries(MainData).items()):
        options = [f"--{name.replace('_', '-')}", *(["--top-speed"] if name == "speed" else [])]
        command = click.option(*options, name, type=float, metavar=entry.unit, help=entry.description)(command)
    return command


@click.command()
@click.argument("name")
@click.option(
    "--vessel",
    metavar="NAME|FILE",
    help="A vessel of the library, such as otter, or a vessel file; the options below then change single values of it.",
)
@main_data_options
@click.option("--thrusters", is_flag=True, help="Drive the ship by the thrusters of --vessel.")
@click.option(
    "--thruster", "fixed", multiple=True, metavar="X,Y,AHEAD,ASTERN", help="A thruster: its place and thrusts, m and N."
)
@click.option("--interface", "stack", metavar="STACK", help="Also write NAME_STACK.yaml, the connection to the stack of a boat.")
@click.option("--survey", metavar="LEGS,LENGTH,SPACING,SPEED", help="Sail a survey instead of the circle: number, m, m, m/s.")
@click.option("--no-check", is_flag=True, help="Do not simulate the new scenario.")
def init(
    name: str,
    vessel: str | None,
    thrusters: bool,
    fixed: tuple[str, ...],
    stack: str | None,
    survey: str | None,
    no_check: bool,
    **data: Any,
) -> None:
    """Write NAME.yaml, a complete commented scenario for a ship of your own, and check it by a simulation.

    Give a vessel, or what you know of the ship; the rest is estimated by rules of thumb, which the file states. The check is a
    run on a circle, with --survey too.
    """
    if thrusters and vessel is None:
        raise ParameterError("--thrusters needs --vessel: it uses the thrusters of a vessel, such as otter")
    if fixed and vessel is not None:
        raise ParameterError("--thruster cannot be given with --vessel: --thrusters uses the thrusters of the vessel")
    connection = None if stack is None else interface(stack)
    path = Path(name).with_suffix(".yaml") if name.endswith((".yaml", ".yml")) else Path(f"{name}.yaml")
    given = {key: value for key, value in data.items() if value is not None}
    text = _text(vessel, path, given, thrusters, fixed)
    # Before it is written: a ship may be too extreme for the ranges.
    scenario = parse_scenario(text, path.stem, source="the new scenario", folder=path.parent)
    if connection and "thruster_allocation" in connection.nodes and not scenario.vessel_sim.vessel.thrusters:
        raise ParameterError(f"--interface {stack} needs thrusters: give each with --thruster x,y,ahead,astern")
    _write(path, with_survey(text, survey_of(survey)) if survey else text)
    if connection:
        to = path.with_name(f"{path.stem}_{connection.name}.yaml")
        _write(to, interface_text(connection, path.stem, scenario.controller.vessel, "gps_noise" in given))
        print_line(f"connection: {to}, with the commands that start the nodes")
    if not no_check:
        _check(scenario)
    print_line(f"scenario: {path}; next: {shell_command()} simulate {shlex.quote(str(path))}")


def _write(path: Path, text: str) -> None:
    """Write a new file."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ScenarioError(f"{path} exists and is not overwritten: choose another name, or delete it") from None
    except OSError as error:
        raise ScenarioError(f"{path} cannot be written: {error.strerror}") from None


def _text(vessel: str | None, path: Path, given: dict[str, float], thrusters: bool, fixed: tuple[str, ...]) -> str:
    """The new scenario."""
    try:
        if vessel is not None:
            return _of_vessel(vessel, path, given, thrusters)
        main_data = schema.build(MainData, given, "init")
        return scenario_text(path.stem, main_data, thruster_layout(fixed, main_data.length) if fixed else None)
    except ParameterError as error:
        raise ParameterError(re.sub(r"\binit\.(\w+)", lambda found: f"--{found[1].replace('_', '-')}", str(error))) from None


def _of_vessel(vessel: str, path: Path, given: dict[str, float], thrusters: bool) -> str:
    """The scenario of a vessel of the library or of a file.

    `vessel`: its name or path. `path`: the scenario to be written, from which a relative path to the vessel starts.
    """
    main = schema.build(MainData, given, "init")
    data = vars(main)
    for key in given:
        if key not in (*OVERRIDES, "wind", "current", "lag", "gps_noise", "gps_rate", "power", "battery"):
            raise ParameterError(f"--{key.replace('_', '-')} cannot be given with --vessel: its hull data are those of {vessel}")
    own = {key: data[key] for key in OVERRIDES if key in given}
    found = read_vessel(vessel)
    is_file = Path(vessel).suffix in (".yaml", ".yml")
    # Relative to the scenario, so that both files can be moved together.
    reference = os.path.relpath(found.path.resolve(), path.parent.resolve()) if is_file else vessel
    return scenario_for(found.values, reference, path.stem, own, main, thrusters)


def _check(scenario: Scenario) -> None:
    """Simulate the scenario and print what its ship can do."""
    from vessel_hsmc_ros.studies.runs.ship_check import check_ship, verdict

    check = check_ship(scenario)
    *lines, last = verdict(check)
    for line in lines:
        print_line(line)
    (print_line if check.tracked else print_warning)(last)
