"""The tables of a report: key figures with their differences, parameters, where the run comes from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.signals import Signals
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.scenario import Scenario

Row = tuple[str, str]

UNITS = {"deg": "°", "position": " m", "force": " N", "moment": " N·m"}
LABELS = {
    "position_error_rms_last_quarter": "position error, rms of the last quarter",
    "heading_error_rms_deg": "heading error, rms",
    "heading_error_final_deg": "heading error, final",
}
FACTS = {
    "missed_periods": ("control periods missed", ".0f", ""),
    "control_interval_deviation_max": ("control interval, largest deviation", ".2g", " s"),
    "messages_recorded": ("messages recorded", ".0f", ""),
    "messages_dropped": ("messages dropped", ".0f", ""),
    "start_up": ("from the command to the first control step", ".2f", " s"),
    "real_time_factor": ("times faster than real time", ".1f", ""),
}

ORIGIN = ("scenario", "mode", "namespace", "seed", "started", "version", "git_commit", "host", "system", "python")
"""What is told of where a run comes from, by the names in run.json."""

NOTABLE = 0.01
"""A difference below this share is not called better or worse."""


@dataclass(frozen=True)
class Record:
    """One run, as a report tells of it.

    Attributes:
        name: What to call it, short.
        limits: Largest surge force [N] and yaw moment [N·m] of the actuators.
        metrics: None where there is no reference to measure against.
        facts: What else was measured, by name.
        scenario: None where the parameters are not known.
        provenance: Which code, machine and time, in words.
    """

    name: str
    signals: Signals
    metrics: Metrics | None = None
    facts: Mapping[str, Any] = field(default_factory=dict)
    scenario: Scenario | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @property
    def limits(self) -> tuple[float, float]:
        """Largest surge force [N] and yaw moment [N·m] of the actuators, infinite where there are none."""
        if self.scenario is None:
            return float("inf"), float("inf")
        actuators = self.scenario.vessel_sim.actuators
        return actuators.surge_force_limit, actuators.yaw_moment_limit


class Quantity(NamedTuple):
    """A key figure; `cost` where less is better."""

    label: str
    value: float
    form: str
    unit: str
    cost: bool

    @property
    def text(self) -> str:
        """The figure with its unit."""
        return f"{self.value:{self.form}}{self.unit}"


def quantities(metrics: Metrics | None, facts: Mapping[str, Any]) -> list[Quantity]:
    """The key figures of a run."""
    found = []
    for name, value in metrics._asdict().items() if metrics else ():
        unit = next((unit for part, unit in UNITS.items() if part in name.split("_")), "")
        *words, last = name.split("_")
        found.append(Quantity(LABELS.get(name, f"{' '.join(words)}, {last}"), float(value), ".4g", unit, True))
    for name, (label, form, unit) in FACTS.items():
        if facts.get(name) is not None:
            found.append(Quantity(label, float(facts[name]), form, unit, name in ("missed_periods", "messages_dropped")))
    return found


def rows(metrics: Metrics | None, facts: Mapping[str, Any]) -> list[Row]:
    """The table of a run: what, and how much."""
    return [(quantity.label, quantity.text) for quantity in quantities(metrics, facts)]


def key_figures(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Key figures of every run, and the differences from the first one."""
    columns = [{quantity.label: quantity for quantity in quantities(record.metrics, record.facts)} for record in records]
    labels = dict.fromkeys(label for column in columns for label in column)
    table = []
    for label in labels:
        first = columns[0].get(label)
        cells: list[dict[str, str]] = []
        for i, column in enumerate(columns):
            mine = column.get(label)
            cells.append({"text": mine.text if mine else "–", "sense": ""})
            if i:
                cells.append(_difference(first, mine))
        table.append({"label": label, "cells": cells})
    return table


def _difference(first: Quantity | None, mine: Quantity | None) -> dict[str, str]:
    """How a figure differs from the first run's, and whether for the better."""
    if first is None or mine is None:
        return {"text": "", "sense": ""}
    change = mine.value - first.value
    size = abs(first.value)
    share = f" ({100.0 * change / size:+.3g} %)" if size and mine.form == ".4g" else ""
    gain = size - abs(mine.value) if mine.cost else 0.0
    sense = "" if abs(gain) <= NOTABLE * size else "better" if gain > 0.0 else "worse"
    return {"text": f"{change:+{mine.form}}{mine.unit}{share}", "sense": sense}


def parameter_tables(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Every parameter by node; `changed` where it differs from its default, or with several runs between them."""
    scenarios = [record.scenario for record in records]
    if not any(scenarios):
        return []
    tables = []
    for node, declared in NODES.items():
        flat = [schema.flatten(getattr(scenario, node)) if scenario else {} for scenario in scenarios]
        lines = []
        for name, entry in schema.entries(declared).items():
            values = [column.get(name) for column in flat]
            changed = any(value != values[0] for value in values) if len(values) > 1 else values[0] != entry.default
            text = f"{node}.{name} {entry.symbol} {entry.description}".lower()
            shown = {"name": name, "unit": entry.unit, "symbol": entry.symbol, "meaning": entry.description}
            lines.append({**shown, "values": [_value(value) for value in values], "changed": changed, "text": text})
        tables.append({"name": node, "rows": lines})
    return tables


def _value(value: object) -> str:
    if value is None:
        return "–"
    if isinstance(value, tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def provenance_table(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Where each run comes from."""
    labels = dict.fromkeys(label for record in records for label in record.provenance)
    return [
        {"label": label.replace("_", " "), "values": [str(record.provenance.get(label, "–")) for record in records]}
        for label in labels
    ]
