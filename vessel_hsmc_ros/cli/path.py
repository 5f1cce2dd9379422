"""`vessel-hsmc path`: send a running vessel along waypoints."""

from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import vessel_option
from vessel_hsmc_ros.cli.running import running_vessel
from vessel_hsmc_ros.scenario.waypoints import read_waypoints


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@vessel_option
def path(file: Path, namespace: str) -> None:
    """Send a running vessel along the waypoints in FILE, a CSV or YAML file with x and y of each in metres.

    The reference ship must take paths: start it by `vessel-hsmc run waypoints --real-time`, or in any scenario with
    reference_ship.mode=path. A third column, the heading, is accepted but not used: the ship follows the legs between the
    waypoints. The exit code is 1 if the reference ship refuses the path.
    """
    points = read_waypoints(file)  # before the search for nodes: a wrong file is reported at once
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.remote import send_path

        print_line(send_path(remote, points))
