"""Options that several verbs take, and how their values are read."""

from collections.abc import Iterable

import click
import yaml

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.scenario import read_yaml

set_option = click.option(
    "--set", "changes", multiple=True, metavar="NODE.PARAM=VALUE", help="Change a parameter; may be given several times."
)


def parse_changes(changes: Iterable[str], option: str = "--set") -> dict[str, object]:
    """`node.param=value` texts, values in YAML.

    Args:
        changes: The texts.
        option: Where they were given, for error messages.

    Raises:
        ParameterError: a text is not like that.
    """
    parsed: dict[str, object] = {}
    for change in changes:
        key, equals, value = change.partition("=")
        if not equals:
            raise ParameterError(f"{option} {change} is not allowed: it takes node.param=value")
        try:
            parsed[key.strip()] = read_yaml(value)
        except yaml.YAMLError:
            raise ParameterError(f"{option} {change} is not allowed: {value} is not a YAML value") from None
    return parsed
