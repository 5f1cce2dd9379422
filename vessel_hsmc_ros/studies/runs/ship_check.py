"""Checks a new scenario by simulation: what its ship can do, and whether it follows its circle."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.metrics import NOISE_PEAK, Run, position_error
from vessel_hsmc_ros.core.quantities import in_noise, number, quantity
from vessel_hsmc_ros.guidance.curve_motion import LARGEST_DRIFT, Demand, Pace, demand
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.scenario.ship_rules import Scale, scale_of
from vessel_hsmc_ros.simulation.offline import simulate

TRACKED = 0.02  # largest position error on the circle, in lengths of the ship, with which it counts as tracked
NEGLIGIBLE = 1e-4  # position error in lengths of the ship below which its digits mean nothing
CALM: dict[str, object] = {
    "vessel_sim.disturbance.earth_fixed.east_force": 0.0,
    "vessel_sim.disturbance.earth_fixed.north_force": 0.0,
    "vessel_sim.disturbance.earth_fixed.gust_deviation": 0.0,
    "vessel_sim.disturbance.current.east": 0.0,
    "vessel_sim.sensors.position_noise": 0.0,
    "vessel_sim.sensors.position_rate_hz": 0.0,
    "controller.observer.enabled": False,
}


class ShipCheck(NamedTuple):
    """What a ship can do, and how it follows the circle of its scenario."""

    speed: float  # steady speed straight ahead under the full surge force, m/s
    fastest: float  # speed up to which the hull data are valid, m/s
    # turn_rate, turn_diameter: steady yaw rate, and diameter of the turning circle, m, under full force and moment
    turn_rate: float
    turn_diameter: float
    demand: Demand  # drift angle, surge force and yaw moment that the circle takes in calm water
    # surge_share, yaw_share: the last two as shares of the limits
    surge_share: float
    yaw_share: float
    error: float  # largest position error in the last quarter of the run, m
    error_lengths: float  # the same in lengths of the ship
    duration: float  # duration of that run, s
    noise: float = 0.0  # standard deviation of the measured positions, in lengths; the error may be as large as theirs

    @property
    def tracked(self) -> bool:
        """Whether the ship follows its circle."""
        return self.error_lengths <= max(TRACKED, NOISE_PEAK * self.noise)


def check_ship(scenario: Scenario) -> ShipCheck:
    """Simulate a run straight ahead, a turning circle, and the scenario itself."""
    known, circle = scenario.controller.vessel, scenario.reference_ship.circle
    # The limits that the law knows: the paper's ship has no others.
    limits = {"surge_force_limit": known.surge_force_limit, "yaw_moment_limit": known.yaw_moment_limit}
    ship = replace(scenario.vessel_sim.vessel, **limits)  # type: ignore[arg-type]
    scale = scale_of(ship)
    straight = steady(scenario, scale, 0.0)
    speed, rate = _mean_speed(turn := steady(scenario, scale, scale.N)), float(np.mean(turn.state[_last(turn, 0.1), 5]))
    needed = demand(circle.shape().curve, Pace(circle.speed, circle.rise_time), ship.coefficients(), LARGEST_DRIFT)
    run = simulate(scenario)
    error = float(np.max(position_error(run.state, run.reference)[_last(run, 0.25)]))
    return ShipCheck(
        speed=_mean_speed(straight),
        fastest=ship.surge_speed_range[1],
        turn_rate=rate,
        turn_diameter=2.0 * speed / abs(rate) if rate else math.inf,
        demand=needed,
        surge_share=needed.surge_force / scale.F,
        yaw_share=needed.yaw_moment / scale.N,
        error=error,
        error_lengths=error / ship.length,
        duration=float(run.time[-1]),
        noise=scenario.vessel_sim.sensors.position_noise / ship.length,
    )


def steady(scenario: Scenario, scale: Scale, yaw_moment: float) -> Run:
    """A run in calm water under the full surge force and a constant yaw moment, until the motion is steady."""
    duration = max(40.0 * scale.T, 8.0 * scale.m11 * scale.U / scale.F)
    changes = CALM | {
        "controller.law": "open_loop",
        "controller.open_loop.surge_force": [scale.F],
        "controller.open_loop.yaw_moment": [yaw_moment],
        "vessel_sim.duration": float(math.ceil(duration)),
    }
    return simulate(scenario.changed(changes))


def verdict(check: ShipCheck) -> list[str]:
    """The check in sentences."""
    c = check
    beyond = f", beyond {quantity(c.fastest, 'm/s')}, up to which its hull data hold" if c.speed > c.fastest else ""
    lines = [
        f"full surge force: {quantity(c.speed, 'm/s')}{beyond}; with the full yaw moment a turning circle of"
        f" {quantity(c.turn_diameter, 'm')} at {quantity(math.degrees(c.turn_rate), '°/s')}",
        f"the circle needs {100.0 * c.surge_share:.0f} % of the surge force, {100.0 * c.yaw_share:.0f} % of the yaw moment and a"
        f" drift angle of {math.degrees(c.demand.drift):.1f}° in calm water",
    ]
    error = f"below {100.0 * NEGLIGIBLE:g} % of the ship's length"
    if c.error_lengths >= NEGLIGIBLE:
        noise = c.noise * c.error / c.error_lengths
        relative = in_noise(c.error, noise) if noise else f"{number(100.0 * c.error_lengths)} % of the ship's length"
        error = f"at most {quantity(c.error, 'm')}, {relative},"
    result = f"position error {error} in the last quarter of {c.duration:g} s"
    return [*lines, f"{'follows its circle' if c.tracked else 'does NOT follow its circle'}: {result}"]


def _last(run: Run, share: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """The samples in the last share of a run."""
    late: np.ndarray[tuple[int], np.dtype[np.bool_]] = run.time >= (1.0 - share) * run.time[-1]
    return late


def _mean_speed(run: Run) -> float:
    """Mean speed over the last tenth of a run."""
    return float(np.mean(np.hypot(*run.state[_last(run, 0.1), 3:5].T)))
