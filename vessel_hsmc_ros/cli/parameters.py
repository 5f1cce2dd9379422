"""`vessel-hsmc parameters`: the reference page of all parameters."""

import click

from vessel_hsmc_ros.cli.options import law_file_option
from vessel_hsmc_ros.scenario.parameter_page import parameter_page


@click.command()
@law_file_option
def parameters() -> None:
    """List all parameters, with their ranges and meaning."""
    click.echo(parameter_page(), nl=False)
