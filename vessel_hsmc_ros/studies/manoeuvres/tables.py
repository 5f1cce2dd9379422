"""The metrics of the manoeuvres as tables: names in words, units, ship lengths, criteria of IMO resolution MSC.137(76), 5.3."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.quantities import number, quantity
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.manoeuvres.run import Manoeuvre, Results

SOURCE = "IMO resolution MSC.137(76), 5.3"

APPLIES = "applies to ships of 100 m and more"

SHORTEST = 100.0
"""Length of the smallest ships to which the resolution applies, m; to tankers of gas and chemicals of any length."""


class Criterion(NamedTuple):
    """An upper limit of a metric."""

    manoeuvre: str
    metric: str
    limit: float  # in the unit of the metric
    text: str  # the limit as the resolution gives it


def criteria(length: float, speed: float) -> list[Criterion]:
    """The criteria for a ship of a length L, m, with a test speed V, m/s."""
    passage = length / speed
    first, second = overshoot_limits(passage)
    return [
        Criterion("turning_circle", "advance", 4.5 * length, "4.5 L"),
        Criterion("turning_circle", "tactical_diameter", 5.0 * length, "5 L"),
        Criterion("zigzag_10", "initial_turning_distance", 2.5 * length, "2.5 L"),
        Criterion("zigzag_10", "first_overshoot", first, f"{first:.3g}° for L/V = {passage:.3g} s"),
        Criterion("zigzag_10", "second_overshoot", second, f"{second:.3g}° for L/V = {passage:.3g} s"),
        Criterion("zigzag_20", "first_overshoot", 25.0, "25°"),
        Criterion("crash_stop", "track_reach", 15.0 * length, "15 L"),
    ]


def overshoot_limits(passage: float) -> tuple[float, float]:
    """The limits of the first and second overshoot of the 10°/10° zig-zag, in degrees, for L/V in s."""
    # Linear in L/V between 10 s and 30 s, constant below and above.
    within = min(max(passage, 10.0), 30.0)
    return 5.0 + 0.5 * within, 17.5 + 0.75 * within


TITLES = {
    "turning_circle": "Turning circle, rudder 35°",
    "zigzag_10": "Zig-zag 10°/10°",
    "zigzag_20": "Zig-zag 20°/20°",
    "spiral": "Spiral (Dieudonné)",
    "crash_stop": "Crash stop",
    "speed_run": "Speed runs",
    "bollard_pull": "Bollard pull",
}

UNITS = {
    **dict.fromkeys(("advance", "transfer", "tactical_diameter", "steady_diameter", "initial_turning_distance"), "m"),
    **dict.fromkeys(("track_reach", "head_reach", "side_reach"), "m"),
    **dict.fromkeys(("time_90", "time_180", "time_360", "first_yaw_check_time", "second_yaw_check_time"), "s"),
    **dict.fromkeys(("initial_turning_time", "period", "stopping_time", "force_rise_time"), "s"),
    **dict.fromkeys(("steady_speed", "top_speed", "half_force_speed"), "m/s"),
    **dict.fromkeys(("drift_angle", "first_overshoot", "second_overshoot", "loop_width"), "°"),
    **dict.fromkeys(("steady_yaw_rate", "residual_yaw_rate", "largest_yaw_rate"), "°/s"),
    "speed_loss": "%",
    "bollard_pull": "N",
}
"""The unit of each metric."""

LABELS = {
    "time_90": "time to 90°",
    "time_180": "time to 180°",
    "time_360": "time to 360°",
    "drift_angle": "drift angle in the steady turn",
    "loop_width": "width of the loop, rudder angle",
    "residual_yaw_rate": "yaw rate with the rudder amidships",
    "half_force_speed": "speed at half of the force",
    "force_rise_time": "time to 95 % of the force",
}
"""Names of metrics in words, where they are not the names with spaces."""

MARGIN = 1e-3  # share of a range of speeds that counts as inside it: a manoeuvre may begin at its end


class Row(NamedTuple):
    """A metric as text."""

    manoeuvre: str
    metric: str
    # label, value, lengths: name in words; value with unit; the same in ship lengths, empty where it is no length
    label: str
    value: str
    lengths: str
    # limit, verdict: the criterion, and `within` or `beyond`; empty where there is none
    limit: str
    verdict: str


def rows(results: Results) -> list[Row]:
    """All metrics of a ship."""
    ship = results.ship
    limits = {(each.manoeuvre, each.metric): each for each in criteria(ship.length, ship.speed)}
    found = []
    for name, metrics in results.metrics.items():
        for metric, value in metrics.items():
            limit = limits.get((name, metric))
            verdict = "" if limit is None or math.isnan(value) else "within" if value <= limit.limit else "beyond"
            lengths = number(value / ship.length) if UNITS[metric] == "m" and math.isfinite(value) else ""
            label = LABELS.get(metric, metric.replace("_", " "))
            found.append(Row(name, metric, label, shown(value, UNITS[metric]), lengths, limit.text if limit else "", verdict))
    return found


OVERVIEW = (
    ("advance L", "turning_circle", "advance"),
    ("tactical diameter L", "turning_circle", "tactical_diameter"),
    ("steady diameter L", "turning_circle", "steady_diameter"),
    ("10°/10° first °", "zigzag_10", "first_overshoot"),
    ("second °", "zigzag_10", "second_overshoot"),
    ("20°/20° first °", "zigzag_20", "first_overshoot"),
    ("loop °", "spiral", "loop_width"),
    ("track reach L", "crash_stop", "track_reach"),
    ("top m/s", "speed_run", "top_speed"),
)
"""Columns of the table of several ships: name, manoeuvre and metric; lengths in ship lengths."""


def overview(found: Sequence[Results]) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of several ships, which have performed all manoeuvres."""
    lines = []
    for results in found:
        cells = []
        for _, manoeuvre, metric in OVERVIEW:
            value = results.metrics.get(manoeuvre, {}).get(metric, math.nan)
            scale = results.ship.length if UNITS[metric] == "m" else 1.0
            cells.append("∞" if math.isinf(value) else "–" if math.isnan(value) else number(value / scale))
        lines.append([results.ship.name, number(results.ship.length), number(results.ship.speed), *cells])
    return ["vessel", "L m", "test m/s", *(name for name, _, _ in OVERVIEW)], lines


