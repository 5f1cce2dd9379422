"""Track a circle and a virtual ship with every vessel of the library: `python benchmarks/vessels.py [NAME]...` prints a table."""

import sys

import numpy as np

from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.own_ship import scenario_for
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.vessels import LibraryVessel, read_vessel, vessel_names

FORCE_SHARE, MOMENT_SHARE = 0.3, 0.1
"""Inputs of the virtual ship as shares of the limits that a law knows."""


def tracking(vessel: LibraryVessel, virtual_ship: bool, share: float = 1.0) -> tuple[float, float]:
    """Track the reference of the scenario that `vessel-hsmc init` writes, or a virtual ship driven by constant inputs.

    Args:
        vessel: The vessel.
        virtual_ship: Track the virtual ship instead of the circle.
        share: Share of the duration of the scenario, two laps of the circle.

    Returns:
        The position error, rms of the last quarter and largest, in lengths of the vessel.
    """
    scenario = parse_scenario(scenario_for(vessel.values, vessel.key), vessel.key)
    limits = scenario.controller.vessel
    changes: dict[str, object] = {
        "vessel_sim.duration": share * scenario.vessel_sim.duration,
        "reference_ship.surge_force": FORCE_SHARE * limits.surge_force_limit,
        "reference_ship.yaw_moment": MOMENT_SHARE * limits.yaw_moment_limit,
    }
    run = simulate(scenario.changed({**changes, "reference_ship.mode": "virtual_ship"} if virtual_ship else changes))
    error = position_error(run.state, run.reference) / scenario.vessel_sim.vessel.length
    return rms(error[run.time >= 0.75 * run.time[-1]]), float(np.max(error))


def main(names: list[str]) -> None:
    """Print the errors as percentages of the length."""
    print("| vessel | circle, rms % | circle, largest % | virtual ship, rms % | virtual ship, largest % |")
    print("| --- | --- | --- | --- | --- |")
    for name in names or vessel_names():
        errors = [100.0 * each for virtual in (False, True) for each in tracking(read_vessel(name), virtual)]
        print(f"| {name} | " + " | ".join(f"{error:.2g}" for error in errors) + " |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
