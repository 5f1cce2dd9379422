"""`vessel-hsmc goto`: send a running vessel to a pose."""

import math

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import running_vessel, vessel_option
from vessel_hsmc_ros.cli.sailing import detach_option, show_until_end
from vessel_hsmc_ros.core.exceptions import ParameterError


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
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.remote import sail_to, send_goal

        if detach:
            print_line(send_goal(remote, x, y, heading))
        else:
            show_until_end(lambda show: sail_to(remote, x, y, heading, show))
