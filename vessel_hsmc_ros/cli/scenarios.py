"""`vessel-hsmc scenarios`: the scenarios that come with the package, and the text of one of them."""

import re
from itertools import takewhile

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import complete_scenario, json_option, print_json
from vessel_hsmc_ros.scenario.scenario import load_scenario, scenario_names, scenario_text

USE = "vessel-hsmc scenarios NAME > my.yaml writes one to start from; vessel-hsmc run ./my.yaml runs it"


@click.command()
@click.argument("name", required=False, shell_complete=complete_scenario)
@json_option
def scenarios(name: str | None, as_json: bool) -> None:
    """List the scenarios that come with the package, or print the parameters file of one: NAME, or a path."""
    if name:
        click.echo(scenario_text(name), nl=False)
        return
    rows = [_row(each) for each in scenario_names()]
    if as_json:
        print_json(rows)
        return
    for row in rows:
        print_line(f"{row['name']}: law {row['law']}, reference {row['reference']}\n    {row['about']}")
    print_line(USE)


def _row(name: str) -> dict[str, str]:
    """What a scenario is: the first sentence of its comment, its law and its reference."""
    loaded = load_scenario(name)
    lines = takewhile(lambda line: line.startswith("#"), scenario_text(name).splitlines())
    about = re.split(r"(?<=[.:]) (?=[A-Z])", " ".join(line.strip("# ") for line in lines), maxsplit=1)[0]
    return {"name": name, "law": loaded.controller.law, "reference": loaded.reference_ship.mode, "about": about}
