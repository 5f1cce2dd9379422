"""The law of a scenario on its ship: margins of the loops, and what the reference needs.

| symbol | meaning | unit |
|---|---|---|
| U | speed of the straight path: mean speed of the reference, at least U_0 of `control.loop.control_period` | m/s |
| tau_1, tau_2 | surge force and yaw moment that the reference needs in calm water | N, N·m |
| omega | rms(dtau/dt)/rms(tau - mean), the mean frequency of what it needs | rad/s |
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.actuators import dynamics
from vessel_hsmc_ros.control.interface.law import KernelLaw
from vessel_hsmc_ros.control.loop.control_period import controlled_point_of
from vessel_hsmc_ros.control.loop.linearised_law import LinearShip, Margins, loops, margins
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import trajectory
from vessel_hsmc_ros.plant.dynamics import acceleration, unforced_acceleration
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law

GAIN_MARGIN_DB, PHASE_MARGIN_DEG = 6.0, 40.0  # the margins below which a loop is reported
MAX_DURATION, RATE_HZ = 400.0, 20.0  # of the reference at most this time, s, is looked at, at this rate
SMALL = 0.02  # share of a limit below which a force or moment that varies does not matter


class Need(NamedTuple):
    """What the reference needs of an input in calm water, 99 % of the time."""

    size: float  # largest magnitude, N or N·m
    rate: float  # largest rate of change, per second
    frequency: float  # omega, rad/s; 0 for an input that varies by less than a fiftieth of its limit


class Study(NamedTuple):
    """The margins of the loops by name, and what the reference needs of surge force and yaw moment."""

    speed: float
    loops: dict[str, Margins]
    surge: Need
    yaw: Need


def ship_about(scenario: Scenario, speed: float) -> LinearShip:
    """The ship of a scenario linearised about a straight path at a speed, m/s, with the lags and dead times of its actuators."""
    c, ship = scenario.controller, scenario.vessel_sim.vessel.coefficients()
    slopes = np.empty((3, 3))
    for column, step in enumerate(1e-4 * speed * np.array([1.0, 1.0, 1.0 / c.vessel.length])):
        d = step * np.eye(3)[column]
        high, low = unforced_acceleration(speed + d[0], d[1], d[2], ship), unforced_acceleration(speed - d[0], -d[1], -d[2], ship)
        slopes[:, column] = (np.array(high) - np.array(low)) / (2.0 * step)
    gains = [acceleration((1.0, 0.0, 0.0), ship), acceleration((0.0, c.vessel.sway_force_per_yaw_moment, 1.0), ship)]
    return LinearShip(speed, c.vessel.length, slopes, np.array(gains).T, *_actuators(scenario))


def _actuators(scenario: Scenario) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lags and dead times of surge force and yaw moment: those of the plant, or for thrusters what the law takes them for."""
    if (a := scenario.vessel_sim.actuators).kind == "wrench":
        return (a.surge_lag, a.yaw_lag), (a.surge_dead_time, a.yaw_dead_time)
    d = dynamics(scenario.controller.vessel.as_controlled())
    return (d.surge.lag, d.yaw.lag), (d.surge.dead_time, d.yaw.dead_time)


def study(scenario: Scenario) -> Study:
    """Linearise the law of a scenario on its ship, and compute what the reference needs."""
    count = int(min(scenario.vessel_sim.duration or MAX_DURATION, MAX_DURATION) * RATE_HZ)
    motion = trajectory(scenario.reference_ship, RATE_HZ, max(count, 3))
    mean = float(np.mean(np.hypot(motion[:, 3], motion[:, 4])[len(motion) // 2 :]))
    c, period = scenario.controller, RateGrid(scenario.controller.rate_hz).period
    own = getattr(c, c.law)
    if hasattr(own, "actuator_identification"):  # the law keeps its model of the actuators
        own = replace(own, actuator_identification=False)
    law, point = make_law(replace(c, **{c.law: own})), controlled_point_of(c.vessel, period)
    if not isinstance(law, KernelLaw):
        raise ParameterError(f"controller.law must be a law with a kernel, such as guided, for margins (got {c.law})")
    speed = max(mean, point.U_0)
    found = {name: margins(loop, period) for name, loop in loops(law, point, ship_about(scenario, speed), period).items()}
    return Study(speed, found, *_needs(scenario, motion))


def _needs(scenario: Scenario, motion: Array) -> tuple[Need, Need]:
    """What a motion, shape (count, 9), needs of surge force and yaw moment."""
    ship, known = scenario.vessel_sim.vessel.coefficients(), scenario.controller.vessel
    u, v, r, du, dv, dr = motion.T[3:]
    f_u, f_v, f_r = np.array([unforced_acceleration(*row, ship) for row in zip(u, v, r, strict=True)]).T
    force, moment = ship.m11 * (du - f_u), ship.m33 * (dr - f_r) + ship.m32 * (dv - f_v)
    return _need(force, known.surge_force_limit), _need(moment, known.yaw_moment_limit)


def _need(tau: Array, limit: float) -> Need:
    """What a course of a force or moment needs of its input."""
    settled = tau[len(tau) // 4 :]  # the start from rest is not what the reference is like
    rate = np.diff(settled) * RATE_HZ
    deviation = float(np.std(settled))
    frequency = float(np.sqrt(np.mean(rate * rate))) / deviation if deviation > SMALL * limit else 0.0
    return Need(float(np.quantile(np.abs(tau), 0.99)), float(np.quantile(np.abs(rate), 0.99)), frequency)


def shortcomings(scenario: Scenario, found: Study) -> list[str]:
    """What is wrong: margins that are too small, and a ship that is too slow for the reference; a line for each."""
    lines = []
    for name, loop in found.loops.items():
        if not loop.stable:
            lines.append(f"the loop of the {name} is unstable")
        elif loop.gain_db < GAIN_MARGIN_DB or loop.phase_deg < PHASE_MARGIN_DEG:
            lines.append(
                f"the loop of the {name} has margins of {loop.gain_db:.1f} dB and {loop.phase_deg:.1f}°;"
                f" it should have {GAIN_MARGIN_DB:g} dB and {PHASE_MARGIN_DEG:g}° at least"
            )
    known = scenario.controller.vessel
    inputs = dynamics(known.as_controlled())
    return [
        *lines,
        *_too_slow("surge force", "N", found.surge, known.surge_force_limit, inputs.surge.rate, found.loops["surge force"]),
        *_too_slow("yaw moment", "N·m", found.yaw, known.yaw_moment_limit, inputs.yaw.rate, found.loops["yaw moment"]),
    ]


def _too_slow(name: str, unit: str, need: Need, limit: float, rate: float, loop: Margins) -> list[str]:
    """In what an input is too weak or too slow for the reference."""
    lines = []
    if need.size > limit:
        lines.append(f"a {name} of {quantity(need.size, unit)}, but the limit is {quantity(limit, unit)}")
    if need.rate > rate:
        lines.append(
            f"a {name} that changes by {quantity(need.rate, unit)} in a second, but it is limited to {quantity(rate, unit)}"
        )
    if need.frequency > loop.crossover:
        lines.append(
            f"a {name} that varies at {need.frequency:.2g} rad/s on average, but the loop follows up to"
            f" {loop.crossover:.2g} rad/s"
        )
    return [f"the ship is too slow for the reference: it needs {line}" for line in lines]
