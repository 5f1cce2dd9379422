"""The thrusters of a vessel as data: where each is, which force it gives, and what limits it.

Lists run in parallel, one element a thruster; a list of one element holds for all of them. Kinds:

| kind | force on the hull at its position (x, y) | demand |
|---|---|---|
| fixed | T in the direction `angle` | thrust T |
| azimuth | T in the direction alpha, which turns | thrust T, angle alpha |
| rudder | T ahead, and behind it the lift L = (l·d - l_2 |d|d)·q to port | thrust T, rudder angle d |

An azimuth with angle_limit = pi turns all the way round. The inflow of a rudder is q = |u|u + s·max(T, 0), with the surge speed u
through the water and the slipstream s of its propeller. Momentum theory gives s = 8/(pi·rho·D²) for a propeller of diameter D.
Source: Skjetne, Smogeli and Fossen, Modeling, Identification and Control 25(1), 2004, where the inflow is a blend of both.
An angle turns the force counter-clockwise, as yaw: positive ones give a force to port.

The thrust of a propeller by the pulse width of its speed controller: a measured curve with a deadband, and its inverse.

Between the measured points the curve is straight, beyond them constant; within the deadband about the neutral pulse the thrust is
zero, and from its edges on the curve goes to the nearest measured points.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter

LOWEST, HIGHEST = 1000.0, 2000.0  # range of pulse widths, µs


class ThrustCurve(NamedTuple):
    """A curve from its most negative to its largest thrust."""

    neutral: float  # pulse width of rest, µs
    deadband: float  # half the width of the deadband, µs
    # pulses, thrusts: its points outside the deadband, µs and N, both increasing
    pulses: tuple[float, ...]
    thrusts: tuple[float, ...]

    def pulse(self, thrust: float) -> float:
        """The pulse width for a thrust, N, within the curve; neutral for none."""
        if not thrust:
            return self.neutral
        side, edge = (1.0, self.neutral + self.deadband) if thrust > 0.0 else (-1.0, self.neutral - self.deadband)
        points = sorted((abs(t), p) for p, t in zip(self.pulses, self.thrusts, strict=True) if t * side > 0.0)
        return float(np.interp(abs(thrust), [0.0, *(t for t, _ in points)], [edge, *(p for _, p in points)]))

    def thrust(self, pulse: float) -> float:
        """The thrust for a pulse width, µs; N."""
        if abs(pulse - self.neutral) <= self.deadband:
            return 0.0
        edges = [(self.neutral - self.deadband, 0.0), (self.neutral + self.deadband, 0.0)]
        points = sorted([*zip(self.pulses, self.thrusts, strict=True), *edges])
        return float(np.interp(pulse, [p for p, _ in points], [t for _, t in points]))


def thrust_curve(neutral: float, deadband: float, pulses: Sequence[float], thrusts: Sequence[float], name: str) -> ThrustCurve:
    """A curve of measured points.

    Args:
        neutral: Pulse width of rest, µs.
        deadband: Half the width of the deadband, µs.
        pulses: Pulse widths of the measurements, µs, increasing, outside the deadband.
        thrusts: The measured thrusts, N: negative below the deadband, positive above it, increasing.
        name: Of the group of parameters, for errors.

    Raises:
        ParameterError: the numbers are not such a curve.
    """
    if len(pulses) != len(thrusts) or not pulses:
        raise ParameterError(
            f"{name}.curve_thrusts must have one element for each of {len(pulses)} curve_pulses (got {len(thrusts)})"
        )
    if not all(LOWEST <= p <= HIGHEST for p in pulses) or any(b <= a for a, b in pairwise(pulses)):
        raise ParameterError(f"{name}.curve_pulses must be increasing numbers from 1000 to 2000 µs (got {list(pulses)})")
    if any(b <= a for a, b in pairwise(thrusts)) or not all(map(math.isfinite, thrusts)):
        raise ParameterError(f"{name}.curve_thrusts must be increasing finite numbers, N (got {list(thrusts)})")
    for p, t in zip(pulses, thrusts, strict=True):
        if abs(p - neutral) <= deadband or (p - neutral) * t <= 0.0:
            raise ParameterError(
                f"{name}.curve_thrusts must be negative below {neutral - deadband:g} µs, positive above {neutral + deadband:g} µs"
                f" and without a point between them (got {t:g} N at {p:g} µs); pwm.reversed exchanges ahead and astern"
            )
    return ThrustCurve(neutral, deadband, tuple(pulses), tuple(thrusts))


KINDS = ("fixed", "azimuth", "rudder")
FIXED, AZIMUTH, RUDDER = range(3)

ALL_ROUND = math.pi  # the angle limit of an azimuth that turns all the way round
NAME = re.compile(r"[A-Za-z]\w*")


class Thruster(NamedTuple):
    """One thruster; the attributes are those of `ThrusterLayout`, with the index of its kind in KINDS."""

    name: str
    kind: int
    x: float
    y: float
    angle: float
    thrust_ahead: float
    thrust_astern: float
    thrust_rate: float
    lag: float
    angle_limit: float
    angle_rate: float
    lift: float
    lift_quadratic: float
    slipstream: float
    thrust_coefficient_ahead: float
    thrust_coefficient_astern: float

    @property
    def has_angle(self) -> bool:
        """Whether it takes an angle beside the thrust."""
        return self.kind != FIXED

    @property
    def largest_angle(self) -> float:
        """The angle of the largest lift of a rudder within its limit: beyond l/(2 l_2) the lift falls."""
        return min(self.angle_limit, 0.5 * self.lift / self.lift_quadratic) if self.lift_quadratic else self.angle_limit

    def largest_lift(self, surge_speed: float) -> float:
        """The largest lift of a rudder at full thrust, N; the speed in m/s."""
        d = self.largest_angle
        inflow = abs(surge_speed) * surge_speed + self.slipstream * self.thrust_ahead
        return max((self.lift - self.lift_quadratic * d) * d * inflow, 0.0)

    def directions(self) -> list[tuple[float, float, float]]:
        """The forces that its demand may choose: direction x, y, and the largest one in N at full thrust and rest."""
        if self.kind == FIXED:
            return [(math.cos(self.angle), math.sin(self.angle), self.thrust_ahead)]
        # A rudder without slipstream has no lift at rest: there the speed of 1 m/s shows its direction.
        side = self.thrust_ahead if self.kind == AZIMUTH else self.largest_lift(0.0) or self.largest_lift(1.0)
        return [(1.0, 0.0, self.thrust_ahead), (0.0, 1.0, side)]

    def largest_moment(self) -> float:
        """The largest yaw moment at rest in the weaker direction, N·m."""
        if self.kind == FIXED:
            return abs(self.x * math.sin(self.angle) - self.y * math.cos(self.angle)) * self.thrust_ahead
        if self.kind == RUDDER:
            return abs(self.x) * self.largest_lift(0.0)
        if self.angle_limit >= ALL_ROUND:
            return math.hypot(self.x, self.y) * self.thrust_ahead
        return abs(self.x) * math.sin(self.angle_limit) * self.thrust_ahead

    def shaft_speed(self, thrust: float) -> float:
        """Shaft speed for a thrust, rad/s, by T = k n|n|; NaN without a thrust coefficient."""
        k = self.thrust_coefficient_ahead if thrust >= 0.0 else self.thrust_coefficient_astern
        return math.copysign(math.sqrt(abs(thrust) / k), thrust) if k else math.nan


def of_each(default: float, what: str, unit: str, low: float, high: float) -> tuple[float, ...]:
    """Declare a list with an element for each thruster, or one for all."""
    return parameter((default,), f"{what}, of each thruster or one for all.", unit=unit, low=low, high=high)


@dataclass(frozen=True)
class ThrusterLayout:
    """The thrusters of a vessel; without names it has none."""

    # ROS has no empty lists of strings in parameters files.
    names: tuple[str, ...] = parameter(("",), "Names of the thrusters, from which those of their topics follow; [''] for none.")
    kinds: tuple[str, ...] = parameter(("fixed",), "Kinds of the thrusters: fixed, azimuth or rudder.")
    x: tuple[float, ...] = of_each(0.0, "Position ahead of the origin", "m", -1e3, 1e3)
    y: tuple[float, ...] = of_each(0.0, "Position to port of the origin", "m", -1e3, 1e3)
    angle: tuple[float, ...] = of_each(0.0, "Direction of the force of a fixed thruster", "rad", -math.pi, math.pi)
    thrust_ahead: tuple[float, ...] = of_each(0.0, "Largest thrust ahead", "N", 0.0, 1e9)
    thrust_astern: tuple[float, ...] = of_each(0.0, "Largest thrust astern", "N", 0.0, 1e9)
    thrust_rate: tuple[float, ...] = of_each(math.inf, "Largest rate of change of the thrust", "N/s", 0.0, math.inf)
    lag: tuple[float, ...] = of_each(0.0, "Time constant of the thrust", "s", 0.0, 1e3)
    angle_limit: tuple[float, ...] = of_each(math.pi, "Largest angle of an azimuth or a rudder", "rad", 0.0, math.pi)
    angle_rate: tuple[float, ...] = of_each(math.inf, "Largest rate of change of the angle", "rad/s", 0.0, math.inf)
    lift: tuple[float, ...] = of_each(0.0, "Lift l of a rudder, per angle and inflow", "N·s²/m²", 0.0, 1e9)
    lift_quadratic: tuple[float, ...] = of_each(0.0, "Loss of lift l_2, per |angle|·angle and inflow", "N·s²/m²", 0.0, 1e9)
    slipstream: tuple[float, ...] = of_each(0.0, "Inflow of a rudder per thrust of its propeller", "m²/(s²·N)", 0.0, 1e6)
    thrust_coefficient_ahead: tuple[float, ...] = of_each(
        0.0, "Thrust ahead over the square of the shaft speed; 0 where it is not known", "N·s²", 0.0, 1e9
    )
    thrust_coefficient_astern: tuple[float, ...] = of_each(
        0.0, "Thrust astern over the square of the shaft speed; 0 where it is not known", "N·s²", 0.0, 1e9
    )

    def __post_init__(self) -> None:
        if self:
            _check_lists(self)
            _check_thrusters(self.thrusters())

    def __bool__(self) -> bool:
        """Whether there are thrusters."""
        return any(self.names)

    def thrusters(self) -> list[Thruster]:
        """The thrusters one by one, in the order of their names."""
        if not self:
            return []
        n = len(self.names)
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        columns = {name: values * n if len(values) == 1 else values for name, values in given.items()}
        kinds = [KINDS.index(kind) for kind in columns.pop("kinds")]
        names = columns.pop("names")
        return [Thruster(*each) for each in zip(names, kinds, *columns.values(), strict=True)]

    @property
    def needs_speed(self) -> bool:
        """Whether the forces depend on the surge speed, as those of rudders do."""
        return any(self.names) and "rudder" in self.kinds

    def topics(self) -> list[tuple[str, int, int]]:
        """The topics of the demands, each with the index of its thruster, and 0 for a thrust or 1 for an angle."""
        parts = [(i, t, part) for i, t in enumerate(self.thrusters()) for part in range(2 if t.has_angle else 1)]
        return [(f"thrusters/{t.name}/{('thrust', 'angle')[part]}", i, part) for i, t, part in parts]

    def limits(self) -> tuple[float, float]:
        """The largest surge force [N], ahead, and the largest yaw moment [N·m], in the weaker direction, each alone at rest."""
        each = self.thrusters()
        force = sum(t.thrust_ahead * (abs(math.cos(t.angle)) if t.kind == FIXED else 1.0) for t in each)
        return force, sum(t.largest_moment() for t in each)

    def sway_force_per_yaw_moment(self) -> float:
        """The sway force that comes with each unit of yaw moment, 1/m: 0 for twin propellers, 1/x for a rudder at x.

        It is that of the least-squares allocation of a small yaw moment: with the columns b = (e_x, x·e_y - y·e_x) of the forces
        and the squares of their limits as weights w, the forces are w·b'·(sum w·b·b')^-1·(0, N).
        """
        columns = [(ex, ey, t.x * ey - t.y * ex, w * w) for t in self.thrusters() for ex, ey, w in t.directions()]
        xx, xn, nn = (sum(w * c[i] * c[j] for *c, w in columns) for i, j in ((0, 0), (0, 2), (2, 2)))
        determinant = xx * nn - xn * xn
        if not determinant:
            return 0.0
        return sum(w * ey * (xx * n - xn * ex) for ex, ey, n, w in columns) / determinant


def _check_lists(layout: ThrusterLayout) -> None:
    n = len(layout.names)
    for field in fields(layout):
        if len(values := getattr(layout, field.name)) not in (1, n):
            expected = f"{n} elements, as many as names, or one"
            raise ParameterError(f"vessel.thrusters.{field.name} must have {expected} (got {list(values)})")
    for name in layout.names:
        if not NAME.fullmatch(name):
            form = "a letter, then letters, digits and underscores each, for the name of a topic"
            raise ParameterError(f"vessel.thrusters.names must be {form} (got {name!r})")
        if layout.names.count(name) > 1:
            raise ParameterError(f"vessel.thrusters.names has {name} twice: each thruster needs a name of its own")
    for kind in layout.kinds:
        if kind not in KINDS:
            raise ParameterError(f"vessel.thrusters.kinds must be of {', '.join(KINDS)} (got {kind!r})")


def _check_thrusters(thrusters: list[Thruster]) -> None:
    for t in thrusters:
        if not t.thrust_ahead > 0.0:
            raise ParameterError(f"thruster {t.name}: thrust_ahead must be above 0 N (got {t.thrust_ahead:g} N)")
        if t.kind == AZIMUTH and 0.5 * math.pi < t.angle_limit < ALL_ROUND:
            raise ParameterError(
                f"thruster {t.name}: angle_limit of an azimuth must be at most pi/2, or pi where it turns all the way round"
                f" (got {t.angle_limit:g} rad)"
            )
        if t.kind == RUDDER and not (t.lift > 0.0 and 0.0 < t.angle_limit < 0.5 * math.pi):
            raise ParameterError(
                f"thruster {t.name}: lift of a rudder must be above 0, and angle_limit between 0 and pi/2"
                f" (got {t.lift:g} N·s²/m² and {t.angle_limit:g} rad)"
            )
    columns = [(ex, t.x * ey - t.y * ex) for t in thrusters for ex, ey, force in t.directions() if force]
    lever = max(math.hypot(t.x, t.y) for t in thrusters)
    if all(abs(a * d - b * c) <= 1e-9 * lever for a, b in columns for c, d in columns):
        raise ParameterError(
            f"vessel.thrusters = {', '.join(t.name for t in thrusters)} cannot give a surge force and a yaw moment independently:"
            " place two fixed thrusters apart, or use a rudder or an azimuth away from the origin"
        )
