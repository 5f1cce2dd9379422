"""The guided law on the paper's ship with slow and late actuators, declared right, wrong and not at all: see docs/guided.md.

Every case is simulated for 400 s, at rest for 600 s, with the law at 50 Hz under the paper's disturbance; the table has the rms
position error of the last quarter.

    python benchmarks/actuators.py
"""

import itertools
import math
from collections.abc import Iterable

from rich.progress import track

from vessel_hsmc_ros.runs.batch import simulate_one
from vessel_hsmc_ros.runs.offline import load_scenario
from vessel_hsmc_ros.scenario.scenario import Scenario

FORCE, MOMENT, SURGE, YAW = 2e5, 3e6, 120e3, 636e5
"""Limits and inertias of the paper's ship."""

PLANT, KNOWN = "vessel_sim.actuators.", "controller.vessel."

BASE = {
    "controller.law": "guided",
    "controller.rate_hz": 50.0,
    "vessel_sim.rate_hz": 50.0,
    "reference_ship.rate_hz": 50.0,
    "vessel_sim.duration": 400.0,
    "vessel_sim.initial_pose": [5.0, 1.0, math.pi / 4],
    f"{PLANT}surge_force_limit": FORCE,
    f"{PLANT}yaw_moment_limit": MOMENT,
    "reference_ship.initial_pose": [15.0, 15.0, 0.0],
}

SINE = "reference_ship.yaw_moment_sine."


Changes = dict[str, object]


def ship(force: float, moment: float, **more: object) -> Changes:
    """The inputs of the virtual ship."""
    return {"reference_ship.surge_force": force, "reference_ship.yaw_moment": moment, **more}


def slalom(amplitude: float, frequency: float) -> Changes:
    """A slalom of the virtual ship."""
    return ship(1e5, 0.0, **{f"{SINE}amplitude": amplitude, f"{SINE}frequency": frequency})


REFERENCES: dict[str, Changes] = {
    "circle": ship(9e4, 6e5),
    "tight": ship(1e5, 1e6),
    "slow": ship(6e4, -4e5),
    "straight": ship(9e4, 0.0),
    "slalom": slalom(1e6, 0.05),
    "fast slalom": slalom(1.5e6, 0.08),
    "eight": {"reference_ship.mode": "figure_eight"},
    "rest": ship(0.0, 0.0, **{"vessel_sim.duration": 600.0}),
}

ACTUATORS = {
    "ideal": (0.0, 0.0, 0.0),
    "lag 0.7 s": (0.7, 0.0, 0.0),
    "lag 1 s": (1.0, 0.0, 0.0),
    "lag 2 s": (2.0, 0.0, 0.0),
    "10 s to full": (0.0, 10.0, 0.0),
    "lag 0.5 s, 5 s to full": (0.5, 5.0, 0.0),
    "dead time 0.5 s": (0.0, 0.0, 0.5),
    "lag 1 s, dead time 0.3 s": (1.0, 0.0, 0.3),
    "lag 2 s, 10 s to full": (2.0, 10.0, 0.0),
}
"""Lag, time from zero to the limit and dead time of both inputs, s."""


def inputs(owner: str, lag: float, full: float, dead_time: float) -> Changes:
    """Lag, rates and dead time of both inputs, as the plant has them or as the law knows them."""
    force, moment = (limit / full if full else math.inf for limit in (FORCE, MOMENT))
    values: Changes = {f"{owner}surge_force_rate": force, f"{owner}yaw_moment_rate": moment}
    return values | {
        f"{owner}{axis}_{name}": value for axis in ("surge", "yaw") for name, value in (("lag", lag), ("dead_time", dead_time))
    }


def wrong(lag: float, full: float, dead_time: float) -> Iterable[Changes]:
    """Declarations that are wrong by 50 % in lag, rate and dead time and by 20 % in the inertias."""
    for factor, inertia in itertools.product((0.5, 1.5), (0.8, 1.2)):
        yield inputs(KNOWN, factor * lag, full / 1.5 if factor < 1.0 else full * 1.5, factor * dead_time) | {
            f"{KNOWN}surge_inertia": inertia * SURGE,
            f"{KNOWN}yaw_inertia": inertia * YAW,
        }


def errors(base: Scenario, changes: Changes) -> list[float]:
    """The errors of all references; infinite for a run that fails."""
    outcomes = (simulate_one(base.changed({**changes, **reference})) for reference in REFERENCES.values())
    return [outcome.metrics.position_error_rms_last_quarter if outcome.metrics else math.inf for outcome in outcomes]


def main() -> None:
    """Print the table."""
    base = load_scenario("case2_tracking", BASE)
    rows, worst = {}, [0.0] * len(REFERENCES)
    for name, dynamics in track(ACTUATORS.items(), "actuators"):
        plant = inputs(PLANT, *dynamics)
        rows[name] = errors(base, plant | inputs(KNOWN, *dynamics))
        if any(dynamics):
            for declared in wrong(*dynamics):
                worst = list(map(max, worst, errors(base, plant | declared)))
        rows[f"nothing declared, {name}"] = errors(base, plant)
    rows["worst of those declared wrong"] = worst
    print("| actuators | " + " | ".join(REFERENCES) + " |")
    print("|" + " --- |" * (1 + len(REFERENCES)))
    for name in sorted(rows, key=lambda name: (name.startswith("nothing"), name.startswith("worst"))):
        print(f"| {name} | " + " | ".join(f"{error:.2g}" for error in rows[name]) + " |")


if __name__ == "__main__":
    main()
