"""`vessel-hsmc watch`: the present state of a running vessel in the terminal."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import json_option, print_json, running_vessel, vessel_option
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.quantities import quantity

if TYPE_CHECKING:
    from vessel_hsmc_ros.core.kinematics import Motion
    from vessel_hsmc_ros.nodes.observation import Snapshot

REFRESH_HZ = 4.0
COLOURS = {"ok": "green", "warning": "yellow", "error": "red"}


@click.command()
@click.option("--once", is_flag=True, help="Print the present state and exit.")
@json_option
@vessel_option
def watch(once: bool, as_json: bool, namespace: str) -> None:
    """Show the state of a running vessel: pose, error, wrench, messages of the nodes, events. Ctrl-C ends it.

    If the output is not a terminal, the command prints one line every second.
    """
    if as_json and not once:
        raise click.UsageError("--json prints one state: give --once too")
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.observation import Observation

        observation = Observation(remote)
        console = Console()
        if as_json:
            print_json(content(observation.look()))
            return
        if once:
            console.print(table(observation.look()))
            return
        try:
            if not console.is_terminal:
                while True:
                    print_line(line(observation.look()))
                    time.sleep(1.0)
            with Live(table(observation.look()), console=console, auto_refresh=False) as live:
                while True:
                    time.sleep(1.0 / REFRESH_HZ)
                    live.update(table(observation.look()), refresh=True)
        except KeyboardInterrupt:
            return


def content(snapshot: Snapshot) -> dict[str, Any]:
    """The state for programs: motions by x, y, psi, u, v, r in SI units and radians."""
    motions = {"ship": snapshot.ship, "desired": snapshot.desired}
    shown = {name: motion and motion._asdict() for name, motion in motions.items()}
    return {**snapshot._asdict(), **shown, "nodes": {name: status._asdict() for name, status in snapshot.nodes.items()}}


def table(snapshot: Snapshot) -> Table:
    """The state as a table of two columns."""
    made = Table(show_header=False, box=None, pad_edge=False)
    made.add_column(no_wrap=True, style="bold")
    made.add_column(overflow="fold")
    for name, value in quantities(snapshot).items():
        made.add_row(name, escape(value))
    if missing := missing_inputs(snapshot):
        made.add_row("missing", missing)
    if snapshot.ages:
        made.add_row("age", ", ".join(f"{name} {age:.1f} s" for name, age in snapshot.ages.items()))
    for name, status in sorted(snapshot.nodes.items()):
        level = COLOURS.get(status.level, "yellow")
        made.add_row(escape(name), f"[{level}]{status.level}[/]  {escape(status.message)}{escape(_details(status.values))}")
    for text in snapshot.events:
        made.add_row("event", escape(text))
    return made


def missing_inputs(snapshot: Snapshot) -> str:
    """The inputs of which no message was received, and for how long; empty if there are none."""
    from vessel_hsmc_ros.nodes.observation import INPUTS, LOOK  # imports ROS

    missing = [name for name in INPUTS if name not in snapshot.ages]
    return f"no {' and no '.join(missing)} within {LOOK:g} s" if missing else ""


def line(snapshot: Snapshot) -> str:
    """The state in one line."""
    parts = [f"{name} {value}" for name, value in quantities(snapshot).items()]
    parts += [f"{name}: {status.message}" for name, status in sorted(snapshot.nodes.items()) if status.level != "ok"]
    return "; ".join(parts or ["no message yet"])


def quantities(snapshot: Snapshot) -> dict[str, str]:
    """The numbers of a state as text, by their names."""
    shown: dict[str, str] = {}
    if snapshot.time is not None:
        shown["time"] = f"{snapshot.time:.1f} s"
    for name, motion in (("ship", snapshot.ship), ("reference", snapshot.desired)):
        if motion is not None:
            speeds = f"{motion.u:.2f} m/s surge, {motion.v:.2f} m/s sway, {math.degrees(motion.r):.2f} deg/s"
            shown[name] = f"x {motion.x:.2f} m, y {motion.y:.2f} m, heading {math.degrees(motion.psi):.1f} deg, {speeds}"
    if snapshot.ship is not None and snapshot.desired is not None:
        shown["error"] = _error(snapshot.ship, snapshot.desired)
    if snapshot.wrench is not None:
        units = (("surge force", "N"), ("yaw moment", "N·m"))
        for (name, unit), value, limit in zip(units, snapshot.wrench, snapshot.limits, strict=True):
            part = f", {abs(value) / limit:.0%} of {quantity(limit, unit)}" if math.isfinite(limit) and limit else ""
            shown[name] = f"{quantity(value, unit)}{part}"
    return shown


def _error(ship: Motion, desired: Motion) -> str:
    """Position error along and across the ship's hull, and heading error."""
    east, north = ship.x - desired.x, ship.y - desired.y
    cosine, sine = math.cos(ship.psi), math.sin(ship.psi)
    ahead, left = cosine * east + sine * north, cosine * north - sine * east
    turned = math.degrees(wrap(ship.psi - desired.psi))
    return f"{math.hypot(east, north):.3g} m ({ahead:.3g} m ahead, {left:.3g} m to port), heading {turned:.2f} deg"


def _details(values: dict[str, str]) -> str:
    """Those values of a node's diagnostics that a person watches."""
    names = {"law": "law", "missed_periods": "missed periods", "real_time_factor": "times real time", "dropped": "dropped"}
    shown = [f"{label} {_rounded(values[key])}" for key, label in names.items() if key in values]
    return f" ({', '.join(shown)})" if shown else ""


def _rounded(text: str) -> str:
    try:
        return f"{float(text):.4g}"
    except ValueError:
        return text
