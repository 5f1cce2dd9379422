"""The scenarios of the manoeuvres: settings of the law, and durations in the ship's own units of time."""

import math
from collections.abc import Callable
from typing import NamedTuple

from vessel_hsmc_ros.manoeuvres.ship import Ship
from vessel_hsmc_ros.scenario.scenario import Scenario

MOORED = 1e12
"""Surge inertia of the ship of the bollard pull, which keeps it from moving, kg."""

SETTLING = 5.0
"""Time to settle in units of T."""

STEPS_PER_LENGTH, STEPS_WHEN_STEADY = 500.0, 50.0
"""Control steps while the ship travels its length: many, because a zig-zag reverses the rudder at a step; fewer where only steady
states count."""

RATES_HZ = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0)

SPIRAL_STEPS, SPEED_STEPS = 15, 8


class Plan(NamedTuple):
    """What a manoeuvre needs.

    Attributes:
        settings: Parameters of the law.
        duration: Estimated time from the execute to the end, s.
        hold: Estimated time of each step, s; 0 for manoeuvres without steps.
        moored: Whether the ship is kept at rest.
    """

    settings: dict[str, object]
    duration: float
    hold: float = 0.0
    moored: bool = False


def _turn(ship: Ship) -> Plan:
    return Plan({"kind": "turning_circle"}, 3.0 * math.pi / ship.turn_rate + SETTLING * ship.time + ship.delay)


def _zigzag(ship: Ship, angle_deg: float) -> Plan:
    settings: dict[str, object] = {"kind": "zigzag", "rudder_deg": angle_deg, "switch_heading_deg": angle_deg}
    return Plan(settings, 4.0 * (ship.time + ship.delay + 4.0 / ship.turn_rate))


def _spiral(ship: Ship) -> Plan:
    hold = SETTLING * ship.time + ship.delay
    return Plan({"kind": "spiral", "steps": SPIRAL_STEPS}, (2 * SPIRAL_STEPS - 1) * hold, hold)


def _crash_stop(ship: Ship) -> Plan:
    return Plan({"kind": "crash_stop"}, 2.0 * ship.time + ship.delay)


def _speed_run(ship: Ship) -> Plan:
    hold = SETTLING * ship.time + ship.delay
    return Plan({"kind": "speed_run", "steps": SPEED_STEPS}, SPEED_STEPS * hold, hold)


def _bollard_pull(ship: Ship) -> Plan:
    return Plan({"kind": "bollard_pull"}, ship.time + 2.0 * ship.delay, moored=True)


PLANS: dict[str, Callable[[Ship], Plan]] = {
    "turning_circle": _turn,
    "zigzag_10": lambda ship: _zigzag(ship, 10.0),
    "zigzag_20": lambda ship: _zigzag(ship, 20.0),
    "spiral": _spiral,
    "crash_stop": _crash_stop,
    "speed_run": _speed_run,
    "bollard_pull": _bollard_pull,
}
"""The manoeuvres by their names."""


def approach_time(ship: Ship, name: str) -> float:
    """Duration of the approach, which begins at the test speed: the actuators settle, and with them the speed, s."""
    return 0.0 if name in ("speed_run", "bollard_pull") else SETTLING * ship.time + ship.delay


def rate(ship: Ship, plan: Plan) -> float:
    """Rate of plant and law, Hz: the lowest of RATES_HZ with enough steps while the ship travels its length."""
    wanted = (STEPS_WHEN_STEADY if plan.hold else STEPS_PER_LENGTH) * ship.speed / ship.length
    return next((each for each in RATES_HZ if each >= wanted), RATES_HZ[-1])


def scenario_of(ship: Ship, name: str, stretch: float = 1.0, side: str = "starboard") -> Scenario:
    """The scenario of a manoeuvre.

    Args:
        ship: The ship.
        name: Of the manoeuvre, one of PLANS.
        stretch: Factor of the estimated durations.
        side: Side of the first turn.
    """
    plan = PLANS[name](ship)
    approach, rate_hz = approach_time(ship, name), rate(ship, plan)
    settings: dict[str, object] = {
        **plan.settings,
        "side": side,
        "approach_time": approach,
        "astern_share": ship.astern_force / ship.largest_force,
        "approach_share": ship.approach_force / ship.largest_force,
    }
    if plan.hold:
        settings["hold_time"] = stretch * plan.hold
    changes: dict[str, object] = {
        **{f"{node}.rate_hz": rate_hz for node in ("vessel_sim", "reference_ship", "controller")},
        "vessel_sim.duration": math.ceil(rate_hz * (approach + stretch * plan.duration)) / rate_hz,
        **{f"{node}.initial_pose": (0.0, 0.0, 0.0) for node in ("vessel_sim", "reference_ship")},
        "vessel_sim.initial_velocity": (ship.speed if approach else 0.0, 0.0, 0.0),
        "controller.law": "manoeuvre",
        **{f"controller.manoeuvre.{key}": value for key, value in settings.items()},
        # The law commands shares of the smallest of all limits.
        "controller.vessel.surge_force_limit": ship.top_force if name == "speed_run" else ship.largest_force,
        "controller.vessel.yaw_moment_limit": ship.largest_moment,
    }
    if plan.moored:
        changes["vessel_sim.vessel.surge_inertia"] = MOORED
    return ship.scenario.changed(changes)
