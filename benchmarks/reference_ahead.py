"""What a law with dead time gains by a reference known ahead: `python benchmarks/reference_ahead.py`; see docs/decisions/0023.

The guided law predicts the reference through the declared dead time by its present acceleration. Here the reference publishes
motions from which this prediction leads exactly to those that follow, with their accelerations: the law acts as if it knew the
reference ahead. The rms error is that of the position against the true reference, in lengths, after the first third: surveys of
the six boats of the suite `boats` in calm water, and the slalom of the paper's ship. Dead times are shares of the time of the
ship's turns, declared exactly, as is that there is no lag. "Known ahead" is the ratio of the error with it to that without.
"""

import math
from typing import Any

import numpy as np
import yaml
from paths import boat, table_of  # type: ignore[import-not-found]

from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate
from vessel_hsmc_ros.core.metrics import rms
from vessel_hsmc_ros.guidance.factory import REFERENCES, trajectory
from vessel_hsmc_ros.scenario.own_ship import MainData
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compiled_loop import reference_of
from vessel_hsmc_ros.simulation.offline import simulate

SHARES = (0.1, 0.3, 0.5, 1.0)
"""Dead times in terms of the time of the ship's turns."""


class Ahead:
    """A reference whose motions lead to those of another one a number of periods later.

    Args:
        reference: The other one.
        periods: The number.
        period: Length of a step, s.
    """

    def __init__(self, reference: Any, periods: int, period: float) -> None:
        self._reference, self._interval, self.track = reference, periods * period, getattr(reference, "track", None)
        for _ in range(periods):
            reference.advance()

    @property
    def state(self) -> Array:
        """The state from which a constant acceleration leads to the coming one."""
        motion, acceleration = Motion(*self._reference.state), Acceleration(*self._reference.acceleration())
        return np.array(extrapolate(motion, acceleration, -self._interval))

    def acceleration(self) -> Array:
        """The coming acceleration."""
        known: Array = self._reference.acceleration()
        return known

    def advance(self) -> None:
        """Advance by one period."""
        self._reference.advance()


def error(scenario: Scenario, length: float, dead_time: float, known: bool) -> float:
    """The rms position error of the guided law after the first third, in lengths.

    Args:
        scenario: Ship and reference.
        length: Of the ship, m.
        dead_time: Of both inputs, s.
        known: Whether the reference is known ahead.
    """
    inputs = [f"{part}.{axis}" for part in ("vessel_sim.actuators", "controller.vessel") for axis in ("surge", "yaw")]
    changes = {f"{name}_dead_time": dead_time for name in inputs} | {f"{name}_lag": 0.0 for name in inputs}
    changes |= {"controller.vessel.surge_force_rate": math.inf, "controller.vessel.yaw_moment_rate": math.inf}
    scenario = scenario.changed(changes)
    ship = scenario.reference_ship
    made, periods = REFERENCES[ship.mode], round(dead_time * ship.rate_hz) if known else 0
    reference_of.cache_clear()
    REFERENCES[ship.mode] = lambda p, period: Ahead(made(p, period), periods, period)  # type: ignore[assignment, return-value]
    try:
        run = simulate(scenario)
    finally:
        REFERENCES[ship.mode] = made
    true = trajectory(ship, ship.rate_hz, len(run.time))
    return rms(np.hypot(*(run.state - true[:, :6]).T[:2])[len(run.time) // 3 :]) / length


def report(name: str, scenario: Scenario, length: float) -> None:
    """Print a row: for each dead time the error with the reference's acceleration, and with the reference known ahead."""
    vessel = scenario.controller.vessel
    T = math.sqrt(vessel.yaw_inertia / vessel.yaw_moment_limit)
    errors = [[error(scenario, length, share * T, known) for known in (False, True)] for share in SHARES]
    print(f"| {name} | {' | '.join(f'{before:.2e} | {after / before:.2f}' for before, after in errors)} |", flush=True)


def main() -> None:
    """Print the table."""
    print(f"| ship | {' | '.join(f'{share:g} T | known ahead' for share in SHARES)} |\n|---|{'---|---|' * len(SHARES)}")
    suite = yaml.safe_load((share_directory() / "config" / "suites" / "boats.yaml").read_text(encoding="utf-8"))
    for name, data in suite["ships"].items():
        b = boat(name, MainData(**{**data, "wind": 0.0}))
        scenario = b.of("lawnmower")
        duration = float(math.ceil(table_of(scenario).times[-1]))
        report(name, scenario.changed({"vessel_sim.duration": duration}), b.scale.L)
    calm = {f"vessel_sim.disturbance.periodic.{name}": 0.0 for name in ("surge_force", "sway_force", "yaw_moment")}
    slalom = load_scenario("case2_slalom", {"controller.law": "guided", "vessel_sim.duration": 300.0, **calm})
    report("slalom", slalom, slalom.controller.vessel.length)


if __name__ == "__main__":
    main()
