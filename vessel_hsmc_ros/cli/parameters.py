"""`vessel-hsmc parameters`: the reference pages that are generated from declarations."""

from pathlib import Path

import click

from vessel_hsmc_ros.cli.options import law_file_option
from vessel_hsmc_ros.scenario.parameter_page import parameter_page
from vessel_hsmc_ros.scenario.safety_page import safety_page


@click.command()
@law_file_option
@click.option(
    "--into",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Renew the generated parts of a page, such as docs/safety.md, in place of listing.",
)
def parameters(into: Path | None) -> None:
    """List all parameters, with their ranges and meaning."""
    if into is None:
        click.echo(parameter_page(), nl=False)
    else:
        into.write_text(safety_page(into.read_text(encoding="utf-8")), encoding="utf-8")
