"""What is uncertain today: the parameters of a run, drawn about the given wind and current and about the declared hull.

| symbol | meaning | unit |
|---|---|---|
| V, F | mean speed of the wind, its mean force by the rule of `init`, F = rho/2·c·A·V² | m/s, N |
| I | turbulence intensity, standard deviation of the wind's speed over V | - |

The gusts of the plant are a force: their standard deviation is dF/dV·I·V = 2·I·F.
"""

import math
from dataclasses import dataclass

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.scenario.ship_rules import loads

WIND_SPEED, WIND_DIRECTION = 0.25, math.radians(20.0)
"""Standard deviations of the mean wind, relative and rad: a forecast of the same day misses the wind measured at 10 m by 1.5 m/s
(rms) at mean speeds of 5 to 6 m/s, and by some 20°."""

TURBULENCE = 0.08, 0.2  # range of I: 0.1 to 0.12 over open water, up to 0.2 under a coast
WIND_FORCE = 0.25  # of the logarithm of the force for a wind: the rule for area and coefficient is one of thumb
CURRENT_SPEED, CURRENT_DIRECTION = 0.2, math.radians(15.0)
"""Standard deviations of the current, relative and rad: models of tidal currents are accepted where nine of ten directions are
within 22.5°."""

INERTIA, DAMPING = 0.1, 0.2  # of the logarithms: twice the first is the 20 % within which a boat file needs its inertias
AXES = ("surge", "sway", "yaw")
REDRAWS = 100  # attempts to draw a hull whose damping takes energy from it at every motion
WIND, CURRENT = "vessel_sim.disturbance.earth_fixed", "vessel_sim.disturbance.current"


@dataclass(frozen=True)
class Conditions:
    """Mean wind and current of the day; directions clockwise from north."""

    wind: float = parameter(0.0, "Mean wind speed.", unit="m/s", low=0.0, high=60.0)
    wind_from: float = parameter(0.0, "Where the wind comes from, clockwise from north.", unit="degrees", low=0.0, high=360.0)
    current: float = parameter(0.0, "Speed of the current.", unit="m/s", low=0.0, high=10.0)
    current_to: float = parameter(0.0, "Where the current flows to, clockwise from north.", unit="degrees", low=0.0, high=360.0)

    @property
    def wind_towards(self) -> complex:
        """Unit vector of the wind, east + i·north."""
        return _towards(self.wind_from + 180.0)

    @property
    def current_towards(self) -> complex:
        """Unit vector of the current, east + i·north."""
        return _towards(self.current_to)


def conditions_of(scenario: Scenario) -> Conditions:
    """The mean wind and the current of a scenario, the wind from its force by the rule of `init`."""
    disturbance = scenario.vessel_sim.disturbance
    force = complex(disturbance.earth_fixed.east_force, disturbance.earth_fixed.north_force)
    current = complex(disturbance.current.east, disturbance.current.north)
    factor = loads(scenario.vessel_sim.vessel.length, 1.0)["wind_force"]
    return Conditions(math.sqrt(abs(force) / factor), _compass(-force), abs(current), _compass(current))


def mean_changes(conditions: Conditions, length: float) -> dict[str, object]:
    """The changes to a scenario that give it the conditions without gusts; the length of the hull in m."""
    force = loads(length, conditions.wind)["wind_force"] * conditions.wind_towards
    return _environment(force, 0.0, conditions.current * conditions.current_towards)


def drawn(scenario: Scenario, conditions: Conditions, seed: int, number: int) -> Scenario:
    """The scenario of a run.

    `seed`, `number`: of the forecast, and of the run. Raises ParameterError if no hull that is drawn is allowed.
    """
    for attempt in range(REDRAWS):
        try:
            return scenario.changed(_changes(scenario, conditions, np.random.default_rng((seed, number, attempt))))
        except ParameterError as error:
            reason = error
    raise ParameterError(f"no hull near the declared one is allowed: {reason}")


def _changes(scenario: Scenario, conditions: Conditions, random: np.random.Generator) -> dict[str, object]:
    normal = random.standard_normal(5)
    wind = conditions.wind * max(0.0, 1.0 + WIND_SPEED * normal[0])
    force = loads(scenario.vessel_sim.vessel.length, wind)["wind_force"] * math.exp(WIND_FORCE * normal[1])
    towards = conditions.wind_towards * np.exp(1j * WIND_DIRECTION * normal[2])
    current = conditions.current * max(0.0, 1.0 + CURRENT_SPEED * normal[3])
    flow = conditions.current_towards * np.exp(1j * CURRENT_DIRECTION * normal[4])
    gusts = 2.0 * random.uniform(*TURBULENCE) * force
    hull = _hull(scenario, random)
    return {
        **_environment(force * towards, gusts, current * flow),
        **hull,
        "vessel_sim.seed": int(random.integers(2**31)),
    }


def _hull(scenario: Scenario, random: np.random.Generator) -> dict[str, object]:
    """The hull data of the plant: one factor for each inertia, and one for all damping of an axis by its own velocity."""
    vessel = scenario.vessel_sim.vessel
    changes: dict[str, object] = {}
    for axis in AXES:
        inertia, damping = np.exp(random.standard_normal(2) * (INERTIA, DAMPING)).tolist()
        names = {f"{axis}_inertia": inertia, **{f"{axis}_damping{order}": damping for order in ("", "_quadratic", "_cubic")}}
        changes |= {f"vessel_sim.vessel.{name}": factor * getattr(vessel, name) for name, factor in names.items()}
    return changes


def _environment(force: complex, gusts: float, current: complex) -> dict[str, object]:
    return {
        f"{WIND}.east_force": float(force.real),
        f"{WIND}.north_force": float(force.imag),
        f"{WIND}.gust_deviation": float(gusts),
        f"{CURRENT}.east": float(current.real),
        f"{CURRENT}.north": float(current.imag),
    }


def _towards(degrees: float) -> complex:
    angle = math.radians(90.0 - degrees)
    return complex(math.cos(angle), math.sin(angle))


def _compass(way: complex) -> float:
    return math.degrees(math.atan2(way.real, way.imag)) % 360.0
