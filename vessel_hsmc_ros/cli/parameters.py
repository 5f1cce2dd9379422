"""`vessel-hsmc parameters`: all parameters by their declarations, and the reference pages that are generated from them."""

from pathlib import Path

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import json_option, law_file_option, print_json
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameter_page import interface_page, matching, parameter_page, safety_page


@click.command()
@click.argument("word", required=False)
@json_option
@law_file_option
@click.option(
    "--into",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Instead of listing parameters, update the generated parts of a page such as docs/safety.md.",
)
@click.option("--boats", is_flag=True, help="Instead of listing parameters, print the page docs/boats.md.")
def parameters(word: str | None, as_json: bool, into: Path | None, boats: bool) -> None:
    """List all parameters, with their ranges and meaning, or those in whose name or meaning WORD occurs."""
    if boats:
        click.echo(interface_page(), nl=False)
    elif into is not None:
        into.write_text(safety_page(into.read_text(encoding="utf-8")), encoding="utf-8")
    elif word or as_json:
        rows = matching(word or "")
        if not rows:
            raise ParameterError(f"no parameter has {word} in its name or meaning: vessel-hsmc parameters lists all")
        if as_json:
            print_json(rows)
            return
        for row in rows:
            print_line(f"{row['name']} = {row['default']}{' *' if row['tunable'] else ''}")
            print_line(f"    {row['meaning']}; {row['allowed']}")
    else:
        click.echo(parameter_page(), nl=False)
