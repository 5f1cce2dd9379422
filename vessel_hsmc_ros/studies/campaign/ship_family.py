"""A family of ships on which no law was tuned: dimensionless numbers from which `ship_expansion` makes the scenario of one ship.

A ship of the family is the paper's ship, Froude-scaled to a length, with other proportions of its inertias, damping, limits and
actuators. What its owner declares of it, its reference, its loads, sensors and rates are numbers of the family too, in the ship's
own units: length L, top speed U, T = sqrt(yaw inertia / largest yaw moment), and the largest surge force F. A campaign draws
them by the names `ship.<number>`; docs/campaigns.md explains the file. Its references have turns that the ship can make in calm
water with a reserve.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.node_list import REFERENCE
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.curve_motion import Pace, demand
from vessel_hsmc_ros.guidance.curves import CLOSING, Arc, Curve, FigureEight
from vessel_hsmc_ros.guidance.lawnmower import LawnmowerParameters, plan_lawnmower
from vessel_hsmc_ros.guidance.sailing import LARGEST_DRIFT, TravelLimits
from vessel_hsmc_ros.plant.dynamics import ShipParameters
from vessel_hsmc_ros.scenario.ship_rules import ADJUSTMENTS, Scale, feasible_turn, motion_limits

SHIP = "ship."  # prefix of the names of these numbers in a campaign file
REFERENCES = ("circle", "straight", "slalom", "figure_eight", "arc", "survey", "rest")

KNOWLEDGE = ("declared", "nothing", "everything", "true_values")


def factor(what: str) -> float:
    """Declare a factor on the value of the paper's ship."""
    return parameter(1.0, f"{what}, relative to the scaled ship of the paper.", low=0.01, high=100.0)


def delay(default: float, what: str, unit: str) -> float:
    """Declare a delay of the actuators in units of the ship."""
    return parameter(default, f"{what}, if there is any.", unit=unit, low=0.0, high=10.0)


def error(what: str) -> float:
    """Declare the factor by which a declaration differs from the truth."""
    return parameter(1.0, f"Declared {what}, relative to the true one.", low=0.01, high=100.0)


def switch(description: str) -> bool:
    """Declare a property that a ship has or has not."""
    return parameter(False, description)


def angle(description: str) -> float:
    """Declare a direction, counter-clockwise from east."""
    return parameter(0.0, description, unit="rad", low=-2.0 * math.pi, high=2.0 * math.pi)


@dataclass(frozen=True)
class ShipFamily:
    """The numbers of one ship, its owner's declarations and its day; by default the paper's ship on a circle in calm water."""

    length: float = parameter(32.0, "Length of the hull; everything else is scaled with it.", unit="m", low=0.1, high=1000.0)
    surge_to_sway_inertia: float = parameter(0.675, "m11/m22; m11 is that of the scaled ship.", low=0.1, high=2.0)
    yaw_inertia: float = factor("Yaw inertia")
    coupled: bool = switch("Whether sway and yaw are coupled in the inertia matrix.")
    percussion_point: float = parameter(0.0, "m23/m22, if coupled.", unit="L", low=-0.2, high=0.2)
    surge_damping: float = factor("Damping in surge")
    sway_damping: float = factor("Damping in sway")
    yaw_damping: float = factor("Damping in yaw")
    surge_force_limit: float = factor("Largest surge force")
    yaw_moment_limit: float = factor("Largest yaw moment")

    has_lag: bool = switch("Whether the actuators have a first-order lag.")
    has_rate: bool = switch("Whether the actuators have a limited rate.")
    has_dead_time: bool = switch("Whether the actuators have a dead time.")
    lag: float = delay(0.1, "Time constant of the lag", "T")
    time_to_full: float = delay(1.0, "Time from zero to the limit", "T")
    dead_time: float = delay(0.05, "Dead time", "T")
    surge_delays: float = parameter(1.0, "Factor on all delays in surge.", low=0.1, high=10.0)
    yaw_delays: float = parameter(1.0, "Factor on all delays in yaw.", low=0.1, high=10.0)

    knowledge: str = parameter(
        "declared",
        "What the law is given besides inertias and limits: what is declared with its errors; nothing; everything, exactly; or"
        " the true values of what is declared.",
        choices=KNOWLEDGE,
    )
    declares_lag: bool = switch("Whether the lags are declared.")
    declares_rate: bool = switch("Whether the rates are declared.")
    declares_dead_time: bool = switch("Whether the dead times are declared.")
    declares_coupling: bool = switch("Whether the coupling of sway and yaw is declared.")
    declares_sway_damping: bool = switch("Whether sway damping rate and Coriolis ratio are declared if the hull needs them.")
    declared_lag: float = error("lag")
    declared_rate: float = error("rate")
    declared_dead_time: float = error("dead time")
    declared_coupling: float = error("coupling of sway and yaw")
    declared_sway_damping_rate: float = error("sway damping rate")
    declared_coriolis_ratio: float = error("Coriolis ratio")
    declared_surge_inertia: float = error("surge inertia")
    declared_sway_inertia: float = error("sway inertia")
    declared_yaw_inertia: float = error("yaw inertia")

    reference: str = parameter("circle", "What the ship follows.", choices=REFERENCES)
    radius: float = parameter(6.0, "Radius of turns; an arc has four times that.", unit="L", low=0.5, high=1000.0)
    speed: float = parameter(0.5, "Speed of the reference.", unit="U", low=0.01, high=1.0)
    to_port: bool = parameter(True, "Whether the reference turns to port first.")

    has_current: bool = switch("Whether there is a current.")
    has_wind: bool = switch("Whether there is a wind, with gusts of a tenth of its force.")
    current: float = parameter(0.1, "Speed of the current, if there is any.", unit="U", low=0.0, high=1.0)
    current_direction: float = angle("Direction to which the current flows; the reference begins eastward.")
    wind: float = parameter(0.1, "Force of the wind, if there is any.", unit="F", low=0.0, high=1.0)
    wind_direction: float = angle("Direction of the force of the wind.")

    noisy: bool = switch("Whether pose alone is measured, with noise, and the observer is on.")
    position_noise: float = parameter(0.005, "Standard deviation of a position, if noisy.", unit="L", low=1e-6, high=1.0)
    heading_noise: float = parameter(0.01, "Standard deviation of a heading, if noisy.", unit="rad", low=1e-6, high=1.0)

    control_rate_hz: float = parameter(50.0, "Rate of the control law.", unit="Hz", low=0.1, high=1000.0)
    start_distance: float = parameter(0.2, "Distance of the start from that of the reference.", unit="L", low=0.0, high=100.0)
    start_direction: float = angle("Direction of the start from that of the reference.")
    start_heading: float = angle("Heading at the start; that of the reference is 0.")


