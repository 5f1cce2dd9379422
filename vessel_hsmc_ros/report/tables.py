"""The tables of a report: metrics with their differences between runs, parameters, provenance."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.report.record import Record, over_shared_interval
from vessel_hsmc_ros.scenario.parameters import NODES

METRICS = {
    "leg_cross_track_rms": ("legs, cross-track error, rms", "m"),
    "leg_cross_track_peak": ("legs, cross-track error, largest", "m"),
    "leg_along_track_rms": ("legs, along-track error, rms", "m"),
    "legs_missed": ("legs, share of their length that was missed", "%"),
    "turn_cross_track_rms": ("turns, cross-track error, rms", "m"),
    "position_error_rms_last_quarter": ("position error, rms of the last quarter", "m"),
    "position_error_peak_last_quarter": ("position error, largest of the last quarter", "m"),
    "position_error_final": ("position error, final", "m"),
    "settling_time": ("position error, settling time", "s"),
    "position_error_rms": ("position error, rms with the approach", "m"),
    "heading_error_final_deg": ("heading error, final", "°"),
    "heading_error_rms_deg": ("heading error, rms with the approach", "°"),
    "surge_force_peak": ("surge force, peak", "N"),
    "surge_force_rms": ("surge force, rms", "N"),
    "surge_force_at_limit": ("surge force, time at its limit", "%"),
    "surge_force_travel": ("surge force, travel relative to its limit", "1/min"),
    "yaw_moment_peak": ("yaw moment, peak", "N·m"),
    "yaw_moment_rms": ("yaw moment, rms", "N·m"),
    "yaw_moment_at_limit": ("yaw moment, time at its limit", "%"),
    "yaw_moment_travel": ("yaw moment, travel relative to its limit", "1/min"),
}
"""Labels and units of the metrics, in the order of the table: first how well a run tracks once it has arrived. For all of them
less is better."""

FACTS = {
    "run_duration": ("duration of the run", "s"),
    "metrics_interval": ("metrics above: over the first, which all runs share", "s"),
    "missed_periods": ("control periods missed", ""),
    "control_interval_deviation_max": ("control interval, largest deviation", "s"),
    "messages_recorded": ("messages recorded", ""),
    "messages_dropped": ("messages dropped", ""),
    "start_up": ("from the command to the first control step", "s"),
    "real_time_factor": ("real-time factor", ""),
}
COSTS = ("missed_periods", "messages_dropped")  # facts for which less is better, as for every metric
NOTABLE = 0.01  # relative difference below which a value is shown as neither better nor worse
ROUNDING = 1e-9
"""Difference, in SI units and relative to the larger value, below which two values are equal but for their rounding."""

LARGEST_SHARE = 10.0  # largest difference, in multiples of the first value, that is expressed in percent
MISSING = "–"


class Quantity(NamedTuple):
    """A number to show."""

    # label, value, unit: its name, its number and its unit
    label: str
    value: float
    unit: str
    cost: bool  # whether less is better
    relative: bool  # whether a difference is also expressed in percent

    @property
    def text(self) -> str:
        """The value with its unit."""
        return quantity(self.value, self.unit)


class MetricRow(NamedTuple):
    """One quantity of several runs; None for runs that lack it."""

    label: str
    values: tuple[Quantity | None, ...]

    def text(self, run: int) -> str:
        """The value of a run with its unit."""
        value = self.values[run]
        return value.text if value else MISSING

    def difference(self, run: int) -> str:
        """Difference of a value from the first run's, with sign and unit; empty if equal up to rounding or missing."""
        first, other = self.values[0], self.values[run]
        if first is None or other is None:
            return ""
        change, size = other.value - first.value, abs(first.value)
        if abs(change) <= ROUNDING * max(1.0, size):
            return ""
        # Relative to a value near zero, any difference is huge: the percentage would only show that the value is near zero.
        share = f" ({100.0 * change / size:+.3g} %)" if other.relative and abs(change) < LARGEST_SHARE * size else ""
        return quantity(change, other.unit, sign=True) + share

    def sense(self, run: int) -> str:
        """`better` or `worse` than the first run; empty where that is not notable or not defined."""
        first, other = self.values[0], self.values[run]
        if run == 0 or first is None or other is None or not other.cost:
            return ""
        gain = abs(first.value) - abs(other.value)
        if abs(gain) <= NOTABLE * abs(first.value):
            return ""
        return "better" if gain > 0.0 else "worse"


def quantities(metrics: Metrics | None, facts: Mapping[str, Any]) -> list[Quantity]:
    """Every metric and fact of a run that tables show."""
    values = metrics._asdict() if metrics else {}
    found = []
    for name, (label, unit) in METRICS.items():
        if values.get(name) is not None:
            value = 100.0 * values[name] if unit == "%" else values[name]
            found.append(Quantity(label, float(value), unit, cost=True, relative=unit != "%"))
    for name, (label, unit) in FACTS.items():
        if facts.get(name) is not None:
            found.append(Quantity(label, float(facts[name]), unit, cost=name in COSTS, relative=False))
    return found


def rows(metrics: Metrics | None, facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The table of a single run: labels and values with their units."""
    return [(quantity.label, quantity.text) for quantity in quantities(metrics, facts)]


def metrics_table(records: Sequence[Record]) -> list[MetricRow]:
    """Metrics and facts of some runs side by side, metrics over the interval that all runs cover."""
    columns = [
        {quantity.label: quantity for quantity in quantities(record.metrics, record.facts)}
        for record in over_shared_interval(records)
    ]
    labels = [label for label, _ in (*METRICS.values(), *FACTS.values()) if any(label in column for column in columns)]
    return [MetricRow(label, tuple(column.get(label) for column in columns)) for label in labels]


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
            lines.append({**shown, "values": [value_text(value) for value in values], "changed": changed, "text": text})
        tables.append({"name": node, "rows": lines})
    return tables


def value_text(value: object) -> str:
    """A parameter's value as tables show it."""
    if value is None:
        return MISSING
    if isinstance(value, tuple):
        return "[" + ", ".join(value_text(item) for item in value) + "]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def provenance_table(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Code version, machine and time of each run."""
    labels = dict.fromkeys(label for record in records for label in record.provenance)
    return [
        {"label": label.replace("_", " "), "values": [str(record.provenance.get(label, MISSING)) for record in records]}
        for label in labels
    ]


def label(metric: str) -> str:
    """A metric in words."""
    return METRICS[metric][0]


def text(metric: str, value: float) -> str:
    """A value of a metric with its unit; a dash where there is none."""
    unit = METRICS[metric][1]
    return quantity(100.0 * value if unit == "%" else value, unit) if math.isfinite(value) else MISSING
