"""`vessel-hsmc path`: send a running vessel along waypoints."""

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import click
import yaml

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import vessel_option
from vessel_hsmc_ros.cli.running import running_vessel
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.scenario.bounded_text import read_text, read_yaml
from vessel_hsmc_ros.scenario.parameters_file import in_one_line

Waypoint = tuple[float, float, float]
"""x, y, heading."""


def read_waypoints(path: Path) -> list[Waypoint]:
    """Read waypoints from a file; those without a heading have the heading 0.

    CSV has a row for each, `x,y` or `x,y,heading`; a first row of names and lines that start with # are skipped. YAML has a
    list of lists `[x, y]`, or one list of all numbers as in the parameter `reference_ship.path.waypoints`.

    Raises:
        ScenarioError: the file cannot be read, has no waypoint, or one that is not two or three finite numbers.
    """
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"path file {path} cannot be read: {in_one_line(error)}") from None
    rows = _yaml_rows(text, path) if path.suffix in (".yaml", ".yml") else _csv_rows(text)
    try:
        points = [_waypoint(row, f"path file {path}, {place}") for place, row in rows]
    except csv.Error as error:  # a field of more than a hundred thousand characters, for instance
        raise ScenarioError(f"path file {path} cannot be read: {error}") from None
    if not points:
        raise ScenarioError(f"path file {path} has no waypoint: it takes x,y in each row")
    return points


def _csv_rows(text: str) -> Iterator[tuple[str, Sequence[Any]]]:
    lines = text.splitlines()
    first = True
    for number, row in enumerate(csv.reader(lines, skipinitialspace=True), 1):
        if not row or row[0].startswith("#"):
            continue
        if not (first and _is_name(row[0].strip())):
            yield f"line {number}", row
        first = False


def _is_name(cell: str) -> bool:
    """Whether a cell is the name of a column; nan and inf are numbers, which no waypoint has."""
    return cell.isidentifier() and cell.lower() not in ("nan", "inf", "infinity")


def _yaml_rows(text: str, path: Path) -> Iterator[tuple[str, Sequence[Any]]]:
    try:
        content = read_yaml(text)
    except yaml.YAMLError as error:
        raise ScenarioError(f"path file {path} cannot be read: {in_one_line(error)}") from None
    if isinstance(content, dict):
        content = content.get("waypoints")
    if not isinstance(content, list):
        raise ScenarioError(f"path file {path} has no list of waypoints: it takes [[x, y], [x, y], ...]")
    if content and not isinstance(content[0], list):
        content = [content[start : start + 2] for start in range(0, len(content), 2)]
    for number, row in enumerate(content, 1):
        yield f"waypoint {number}", row if isinstance(row, list) else [row]


def _waypoint(row: Sequence[Any], place: str) -> Waypoint:
    try:
        numbers = [float(cell) for cell in row]
    except (TypeError, ValueError, OverflowError):
        numbers = []
    if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
        shown = ",".join(map(str, row))
        raise ScenarioError(f"{place}: {shown} is not allowed: it takes x,y or x,y,heading, finite numbers")
    x, y, *heading = numbers
    return x, y, heading[0] if heading else 0.0


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@vessel_option
def path(file: Path, namespace: str) -> None:
    """Send a running vessel along the waypoints in FILE, a CSV or YAML file with x and y of each in metres.

    The reference ship must take paths: start it by `vessel-hsmc run waypoints --real-time`, or in any scenario with
    reference_ship.mode=path. A third column, the heading, is accepted but not used: the ship follows the legs between the
    waypoints. The exit code is 1 if the reference ship refuses the path.
    """
    points = read_waypoints(file)  # before the search for nodes: a wrong file is reported at once
    with running_vessel(namespace) as remote:
        from vessel_hsmc_ros.nodes.remote import send_path

        print_line(send_path(remote, points))
