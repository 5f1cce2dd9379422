"""A scenario for a ship of which only the main data are known; everything else is estimated by rules of thumb.

| symbol | meaning | unit |
|---|---|---|
| L, B, D | length, beam, draught | m |
| m, U | mass, top speed | kg, m/s |
| F, N | largest surge force, largest yaw moment | N, N·m |
| m11, m22, m33 | inertia with added mass, as in (6) | kg, kg, kg·m² |
| r_N | yaw rate of a turn on the spot under N | rad/s |
| T | unit of time of the ship's turns, sqrt(m33/N) | s |

The template in `config/templates` states the rule beside each number.
"""

import math
import re
from dataclasses import dataclass
from string import Template

from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.schema import parameter

GRAVITY, WATER_DENSITY, AIR_DENSITY = 9.81, 1025.0, 1.2

COMMENT_COLUMN = 40


def datum(what: str, unit: str, high: float, rule: str) -> float:
    """Declare a datum of the ship that is estimated where it is zero; the rule completes the description."""
    return parameter(0.0, f"{what}; by default {rule}.", unit=unit, low=0.0, high=high)


@dataclass(frozen=True)
class MainData:
    """What is known of a ship; zero for what is to be estimated."""

    length: float = parameter(4.0, "Length; by default 4 m.", unit="m", low=0.1, high=1e3)
    beam: float = datum("Beam", "m", 1e3, "0.53·length^0.75")
    mass: float = datum("Mass", "kg", 1e12, "8·length³")
    surge_force_limit: float = datum("Largest surge force", "N", 1e12, "5 % of the weight")
    yaw_moment_limit: float = datum("Largest yaw moment", "N·m", 1e15, "the surge force at a lever of a fifth of the length")
    speed: float = datum("Top speed", "m/s", 100.0, "0.4·sqrt(g·length)")
    wind: float = parameter(0.0, "Speed of a wind from the west, with gusts; by default none.", unit="m/s", low=0.0, high=60.0)

    def completed(self) -> "MainData":
        """The data with estimates for those that are zero."""
        mass = self.mass or _rounded(8.0 * self.length**3)
        force = self.surge_force_limit or _rounded(0.05 * mass * GRAVITY)
        return MainData(
            self.length,
            self.beam or _rounded(0.53 * self.length**0.75),
            mass,
            force,
            self.yaw_moment_limit or _rounded(0.2 * force * self.length),
            self.speed or _rounded(0.4 * math.sqrt(GRAVITY * self.length)),
            self.wind,
        )


def scenario_text(name: str, data: MainData) -> str:
    """Write the scenario of a ship: hull, calm water or wind, a circle as reference, and the guided law.

    Args:
        name: Name of the ship, for the headline.
        data: What is known of the ship.

    Returns:
        A commented ROS parameters file.
    """
    d = data.completed()
    given = {key: _number(value) for key, value in vars(d).items()}
    hull = _hull(d)
    numbers = {**hull, **_loads(d), **_reference(d, hull), **_gains(d, hull)}
    estimated = {key: _number(_rounded(value)) for key, value in numbers.items()}
    template = Template((share_directory() / "config" / "templates" / "ship.yaml").read_text(encoding="utf-8"))
    return "\n".join(map(_aligned, template.substitute(name=name, **given, **estimated).splitlines())) + "\n"


def _hull(d: MainData) -> dict[str, float]:
    """Draught, inertia and damping."""
    draught = d.mass / (WATER_DENSITY * 0.5 * d.length * d.beam)
    m22, m33, decay = 1.5 * d.mass, 1.5 * d.mass * (0.25 * d.length) ** 2, d.speed / d.length
    d_r, d_r2 = m33 * decay, WATER_DENSITY * draught * d.length**4 / 64.0
    return {
        "draught": draught,
        "surge_inertia": 1.05 * d.mass,
        "sway_inertia": m22,
        "yaw_inertia": m33,
        "surge_damping": 0.2 * d.surge_force_limit / d.speed,
        "surge_damping_quadratic": 0.8 * d.surge_force_limit / d.speed**2,
        "sway_damping": m22 * decay,
        "sway_damping_quadratic": 0.5 * WATER_DENSITY * d.length * draught,
        "yaw_damping": d_r,
        "yaw_damping_quadratic": d_r2,
        # The positive root of d_r2·r² + d_r·r = N.
        "turn_rate": 2.0 * d.yaw_moment_limit / (d_r + math.sqrt(d_r**2 + 4.0 * d_r2 * d.yaw_moment_limit)),
    }


