"""Figures of the vessels of the library in calm water, beside those that their sources state, and tables of them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import shown, suggestion
from vessel_hsmc_ros.plant.dynamics import Vessel, derivative
from vessel_hsmc_ros.plant.hull_parameters import largest_gain
from vessel_hsmc_ros.scenario.parameters_file import VESSEL
from vessel_hsmc_ros.scenario.ship_rules import steady_velocity
from vessel_hsmc_ros.scenario.vessels import LibraryVessel, hull_data, read_vessel, vessel_names

CALM = (0.0, 0.0, 0.0)

AGREEMENT = 0.05  # largest relative difference from a published figure that counts as agreement
COARSE = {"towing_surge_damping": 0.3, "towing_sway_damping": 0.3}
"""The same for figures that come from measurements of another loading condition."""

TOWING = 0.2  # largest speed of the towing tests, m/s


def figure(unit: str, words: str) -> Any:
    """Declare a figure with its unit and meaning, for tables."""
    return field(metadata={"unit": unit, "words": words})


@dataclass(frozen=True)
class Figures:
    """Figures of a vessel in calm water; NaN where a limit that they need is not given."""

    surge_force: float = figure("N", "largest surge force")
    yaw_moment: float = figure("N·m", "largest yaw moment")
    top_speed: float = figure("m/s", "steady speed at the largest surge force")
    half_speed: float = figure("m/s", "steady speed at half of it")
    start_acceleration: float = figure("m/s²", "acceleration at rest by the largest surge force")
    turning_rate: float = figure("rad/s", "steady yaw rate on the spot by the largest yaw moment")
    turn_radius: float = figure(
        "lengths", "radius of the steady turn at the largest surge force and a quarter of the largest yaw moment"
    )
    turn_speed: float = figure("m/s", "speed in this turn")
    turn_drift: float = figure("rad", "drift angle in this turn, positive with the stern outward")
    sway_time_constant: float = figure("s", "m22/d_v")
    yaw_time_constant: float = figure("s", "m33/d_r")
    towing_surge_damping: float = figure("kg/s", f"linear fit of the surge damping up to {TOWING:g} m/s")
    towing_sway_damping: float = figure("kg/s", f"linear fit of the sway damping up to {TOWING:g} m/s")
    percussion_point: float = figure("m", "centre of percussion m23/m22 ahead of the origin")
    mass_ratio: float = figure("", "m11/m22")
    energy_gain: float = figure("1/s", "largest rate at which damping adds energy in the range of validity; 0: it removes energy")


def figures(vessel: LibraryVessel) -> Figures:
    """Compute the figures of a vessel."""
    hull = vessel.hull()
    v = hull.coefficients()
    X, N = (limit if math.isfinite(limit) else math.nan for limit in (hull.surge_force_limit, hull.yaw_moment_limit))
    turn = steady_motion(v, X, 0.25 * N)
    speed = math.hypot(turn[0], turn[1])
    return Figures(
        surge_force=X,
        yaw_moment=N,
        top_speed=steady_speed(v, X),
        half_speed=steady_speed(v, 0.5 * X),
        start_acceleration=X / v.m11,
        turning_rate=steady_motion(v, 0.0, N)[2],
        turn_radius=_ratio(speed, abs(turn[2])) / hull.length,
        turn_speed=speed,
        turn_drift=-math.atan2(turn[1], turn[0]),
        sway_time_constant=_ratio(v.m22, v.d_v),
        yaw_time_constant=_ratio(v.m33, v.d_r),
        towing_surge_damping=_linear_fit(v.d_u, v.d_u2, v.d_u3),
        towing_sway_damping=_linear_fit(v.d_v, v.d_v2, v.d_v3),
        percussion_point=v.m23 / v.m22,
        mass_ratio=v.m11 / v.m22,
        energy_gain=gain.rate if (gain := largest_gain(hull)) else 0.0,
    )


def steady_speed(vessel: Vessel, force: float) -> float:
    """The speed ahead at which damping balances a surge force [N], m/s: the root of d_u·u + d_u2·u² + d_u3·u³ = X."""
    return math.nan if math.isnan(force) else steady_velocity(force, vessel.d_u, vessel.d_u2, vessel.d_u3)


def steady_motion(vessel: Vessel, force: float, moment: float) -> tuple[float, float, float]:
    """The velocities u, v, r that a surge force [N] and a yaw moment [N·m] lead to from rest; NaN where none is reached."""
    from scipy.integrate import solve_ivp

    if math.isnan(force + moment):
        return math.nan, math.nan, math.nan

    def rates(_time: float, velocity: Any) -> Any:
        return derivative(np.array([0.0, 0.0, 0.0, *velocity]), (force, 0.0, moment), CALM, vessel)[3:]

    # Damping is weak in some hulls: a hundred time constants of the slowest motion, or of a turn on the spot.
    decays = (_ratio(vessel.m11, vessel.d_u), _ratio(vessel.m22, vessel.d_v), _ratio(vessel.m33, vessel.d_r))
    slowest = max(time for time in (*decays, math.sqrt(abs(_ratio(vessel.m33, moment))), 1.0) if math.isfinite(time))
    solution = solve_ivp(rates, (0.0, 100.0 * slowest), CALM, method="LSODA", rtol=1e-8, atol=1e-10)
    u, v, r = map(float, solution.y[:, -1])
    settled = np.allclose(solution.y[:, -1], solution.y[:, len(solution.t) * 9 // 10], rtol=1e-3, atol=1e-6)
    return (u, v, r) if settled else (math.nan, math.nan, math.nan)


def agreement(vessel: LibraryVessel, computed: Figures) -> dict[str, float]:
    """The relative differences of computed figures from the published ones, by name."""
    known = [each.name for each in fields(Figures)]
    for name in vessel.published:
        if name not in known:
            raise ParameterError(f"vessel file {vessel.path}: published.{name} is not a figure: {suggestion(name, known)}")
    return {name: getattr(computed, name) / value - 1.0 for name, value in vessel.published.items()}


def agrees(name: str, difference: float) -> bool:
    """Whether a relative difference of a figure counts as agreement."""
    return abs(difference) <= COARSE.get(name, AGREEMENT)


def _ratio(a: float, b: float) -> float:
    return a / b if b else math.inf


def _linear_fit(linear: float, quadratic: float, cubic: float) -> float:
    """The coefficient k of least squares k·w = d·w + d_2·w² + d_3·w³ on 0 <= w <= TOWING, by the integrals of w^n."""
    w = TOWING
    return linear + quadratic * 0.75 * w + cubic * 0.6 * w * w


Row = Sequence[str]

HEAD = ("vessel", "name", "inputs", "length m", "mass kg", "top m/s", "turn rad/s", "x_p m", "m11/m22", "verified", "open")

COMPARED = ("vessel", "figure", "computed", "published", "difference")

INFORMATION = {each.name: each.metadata for each in fields(Figures)}  # unit and meaning of each figure


def published_vessels() -> list[LibraryVessel]:
    """The vessels that come with the package."""
    return [read_vessel(name) for name in vessel_names()]


def overview(vessels: Iterable[LibraryVessel]) -> list[Row]:
    """Vessels with their main figures; the columns are those of HEAD."""
    return [_summary(vessel) for vessel in vessels]


def comparison(vessels: Iterable[LibraryVessel]) -> list[Row]:
    """The published figures of vessels beside the computed ones; the columns are those of COMPARED."""
    rows: list[Row] = []
    for vessel in vessels:
        computed = figures(vessel)
        for name, difference in agreement(vessel, computed).items():
            verdict = "" if agrees(name, difference) else ", not verified"
            values = number(getattr(computed, name)), number(vessel.published[name])
            rows.append((vessel.key, _with_unit(name), *values, f"{100.0 * difference:+.1f} %{verdict}"))
    return rows


def details(vessel: LibraryVessel) -> list[Row]:
    """Figures and hull data of one vessel: name with unit, value, meaning."""
    computed, entries = figures(vessel), hull_data()
    rows: list[Row] = [(_with_unit(name), number(getattr(computed, name)), each["words"]) for name, each in INFORMATION.items()]
    for key, value in vessel.values.items():
        name = key.removeprefix(VESSEL)
        entry = entries[name][0]
        rows.append((f"{name} {entry.unit}".strip(), shown(value), entry.description))
    return rows


def markdown() -> str:
    """Overview and comparison as tables of Markdown, for the docs."""
    tables = ((HEAD, overview(published_vessels())), (COMPARED, comparison(published_vessels())))
    return "\n\n".join(
        "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)) for head, rows in tables
    )


def number(value: float) -> str:
    """A number with three digits; empty for NaN."""
    return "" if math.isnan(value) else f"{float(f'{value:.3g}'):g}"


def _summary(vessel: LibraryVessel) -> Row:
    computed, hull = figures(vessel), vessel.hull()
    inputs = ", ".join(dict.fromkeys(hull.thrusters.kinds)) if hull.thrusters else "wrench"
    verified = sum(agrees(name, difference) for name, difference in agreement(vessel, computed).items())
    published = f"{verified} of {len(vessel.published)}" if vessel.published else ""
    sizes = (hull.length, vessel.mass or math.nan)
    speeds = (computed.top_speed, computed.turning_rate, computed.percussion_point, computed.mass_ratio)
    return (vessel.key, vessel.name, inputs, *map(number, (*sizes, *speeds)), published, str(len(vessel.unverified)))


def _with_unit(name: str) -> str:
    return f"{name} {INFORMATION[name]['unit']}".strip()
