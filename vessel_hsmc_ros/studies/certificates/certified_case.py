"""What a certificate is for: the hull of a scenario with its box, the gains of the law, the reference and the loads.

| symbol | meaning | unit |
|---|---|---|
| U, r_d | mean speed and largest yaw rate of the reference | m/s, rad/s |
| D, K | decay rate of the sway velocity, sway acceleration per surge velocity and yaw rate, at the controlled point | 1/s, - |

The box: surge and yaw inertia, D and K differ by up to a fifth from their data.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.actuators import dynamics
from vessel_hsmc_ros.control.interface.known_vessel import ControlledVessel
from vessel_hsmc_ros.control.laws.hierarchical_linear import Hull, Lag, Loads, Mean
from vessel_hsmc_ros.control.laws.hierarchical_parameters import Gains, HierarchicalParameters, gains
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import trajectory
from vessel_hsmc_ros.plant.dynamics import ShipParameters, Vessel, acceleration, unforced_acceleration
from vessel_hsmc_ros.scenario.scenario import Scenario

BOX = 0.2
"""Share by which the data of a hull may be wrong."""

MAX_DURATION, REFERENCE_HZ = 400.0, 5.0
"""How much of the reference is looked at, s, and its rate."""

DAMPING = tuple(name for name in ShipParameters.__dataclass_fields__ if "_damping" in name)


class Case(NamedTuple):
    """What a certificate is for.

    Attributes:
        parameters, known, g: The law's numbers, what it knows of the vessel, and its gains.
        ship: The hull as given.
        speed, turn: Of the reference; 0 for one that hardly moves.
        lags: Lag and dead time of surge force and yaw moment.
        loads, lever: What disturbs the vessel, and the lever of the wind, m.
    """

    parameters: HierarchicalParameters
    known: ControlledVessel
    g: Gains
    ship: ShipParameters
    speed: float
    turn: float
    lags: tuple[Lag, Lag]
    loads: Loads
    lever: float

    def hulls(self, x: float) -> list[Hull]:
        """The corners of the box at a point at the distance x ahead of the origin."""
        return [hull_at(ship.coefficients(), x) for ship in box(self.ship)]

    def mean(self, angle: float) -> Mean:
        """The mean loads, the force towards a direction."""
        F, c, along = self.loads.force, self.loads.current, angle + self.loads.between
        force, current = (F * math.cos(angle), F * math.sin(angle)), (c * math.cos(along), c * math.sin(along))
        return Mean(force, self.lever, current)


def case_of(scenario: Scenario) -> Case:
    """The hull, law, loads and reference of a scenario.

    Raises:
        InstabilityError: the period is too long for the gains.
    """
    c, sim = scenario.controller, scenario.vessel_sim
    known, period = c.vessel.as_controlled(), RateGrid(c.rate_hz).period
    count = int(min(sim.duration or MAX_DURATION, MAX_DURATION) * REFERENCE_HZ)
    motion = trajectory(scenario.reference_ship, REFERENCE_HZ, max(count, 4))
    late = motion[len(motion) // 2 :]  # the start from rest is not what the reference is like
    g, speed = gains(c.hierarchical, known, period), float(np.mean(np.hypot(late[:, 3], late[:, 4])))
    moves = speed > g.U_c
    return Case(
        c.hierarchical,
        known,
        g,
        sim.vessel,
        speed if moves else 0.0,
        float(late[np.argmax(np.abs(late[:, 5])), 5]) if moves else 0.0,
        _lags(scenario),
        _loads(scenario, period),
        sim.disturbance.earth_fixed.lever,
    )


def _lags(scenario: Scenario) -> tuple[Lag, Lag]:
    """Lag and dead time of surge force and yaw moment."""
    if (a := scenario.vessel_sim.actuators).kind == "wrench":
        return Lag(a.surge_lag, a.surge_dead_time), Lag(a.yaw_lag, a.yaw_dead_time)
    d = dynamics(scenario.controller.vessel.as_controlled())
    return Lag(d.surge.lag, d.surge.dead_time), Lag(d.yaw.lag, d.yaw.dead_time)


def _loads(scenario: Scenario, period: float) -> Loads:
    """The loads of a scenario. Without the observer's dynamics its noise is unknown, so then that of the sensors is left out."""
    d, s = scenario.vessel_sim.disturbance, scenario.vessel_sim.sensors
    deviations = s.position_noise, s.position_noise, s.heading_noise, s.velocity_noise, s.velocity_noise, s.yaw_rate_noise
    rates = (s.position_rate_hz,) * 2 + (s.heading_rate_hz,) + (s.velocity_rate_hz,) * 3
    seen = 0.0 if scenario.controller.observer.enabled else 1.0
    noise = [
        seen * each * math.sqrt(max(period, 1.0 / rate if rate else 0.0)) for each, rate in zip(deviations, rates, strict=True)
    ]
    wind, periodic = d.earth_fixed, d.periodic
    between = math.atan2(d.current.north, d.current.east) - math.atan2(wind.north_force, wind.east_force)
    return Loads(
        tuple(noise),
        wind.gust_deviation,
        wind.gust_time_constant,
        math.hypot(wind.east_force, wind.north_force),
        math.hypot(d.current.east, d.current.north),
        between,
        (periodic.surge_force, periodic.sway_force, periodic.yaw_moment),
        periodic.frequency,
    )


def hull_at(vessel: Vessel, x: float) -> Hull:
    """The accelerations of a hull at a point at the distance x ahead of its origin."""

    def accelerations(m: Motion, wrench: tuple[float, float, float], c: tuple[float, float]) -> tuple[float, float, float]:
        f_u, f_v, f_r = unforced_acceleration(m.u - c[0], m.v - x * m.r - c[1], m.r, vessel)
        a_u, a_v, a_r = acceleration(wrench, vessel)
        dr = f_r + a_r
        return f_u + a_u + m.r * c[1], f_v + a_v - m.r * c[0] + x * dr, dr

    return accelerations


def box(ship: ShipParameters) -> Iterator[ShipParameters]:
    """The corners of the box: m11, m33, D and K a fifth less or more."""
    for factors in itertools.product((1.0 - BOX, 1.0 + BOX), repeat=4):
        yield in_box(ship, *factors)


def in_box(ship: ShipParameters, surge: float, yaw: float, D: float, K: float) -> ShipParameters:
    """A hull with other m11, m33, D and K, by their factors; the centre of percussion stays where it is."""
    sway = surge / K
    factors = {"surge_inertia": surge, "sway_inertia": sway, "sway_yaw_inertia": sway, "yaw_sway_inertia": sway}
    factors |= {"yaw_inertia": yaw, **dict.fromkeys(DAMPING, D * sway)}
    return replace(ship, **{name: factor * getattr(ship, name) for name, factor in factors.items()})


def sway_of(hull: Hull, U: float, step: float) -> tuple[float, float]:
    """D and K of a hull at a speed, by central differences; K is 0 at rest.

    Args:
        hull: Accelerations at the controlled point.
        U: Speed.
        step: Of the sway velocity, m/s.
    """

    def sway(v: float, r: float) -> float:
        return hull(Motion(0.0, 0.0, 0.0, U, v, r), (0.0, 0.0, 0.0), (0.0, 0.0))[1]

    D = (sway(-step, 0.0) - sway(step, 0.0)) / (2.0 * step)
    return D, (sway(0.0, -step / U) - sway(0.0, step / U)) / (2.0 * step) if U else 0.0
