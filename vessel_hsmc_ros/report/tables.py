"""The tables of a report: metrics with their differences between runs, parameters, provenance."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.record import Record, over_shared_interval
from vessel_hsmc_ros.scenario.parameters import NODES

UNITS = {"deg": "°", "position": " m", "force": " N", "moment": " N·m"}
LABELS = {
    "position_error_rms_last_quarter": "position error, rms of the last quarter",
    "heading_error_rms_deg": "heading error, rms",
    "heading_error_final_deg": "heading error, final",
}
FACTS = {
    "run_duration": ("duration of the run", "g", " s"),
    "metrics_interval": ("metrics above: over the first, which all runs share", "g", " s"),
    "missed_periods": ("control periods missed", ".0f", ""),
    "control_interval_deviation_max": ("control interval, largest deviation", ".2g", " s"),
    "messages_recorded": ("messages recorded", ".0f", ""),
    "messages_dropped": ("messages dropped", ".0f", ""),
    "start_up": ("from the command to the first control step", ".2f", " s"),
    "real_time_factor": ("real-time factor", ".1f", ""),
}
COSTS = ("missed_periods", "messages_dropped")
"""Facts for which less is better, as for every metric."""

NOTABLE = 0.01
"""Relative difference below which a value is shown as neither better nor worse."""

LARGEST_SHARE = 10.0
"""Largest difference, in multiples of the first value, that is expressed in percent."""

MISSING = "–"


class Quantity(NamedTuple):
    """A number to show.

    Attributes:
        label, value: Its name and its number.
        form, unit: Format specification and unit of its text.
        cost: Whether less is better.
    """

    label: str
    value: float
    form: str
    unit: str
    cost: bool

    @property
    def text(self) -> str:
        """The value with its unit."""
        return f"{self.value:{self.form}}{self.unit}"


class MetricRow(NamedTuple):
    """One quantity of several runs; None for runs that lack it."""

    label: str
    values: tuple[Quantity | None, ...]

    def text(self, run: int) -> str:
        """The value of a run with its unit."""
        value = self.values[run]
        return value.text if value else MISSING

    def difference(self, run: int) -> str:
        """The difference of a run's value from the first run's, with sign and unit; empty if equal or if one is missing."""
        first, other = self.values[0], self.values[run]
        if first is None or other is None or first.value == other.value:
            return ""
        change, size = other.value - first.value, abs(first.value)
        # Relative to a value near zero, any difference is huge: the percentage would only show that the value is near zero.
        meaningful = other.form == ".4g" and abs(change) < LARGEST_SHARE * size
        share = f" ({100.0 * change / size:+.3g} %)" if meaningful else ""
        return f"{change:+{other.form}}{other.unit}{share}"

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
    found = []
    for name, value in metrics._asdict().items() if metrics else ():
        unit = next((unit for part, unit in UNITS.items() if part in name.split("_")), "")
        *words, last = name.split("_")
        found.append(Quantity(LABELS.get(name, f"{' '.join(words)}, {last}"), float(value), ".4g", unit, True))
    for name, (label, form, unit) in FACTS.items():
        if facts.get(name) is not None:
            found.append(Quantity(label, float(facts[name]), form, unit, name in COSTS))
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
    labels = dict.fromkeys(label for column in columns for label in column)
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
