"""The common interface of all references, their factory, and the whole trajectory of one in a call."""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.fence import Fence, FenceParameters, allowed, fence_of, leaving
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import as_motion
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.curve_motion import LARGEST_DRIFT, CurveReference, Demand, Pace, check_feasible
from vessel_hsmc_ros.guidance.curves import (
    CircleParameters,
    ExpandingSquareParameters,
    FigureEightParameters,
    SpiralParameters,
    SquareParameters,
    StraightParameters,
)
from vessel_hsmc_ros.guidance.following import FollowingReference, PacedReference, Waiting, waiting_of
from vessel_hsmc_ros.guidance.goal import Filtered, GoalReference, MotionLimits, filter_of
from vessel_hsmc_ros.guidance.lawnmower import LawnmowerParameters, plan_survey
from vessel_hsmc_ros.guidance.path import PathReference
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, TimetableReference, track_leaving
from vessel_hsmc_ros.guidance.programs import CourseReference, CourseReferenceParameters, ReferenceShip, VirtualShipParameters
from vessel_hsmc_ros.guidance.route import TravelLimits
from vessel_hsmc_ros.guidance.timetable import KernelReference, TimetableMemory, follow
from vessel_hsmc_ros.guidance.waypoints import (
    PATH,
    THROUGH,
    GoalParameters,
    PathParameters,
    Point,
    Ship,
    Waypoint,
    scheduled_goals,
    scheduled_path,
)