Changes = dict[str, Any]


WIDE_RADIUS_RATIO = 4.0  # radius of an arc relative to that of the other turns
HEADING_AMPLITUDE = 0.9  # amplitude of the heading on a slalom, rad
LEG, SPACING, LEGS = 20.0, 4.0, 4
"""Length and spacing of the legs of a survey, in lengths of the hull, and their least number: a survey lasts as long as a run."""

SURVEY_SPEED = 0.3  # speed on the legs of a survey, relative to the top speed
MAX_TURN_TIMES = 300.0  # duration of a run after the start at most, in T
START_SHARE = 0.25  # share of the largest surge force that the start from rest takes
EIGHT = FigureEight(1.0).period / (2.0 * math.pi * CLOSING)  # smallest radius of a figure eight relative to its length


class Course(NamedTuple):
    """What a ship follows."""

    changes: Changes  # of the scenario, always the same names
    period: float  # after which the motion repeats, s; 0 for a motion that does not change
    rise_time: float  # duration of the start from rest, s


class Turn(NamedTuple):
    """The tightest turn of a reference: radius, m, speed, m/s, duration of the start, s; +1 to port, -1 to starboard first."""

    radius: float
    speed: float
    rise_time: float
    side: float


class Request(NamedTuple):
    """A requested reference: kind, one of `ship_family.REFERENCES`; radius [m]; speed [m/s]; +1 for port first, or -1."""

    kind: str
    radius: float
    speed: float
    side: float


def course_for(request: Request, hull: ShipParameters, scale: Scale) -> Course:
    """The reference of a kind for a ship; wider or slower where the ship could not follow it in calm water.

    Raises ParameterError if the ship cannot follow any reference of this kind.
    """
    turn = _feasible(request, hull, scale)
    mode, chosen, period = MAKERS[request.kind](turn, hull, scale)
    return Course(
        {f"{REFERENCE}.{name}": value for name, value in (UNUSED | {"mode": mode} | chosen).items()}, period, turn.rise_time
    )


UNUSED: Changes = {
    "surge_force": 0.0,
    "yaw_moment": 0.0,
    "yaw_moment_sine.amplitude": 0.0,
    "yaw_moment_sine.frequency": 0.0,
    **{f"{mode}.{name}": 1.0 for mode in ("circle", "straight", "figure_eight") for name in ("speed", "rise_time")},
    "circle.radius": 1.0,
    "figure_eight.length": 1.0,
    **{f"lawnmower.{name}": value for name, value in schema.flatten(LawnmowerParameters()).items()},
    **{f"motion.{name}": 1.0 for name in ("acceleration", "yaw_rate", "yaw_acceleration")},
}
"""Values of the parameters that a kind of reference does not use."""

