"""Wherever a time counts in whole periods, a multiple of the period counts as that many, however its quotient is rounded."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.guided.controller import LONGEST_AGE, delays
from vessel_hsmc_ros.control.interface.actuators import bank, channel
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.loop.control_loop import ages
from vessel_hsmc_ros.core.kernel import whole_periods

RATES = (3.0, 10.0, 20.0, 30.0, 50.0, 100.0)


def of_guided(rate: float) -> Callable[[float], int]:
    law: Any = make_controller("guided", 1.0 / rate, **INSTANT)
    return lambda age: delays(age, law.memory, law.constants.gains)[1]


def of_manoeuvre(rate: float, name: str) -> Callable[[float], int]:
    def count(time: float) -> int:
        made: Any = make_controller("manoeuvre", 1.0 / rate, **{f"{name}_time": time})
        return int(getattr(made.constants, name))

    return count


def of_bank(rate: float) -> Callable[[float], int]:
    """Of an interval, which is as long as the period where that is long."""
    vessel = {**INSTANT, "yaw_inertia": 400.0 / rate**2, "yaw_moment_limit": 1.0}

    def count(dead_time: float) -> int:
        found = bank(KnownVessel(**{**vessel, "yaw_dead_time": dead_time}), 1.0 / rate)
        assert found.every == 1
        return int(found.late[0])

    return count


COUNTS: dict[str, Callable[[float], Callable[[float], int]]] = {
    "delay line": lambda rate: lambda delay: whole_periods(delay, 1.0 / rate),
    "dead time of a law": lambda rate: lambda delay: channel(1.0, 0.0, 0.0, math.inf, delay, 1.0 / rate).delay,
    "age of a measurement": lambda rate: lambda age: int(ages(np.array([round(age * 1e9)]), np.array([0]), 1.0 / rate)[1][0]),
    "age of a measurement of the guided law": of_guided,
    "dead time of the identification": of_bank,
    "approach of a manoeuvre": lambda rate: of_manoeuvre(rate, "approach"),
    "step of a manoeuvre": lambda rate: of_manoeuvre(rate, "hold"),
}


@pytest.mark.parametrize("name", COUNTS)
@pytest.mark.parametrize("rate", RATES)
def test_a_multiple_of_the_period_counts_as_that_many_periods(name: str, rate: float) -> None:
    count, most = COUNTS[name](rate), min(60, int(LONGEST_AGE * rate))
    wanted = range(1, most)
    for times in ([k / rate for k in wanted], [round(k / rate, 6) for k in wanted], [k * (1.0 / rate) for k in wanted]):
        assert [count(time) for time in times] == list(wanted)
