"""The verbs that list what the package has: `scenarios`, `vessels` and `parameters`."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from itertools import takewhile
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_line, print_table
from vessel_hsmc_ros.cli.options import complete_scenario, json_option, law_file_option, print_json
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters import FIRST, NODES, WATCHERS
from vessel_hsmc_ros.scenario.scenario import load_scenario, scenario_names, scenario_text
from vessel_hsmc_ros.scenario.vessels import LibraryVessel, read_vessel
from vessel_hsmc_ros.studies.vessel_figures import COMPARED, HEAD, comparison, details, overview, published_vessels
from vessel_hsmc_ros.studies.vessel_figures import markdown as tables_in_markdown

SCENARIOS_USE = "vessel-hsmc scenarios NAME > my.yaml writes one to start from; vessel-hsmc run ./my.yaml runs it"


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
    print_line(SCENARIOS_USE)


def _row(name: str) -> dict[str, str]:
    """What a scenario is: the first sentence of its comment, its law and its reference."""
    loaded = load_scenario(name)
    lines = takewhile(lambda line: line.startswith("#"), scenario_text(name).splitlines())
    about = re.split(r"(?<=[.:]) (?=[A-Z])", " ".join(line.strip("# ") for line in lines), maxsplit=1)[0]
    return {"name": name, "law": loaded.controller.law, "reference": loaded.reference_ship.mode, "about": about}


VESSELS_USE = (
    "vessel-hsmc vessels NAME shows one of them; `vessel: NAME` in a scenario or --set vessel=NAME uses it (docs/vessels.md)"
)


@click.command()
@click.argument("name", required=False)
@click.option("--markdown", is_flag=True, help="Print the tables of all vessels in Markdown, for the docs.")
@json_option
def vessels(name: str | None, markdown: bool, as_json: bool) -> None:
    """List the vessels of the library, which a scenario selects by `vessel: NAME`, or show one: NAME or a vessel file.

    Speeds and turns are computed from the hull data. The column `verified` counts the published values that agree with them,
    `open` the published values that could not be checked.
    """
    if as_json:
        print_json(_content(read_vessel(name)) if name else [_content(each) for each in published_vessels()])
    elif name:
        _show(read_vessel(name))
    elif markdown:
        print_line(tables_in_markdown())
    else:
        print_table(HEAD, overview(published_vessels()), text_columns=3)
        print_line(VESSELS_USE)


def _content(vessel: LibraryVessel) -> dict[str, Any]:
    """All about a vessel, for programs."""
    shown = {field.name: getattr(vessel, field.name) for field in fields(vessel)}
    return {name: dict(value) if isinstance(value, Mapping) else value for name, value in shown.items()} | {
        "path": str(vessel.path)
    }


def _show(vessel: LibraryVessel) -> None:
    print_line(f"{vessel.name}: {vessel.description}".rstrip(": "))
    for key, text in vessel.source.items():
        print_line(f"{key}: {text}")
    print_table(["", "", ""], details(vessel), text_columns=3)
    if vessel.published:
        print_table(COMPARED, comparison([vessel]), title="beside the source", text_columns=2)
    _list("verified", vessel.verified)
    _list("not verified", vessel.unverified)


def _list(title: str, lines: Sequence[str]) -> None:
    for line in lines:
        print_line(f"{title}: {line}")


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
