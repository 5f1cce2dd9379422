"""What a law knows of a ship: the point at which the yaw moment does not enter the sway, and what is not declared."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.actuators import ASSUMED_LAG, dynamics, unit_time
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.core.hull import DrawnHull, Hull

BARE: dict[str, Any] = {"surge_inertia": 9e3, "sway_inertia": 14e3, "yaw_inertia": 1.3e5}
COUPLINGS: list[dict[str, Any]] = [
    {"sway_yaw_inertia": 6e3, "yaw_sway_inertia": 2e3, "sway_force_per_yaw_moment": 0.01},
    {"sway_yaw_inertia": 6e3, "yaw_sway_inertia": 2e3, "sway_force_per_yaw_moment": -0.03},
    {"sway_yaw_inertia": 6e3, "yaw_sway_inertia": -3e3},
    {"sway_yaw_inertia": -5e3, "yaw_sway_inertia": 2e3},
    {"sway_yaw_inertia": 6e3},
    {"sway_yaw_inertia": 0.0, "yaw_sway_inertia": 4e3, "sway_force_per_yaw_moment": -0.03},
    {"sway_force_per_yaw_moment": 0.03},
    {},
]


@pytest.mark.parametrize("choice", ["ahead", "percussion", "origin"])
@pytest.mark.parametrize("coupling", COUPLINGS, ids=str)
def test_the_moment_accelerates_the_known_inertia_and_at_the_controlled_point_no_sway(
    coupling: dict[str, Any], choice: str
) -> None:
    vessel = KnownVessel(**BARE, **coupling, controlled_point=choice)
    m23, e = vessel.sway_yaw_inertia, vessel.sway_force_per_yaw_moment
    M = np.array([[vessel.sway_inertia, m23], [vessel.yaw_sway_inertia or m23, vessel.yaw_inertia]])
    dv, dr = np.linalg.solve(M, [e, 1.0])
    known = vessel.as_controlled()
    assert known.yaw_inertia == pytest.approx(1.0 / dr)
    assert vessel.percussion_point == pytest.approx(-dv / dr)
    wanted = 0.0 if choice == "origin" or (choice == "ahead" and -dv / dr < 0.0) else -dv / dr
    assert known.ahead == vessel.controlled == pytest.approx(wanted)
    couplings = known.sway_yaw_inertia, known.yaw_sway_inertia, known.sway_force_per_yaw_moment
    assert couplings == ((0.0, 0.0, 0.0) if wanted else (m23, vessel.yaw_sway_inertia, e))


NAMES = [f"{axis}_{what}" for axis in ("surge", "yaw") for what in ("lag", "dead_time")] + ["surge_force_rate", "yaw_moment_rate"]


@pytest.mark.parametrize("given", [*([name] for name in NAMES), [], NAMES[:5], NAMES], ids=str)
def test_a_lag_is_assumed_only_where_nothing_is_declared_of_either_input(given: list[str]) -> None:
    found = dynamics(KnownVessel(**{name: INSTANT[name] for name in given}))
    assumed = 0.0 if given else ASSUMED_LAG * unit_time(KnownVessel())
    assert [each.lag for each in (found.surge, found.yaw)] == [assumed] * 2
    assert [each.remaining for each in (found.surge, found.yaw)] == [assumed] * 2, "what is assumed is not led against"
    assert found.declared is (len(given) == len(NAMES))


def test_each_input_has_the_dynamics_that_are_declared_of_it() -> None:
    surge, yaw, _ = dynamics(
        KnownVessel(
            surge_lag=2.0, surge_dead_time=0.3, surge_force_rate=1e5, surge_force_limit=2e5,
            yaw_lag=0.1, yaw_dead_time=0.7, yaw_moment_rate=0.0, yaw_moment_limit=3e6,
        )
    )  # fmt: skip
    assert [*surge] == pytest.approx([2.0, 0.4, 1e5, 0.3, 2.0])
    assert [*yaw] == pytest.approx([0.1, min(0.1, 0.05 * unit_time(KnownVessel())), math.inf, 0.7, 0.0])


@pytest.mark.parametrize("length", [0.0, 50.0])
@pytest.mark.parametrize("beam", [0.0, 8.0])
def test_a_drawn_hull_has_each_dimension_of_its_own_and_else_that_of_the_ship(length: float, beam: float) -> None:
    drawn = DrawnHull(length=length, beam=beam).of(Hull(length=20.0, beam=4.0))
    assert (drawn.length, drawn.beam) == (length or 20.0, beam or 4.0)
