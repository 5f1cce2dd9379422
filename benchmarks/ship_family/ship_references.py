"""What the ships of the family follow: circles, lines, slaloms, eights, arcs and surveys that they can sail in calm water."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.node_list import REFERENCE
from vessel_hsmc_ros.guidance.curve_motion import Pace, demand
from vessel_hsmc_ros.guidance.curves import CLOSING, Arc, Curve, FigureEight
from vessel_hsmc_ros.guidance.lawnmower import LawnmowerParameters, plan_lawnmower
from vessel_hsmc_ros.guidance.route import TravelLimits
from vessel_hsmc_ros.guidance.sailing import LARGEST_DRIFT
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.scenario.ship_rules import ADJUSTMENTS, Scale, feasible_turn, motion_limits

if TYPE_CHECKING:
    from ship_family import ShipFamily

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


def course_for(family: "ShipFamily", hull: ShipParameters, scale: Scale) -> Course:
    """The reference of a ship; wider or slower where the ship could not follow it in calm water."""
    kind = family.reference
    curve = CURVES.get(kind, _arc)
    made = feasible_turn(
        kind,
        curve,
        (family.radius * scale.L, family.speed * scale.U),
        lambda speed: speed * scale.m11 / (START_SHARE * scale.F),
        hull,
        scale,
    )
    turn = Turn(made.radius, made.speed, made.rise_time, 1.0 if family.to_port else -1.0)
    mode, chosen, period = MAKERS[kind](turn, hull, scale)
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
    # The forces of a steady speed on a straight line, and of a steady turn.
    drag = hull.surge_damping + turn.speed * (hull.surge_damping_quadratic + turn.speed * hull.surge_damping_cubic)
    moment = demand(_arc(turn.radius), Pace(turn.speed, 0.0), hull.coefficients(), LARGEST_DRIFT).yaw_moment
    changes: Changes = {
        "surge_force": turn.speed * drag,
        "yaw_moment_sine.amplitude": turn.side * moment,
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


MAKERS: dict[str, Callable[[Turn, ShipParameters, Scale], Made]] = {
    "circle": _make_circle,
    "straight": lambda turn, _, __: ("straight", {"straight.speed": turn.speed, "straight.rise_time": turn.rise_time}, 0.0),
    "slalom": _make_slalom,
    "figure_eight": _make_eight,
    "arc": _make_wide_arc,
    "survey": _make_survey,
    "rest": lambda _, __, ___: ("virtual_ship", {}, 0.0),
}
