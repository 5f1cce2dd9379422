"""A survey in a new scenario: its legs as given, and a run that lasts as long as they take."""

import math
import re
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.quantities import number_of
from vessel_hsmc_ros.reference.factory import travel_limits
from vessel_hsmc_ros.reference.lawnmower import plan_survey
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario

MARGIN = 1.1
"""Duration of the run relative to the planned time of the survey: the ship comes to its end a little later than the plan."""

TAKES = "legs,length,spacing,speed: a whole number, m, m (negative to starboard) and m/s, such as 4,80,16,1"


class NewSurvey(NamedTuple):
    """Number of legs, their length and spacing, m, and the speed on them, m/s."""

    legs: int
    length: float
    spacing: float
    speed: float


def survey_of(text: str) -> NewSurvey:
    """Read a survey, `legs,length,spacing,speed`.

    Raises:
        ParameterError: it is not four numbers, or the first is not a whole one.
    """
    try:
        legs, *others = map(number_of, text.split(","))
        if legs.is_integer() and len(others) == 3:
            return NewSurvey(int(legs), *others)
    except (ValueError, AttributeError):
        pass
    raise ParameterError(f"--survey must be {TAKES} (got {text})")


def with_survey(text: str, survey: NewSurvey) -> str:
    """A scenario that `own_ship` has written, with a survey for its reference.

    Returns:
        The scenario; its duration is the planned time of the survey and a tenth of it.

    Raises:
        ParameterError: a value is out of range, or the ship cannot sail the survey; the message states what would do.
    """
    names = dict(zip(("legs", "leg_length", "spacing", "speed"), survey, strict=True))
    try:
        planned = parse_scenario(text, "new", {f"reference_ship.lawnmower.{name}": value for name, value in names.items()})
        duration = math.ceil(MARGIN * planned_time(planned) / 10.0) * 10.0
    except ParameterError as error:
        raise ParameterError(f"--survey: {error}") from None
    own = planned.reference_ship.lawnmower
    values = ", ".join(f"{name}: {getattr(own, name)}" for name in ("legs", "leg_length", "spacing", "run_in", "speed"))
    for pattern, new in (
        (r"mode: circle   ", "mode: lawnmower"),
        (r"or straight, figure_eight, square, lawnmower,", "or circle, straight, figure_eight, square,"),
        (r"lawnmower: \{.*", f"lawnmower: {{{values}}}"),
        (r"duration: .*", f"duration: {duration}                     # the time that the survey takes, and a tenth of it"),
        (r" on a circle\. Written", " on a survey. Written"),
    ):
        text = re.sub(pattern, new, text, count=1)
    return text


def planned_time(scenario: Scenario) -> float:
    """The time that the survey of a scenario takes, s, whatever the mode of its reference is."""
    p = scenario.reference_ship
    x, y, course = p.initial_pose
    return float(plan_survey(p.lawnmower, p.vessel.coefficients(), travel_limits(p), (x, y, course)).table.times[-1])
