"""The library of vessels as tables: all of them side by side, and everything about one."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import fields

from vessel_hsmc_ros.core.schema import shown
from vessel_hsmc_ros.scenario.parameters import VESSEL
from vessel_hsmc_ros.scenario.vessel_figures import Figures, agreement, agrees, figures
from vessel_hsmc_ros.scenario.vessels import LibraryVessel, hull_data, read_vessel, vessel_names

Row = Sequence[str]

HEAD = ("vessel", "name", "inputs", "length m", "mass kg", "top m/s", "turn rad/s", "pivot m", "m11/m22", "verified", "open")

COMPARED = ("vessel", "figure", "computed", "published", "difference")

INFORMATION = {each.name: each.metadata for each in fields(Figures)}
"""Unit and meaning of each figure."""


def published_vessels() -> list[LibraryVessel]:
    """The vessels that come with the package."""
    return [read_vessel(name) for name in vessel_names()]


def overview(vessels: Iterable[LibraryVessel]) -> list[Row]:
    """Vessels with their main figures; the columns are those of HEAD."""
    return [_summary(vessel) for vessel in vessels]


def comparison(vessels: Iterable[LibraryVessel]) -> list[Row]:
    """The published figures of vessels beside the computed ones; the columns are those of COMPARED."""
    rows: list[Row] = []
    for vessel in vessels:
        computed = figures(vessel)
        for name, difference in agreement(vessel, computed).items():
            verdict = "" if agrees(name, difference) else ", not verified"
            values = number(getattr(computed, name)), number(vessel.published[name])
            rows.append((vessel.key, _with_unit(name), *values, f"{100.0 * difference:+.1f} %{verdict}"))
    return rows


def details(vessel: LibraryVessel) -> list[Row]:
    """Figures and hull data of one vessel: name with unit, value, meaning."""
    computed, entries = figures(vessel), hull_data()
    rows: list[Row] = [(_with_unit(name), number(getattr(computed, name)), each["words"]) for name, each in INFORMATION.items()]
    for key, value in vessel.values.items():
        name = key.removeprefix(VESSEL)
        entry = entries[name][0]
        rows.append((f"{name} {entry.unit}".strip(), shown(value), entry.description))
    return rows


def markdown() -> str:
    """Overview and comparison as tables of Markdown, for the docs."""
    tables = ((HEAD, overview(published_vessels())), (COMPARED, comparison(published_vessels())))
    return "\n\n".join(_markdown(head, rows) for head, rows in tables)


def number(value: float) -> str:
    """A number with three digits; empty for NaN."""
    return "" if math.isnan(value) else f"{float(f'{value:.3g}'):g}"


def _summary(vessel: LibraryVessel) -> Row:
    computed, hull = figures(vessel), vessel.hull()
    inputs = ", ".join(dict.fromkeys(hull.thrusters.kinds)) if hull.thrusters else "wrench"
    verified = sum(agrees(name, difference) for name, difference in agreement(vessel, computed).items())
    published = f"{verified} of {len(vessel.published)}" if vessel.published else ""
    sizes = (hull.length, vessel.mass or math.nan)
    speeds = (computed.top_speed, computed.turning_rate, computed.pivot, computed.mass_ratio)
    return (vessel.key, vessel.name, inputs, *map(number, (*sizes, *speeds)), published, str(len(vessel.unverified)))


def _with_unit(name: str) -> str:
    return f"{name} {INFORMATION[name]['unit']}".strip()


def _markdown(head: Row, rows: Sequence[Row]) -> str:
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows))
