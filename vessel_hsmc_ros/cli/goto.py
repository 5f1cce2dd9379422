"""`vessel-hsmc goto`: send a running vessel to a pose."""

import math

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import vessel_option
from vessel_hsmc_ros.cli.running import running_vessel
from vessel_hsmc_ros.core.exceptions import ParameterError


# Without this setting a negative coordinate would be taken for an option.
@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("x", type=float)
@click.argument("y", type=float)
@click.argument("heading", type=float, required=False)
@click.option("--heading-deg", type=float, help="The heading in degrees, instead of HEADING.")
@vessel_option
def goto(x: float, y: float, heading: float | None, heading_deg: float | None, namespace: str) -> None:
    """Send a running vessel to X, Y, m, with HEADING, rad, counter-clockwise from x.

    Its reference must take goals: `vessel-hsmc run goal --real-time`, or any scenario with reference_ship.mode=goal.
    """
    if (heading is None) == (heading_deg is None):
        raise click.UsageError("give the heading either as HEADING, in radians, or as --heading-deg")
    if heading is None:
        heading = math.radians(heading_deg or 0.0)
    if not all(map(math.isfinite, (x, y, heading))):
        raise ParameterError(f"goal {x:g} {y:g} {heading:g} is not allowed: it takes finite numbers")
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.remote import send_goal

        print_line(send_goal(remote, (x, y, heading)))
