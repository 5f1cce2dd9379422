"""What controlling the centre of percussion is worth: laws on the paper's ship with coupled sway and yaw, declared and not.

The plant has m23 and a cross damping of 0.3 1/s times m23. The law knows nothing of it, or it knows m23 and controls the centre
of percussion, or it knows m23 and controls the origin. Prints the rms position error over the second half of each run and over
all of it, and for two other ships the largest error of the origin over the last lap of a circle in a wind.

    python benchmarks/controlled_point.py [--laws guided los_pid hierarchical]
"""

import argparse
import math
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT
from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text, ship_of
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import circle_for, scale_of, sway_damping_rate
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

SCENARIOS = ("case2_tracking", "figure_eight", "waypoints")
COUPLINGS = (0.0, 6e5, 1.2e6, -1.2e6)
KNOWLEDGE = {"nothing": None, "m23, at the centre of percussion": "percussion", "m23, at the origin": "origin"}

GUNNERUS = {
    **{"length": 31.25, "beam": 9.6, "draught": 2.7, "surge_force_limit": 154e3, "yaw_moment_limit": 1.2e6},
    **{"surge_inertia": 600.7e3, "sway_inertia": 706.7e3, "yaw_inertia": 54.56e6},
    **{"sway_yaw_inertia": -473.3e3, "yaw_sway_inertia": -571.2e3},
    **{"surge_damping": 1117.6, "sway_damping": 22288.64, "yaw_damping": 1949686.56},
    **{"surge_damping_quadratic": 1671.6, "sway_damping_quadratic": 23611.35, "yaw_damping_quadratic": 3.65427334e8},
    **{"surge_damping_cubic": 0.0, "sway_damping_cubic": 0.0, "yaw_damping_cubic": 0.0},
}
"""R/V Gunnerus, from the COLAV simulator (MIT)."""

SUPPLY_VESSEL = {
    **{"length": 76.2, "beam": 18.0, "draught": 6.0, "surge_force_limit": 1e6, "yaw_moment_limit": 2e7},
    **{"surge_inertia": 6.7644e6, "sway_inertia": 1.13412e7, "yaw_inertia": 4.45238e9, "sway_yaw_inertia": -3.40157e7},
    **{"surge_damping": 7.70711e4, "sway_damping": 2.54679e5, "yaw_damping": 3.85007e8},
    **{"sway_damping_from_yaw": -2.03416e6, "yaw_damping_from_sway": -6.72585e5},
    **{f"{force}_damping_{power}": 0.0 for force in ("surge", "sway", "yaw") for power in ("quadratic", "cubic")},
}
"""Fossen, Sagatun, Sorensen 1996."""

CIRCLES = {"R/V Gunnerus": (GUNNERUS, 574e3), "supply vessel": (SUPPLY_VESSEL, 6e6)}
SPEED, RADIUS, WIND = 2.0, 6.0, 0.1
"""Speed on the circle, m/s; its radius in lengths; force of the wind as a share of the largest surge force."""


def main() -> int:
    """Run everything and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--laws", nargs="+", default=["guided", "los_pid", "hierarchical"])
    laws = parser.parse_args().laws
    console = Console(width=120)
    for name in SCENARIOS:
        console.print(papers_ship(name, laws))
    console.print(circles())
    return 0


def changes_of(law: str, m23: float, point: str | None) -> dict[str, object]:
    """The changes of a scenario for a coupled plant, and a law that knows of it where a point is given."""
    plant: dict[str, object] = {"vessel_sim.vessel.sway_yaw_inertia": m23, "vessel_sim.vessel.sway_damping_from_yaw": 0.3 * m23}
    changes = {"controller.law": law, "controller.rate_hz": 100.0, "vessel_sim.rate_hz": 100.0, "reference_ship.rate_hz": 100.0}
    # A law that takes its actuators for slow is slow enough for the coupling, too; these actuators are instant.
    changes |= {f"controller.vessel.{name}": value for name, value in INSTANT.items()}
    known: dict[str, object] = {"controller.vessel.sway_yaw_inertia": m23, "controller.vessel.controlled_point": point}
    return {**plant, **changes, **(known if point else {})}


def papers_ship(name: str, laws: list[str]) -> Table:
    """The errors in one scenario, by law, coupling and knowledge."""
    table = Table(
        "law",
        "m23 [kg·m]",
        "x_p [m]",
        *(f"knows {what} [m]" for what in KNOWLEDGE),
        title=f"{name}: rms error, second half (all)",
    )
    for law in laws:
        for m23 in COUPLINGS:
            cells = [errors(load_scenario(name, changes_of(law, m23, point))) for point in KNOWLEDGE.values()]
            table.add_row(law, f"{m23:g}", f"{m23 / 177.9e3:.2f}", *cells)
    return table


def errors(scenario: Scenario) -> str:
    """The rms position error over the second half of a run and over all of it."""
    try:
        run = simulate(scenario)
    except VesselHsmcError:
        return "diverges"
    error = position_error(run.state, run.reference)
    return f"{rms(error[len(error) // 2 :]):.3f} ({rms(error):.3f})"


def circle(hull: dict[str, Any], mass: float, point: str) -> Scenario:
    """A ship on a circle in a wind from the west, two laps."""
    data = MainData(hull["length"], hull["beam"], mass, hull["surge_force_limit"], hull["yaw_moment_limit"], 3.0 * SPEED)
    radius = RADIUS * hull["length"]
    ship = ship_of({f"vessel.{name}": value for name, value in hull.items()})
    scale = scale_of(ship)
    changes = {
        **{f"vessel.{name}": value for name, value in hull.items()},
        "reference_ship.circle.radius": radius,
        "reference_ship.circle.speed": SPEED,
        "vessel_sim.disturbance.earth_fixed.east_force": WIND * hull["surge_force_limit"],
        "vessel_sim.disturbance.earth_fixed.gust_deviation": 0.0,
        "vessel_sim.duration": round(4.0 * math.pi * radius / SPEED),
        "controller.vessel.controlled_point": point,
        "controller.vessel.sway_damping_rate": sway_damping_rate(ship, scale, circle_for(ship, scale)),
    }
    return parse_scenario(scenario_text("circle", data), "circle", changes)


def circles() -> Table:
    """The errors of the origin on the circle of two ships whose centre of percussion is behind it."""
    table = Table("ship", "x_p [m]", *(f"at the {point} [lengths]" for point in ("percussion", "origin")), "heading off by [deg]")
    for name, (hull, mass) in CIRCLES.items():
        cells, offset = [], 0.0
        for point in ("percussion", "origin"):
            scenario = circle(hull, mass, point)
            run = simulate(scenario)
            lap = len(run.time) // 2
            cells.append(f"{position_error(run.state, run.reference)[lap:].max() / hull['length']:.5f}")
            offset = np.degrees(np.abs(np.arctan2(*_sine_and_cosine(run.state[lap:, 2] - run.reference[lap:, 2]))).max())
        table.add_row(name, f"{scenario.controller.vessel.percussion_point:.2f}", *cells, f"{offset:.1f}")
    return table


def _sine_and_cosine(angle: Any) -> tuple[Any, Any]:
    return np.sin(angle), np.cos(angle)


if __name__ == "__main__":
    raise SystemExit(main())
