"""`vessel-hsmc init`: a commented scenario for a ship of one's own."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario


def main_data_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add an option for each of the ship's main data, from their declarations."""
    for name, entry in reversed(schema.entries(MainData).items()):
        option = f"--{name.replace('_', '-')}"
        command = click.option(option, type=float, metavar=entry.unit, help=entry.description)(command)
    return command


@click.command()
@click.argument("name")
@main_data_options
def init(name: str, **data: Any) -> None:
    """Write NAME.yaml, a complete commented scenario for a ship of your own.

    Give what you know of the ship; the rest is estimated by rules of thumb, which the file states.
    """
    path = Path(name).with_suffix(".yaml") if name.endswith((".yaml", ".yml")) else Path(f"{name}.yaml")
    given = {key: value for key, value in data.items() if value is not None}
    text = scenario_text(path.stem, schema.build(MainData, given, "init"))
    parse_scenario(text, path.stem, source="the new scenario")  # before it is written: a ship may be too extreme for the ranges
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ScenarioError(f"{path} exists and is not overwritten: choose another name, or delete it") from None
    except OSError as error:
        raise ScenarioError(f"{path} cannot be written: {error.strerror}") from None
    print_line(f"scenario: {path}; next: vessel-hsmc simulate {path}")