def shown(value: float, unit: str) -> str:
    """A metric as text."""
    return "not checked" if math.isinf(value) else "not reached" if math.isnan(value) else quantity(value, unit)


def notes(done: Manoeuvre) -> Iterator[str]:
    """What the reader must know to judge a manoeuvre, a sentence each."""
    if done.failure:
        yield f"The simulation failed: {done.failure}."
        return
    if math.inf in done.metrics.values():
        yield "The rudder does not check the yaw: the ship goes on turning against it."
    if not done.complete:
        yield "Not everything is steady at the end of its step: near the edge of its loop a vessel needs very long to settle."
    hull, track = done.scenario.vessel_sim.vessel, done.track
    # A track is mirrored to the side of its first turn.
    side = 1.0 if done.scenario.controller.manoeuvre.side == "port" else -1.0
    ranges = (
        ("surge speed", "m/s", hull.surge_speed_range, track.u),
        ("sway speed", "m/s", hull.sway_speed_range, side * track.v),
        ("yaw rate", "rad/s", hull.yaw_rate_range, side * track.r),
    )
    for name, unit, (low, high), values in ranges:
        beyond = np.maximum(values - high, low - values)
        if beyond.max() > MARGIN * (high - low):
            reached = float(values[beyond.argmax()])
            yield f"The {name} reaches {reached:.3g} {unit}, outside the range of the hull data, {low:g} to {high:g} {unit}."


def hull_data(results: Results) -> list[tuple[str, str]]:
    """The hull data that are not zero, by name, as texts with their units."""
    hull = results.ship.scenario.vessel_sim.vessel
    values = schema.flatten(hull)
    units = {name: entry.unit for name, entry in schema.entries(type(hull)).items()}
    return [
        (name, f"{value:.6g} {units[name]}".strip())
        for name, value in values.items()
        if isinstance(value, float) and value and math.isfinite(value)
    ]


def source(results: Results) -> str:
    """The source of the hull data; empty where the scenario has no named vessel."""
    name = results.ship.scenario.vessel_sim.vessel.name
    return read_vessel(name).source.get("citation", "") if name else ""
