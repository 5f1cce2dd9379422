"""The verbs that act on a running vessel: `call`, `set`, `goto` and `path`."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vessel_hsmc_ros.boats.missions.waypoints import Waypoint, read_waypoints
from vessel_hsmc_ros.cli.console import print_line, progress_bar
from vessel_hsmc_ros.cli.options import parse_changes, running_vessel, vessel_option
from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.core.kinematics import TURN

if TYPE_CHECKING:
    from vessel_hsmc_ros.nodes.remote import Progress, Result


detach_option = click.option("--detach", is_flag=True, help="Only send it, as a message, and do not wait for the end.")


def show_until_end(sail: Callable[[Callable[["Progress"], None]], "Result"]) -> None:
    """Show the progress of a goal until its end.

    `sail`: sends the goal, calls what it is given with each progress, and returns the result.
    """
    farthest = 0.0
    with progress_bar("sailing", 100.0, "%") as update:

        def show(now: Any) -> None:
            nonlocal farthest
            farthest = max(farthest, now.distance)
            leg = f"leg {now.leg} of {now.legs}, " if now.legs > 1 else ""
            note = f"{leg}{now.distance:.0f} m, {now.speed:.1f} m/s, {now.time_left:.0f} s left"
            update(100.0 * (1.0 - now.distance / farthest) if farthest else 0.0, note=note)

        result = sail(show)
    if not result.reached:
        raise RunError(result.text)
    print_line(result.text)


def sail(waypoints: Sequence[Waypoint], namespace: str, detach: bool) -> None:
    """Send waypoints to a running vessel, and wait for the end unless the command is detached from it."""
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.remote import sail_along, send_path

        if detach:
            print_line(send_path(remote, waypoints))
        else:
            show_until_end(lambda show: sail_along(remote, waypoints, show))


SWITCHES = {
    "pause": (("vessel_sim", "reference_ship"), "pause", True),
    "resume": (("vessel_sim", "reference_ship"), "pause", False),
    "hold": (("reference_ship",), "hold", True),
    "release": (("reference_ship",), "hold", False),
    "enable": (("controller",), "enable", True),
    "disable": (("controller",), "enable", False),
}
"""Nodes, service and flag of each action that switches something."""

TRIGGERS = {
    "reset": ("vessel_sim", "reference_ship", "controller"),
    "stop": ("controller",),
    "rearm": ("controller",),
}
"""Nodes of each action that triggers something, whose service has the same name."""


@click.command()
@click.argument("action", type=click.Choice([*SWITCHES, *TRIGGERS]))
@vessel_option
def call(action: str, namespace: str) -> None:
    """Pause, resume, hold, release, reset, enable, disable, stop or rearm a running vessel.

    \b
    pause     pause ship and reference; in real time the clock goes on
    resume    let ship and reference go on after a pause
    hold      let the vessel come to rest on its way and keep station
    release   let it sail its way on after a hold
    reset     put ship and reference back to their start, and reset the law
    disable   put the controller into standby: it commands zero until `enable`
              (the run goes on; Ctrl-C in its terminal ends it)
    stop      command zero at once, in any state, and stay stopped until `rearm`
    rearm     end the stop: the controller is in standby, and `enable` starts it
    enable    let the controller command, if its inputs are complete
    """  # noqa: D301 - \b keeps click from wrapping the list
    with running_vessel(namespace) as remote:
        from std_srvs.srv import SetBool, Trigger

        from vessel_hsmc_ros.nodes.remote import Service

        if action in TRIGGERS:
            services, request = [Service(node, action, Trigger) for node in TRIGGERS[action]], Trigger.Request()
        else:
            nodes, name, flag = SWITCHES[action]
            services, request = [Service(node, name, SetBool) for node in nodes], SetBool.Request(data=flag)
        for service, client in zip(services, remote.connect(services), strict=True):
            response = remote.call(client, request)
            if not response.success:
                raise RunError(f"{service.node}: {response.message}")
            print_line(f"{service.node}: {response.message}")


@click.command("set")
@click.argument("changes", nargs=-1, required=True, metavar="NODE.PARAM=VALUE...")
@vessel_option
def set_parameters(changes: tuple[str, ...], namespace: str) -> None:
    """Change parameters of a running vessel, such as controller.guided.position_gain=0.5.

    All changes are checked before the first is made; those of one node are made together.
    """
    values = parse_changes(changes, "set")
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.remote import change_parameters

        for change in change_parameters(remote, values):
            print_line(f"{change.name}: {change.old} -> {change.new}")


# Without this setting a negative coordinate would be taken for an option.
@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("x", type=float)
@click.argument("y", type=float)
@click.argument("heading", type=float, required=False)
@click.option("--heading-deg", type=float, help="The heading in degrees, instead of HEADING.")
@detach_option
@vessel_option
def goto(x: float, y: float, heading: float | None, heading_deg: float | None, detach: bool, namespace: str) -> None:
    """Send a running vessel to the position X, Y, in metres, and wait until it is there.

    HEADING is in radians, counter-clockwise from x. Without it and without --heading-deg the vessel arrives in the direction
    from its present reference to the goal. The reference ship must take goals: start it by `vessel-hsmc run goal --real-time`,
    or in any scenario with reference_ship.mode=goal or path. The exit code is 0 only where the vessel is there. Ctrl-C cancels:
    the vessel comes to rest and keeps station.
    """
    if heading is not None and heading_deg is not None:
        raise click.UsageError("give the heading either as HEADING, in radians, or as --heading-deg")
    if heading_deg is not None:
        heading = math.radians(heading_deg)
    given = [x, y] if heading is None else [x, y, heading]
    if not all(map(math.isfinite, given)):
        raise ParameterError(f"goal must be finite numbers (got {' '.join(f'{value:g}' for value in given)})")
    if heading is not None and heading_deg is None and abs(heading) > TURN:
        wanted = f"in radians from {-TURN:.3g} to {TURN:.3g}; --heading-deg takes degrees"
        raise ParameterError(f"HEADING must be {wanted} (got {heading:g})")
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.remote import sail_to, send_goal

        if detach:
            print_line(send_goal(remote, x, y, heading))
        else:
            show_until_end(lambda show: sail_to(remote, x, y, heading, show))


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@detach_option
@vessel_option
def path(file: Path, detach: bool, namespace: str) -> None:
    """Send a running vessel along the waypoints in FILE, a CSV or YAML file with x and y of each in metres, and wait for the end.

    The reference ship must take paths: start it by `vessel-hsmc run waypoints --real-time`, or in any scenario with
    reference_ship.mode=path. A heading is accepted but not used: the ship follows the legs between the
    waypoints. A CSV file may begin with a row of names: x, y, z and heading, in any order; other columns, such as a latitude,
    are refused. The exit code is 0 only where the vessel has come to the end. Ctrl-C cancels: the vessel comes to rest on its
    way and keeps station.
    """
    sail(read_waypoints(file), namespace, detach)  # a wrong file is reported before the search for nodes
