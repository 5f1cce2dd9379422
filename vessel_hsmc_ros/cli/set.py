"""`vessel-hsmc set`: change parameters of running nodes."""

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import parse_changes, running_vessel, vessel_option


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
