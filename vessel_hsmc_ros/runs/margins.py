"""The guided law on the ship of a scenario: margins of its loops, the loops perturbed, and what the reference needs.

| symbol | meaning | unit |
|---|---|---|
| U | speed of the straight path: mean speed of the reference, or the law's approach_speed for one at rest | m/s |
| x_p | distance of the controlled point ahead of the origin | m |
| tau_1, tau_2 | surge force and yaw moment that the reference needs in calm water | N, N·m |
| omega | rms(dtau/dt)/rms(tau - mean), the mean frequency of what it needs | rad/s |
"""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.controlled_point import INTEGRAL, controlled_point_of
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guided.margins import Actuator, Carriage, Hull, surge_loop, yaw_loop
from vessel_hsmc_ros.guided.parameters import Gains, by_hand_or_derived, gains
from vessel_hsmc_ros.guided.rule import RULES, dynamics
from vessel_hsmc_ros.law.known_vessel import KnownVessel
from vessel_hsmc_ros.law.linear_loop import Margins, margins
from vessel_hsmc_ros.plant.dynamics import acceleration, unforced_acceleration
from vessel_hsmc_ros.reference.trajectory import trajectory
from vessel_hsmc_ros.scenario.scenario import Scenario

GAIN_MARGIN_DB, PHASE_MARGIN_DEG = 6.0, 40.0
"""The margins below which a loop is reported."""

MAX_DURATION, RATE_HZ = 400.0, 20.0
"""Of the reference at most this time, s, is looked at, at this rate."""

SMALL = 0.02
"""Share of a limit below which a force or moment that varies does not matter."""


class Need(NamedTuple):
    """What the reference needs of an input in calm water, 99 % of the time.

    Attributes:
        size: Largest magnitude, N or N·m.
        rate: Largest rate of change, per second.
        frequency: omega, rad/s; 0 for an input that varies by less than a fiftieth of its limit.
    """

    size: float
    rate: float
    frequency: float


class Study(NamedTuple):
    """The margins of the loops by name, and what the reference needs of surge force and yaw moment."""

    speed: float
    loops: dict[str, Margins]
    surge: Need
    yaw: Need


def constants(scenario: Scenario) -> Gains:
    """The constants of the guided law of a scenario."""
    c = scenario.controller
    return gains(c.guided, c.vessel.as_controlled(), RateGrid(c.rate_hz).period)


def hull_about(scenario: Scenario, speed: float) -> Hull:
    """The hull of a scenario linearised about a straight path, at the point that the law controls.

    Args:
        scenario: The scenario.
        speed: U, m/s.
    """
    ship, declared = scenario.vessel_sim.vessel.coefficients(), scenario.controller.vessel
    known = declared.as_controlled()
    small = 1e-4 * max(speed, 1e-3), 1e-4 * max(speed, 1e-3), 1e-4 * max(speed, 1e-3) / known.length
    slopes = np.empty((3, 3))
    for column, step in enumerate(small):
        d = step * np.eye(3)[column]
        high, low = unforced_acceleration(speed + d[0], d[1], d[2], ship), unforced_acceleration(speed - d[0], -d[1], -d[2], ship)
        slopes[:, column] = (np.array(high) - np.array(low)) / (2.0 * step)
    thrust = acceleration((1.0, 0.0, 0.0), ship)[0] * known.surge_inertia
    turn = np.array(acceleration((0.0, declared.sway_force_per_yaw_moment, 1.0), ship)[1:]) * known.yaw_inertia
    to_point = np.array([[1.0, known.ahead], [0.0, 1.0]])
    lateral = to_point @ slopes[1:, 1:] @ np.linalg.inv(to_point)
    return Hull(speed, float(slopes[0, 0]), thrust, lateral, to_point @ turn, _carriage(declared, speed))


