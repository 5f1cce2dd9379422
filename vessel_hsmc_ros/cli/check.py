"""`vessel-hsmc check`: one page on a connection with a boat, live or from a bag: each line OK, or what to do."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.markup import escape

from vessel_hsmc_ros.boats.interfaces import interface
from vessel_hsmc_ros.cli.options import json_option, print_json, refuse_without, running_vessel, vessel_option
from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.core.install_paths import require
from vessel_hsmc_ros.preflight.connection import OK, WRONG, Connection, Finding
from vessel_hsmc_ros.preflight.rules import judge

if TYPE_CHECKING:
    from vessel_hsmc_ros.boats.interfaces import Interface

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
    from vessel_hsmc_ros.preflight.from_bag import connection_in

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