class Reference(Protocol):
    """A desired motion in discrete time."""

    @property
    def state(self) -> Array:
        """Pose x, y, psi and body velocities u, v, r of the present step, shape (6,)."""
        ...

    def reset(self) -> None:
        """Return to the start."""
        ...

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities at the present step, shape (3,): m/s², m/s², rad/s²."""
        ...

    def advance(self) -> None:
        """Advance by one period."""
        ...


def _virtual_ship(parameters: "ReferenceShipParameters", period: float) -> Reference:
    vessel = parameters.vessel
    # The default inputs are those of the paper's ship. Without a name the hull may be a variation of it.
    for name, unit in (("surge_force", "N"), ("yaw_moment", "N·m")):
        value, limit = getattr(parameters, name), getattr(vessel, f"{name}_limit")
        if vessel.name and abs(value) > limit:
            raise ParameterError(
                f"reference_ship.{name} must be at most vessel.{name}_limit = {limit:g} {unit} (got {value:g} {unit});"
                f" vessel-hsmc init NAME --vessel {vessel.name} writes a scenario that fits"
            )
    return ReferenceShip(parameters, period)


def _course(parameters: "ReferenceShipParameters", period: float) -> Reference:
    # The heading of a course reference is given by its program, so the initial heading is not used.
    x, y = parameters.initial_pose[:2]
    return CourseReference(parameters.course, (x, y), period)


def _goal(parameters: "ReferenceShipParameters", period: float) -> Reference:
    p = parameters
    start = Filtered(*map(float, (*p.initial_pose, *p.initial_velocity, 0.0, 0.0)))
    return GoalReference(start, filter_of(p.motion, p.vessel.coefficients(), period, p.vessel.yaw_moment_limit), p.goal)


def _path(parameters: "ReferenceShipParameters", period: float) -> Reference:
    p, speed = parameters.path, parameters.motion.speed
    start = as_motion((*parameters.initial_pose, *parameters.initial_velocity))
    ship = Ship(parameters.vessel.coefficients(), travel_limits(parameters), p.corner_radius, PATH)
    return PathReference(start, ship, speed, scheduled_path(p, speed), period)


def _pattern(parameters: "ReferenceShipParameters", period: float) -> Reference:
    chosen, (x, y, course) = getattr(parameters, parameters.mode), parameters.initial_pose
    start = as_motion((*parameters.initial_pose, *parameters.initial_velocity))
    ship = Ship(parameters.vessel.coefficients(), travel_limits(parameters), 0.0, f"reference_ship.{parameters.mode}")
    points = [Waypoint(place, THROUGH, chosen.speed) for place in chosen.places(complex(x, y), course)]
    return PathReference(start, ship, chosen.speed, (0.0, points), period)


def _curve(parameters: "ReferenceShipParameters", period: float) -> Reference:
    chosen = getattr(parameters, parameters.mode)
    shape, vessel = chosen.shape(), parameters.vessel.coefficients()
    given = parameters.vessel
    pace = Pace(chosen.speed, chosen.rise_time)
    limits = Demand(LARGEST_DRIFT, given.surge_force_limit, given.yaw_moment_limit)
    check_feasible(f"reference_ship.{parameters.mode}", shape, pace, vessel, limits)
    return CurveReference(shape, pace, vessel, parameters.initial_pose, period)


def travel_limits(parameters: "ReferenceShipParameters") -> TravelLimits:
    """The limits of motions along routes."""
    m, vessel = parameters.motion, parameters.vessel
    limits = vessel.surge_force_limit, vessel.yaw_moment_limit
    return TravelLimits(m.acceleration, m.yaw_rate, m.yaw_acceleration, *limits, m.current)


def _lawnmower(parameters: "ReferenceShipParameters", period: float) -> Reference:
    x, y, course = parameters.initial_pose
    survey = plan_survey(parameters.lawnmower, parameters.vessel.coefficients(), travel_limits(parameters), (x, y, course))
    return TimetableReference(survey.table, survey.track, period)


REFERENCES: dict[str, Callable[["ReferenceShipParameters", float], Reference]] = {
    "virtual_ship": _virtual_ship,
    "course": _course,
    "goal": _goal,
    "path": _path,
    "straight": _curve,
    "circle": _curve,
    "figure_eight": _curve,
    "square": _curve,
    "lawnmower": _lawnmower,
    "expanding_square": _pattern,
    "spiral": _pattern,
}

PLANNED = ("lawnmower", "path", "expanding_square", "spiral")  # modes whose geometry is known ahead
CURVES = ("straight", "circle", "figure_eight", "square")

HULL_LENGTH = 4.0  # length of most hulls in radii of gyration


@dataclass(frozen=True)
class ReferenceShipParameters(VirtualShipParameters):
    """Parameters of all references: virtual ship, course, goals, path, and curves at constant speed."""

    mode: str = parameter(
        "virtual_ship",
        "Reference to track: virtual_ship, the virtual ship (8); course, a heading over time; goal; path, waypoints; or,"
        " begun at `initial_pose` with its heading as course, a curve at constant speed: straight, circle, figure_eight, square;"
        " or lawnmower, parallel legs joined by U-turns; or from there outwards, expanding_square or spiral.",
        choices=tuple(REFERENCES),
    )
    follow: str = parameter(
        "time",
        "What the clock of a path, a survey or a curve follows: time; or vessel, it slows and stops while the vessel is behind.",
        choices=("time", "vessel"),
    )
    follow_lag: float = parameter(
        1.0,
        "With `follow` vessel, how far the vessel is behind along the track when the clock begins to slow, in hull lengths,"
        " which are taken as four radii of gyration, sqrt(m33/m22).",
        low=0.1,
        high=100.0,
    )
    course: CourseReferenceParameters = group(CourseReferenceParameters)
    motion: MotionLimits = group(MotionLimits)
    goal: GoalParameters = group(GoalParameters)
    path: PathParameters = group(PathParameters)
    straight: StraightParameters = group(StraightParameters)
    circle: CircleParameters = group(CircleParameters)
    figure_eight: FigureEightParameters = group(FigureEightParameters)
    square: SquareParameters = group(SquareParameters)
    lawnmower: LawnmowerParameters = group(LawnmowerParameters)
    expanding_square: ExpandingSquareParameters = group(ExpandingSquareParameters)
    spiral: SpiralParameters = group(SpiralParameters)
    fence: FenceParameters = group(FenceParameters)


def make_reference(parameters: ReferenceShipParameters, period: float) -> Reference:
    """Make the reference that the parameters select. `period`: time between two published states, s."""
    if parameters.follow == "vessel" and parameters.mode not in (*PLANNED, *CURVES):
        raise ParameterError(
            f"reference_ship.follow must be time in mode {parameters.mode} (got vessel): only a track that is known ahead waits,"
            f" of the modes {', '.join((*PLANNED, *CURVES))}"
        )
    reference = REFERENCES[parameters.mode](parameters, period)
    if fence := fence_of(parameters.fence, "reference_ship.fence"):
        check_within(fence, parameters, reference)
    return FollowingReference(reference, _waiting(parameters), period) if parameters.follow == "vessel" else reference


def check_within(fence: Fence, p: ReferenceShipParameters, reference: Any) -> None:
    """Check that a reference begins inside of a fence, and that its goals or planned track stay there.

    A curve or an input program has no end: the vessel is stopped where it leaves the fence. `reference`: one that does not follow
    the vessel. Raises ParameterError if it leaves the fence.
    """
    begin = complex(*p.initial_pose[:2])
    if not allowed(fence, begin):
        raise ParameterError(f"reference_ship.initial_pose must be inside of the fence (got ({begin.real:g}, {begin.imag:g}) m)")
    problem = ""
    if p.mode in PLANNED:
        problem = track_leaving(fence, reference.track)
    elif p.mode == "goal" and (goals := [complex(x, y) for time, (x, y, _) in scheduled_goals(p.goal) if time >= 0.0]):
        problem = leaving(fence, np.array([begin, *goals]), range(1, len(goals) + 1))
    if problem:
        raise ParameterError(f"reference_ship.{p.mode} must stay within the fence (got one whose {problem})")


def make_held_reference(parameters: ReferenceShipParameters, period: float) -> Reference:
    """As `make_reference`; its clock can be held, in modes of a track that is known ahead."""
    reference = make_reference(parameters, period)
    if parameters.mode not in (*PLANNED, *CURVES) or parameters.follow == "vessel":
        return reference
    return PacedReference(reference, _waiting(parameters), period)


def half_length(parameters: ReferenceShipParameters) -> float:
    """Half the length of most hulls of this inertia, two radii of gyration, m."""
    hull = parameters.vessel.coefficients()
    return 0.5 * HULL_LENGTH * math.sqrt(hull.m33 / hull.m22)


def _waiting(p: ReferenceShipParameters) -> Waiting:
    largest_speed = max(p.motion.speed, *p.path.speeds) if p.mode == "path" else float(getattr(p, p.mode).speed)
    return waiting_of(p.follow_lag, 2.0 * half_length(p), largest_speed, p.motion)


def track_of(
    parameters: ReferenceShipParameters, period: float, paths: Sequence[tuple[float, Sequence[Point]]] = ()
) -> PlannedTrack | None:
    """The geometry that a reference plans; None in modes without one.

    `period`: time between two published states, s. `paths`: waypoints that were set by messages, with their times, s.
    """
    if parameters.mode not in PLANNED:
        return None
    reference: Any = make_reference(replace(parameters, follow="time"), period)
    for time, points in paths:
        reference.memory = TimetableMemory(round(time / period))
        reference.set_path(points)
    track: PlannedTrack = reference.track
    return track._replace(waits=parameters.follow == "vessel")


Compiler = Callable[..., Callable[..., Any]]


def trajectory(parameters: ReferenceShipParameters, rate_hz: float, count: int, compiled: Compiler | None = None) -> Array:
    """The motion of a reference at its published instants 0 to count - 1, bit-identical to stepping it.

    One that follows its vessel has the motion of its timetable, as if the vessel were never behind. `rate_hz`: rate at which it
    is published, Hz. `count`: number of instants. `compiled`: compiles a kernel; interpreted by default. Returns x, y, psi (not
    wrapped), u, v, r, du, dv, dr, shape (count, 9). SimulationError if the motion is no longer finite.
    """
    reference = make_reference(replace(parameters, follow="time"), RateGrid(rate_hz).period)
    rows = np.full((count, 9), np.nan)
    if compiled and isinstance(reference, KernelReference):
        with suppress(ValueError):  # the cosine of an infinite heading, where another compiler interprets
            compiled(follow, **reference.kernels)(reference.memory, reference.constants, rows)
        if np.isfinite(rows).all():
            return rows
    # Step by step, which raises the error that names what is no longer finite, and when.
    for k in range(count):
        if k:
            reference.advance()
        rows[k] = *reference.state, *reference.acceleration()
    return rows
