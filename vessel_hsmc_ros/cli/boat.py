"""The verbs that connect a boat: `init`, `check` and `ardupilot`."""

from __future__ import annotations

import os
import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.markup import escape

from vessel_hsmc_ros.boats.autopilot import Pulses
from vessel_hsmc_ros.boats.parameters import interface, interface_text
from vessel_hsmc_ros.boats.plants import PORT, Physics, Wiring, serve
from vessel_hsmc_ros.cli.console import print_line, print_warning, write_new
from vessel_hsmc_ros.cli.options import (
    json_option,
    load_checked,
    print_json,
    refuse_without,
    running_vessel,
    scenario_argument,
    set_option,
    vessel_option,
)
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.core.install_paths import require, shell_command
from vessel_hsmc_ros.core.quantities import number_of
from vessel_hsmc_ros.preflight.connection import OK, WRONG, Connection, Finding
from vessel_hsmc_ros.preflight.rules import judge
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

if TYPE_CHECKING:
    from collections.abc import Callable

    from vessel_hsmc_ros.boats.parameters import Interface


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
    write_new(path, with_survey(text, survey_of(survey)) if survey else text)
    if connection:
        to = path.with_name(f"{path.stem}_{connection.name}.yaml")
        write_new(to, interface_text(connection, path.stem, scenario.controller.vessel, "gps_noise" in given))
        print_line(f"connection: {to}, with the commands that start the nodes")
    if not no_check:
        _check(scenario)
    print_line(f"scenario: {path}; next: {shell_command()} simulate {shlex.quote(str(path))}")


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
    from vessel_hsmc_ros.studies.forecast.feasibility import check_ship, verdict

    check = check_ship(scenario)
    *lines, last = verdict(check)
    for line in lines:
        print_line(line)
    (print_line if check.tracked else print_warning)(last)


LEVEL_LABELS = {OK: "[green]OK   [/]", "todo": "[yellow]TO DO[/]", WRONG: "[red]WRONG[/]"}

WARNING = (
    "The boat will move: {ahead:g} {units[0]} for 2 s, then {turn:g} {units[1]} for 2 s. Is it clear of people and obstacles,"
    " with the hardware stop within reach?"
)


@click.command()
@click.argument("bag", required=False, type=click.Path(path_type=Path))
@click.option("--interface", "stack", metavar="STACK", help="The stack whose names and forms count where no node runs.")
@click.option("--seconds", type=click.FloatRange(1.0, 600.0), default=8.0, show_default=True, help="Time to listen.")
@click.option(
    "--pulse",
    metavar="N,N·m",
    help="Also command a short force and moment, or m/s,rad/s with drive.form cmd_vel, and see what they do; nothing else may.",
)
@click.option("--yes", is_flag=True, help="Do not wait for a confirmation of the pulse.")
@json_option
@vessel_option
def check(
    bag: Path | None,
    stack: str | None,
    seconds: float,
    pulse: str | None,
    yes: bool,
    as_json: bool,
    namespace: str,
) -> None:
    """Check the connection with a boat: topics, types, rates, stamps, frames, units, signs, stop.

    It looks at the running nodes, or at BAG. Every line is OK, a mistake with what to do, or something not shown yet, such as the
    sign of the yaw moment of a boat at rest. With a mistake the exit code is 1.
    """
    chosen = None if stack is None else interface(stack)
    if bag is not None and pulse is not None:
        raise ParameterError("--pulse cannot be given with a bag: it needs running nodes")
    if bag is not None and bag.suffix in (".yaml", ".yml") and bag.stem != "metadata":
        raise ParameterError(
            f"BAG must be a recording (got {bag}): run the scenario and give the bag of its run, or leave BAG out while its"
            " nodes run"
        )
    if bag is not None:
        refuse_without("running nodes, not with a bag", "seconds", "namespace")
    size = None if pulse is None else _pulse(pulse)
    found = judge(_recorded(bag, chosen) if bag is not None else _observed(namespace, chosen, seconds, size, yes))
    if as_json:
        print_json([finding._asdict() for finding in found])
    else:
        show(found)
    if wrong := sum(finding.level == WRONG for finding in found):
        raise RunError(f"{wrong} of {len(found)} lines are wrong")