def _carriage(declared: KnownVessel, speed: float) -> Carriage | None:
    """How the reference is transformed to the controlled point of a vessel at a speed, m/s."""
    point = controlled_point_of(declared, 1.0)
    omega = max(speed, point.U_0) * point.per_distance
    return Carriage(point.x_p, omega, INTEGRAL * omega**2) if point.x_p else None


def true_actuators(scenario: Scenario) -> tuple[Actuator, Actuator]:
    """Lag and dead time of surge force and yaw moment: those of the plant, or for thrusters what the law takes them for."""
    if (a := scenario.vessel_sim.actuators).kind == "wrench":
        return Actuator(a.surge_lag, a.surge_dead_time), Actuator(a.yaw_lag, a.yaw_dead_time)
    d = dynamics(scenario.controller.vessel.as_controlled())
    return Actuator(d.surge.lag, d.surge.dead_time), Actuator(d.yaw.lag, d.yaw.dead_time)


def study(scenario: Scenario) -> Study:
    """Linearise the guided law on the ship of a scenario, and compute what the reference needs.

    Raises:
        ParameterError: a gain or the reference is not allowed.
        SimulationError: the motion of the reference is no longer finite.
    """
    count = int(min(scenario.vessel_sim.duration or MAX_DURATION, MAX_DURATION) * RATE_HZ)
    motion = trajectory(scenario.reference_ship, RATE_HZ, max(count, 3))
    mean = float(np.mean(np.hypot(motion[:, 3], motion[:, 4])[len(motion) // 2 :]))
    g = constants(scenario)
    speed = mean if mean > g.U_s else g.v_max
    hull, (surge, yaw) = hull_about(scenario, speed), true_actuators(scenario)
    loops = {
        "surge force": margins(surge_loop(g, hull, surge), g.T),
        "yaw moment": margins(yaw_loop(g, hull, yaw), g.T),
        "guidance": margins(yaw_loop(g, hull, yaw, at_guidance=True), g.T),
    }
    return Study(speed, loops, *_needs(scenario, motion))


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
    """In what an input is too weak or too slow for the reference.

    Args:
        name: The input.
        unit: Its unit.
        need: What the reference needs of it.
        limit, rate: Its largest magnitude and rate of change.
        loop: Its loop.
    """
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


def perturbed(scenario: Scenario, gain: float = 1.0, phase: float = 0.0) -> Scenario:
    """The scenario with its loops perturbed: the law as it is, on a ship with another gain and more dead time of the inputs.

    The law takes the ship for `gain` times as heavy as it is, with its gains held: it commands `gain` times the wrench, as if the
    actuators were that much stronger.

    Args:
        scenario: The scenario, with the guided law.
        gain: Factor on both inputs.
        phase: Phase lag of both inputs at the crossover of their loops, rad, as dead time.
    """
    loops, c, actuators = study(scenario).loops if phase else {}, scenario.controller, scenario.vessel_sim.actuators
    held = asdict(by_hand_or_derived(c.guided, c.vessel.as_controlled()))
    changes: dict[str, object] = {f"controller.guided.{name}": held[name] for name in RULES}
    changes["controller.guided.actuator_identification"] = False  # it would find the dead time
    for name, loop in (("surge", "surge force"), ("yaw", "yaw moment")):
        changes[f"controller.vessel.{name}_inertia"] = gain * getattr(c.vessel, f"{name}_inertia")
        more = phase / loops[loop].crossover if phase else 0.0
        changes[f"vessel_sim.actuators.{name}_dead_time"] = getattr(actuators, f"{name}_dead_time") + more
    return scenario.changed(changes)


def perturbations() -> Mapping[str, tuple[float, float]]:
    """The perturbations that every loop should tolerate, as gain and phase, by name."""
    twice, phase = 10.0 ** (GAIN_MARGIN_DB / 20.0), math.radians(PHASE_MARGIN_DEG)
    return {f"+{GAIN_MARGIN_DB:g} dB": (twice, 0.0), f"-{GAIN_MARGIN_DB:g} dB": (1.0 / twice, 0.0), "delay": (1.0, phase)}
