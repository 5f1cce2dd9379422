"""Ships that are similar by Froude's law get similar commands: a number that lacks its unit of length, time or mass would show.

Lengths are larger by LAMBDA, times by TAU = sqrt(LAMBDA), masses by MU: so speeds relative to sqrt(g·L) are the same. The factors
are powers of two, which rounding does not touch.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.guided.controller import GuidedController
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import KernelLaw
from vessel_hsmc_ros.control.laws.los_pid import LosPidController, LosPidParameters
from vessel_hsmc_ros.control.loop.control_period import START, controlled_point_of, to_controlled_point
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.control.safety.parameters import SafetyParameters
from vessel_hsmc_ros.control.safety.samples import Jumps
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

LAMBDA, TAU, MU = 4.0, 2.0, 64.0
FORCE, MOMENT = MU * LAMBDA / TAU**2, MU * LAMBDA**2 / TAU**2
PERIOD, STEPS = 0.05, 25

FACTORS = {
    "length": LAMBDA,
    "surge_inertia": MU,
    "sway_inertia": MU,
    "yaw_inertia": MU * LAMBDA**2,
    "sway_yaw_inertia": MU * LAMBDA,
    "yaw_sway_inertia": MU * LAMBDA,
    "sway_force_per_yaw_moment": 1.0 / LAMBDA,
    "surge_force_limit": FORCE,
    "yaw_moment_limit": MOMENT,
    "surge_force_rate": FORCE / TAU,
    "yaw_moment_rate": MOMENT / TAU,
    **dict.fromkeys(("surge_lag", "yaw_lag", "surge_dead_time", "yaw_dead_time"), TAU),
    "sway_damping_rate": 1.0 / TAU,
    "coriolis_ratio": 1.0,
}
"""By how much larger each number of the larger ship is; what is not declared, negative, stays so."""

BARE: dict[str, Any] = {"length": 12.0, "surge_inertia": 9e3, "sway_inertia": 14e3, "yaw_inertia": 1.3e5}
SHIPS: dict[str, dict[str, Any]] = {
    "nothing declared": {},
    "sway": {"sway_damping_rate": 0.4, "coriolis_ratio": 0.7},
    "actuators": {
        "surge_lag": 0.3, "yaw_lag": 0.2, "surge_dead_time": 0.1, "yaw_dead_time": 0.15,
        "surge_force_rate": 4e4, "yaw_moment_rate": 3e5,
    },
    "in part": {"yaw_lag": 0.4},
    "coupled": {"sway_yaw_inertia": 6e3, "yaw_sway_inertia": 4e3, "sway_force_per_yaw_moment": -0.02, "sway_damping_rate": 0.5},
}  # fmt: skip


def vessels(name: str) -> tuple[KnownVessel, KnownVessel]:
    """A ship and the larger one."""
    own = {**BARE, "surge_force_limit": 2e4, "yaw_moment_limit": 1.2e5, **SHIPS[name]}
    larger = {
        key: value if value < 0.0 and key != "sway_force_per_yaw_moment" else FACTORS[key] * value for key, value in own.items()
    }
    return KnownVessel(**own), KnownVessel(**larger)


def enlarged(m: Motion) -> Motion:
    V = LAMBDA / TAU
    return Motion(LAMBDA * m.x, LAMBDA * m.y, m.psi, V * m.u, V * m.v, m.r / TAU)


def hastened(a: Acceleration) -> Acceleration:
    return Acceleration(LAMBDA / TAU**2 * a.du, LAMBDA / TAU**2 * a.dv, a.dr / TAU**2)


def voyage(speed: float) -> list[tuple[Motion, Motion, Acceleration]]:
    """A ship beside a reference that turns."""
    found = []
    for k in range(STEPS):
        t = PERIOD * k
        rate = Acceleration(0.02 * math.cos(t), 0.01 * math.sin(t), 0.03 * math.cos(2.0 * t))
        desired = Motion(speed * t, 0.4 * t, 0.2 * t, speed, 0.1, 0.2)
        away = 0.005 * math.sin(t)
        ship = Motion(speed * t - 0.02, 0.4 * t + 0.004, 0.05 * t + away, speed - away, 0.1, 0.05 + 0.005 * math.cos(t))
        found.append((ship, desired, rate))
    return found


LAWS: dict[str, Callable[[KnownVessel, float], KernelLaw[Any]]] = {
    "guided": lambda ship, period: GuidedController(GuidedParameters(), ship.as_controlled(), period),
    "los_pid": lambda ship, period: LosPidController(LosPidParameters(), ship.as_controlled(), period),
    "alos": lambda ship, period: LosPidController(LosPidParameters(guidance="alos"), ship.as_controlled(), period),
}


@pytest.mark.parametrize("speed", [1.5, -1.0])
@pytest.mark.parametrize("name", SHIPS)
@pytest.mark.parametrize("law", LAWS)
def test_a_larger_similar_ship_gets_a_wrench_that_is_larger_by_the_same_factors(law: str, name: str, speed: float) -> None:
    small, large = (LAWS[law](ship, period) for ship, period in zip(vessels(name), (PERIOD, TAU * PERIOD), strict=True))
    wrenches = []
    for k, (ship, desired, rate) in enumerate(voyage(speed)):
        age = PERIOD * (k % 3) if small.takes_age else None
        ages = ((), ()) if age is None else ((age,), (TAU * age,))
        one, terms = small.step(ship, desired, rate, *ages[0])
        other, larger = large.step(enlarged(ship), enlarged(desired), hastened(rate), *ages[1])
        assert other == pytest.approx((FORCE * one[0], MOMENT * one[1]), rel=1e-9)
        assert larger.commanded_surge_velocity == pytest.approx(LAMBDA / TAU * terms.commanded_surge_velocity, rel=1e-9)
        assert larger.commanded_yaw_rate * TAU == pytest.approx(terms.commanded_yaw_rate, rel=1e-9)
        wrenches.append(one)
    assert np.ptp(wrenches, axis=0).any()


@pytest.mark.parametrize("name", SHIPS)
def test_the_observer_of_a_larger_similar_ship_estimates_a_motion_that_is_larger_by_the_same_factors(name: str) -> None:
    small, large = vessels(name)
    first = Observer(ObserverParameters(position_noise=0.1), small)
    second = Observer(ObserverParameters(position_noise=0.1 * LAMBDA), large)
    for k, (ship, _, _) in enumerate(voyage(1.5)):
        stamp, wrench = round(k * PERIOD * 1e9), (3e3 * math.cos(k), 9e3 * math.sin(k))
        one = first.update(stamp, ship[:3], wrench)
        other = second.update(round(TAU * k * PERIOD * 1e9), enlarged(ship)[:3], (FORCE * wrench[0], MOMENT * wrench[1]))
        assert other == pytest.approx(enlarged(one), rel=1e-9, abs=1e-12)
    assert one.u == pytest.approx(1.5, abs=0.4)


def test_the_controlled_point_of_a_larger_similar_ship_is_ahead_by_the_same_share() -> None:
    points = [controlled_point_of(ship, T) for ship, T in zip(vessels("coupled"), (PERIOD, TAU * PERIOD), strict=True)]
    deltas = [START, START]
    for ship, desired, rate in voyage(0.5):
        one = to_controlled_point(ship, desired, rate, deltas[0], points[0])
        other = to_controlled_point(enlarged(ship), enlarged(desired), hastened(rate), deltas[1], points[1])
        deltas = [one.delta, other.delta]
        assert other.motion == pytest.approx(enlarged(one.motion), rel=1e-9)
        assert other.desired == pytest.approx(enlarged(one.desired), rel=1e-9)
        assert other.acceleration == pytest.approx(hastened(one.acceleration), rel=1e-9, abs=1e-12)
    assert one.back[1]


def test_a_larger_similar_ship_may_jump_and_brake_by_the_same_factors() -> None:
    jumps = [Jumps(SafetyParameters(jump_samples=2), length) for length in (12.0, 12.0 * LAMBDA)]
    random, seen = np.random.default_rng(2), set()
    for k in range(200):
        spread = random.choice([0.1, 12.0, 30.0])
        motion = Motion(*(spread * random.normal(size=2)).tolist(), *random.normal(size=4).tolist())
        verdicts = {
            each.check(round(factor * k * PERIOD * 1e9), moved)
            for each, factor, moved in zip(jumps, (1.0, TAU), (motion, enlarged(motion)), strict=True)
        }
        assert len(verdicts) == 1
        seen |= verdicts
    assert len(seen) == 3
