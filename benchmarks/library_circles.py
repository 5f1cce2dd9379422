"""Every vessel of the library on the circle of its own scenario: what `vessel-hsmc init NAME --vessel KEY` checks, as a table.

python benchmarks/library_circles.py
"""

import math

from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.runs.ship_check import check_ship
from vessel_hsmc_ros.scenario.own_ship import scenario_for
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names


def main() -> None:
    """Print a row for each vessel."""
    print("| vessel | circle | speed | surge force | yaw moment | drift | largest position error, last quarter |")
    print("|---|---|---|---|---|---|---|")
    for key in vessel_names():
        scenario = parse_scenario(scenario_for(read_vessel(key).values, key, key), key)
        check, circle = check_ship(scenario), scenario.reference_ship.circle
        error = f"{quantity(check.error, 'm')} ({check.error_lengths:.1g} lengths)"
        shares = f"{100.0 * check.surge_share:.0f} % | {100.0 * check.yaw_share:.0f} %"
        drift = f"{math.degrees(check.demand.drift):.1f}°"
        print(f"| {key} | {circle.radius:g} m | {circle.speed:g} m/s | {shares} | {drift} | {error} |", flush=True)


if __name__ == "__main__":
    main()
