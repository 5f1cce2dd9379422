"""`vessel-hsmc vessels`: the library of published vessels, and everything about one of them."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_line, print_table
from vessel_hsmc_ros.cli.options import json_option, print_json
from vessel_hsmc_ros.scenario.vessels import (
    COMPARED,
    HEAD,
    LibraryVessel,
    comparison,
    details,
    overview,
    published_vessels,
    read_vessel,
)
from vessel_hsmc_ros.scenario.vessels import (
    markdown as tables_in_markdown,
)

USE = "vessel-hsmc vessels NAME shows one of them; `vessel: NAME` in a scenario or --set vessel=NAME uses it (docs/vessels.md)"


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
        print_line(USE)


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