def _loads(d: MainData) -> dict[str, float]:
    """The wind: rho/2·c·A·V² on an area of 0.15·L² with c = 1."""
    factor = 0.5 * AIR_DENSITY * 0.15 * d.length**2
    force = factor * d.wind**2
    return {"wind_factor": factor, "wind_force": force, "gust_deviation": 0.1 * force}


def _reference(d: MainData, hull: dict[str, float]) -> dict[str, float]:
    """Circle and other references, and the limits of motions to goals."""
    radius, cruise = 5.0 * d.length, d.speed / 3.0
    return {
        "radius": radius,
        "cruise": cruise,
        "rise_time": max(cruise * hull["surge_inertia"] / (0.25 * d.surge_force_limit), 10.0),
        "duration": 4.0 * math.pi * radius / cruise,
        "eight": 15.0 * d.length,
        "side": 10.0 * d.length,
        "motion_acceleration": 0.25 * d.surge_force_limit / hull["surge_inertia"],
        "motion_yaw_rate": hull["turn_rate"] / 3.0,
        "motion_yaw_acceleration": 0.25 * d.yaw_moment_limit / hull["yaw_inertia"],
        "astern_distance": 0.3 * d.length,
        "path_radius": max(0.3 * d.length, 0.1),
    }


def _gains(d: MainData, hull: dict[str, float]) -> dict[str, float]:
    """Gains of the guided law: those of the paper's ship in units of T, length and speed; and decay rates of the observer.

    The position gain is smaller: most hulls damp sway less than the paper's ship, and station keeping in wind would oscillate.
    """
    T = math.sqrt(hull["yaw_inertia"] / d.yaw_moment_limit)
    return {
        "unit_time": T,
        "position_gain": 0.6 / T,
        "approach_speed": 0.36 * d.speed,
        "drift_gain": 0.09 / T**2,
        "drift_limit": 0.03 * d.speed,
        "heading_surface_slope": 1.9 / T,
        "turn_rate_limit": 0.8 * hull["turn_rate"],
        "command_bandwidth": 9.2 / T,
        "yaw_reaching_gain": 8.3 / T,
        "surge_reaching_gain": 6.4 / T,
        "surge_learning_rate": 9.2 / T,
        "sway_learning_rate": 14.0 / T,
        "yaw_learning_rate": 8.3 / T,
        "position_filter": 6.9 / T,
        "heading_filter": 14.0 / T,
        "slew_time": 0.2 * T,
        "resting_lever": max(0.0056 * d.length, 1e-3),
        "resting_lever_time": 0.65 * T,
        "resting_heading_gain": 0.14 / T,
        "resting_speed": max(0.006 * d.speed, 1e-3),
        "resting_push": max(0.003 * d.surge_force_limit / hull["surge_inertia"], 1e-3),
        "backing_distance": 1.6 * d.length,
        "surge_decay": hull["surge_damping"] / hull["surge_inertia"],
        "sway_decay": hull["sway_damping"] / hull["sway_inertia"],
        "yaw_decay": hull["yaw_damping"] / hull["yaw_inertia"],
    }


def _rounded(value: float) -> float:
    """An estimate with three digits: more would pretend a precision that it does not have."""
    return float(f"{value:.3g}")


def _number(value: float) -> str:
    """A number with the decimal point by which ROS recognises a floating-point number."""
    text = f"{value:.12g}"
    return text if "." in text else f"{value:.1e}" if "e" in text else f"{text}.0"


def _aligned(line: str) -> str:
    """A line with its comment, if it has a value as well, in the column of comments."""
    found = re.fullmatch(r"(\s*[^#\s][^#]*?)\s*(#.*)", line)
    return f"{found[1]:<{COMMENT_COLUMN - 2}}  {found[2]}" if found else line
