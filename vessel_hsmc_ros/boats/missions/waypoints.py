"""Waypoints of a path message, x and y in metres, from a CSV or YAML file."""

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.quantities import number_of
from vessel_hsmc_ros.scenario.named_files import SUFFIXES
from vessel_hsmc_ros.scenario.parameters_file import parsed, read_file

Waypoint = tuple[float, float, float]  # x, y, heading


COLUMNS = ("x", "y", "z", "heading")  # names of the columns; x and y are needed
FORM = "x and y, and perhaps z and heading, in metres and radians in the frame of the odometry"


def read_waypoints(path: Path) -> list[Waypoint]:
    """Read waypoints from a file; those without a heading have the heading 0.

    CSV has a row for each, `x,y` or `x,y,heading`, or the columns that its first row names, in any order; lines that start
    with # are skipped. YAML has a list of lists `[x, y]` or `[x, y, heading]`, also as the value of `waypoints`.
    """
    text = read_file(path, "path file")
    rows = _yaml_rows(text, path) if path.suffix in SUFFIXES else _csv_rows(text, path)
    try:
        points = [_waypoint(row, f"path file {path}, {place}") for place, row in rows]
    except csv.Error as error:  # a field of more than a hundred thousand characters, for instance
        raise ScenarioError(f"path file {path} cannot be read: {error}") from None
    if not points:
        raise ScenarioError(f"path file {path} has no waypoint: each row must be x,y")
    return points


def _csv_rows(text: str, path: Path) -> Iterator[tuple[str, Sequence[Any]]]:
    """The rows with their places; of named columns x, y and heading, where there is one."""
    names: list[str] | None = None
    for number, row in enumerate(csv.reader(text.splitlines(), skipinitialspace=True), 1):
        if not row or row[0].startswith("#"):
            continue
        if names is None:
            names = [] if any(map(_is_number, row)) else _names(row, f"path file {path}, line {number}")
            if names:
                continue
        yield f"line {number}", _ordered(row, names, f"path file {path}, line {number}") if names else row


def _is_number(cell: str) -> bool:
    """Whether a cell is a number, of any script; also nan and inf, which no waypoint has."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _names(row: Sequence[str], place: str) -> list[str]:
    """The names of the columns."""
    names = [cell.strip() for cell in row]
    if not {"x", "y"} <= set(names) <= set(COLUMNS) or len(set(names)) < len(names):
        raise ScenarioError(f"{place}: columns must be {FORM} (got {', '.join(names)})")
    return names


def _ordered(row: Sequence[str], names: Sequence[str], place: str) -> list[str]:
    if len(row) != len(names):
        raise ScenarioError(f"{place} must be {len(names)} numbers, {','.join(names)} (got {','.join(row)})")
    cells = dict(zip(names, row, strict=True))
    return [cells[name] for name in ("x", "y", "heading") if name in cells]


def _yaml_rows(text: str, path: Path) -> Iterator[tuple[str, Sequence[Any]]]:
    content = parsed(text, f"path file {path}")
    if isinstance(content, dict):
        content = content.get("waypoints")
    # Of a list of six numbers it is not known whether they are three pairs, or two waypoints with a heading.
    if not isinstance(content, list) or (content and not any(isinstance(row, list) for row in content)):
        raise ScenarioError(f"path file {path} has no list of waypoints: it must be [[x, y], [x, y], ...]")
    for number, row in enumerate(content, 1):
        yield f"waypoint {number}", row if isinstance(row, list) else [row]


def _waypoint(row: Sequence[Any], place: str) -> Waypoint:
    try:
        numbers = [number_of(str(cell)) for cell in row]
    except (TypeError, ValueError, OverflowError):
        numbers = []
    if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
        raise ScenarioError(f"{place} must be x,y or x,y,heading, finite numbers (got {','.join(map(str, row))})")
    x, y, *heading = numbers
    return x, y, heading[0] if heading else 0.0