def _recorded(bag: Path, stack: Interface | None) -> Connection:
    require("lz4", "mcap", "rosbags", "zstandard")
    from vessel_hsmc_ros.bags.reader import open_bag
    from vessel_hsmc_ros.preflight.expected import connection_in

    return connection_in(open_bag(bag), stack)


def _observed(
    namespace: str, stack: Interface | None, limit: float, size: tuple[float, float] | None, confirmed: bool
) -> Connection:
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.preflight.live import LiveConnection

        live = LiveConnection(remote, stack)
        if size and not confirmed:
            click.confirm(WARNING.format(ahead=size[0], turn=size[1], units=live.units), abort=True)
        live.listen(limit)
        if size:
            live.pulse(*size)
        return live.connection()


def _pulse(text: str) -> tuple[float, float]:
    """Force and moment, or speed and yaw rate, of the option."""
    try:
        force, moment = map(float, text.split(","))
    except ValueError:
        force = moment = 0.0
    if not (0.0 < abs(force) < 1e12 and 0.0 < abs(moment) < 1e12):
        raise ParameterError(
            "--pulse must be a force in N and a moment in N·m, both not 0, such as 30,20, or with drive.form = cmd_vel a speed"
            f" in m/s and a yaw rate in rad/s, such as 0.5,0.2 (got {text})"
        )
    return force, moment


def show(found: list[Finding]) -> None:
    """Print the page."""
    console = Console()
    width = max(len(finding.about) for finding in found)
    for level, about, text in found:
        console.print(f"{LEVEL_LABELS[level]} {escape(about):<{width}}  {escape(text)}", highlight=False, soft_wrap=True)
    counts = {level: sum(finding.level == level for finding in found) for level in LEVEL_LABELS}
    console.print(f"{counts[OK]} OK, {counts[WRONG]} wrong, {counts['todo']} to do", highlight=False)


@click.command()
@scenario_argument
@set_option
@click.option("--servos", default="1,3", show_default=True, help="Outputs of the thrusters; without thrusters, left and right.")
@click.option("--pulses", default="1100,1500,1900", show_default=True, help="Pulse widths astern, at rest and ahead, µs.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", default=PORT, show_default=True, type=click.IntRange(0, 65535), help="Port to listen on; 0: any.")
@click.option("--duration", default=0.0, help="Simulated time after which it ends, s; 0: never.")
def ardupilot(scenario: str, changes: dict[str, object], servos: str, pulses: str, host: str, port: int, duration: float) -> None:
    """Simulate the ship for ArduPilot's autopilot (SITL, frame JSON).

    The ship of SCENARIO with its sea and its actuators takes the place of ArduPilot's own boat, one time step for each frame.
    """
    loaded = load_checked(scenario, changes)
    widths = _numbers(pulses, "--pulses")
    if len(widths) != 3 or sorted(set(widths)) != widths:
        raise ParameterError(f"--pulses must be three increasing widths (got {pulses})")
    physics = Physics(loaded.vessel_sim, Wiring(tuple(map(int, _numbers(servos, "--servos"))), Pulses(*widths)))
    try:
        serve(physics, (host, port), duration, print_line)
    finally:
        print_line(f"{physics.frames} frames, {physics.lost} lost, {physics.repeated} repeated; {physics.time:.1f} s simulated")


def _numbers(text: str, option: str) -> list[float]:
    try:
        found = [number_of(part) for part in text.split(",")]
    except ValueError:
        found = []
    if not found or min(found) < 1.0:
        raise ParameterError(f"{option} must be numbers from 1 on, with commas between them (got {text})")
    return found
