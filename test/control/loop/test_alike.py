"""Both axes are treated alike, each with its own numbers, and every clock alike, whatever it shows.

With all that belongs to force and moment exchanged, what comes out is exchanged. With all stamps later by the same time, all is
as before: a number of the one in the place of the other, or a time in floating point, would show.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.loop.allocation import Allocation
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop, Watch
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters, actuated, actuators, no_commands
from vessel_hsmc_ros.control.safety.monitors import NotMoving, Saturation, Velocities
from vessel_hsmc_ros.control.safety.parameters import ACTIONS, FreshnessParameters, MonitorParameters, Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.samples import Freshness, Jumps, Sample
from vessel_hsmc_ros.control.safety.supervision import Authority, Supervision
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.core.timing import RateGrid

Pair = tuple[float, float]
LIMITS, INERTIA = (100.0, 40.0), (10.0, 35.0)
OWN: dict[str, Pair] = {"limit": (80.0, 30.0), "rate": (60.0, 25.0)}


def exchanged(pair: Any) -> Any:
    return None if pair is None else (pair[1], pair[0])


def supervised(turned: bool, bounded: bool, own: str, **values: Any) -> Supervision:
    order: Callable[[Any], Any] = exchanged if turned else tuple
    names = ("surge_force", "yaw_moment")
    numbers = dict(zip((f"{name}_{own}" for name in names), order(OWN[own]), strict=True)) if own else {}
    ship = Authority(order(LIMITS), order(INERTIA), bounded, not bounded)
    return Supervision(SafetyParameters(ramp_time=1.7, hold_time=0.4, fresh_samples=2, **numbers, **values), ship)


@pytest.mark.parametrize("action", ACTIONS)
@pytest.mark.parametrize("bounded", [True, False])
@pytest.mark.parametrize("own", ["", "limit", "rate"])
def test_force_and_moment_exchange_with_all_that_belongs_to_them(action: str, bounded: bool, own: str) -> None:
    random = np.random.default_rng(len(action) + 10 * bounded)
    first, second = (supervised(turned, bounded, own, action=action) for turned in (False, True))
    seen, demand = set(), np.zeros(2)
    for _ in range(400):
        demand = np.clip(demand + random.normal(size=2) * [3.0, 1.2], (-130.0, -50.0), (130.0, 50.0))
        wanted = None if random.random() < 0.02 else (float(demand[0]), float(demand[1]))
        reason = Reason.OVERDUE if random.random() < 0.02 else Reason.NONE
        motion, fallback = ((*random.normal(size=2).tolist(),) for _ in range(2))
        fallback = (50.0 * fallback[0], 30.0 * fallback[1])
        one = first.step(wanted, reason, 0.1, motion, fallback)
        assert second.step(exchanged(wanted), reason, 0.1, exchanged(motion), exchanged(fallback)) == exchanged(one)
        assert (first.operation, first.reason, first.violations) == (second.operation, second.reason, second.violations)
        seen.add(first.operation)
    assert len(seen) == 2


BOUNDS = {"moving_speed": 0.3, "moving_yaw_rate": 0.02}


@pytest.mark.parametrize("kind", [NotMoving, Saturation])
def test_monitors_of_both_axes_exchange_with_their_bounds(kind: Callable[..., Any]) -> None:
    times = replace(MonitorParameters(), not_moving_warning=0.2, not_moving_safe=0.4, saturation_warning=0.2, saturation_safe=0.4)
    bounds = replace(times, **BOUNDS), replace(times, **dict(zip(BOUNDS, reversed(BOUNDS.values()), strict=True)))
    one, other = kind(bounds[0], LIMITS), kind(bounds[1], exchanged(LIMITS))
    random, seen, driven = np.random.default_rng(3), set(), np.ones(2)
    for _ in range(400):
        driven = np.where(random.random(2) < 0.1, random.choice([-1.0, 0.0, 0.5, 1.0], 2), driven)
        command, motion = (driven * LIMITS).tolist(), (random.choice([0.0, 1.0, -1.0], 2, p=[0.9, 0.05, 0.05])).tolist()
        motion = [motion[0] * 0.31, motion[1] * 0.021]
        inputs = (command, motion) if kind is NotMoving else (command,)
        alarm = one.step(*inputs, 0.1)
        assert other.step(*map(exchanged, inputs), 0.1) is alarm
        seen.add(alarm)
    assert len(seen) == 3


def test_the_actuators_of_the_observer_exchange_with_what_is_declared() -> None:
    surge: dict[str, Any] = {"surge_force_limit": 50.0, "surge_lag": 0.3, "surge_dead_time": 0.2, "surge_force_rate": 90.0}
    yaw: dict[str, Any] = {"yaw_moment_limit": 20.0, "yaw_lag": 0.1, "yaw_dead_time": 0.35, "yaw_moment_rate": 25.0}
    others = dict(zip(surge, yaw.values(), strict=True)), dict(zip(yaw, surge.values(), strict=True))
    constants = [actuators(ObserverParameters(), KnownVessel(**a, **b)) for a, b in ((surge, yaw), others)]
    rings, applied = [no_commands(), no_commands()], [(0.0, 0.0), (0.0, 0.0)]
    random = np.random.default_rng(4)
    for k in range(60):
        command = (60.0 * random.normal(), 25.0 * random.normal())
        for i, each in enumerate((command, exchanged(command))):
            applied[i] = actuated(applied[i], k * 50_000_000, each, 0.05, rings[i], constants[i])
        assert applied[1] == exchanged(applied[0])
    assert all(applied[0])


# -- every clock ------------------------------------------------------------------------------------------------------

PERIOD = 50_000_000
LATER = 1_700_000_000_000_000_000
"""The time since 1970, ns: of a float, the last bit is 0.2 µs there."""


def ship(k: int) -> Motion:
    t = 0.05 * k
    return Motion(3.0 + 2.0 * t + 0.01 * math.sin(9.0 * t), 0.3 * t, 0.15 + 0.02 * math.sin(t), 2.0, 0.0, 0.02 * math.cos(t))


def freshness(origin: int) -> list[Any]:
    made, found = Freshness(0.3, FreshnessParameters(), "odom"), []
    for k in range(60):
        stamp, now = origin + k * PERIOD - (k % 7) * 60_000_000, origin + k * PERIOD
        found += [made.accept(Sample(stamp, "odom", "", (1.0,)), now, k * PERIOD), made.overdue(now + 1, k * PERIOD)]
    return found


def jumps(origin: int) -> list[Any]:
    made = Jumps(SafetyParameters(jump_samples=3), 4.0)
    far = [0.0] * 10 + [8.9, 0.0, 60.0, 60.1] + [300.0] * 10
    return [made.check(origin + 1 + k * PERIOD, ship(k)._replace(x=x)) for k, x in enumerate(far)]


def velocities(origin: int) -> list[Any]:
    made = Velocities(MonitorParameters(), 4.0)
    alarms = [made.step(origin + k * PERIOD, ship(k)._replace(v=1.3), 0.05) for k in range(200)]
    return [*alarms, made.detail, *made._integral]


def observer(origin: int) -> list[Any]:
    made = Observer(ObserverParameters(), KnownVessel(surge_dead_time=0.1, yaw_lag=0.3))
    return [made.update(origin + k * PERIOD, ship(k)[:3], (1e4 * (k % 9), 2e5 * (k % 5))) for k in range(60)]


def allocation(origin: int) -> list[Any]:
    layout = ThrusterLayout(
        names=("port", "starboard"), y=(0.4, -0.4), thrust_ahead=(50.0,), thrust_astern=(30.0,), thrust_rate=(20.0,)
    )
    made = Allocation(layout)
    return [made.step_at(origin + k * PERIOD, (40.0 - 3.0 * k, 5.0 * (-1) ** k), 1.0) for k in range(40)]


def loop(origin: int) -> list[Any]:
    watch = Watch(MonitorParameters(), (2e5, 3e6), 32.0)
    made = ControlLoop(
        make_controller("los_pid", 0.05), RateGrid(20.0), Observer(ObserverParameters(), KnownVessel()), watch=watch
    )
    found: list[Any] = []
    for k in range(60):
        stamp, late = origin + k * PERIOD, (k % 3) * PERIOD
        found.append(made.due(stamp))
        if k % 11 == 7:
            made.skip(stamp)
        else:
            made.step(stamp, ship(k - k % 3), ship(k), Acceleration(0.0, 0.0, 0.0), stamp - late, late * 1e-9)
        found += [made.wrench, made.estimate, made.missed_periods]
    return found


@pytest.mark.parametrize("run", [freshness, jumps, velocities, observer, allocation, loop], ids=lambda run: run.__name__)
def test_with_all_stamps_later_by_the_same_time_all_is_as_before(run: Callable[[int], list[Any]]) -> None:
    first = run(10_000_000_000)
    assert run(LATER) == first
    assert len(set(map(repr, first))) > 1
