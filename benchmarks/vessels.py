"""Track circle, straight and slalom and keep station with every vessel of the library, in calm water and in a sea of its scale.

`python benchmarks/vessels.py [NAME]... [--states calm,sea] [--law guided]` prints a table, and how many errors are within their
limits; a name may be the path of a vessel file. The states `wind`, `current` and `noise` are the sea without the other two. The
scenario is that of `vessel-hsmc init`, the gains are those of the rule. All references and loads are dimensionless numbers times
the units of the ship: length L, sqrt(g·L), and T = sqrt(m33/tau_2max).
"""

import argparse
import math

from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.scenario.own_ship import scenario_for, ship_of
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import Scale, loads, scale_of
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names
from vessel_hsmc_ros.studies.batch import simulate_one

FORCE_SHARE, MOMENT_SHARE, FREQUENCY = 0.3, 0.1, 0.1
"""Inputs of the virtual ship in the slalom as shares of the limits, and the frequency of its yaw moment, in 1/T."""

WIND, CURRENT = 0.3, 0.03
"""Wind and current, in sqrt(g·L)."""

CALM_LIMIT, SEA_LIMIT = 0.002, 0.01
"""Limits of the rms position error, in lengths."""

KINDS = ("circle", "straight", "slalom", "rest")


def references(s: Scenario, scale: Scale) -> dict[str, dict[str, object]]:
    """The changes for each reference; the ship starts half a length behind and beside it, 45° off its heading."""
    start: dict[str, object] = {"vessel_sim.initial_pose": [-0.3 * scale.L, -0.4 * scale.L, math.pi / 4.0]}
    limits = s.controller.vessel
    rest = {**start, "reference_ship.mode": "virtual_ship", "reference_ship.surge_force": 0.0, "reference_ship.yaw_moment": 0.0}
    slalom = {
        **rest,
        "reference_ship.surge_force": FORCE_SHARE * limits.surge_force_limit,
        "reference_ship.yaw_moment_sine.amplitude": MOMENT_SHARE * limits.yaw_moment_limit,
        "reference_ship.yaw_moment_sine.frequency": FREQUENCY / scale.T,
    }
    return {"circle": start, "straight": {**start, "reference_ship.mode": "straight"}, "slalom": slalom, "rest": rest}


def loads_of(state: str, scale: Scale) -> dict[str, object]:
    """Wind from the west with gusts, current from the south and noise, in the units of the ship.

    Args:
        state: `calm`, `sea` with all of them, or `wind`, `current` or `noise` with one.
        scale: The units.
    """
    speed = math.sqrt(GRAVITY * scale.L)
    force = loads(scale.L, WIND * speed)
    parts: dict[str, dict[str, object]] = {
        "wind": {
            "vessel_sim.disturbance.earth_fixed.east_force": force["wind_force"],
            "vessel_sim.disturbance.earth_fixed.gust_deviation": force["gust_deviation"],
            "vessel_sim.disturbance.earth_fixed.gust_time_constant": 4.0 * scale.T,
        },
        "current": {"vessel_sim.disturbance.current.north": CURRENT * speed},
        "noise": {
            "vessel_sim.sensors.position_noise": 0.003 * scale.L,
            "vessel_sim.sensors.heading_noise": 0.005,
            "vessel_sim.sensors.velocity_noise": 0.001 * speed,
            "vessel_sim.sensors.yaw_rate_noise": 0.005 / scale.T,
        },
    }
    return {name: value for part, changes in parts.items() if state in (part, "sea") for name, value in changes.items()}


def errors(name: str, state: str, law: str) -> dict[str, float]:
    """The rms position error of the last quarter of each reference, in lengths; infinite for a run that fails.

    Args:
        name: The vessel, or the path of its file.
        state: As in `loads_of`.
        law: The control law.
    """
    values = read_vessel(name).values
    scenario, scale = parse_scenario(scenario_for(values, name), name), scale_of(ship_of(values))
    found = {}
    for reference, changes in references(scenario, scale).items():
        metrics = simulate_one(scenario.changed({"controller.law": law, **changes, **loads_of(state, scale)})).metrics
        found[reference] = metrics.position_error_rms_last_quarter / scale.L if metrics else math.inf
    return found


def main() -> None:
    """Print the errors in percent of the length; an asterisk marks those above the limit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="vessels (default: the library)")
    parser.add_argument("--states", default="calm,sea", help="calm, sea, wind, current, noise, separated by commas")
    parser.add_argument("--law", default="guided", help="control law")
    given = parser.parse_args()
    names, states = given.names or vessel_names(), given.states.split(",")
    within = dict.fromkeys(states, 0)
    print("| vessel | " + " | ".join(f"{kind}, {state} %" for state in states for kind in KINDS) + " |")
    print("|" + " --- |" * (1 + len(states) * len(KINDS)))
    for name in names:
        cells = []
        for state in states:
            limit, found = CALM_LIMIT if state == "calm" else SEA_LIMIT, errors(name, state, given.law)
            within[state] += sum(error <= limit for error in found.values())
            cells += [f"{100.0 * found[kind]:.2g}{'' if found[kind] <= limit else ' *'}" for kind in KINDS]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    print("within the limits: " + ", ".join(f"{within[state]} of {len(names) * len(KINDS)} in {state}" for state in states))


if __name__ == "__main__":
    main()
