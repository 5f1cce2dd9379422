"""The criteria of IMO resolution MSC.137(76), Standards for ship manoeuvrability, 5.3, for ships of 100 m and more.

| symbol | meaning | unit |
|---|---|---|
| L, V | length of the ship, test speed | m, m/s |
"""

from typing import NamedTuple

from vessel_hsmc_ros.manoeuvres.run import Results

SOURCE = "IMO resolution MSC.137(76), 5.3"

APPLIES = "applies to ships of 100 m and more"

SHORTEST = 100.0
"""Length of the smallest ships to which the resolution applies, m; to tankers of gas and chemicals of any length."""


class Criterion(NamedTuple):
    """An upper limit of a metric.

    Attributes:
        manoeuvre, metric: Their names.
        limit: In the unit of the metric.
        text: The limit as the resolution gives it.
    """

    manoeuvre: str
    metric: str
    limit: float
    text: str


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


def criterion_of(results: Results, manoeuvre: str, metric: str) -> Criterion | None:
    """The criterion of a metric; None if it has none."""
    every = criteria(results.ship.length, results.ship.speed)
    return next((each for each in every if (each.manoeuvre, each.metric) == (manoeuvre, metric)), None)
