"""`vessel-hsmc parameters`: all parameters by their declarations."""

from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import json_option, law_file_option, print_json
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters import FIRST, NODES, WATCHERS


@click.command()
@click.argument("word", default="")
@json_option
@law_file_option
def parameters(word: str, as_json: bool) -> None:
    """List all parameters, with their ranges and meaning, or those in whose name or meaning WORD occurs.

    The first ones are those that the owner of a vessel sets.
    """
    rows = matching(word)
    if not rows:
        raise ParameterError(f"no parameter has {word} in its name or meaning: vessel-hsmc parameters lists all")
    if as_json:
        print_json(rows)
        return
    for row in rows:
        print_line(f"{row['name']} = {row['default']}{' *' if row['tunable'] else ''}")
        print_line(f"    {row['meaning']}; {row['allowed']}")


def matching(word: str) -> list[dict[str, Any]]:
    """The parameters in whose full name or meaning a word occurs, whatever its case; all for an empty word.

    Returns a record for each: name with its node, default, allowed values, meaning, and whether it can be changed at run time.
    """
    found = []
    for node, cls in (NODES | WATCHERS).items():
        for name, entry in schema.entries(cls).items():
            if word.casefold() in f"{node}.{name} {entry.description}".casefold():
                default = list(entry.default) if isinstance(entry.default, tuple) else entry.default
                record: dict[str, Any] = {"name": f"{node}.{name}", "default": default, "allowed": entry.allowed}
                found.append(record | {"meaning": entry.description, "tunable": entry.tunable})
    return sorted(found, key=lambda record: FIRST.index(record["name"]) if record["name"] in FIRST else len(FIRST))