Made = tuple[str, Changes, float]  # mode, changes of reference_ship, and period, s


def _feasible(request: Request, hull: ShipParameters, scale: Scale) -> Turn:
    """The tightest turn as requested, or wider or slower; see `course_for`."""

    def rise_time(speed: float) -> float:
        return speed * scale.m11 / (START_SHARE * scale.F)

    curve = CURVES.get(request.kind, _arc)
    made = feasible_turn(request.kind, curve, (request.radius, request.speed), rise_time, hull, scale)
    return Turn(made.radius, made.speed, made.rise_time, request.side)


def _arc(radius: float) -> Curve:
    return Arc(1.0 / radius)


CURVES: dict[str, Callable[[float], Curve]] = {
    "figure_eight": lambda radius: FigureEight(radius / EIGHT),
    "straight": lambda _: Arc(0.0),
    "rest": lambda _: Arc(0.0),
}
"""The curves of the kinds whose turns are not arcs."""


def _make_circle(turn: Turn, _: ShipParameters, __: Scale) -> Made:
    changes: Changes = {"circle.radius": turn.side * turn.radius, "circle.speed": turn.speed, "circle.rise_time": turn.rise_time}
    return "circle", changes, 2.0 * math.pi * turn.radius / turn.speed


def _make_wide_arc(turn: Turn, hull: ShipParameters, scale: Scale) -> Made:
    mode, changes, _ = _make_circle(turn._replace(radius=WIDE_RADIUS_RATIO * turn.radius), hull, scale)
    return mode, changes, 0.0


def _make_eight(turn: Turn, _: ShipParameters, __: Scale) -> Made:
    length = turn.radius / EIGHT
    changes: Changes = {
        "figure_eight.length": turn.side * length,
        "figure_eight.speed": turn.speed,
        "figure_eight.rise_time": turn.rise_time,
    }
    return "figure_eight", changes, FigureEight(length).period / turn.speed


def _make_slalom(turn: Turn, hull: ShipParameters, _: Scale) -> Made:
    frequency = turn.speed / turn.radius / HEADING_AMPLITUDE
    changes: Changes = {
        "surge_force": _drag(hull, turn.speed),
        "yaw_moment_sine.amplitude": turn.side * _moment(hull, turn),
        "yaw_moment_sine.frequency": frequency,
    }
    return "virtual_ship", changes, 2.0 * math.pi / frequency


def _make_survey(turn: Turn, hull: ShipParameters, scale: Scale) -> Made:
    """Legs and U-turns at a share of the top speed, or slower where the ship cannot sail them so."""
    given = motion_limits(scale)
    limits = TravelLimits(**given, surge_force=scale.F, yaw_moment=scale.N, current=0.0)
    one = LawnmowerParameters(2, LEG * scale.L, turn.side * SPACING * scale.L, SURVEY_SPEED * scale.U)
    for _ in range(ADJUSTMENTS):
        try:
            planned = plan_lawnmower(one, hull.coefficients(), limits, (0.0, 0.0, 0.0))
        except ParameterError:
            one = replace(one, speed=0.9 * one.speed)
        else:
            break
    else:
        raise ParameterError("no survey is feasible for this ship: legs and U-turns need more than its propulsion at any speed")
    period = 2.0 * (planned.route.length - one.leg_length) / one.speed
    legs = max(LEGS, math.ceil(2.0 * (MAX_TURN_TIMES * scale.T + turn.rise_time) / period) + 1)
    survey = schema.flatten(replace(one, legs=legs))
    changes = {f"lawnmower.{name}": value for name, value in survey.items()}
    return "lawnmower", changes | {f"motion.{name}": value for name, value in given.items()}, period


def _drag(hull: ShipParameters, speed: float) -> float:
    """The surge force of a steady speed on a straight line, N."""
    return speed * (hull.surge_damping + speed * (hull.surge_damping_quadratic + speed * hull.surge_damping_cubic))


def _moment(hull: ShipParameters, turn: Turn) -> float:
    """The yaw moment of a steady turn, N·m."""
    return demand(_arc(turn.radius), Pace(turn.speed, 0.0), hull.coefficients(), LARGEST_DRIFT).yaw_moment


MAKERS: dict[str, Callable[[Turn, ShipParameters, Scale], Made]] = {
    "circle": _make_circle,
    "straight": lambda turn, _, __: ("straight", {"straight.speed": turn.speed, "straight.rise_time": turn.rise_time}, 0.0),
    "slalom": _make_slalom,
    "figure_eight": _make_eight,
    "arc": _make_wide_arc,
    "survey": _make_survey,
    "rest": lambda _, __, ___: ("virtual_ship", {}, 0.0),
}
