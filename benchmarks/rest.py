"""Station keeping of the ship of the paper in a current from four sides, with and without the paper's disturbance.

`python benchmarks/rest.py` prints the rms position error of the last quarter of 900 s, m: the smallest and the largest of the
four directions. The guided law at 20 Hz with derived gains.
"""

import itertools
import math

from vessel_hsmc_ros.runs.batch import simulate_one
from vessel_hsmc_ros.runs.offline import load_scenario

SPEEDS = (0.1, 0.25, 0.5, 0.8)
"""Speeds of the current, m/s."""

SCENARIOS = {"the paper's disturbance": "case3_stabilisation", "calm": "case3_calm"}

COUPLING = 6e5
"""The inertia m23 of the coupled ship, kg·m, and 0.4/s of it as cross damping."""


def changes(speed: float, direction: float, coupling: float, lag: float | None) -> dict[str, object]:
    """The changes of a scenario.

    Args:
        speed, direction: Of the current, m/s and rad.
        coupling: The inertia m23, declared where the lag is.
        lag: Lag of both inputs, declared; None for instant inputs of which nothing is declared.
    """
    changed: dict[str, object] = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}
    changed |= {"controller.law": "guided", "vessel_sim.duration": 900.0}
    changed["vessel_sim.disturbance.current.north"] = speed * math.sin(direction)
    changed["vessel_sim.disturbance.current.east"] = speed * math.cos(direction)
    known = ("vessel_sim", "controller") if lag is not None else ("vessel_sim",)
    if coupling:
        changed |= {f"vessel_sim.vessel.{each}": 0.4 * coupling for each in ("sway_damping_from_yaw", "yaw_damping_from_sway")}
        changed |= {f"{node}.vessel.sway_yaw_inertia": coupling for node in known}
    if lag is not None:
        nodes = ("vessel_sim.actuators", "controller.vessel")
        changed |= {f"{node}.{each}_lag": lag for node in nodes for each in ("surge", "yaw")}
    return changed


def main() -> None:
    """Print a row for each ship and disturbance, a column for each speed of the current."""
    print("| disturbance | m23 | lag | " + " | ".join(f"{speed:g} m/s" for speed in SPEEDS) + " |")
    print("|" + " --- |" * (3 + len(SPEEDS)))
    for (name, scenario), coupling, lag in itertools.product(SCENARIOS.items(), (0.0, COUPLING), (None, 2.0)):
        cells = []
        for speed in SPEEDS:
            found = [
                simulate_one(load_scenario(scenario, changes(speed, 0.5 * math.pi * k, coupling, lag))).metrics for k in range(4)
            ]
            errors = [each.position_error_rms_last_quarter if each else math.inf for each in found]
            cells.append(f"{min(errors):.2g} to {max(errors):.2g}")
        declared = "not declared" if lag is None else f"{lag:g} s"
        print(f"| {name} | {coupling:g} | {declared} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
