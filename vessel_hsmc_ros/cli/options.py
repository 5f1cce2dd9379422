"""Arguments and options that several verbs take."""

from collections.abc import Iterable
from pathlib import Path

import click
import yaml

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.law_file import OPTION, load_law_file
from vessel_hsmc_ros.scenario.parameters_file import read_yaml

scenario_argument = click.argument("scenario")

bag_argument = click.argument("bag", type=click.Path(path_type=Path))

set_option = click.option(
    "--set", "changes", multiple=True, metavar="NODE.PARAM=VALUE", help="Set a parameter; may be given several times."
)


def _load_law_files(_context: click.Context, _option: click.Parameter, paths: tuple[Path, ...]) -> None:
    for path in paths:
        load_law_file(path)


law_file_option = click.option(
    OPTION,
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Python file with a control law of your own; may be given several times.",
    callback=_load_law_files,
    expose_value=False,
    is_eager=True,
)
"""Registers the laws before the verb starts, which therefore takes no argument for it."""

output_option = click.option(
    "--output",
    type=click.Path(path_type=Path),
    default=Path("runs"),
    show_default=True,
    help="Folder in which the run folder is created.",
)

namespace_option = click.option("--namespace", help="ROS namespace of the vessel, if the bag holds several vessels.")


def parse_changes(changes: Iterable[str], option: str = "--set") -> dict[str, object]:
    """Parse texts of the form `node.param=value`, with the value in YAML.

    Args:
        changes: The texts.
        option: The command-line option they belong to, for error messages.

    Returns:
        Values by `node.param`.

    Raises:
        ParameterError: a text has no equals sign, or its value is not YAML.
    """
    parsed: dict[str, object] = {}
    for change in changes:
        key, equals, value = change.partition("=")  # at the first one: a regular expression may contain more
        if not equals:
            raise ParameterError(f"{option} {change} is not allowed: it takes node.param=value")
        try:
            parsed[key.strip()] = read_yaml(value)
        except yaml.YAMLError:
            raise ParameterError(f"{option} {change} is not allowed: {value} is not a YAML value") from None
    return parsed
