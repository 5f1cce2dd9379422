"""The numbers in the texts of a connection's mistakes are those of the mistake, on either side, with the right sign."""

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from connection_mistakes import changed, columns, every, times
from connections import healthy, of, with_sensors
from durations import rest_long

from vessel_hsmc_ros.preflight.connection import TODO, WRONG, Connection
from vessel_hsmc_ros.preflight.rules import judge

NUMBER = r"(-?[\d.]+(?:e[+-]\d+)?)"


def stamps(seconds: float) -> Callable[[Connection], Connection]:
    return columns(stamp=lambda c: c["stamp"] + seconds)


def silent(seconds: float) -> Callable[[Connection], Connection]:
    return times(lambda t: np.where(t > t[len(t) // 2], t + seconds, t))


def of_variance(variance: float, limit: float) -> Callable[[Connection], Connection]:
    plant = columns(variance=lambda c: c["variance"] + variance)
    return lambda connection: plant(connection)._replace(covariance_limit=limit)


def scaled(**factors: float) -> Callable[[Connection], Connection]:
    """Commands whose numbers are larger by factors, and have so many times less effect."""

    def rule(name: str, factor: float) -> Callable[[Any], Any]:
        return lambda c: factor * c[name]

    return columns("/cmd_wrench", **{name: rule(name, factor) for name, factor in factors.items()})


def yaw_rates(side: float) -> Callable[[Connection], Connection]:
    return lambda _: with_sensors(imu={"r": lambda c: 0.1 * c["r"] + 40.0 * side * (np.arange(len(c["r"])) == 30)})


def courses(side: float) -> Callable[[Connection], Connection]:
    return lambda _: with_sensors(course={"value": lambda c: side * np.degrees(c["value"])})


def fixes(latitude: float, longitude: float) -> Callable[[Connection], Connection]:
    def plant(_: Connection) -> Connection:
        return with_sensors(
            fix={"latitude": lambda c: latitude + 0.0 * c["latitude"], "longitude": lambda c: longitude + 0.0 * c["longitude"]}
        )

    return plant


def repeated(connection: Connection) -> Connection:
    stamp = connection.topics["/odom"].columns["stamp"]
    return changed(
        connection, "/odom", columns={**connection.topics["/odom"].columns, "stamp": np.repeat(stamp[::2], 2)[: len(stamp)]}
    )


CASES: dict[str, tuple[Callable[[Connection], Connection], str, tuple[float, ...]]] = {
    "stamps that are old": (stamps(-3.0), rf"are {NUMBER} s old, above the time-out of {NUMBER} s", (3.01, 0.5)),
    "stamps that are ahead": (stamps(3.0), rf"are {NUMBER} s ahead of the clock here", (2.99,)),
    "a silence": (silent(2.0), rf"was silent for {NUMBER} s, above the time-out of {NUMBER} s", (2.04, 0.5)),
    "a low rate": (every(10), rf"has {NUMBER} Hz: it must have at least {NUMBER} Hz", (2.5, 5.0)),
    "length of orientations": (columns(norm=lambda c: 3.0 * c["norm"]), rf"orientations of length {NUMBER}:", (3.0,)),
    "a variance": (
        of_variance(25.0, 16.0),
        rf"a variance of {NUMBER} m², above safety.freshness.covariance_limit = {NUMBER}",
        (25.0, 16.0),
    ),
    "a deviation": (of_variance(400.0, math.inf), rf"a standard deviation of {NUMBER} m", (20.0,)),
    "repeated stamps": (repeated, rf"repeats its stamps, {NUMBER} of {NUMBER}", (562.0, 1124.0)),
    "a force of 20 times": (scaled(force=20.0), rf"the surge force has {NUMBER} times the effect", (0.05,)),
    "a moment of a twentieth": (
        scaled(moment=0.05),
        rf"the yaw moment has {NUMBER} times the effect",
        (20.0,),
    ),
    "a yaw rate to port": (yaw_rates(1.0), rf"has a yaw rate of {NUMBER}: it must be in rad/s", (40.0,)),
    "a yaw rate to starboard": (yaw_rates(-1.0), rf"has a yaw rate of {NUMBER}: it must be in rad/s", (40.0,)),
    "a course to starboard": (courses(1.0), rf"has values to {NUMBER}: it must be in rad", (343.8,)),
    "a course to port": (courses(-1.0), rf"has values to {NUMBER}: it must be in rad", (343.8,)),
    "a fix in the north": (fixes(95.0, -10.0), rf"is at {NUMBER}, {NUMBER}: are latitude", (95.0, -10.0)),
    "a fix in the south": (fixes(-95.0, 10.0), rf"is at {NUMBER}, {NUMBER}: are latitude", (-95.0, 10.0)),
    "a fix in the west": (fixes(50.0, -400.0), rf"is at {NUMBER}, {NUMBER}: are latitude", (50.0, -400.0)),
}


@pytest.mark.parametrize("name", rest_long(CASES, 11))
def test_the_numbers_of_a_mistake_are_those_that_were_planted(name: str) -> None:
    plant, pattern, expected = CASES[name]
    found = judge(plant(healthy()))
    texts = [*of(found, WRONG), *of(found, TODO)]
    matches = [match for text in texts if (match := re.search(pattern, text))]
    assert len(matches) == 1, texts
    assert [float(number) for number in matches[0].groups()] == pytest.approx(expected, rel=0.12)
