"""Tuning of the baseline `los_pid`: a coordinate search from textbook gains.

Cases: circle and straight, each calm, under the paper's disturbance, and under it with noisy sensors, 240 s, the law at 50 Hz,
limited actuators. Cost: the mean over the cases of log(rms position error of the last quarter), not below 1 mm, plus half of the
same for the second quarter, not below 1 cm, so that settling counts too. Noise bounds the gains.

    .venv/bin/python benchmarks/tune_los_pid.py        # about ten minutes on two cores
"""

import math
from concurrent.futures import ProcessPoolExecutor

from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.laws import LosPidParameters
from vessel_hsmc_ros.runs.offline import load_scenario, simulate

TEXTBOOK = {
    "lookahead_time": 6.0,
    "lookahead_distance": 8.0,
    "drift_gain": 0.3,
    "along_gain": 0.2,
    "surge_gain": 1.0,
    "surge_integral_gain": 0.2,
    "yaw_bandwidth": 0.6,
    "yaw_damping": 1.0,
    "yaw_integral_gain": 0.05,
    "command_bandwidth": 0.5,
}
COMMON = {
    "controller.law": "los_pid",
    "controller.rate_hz": 50.0,
    "reference_ship.rate_hz": 50.0,
    "vessel_sim.rate_hz": 50.0,
    "vessel_sim.duration": 240.0,
    "vessel_sim.actuators.surge_force_limit": 2e5,
    "vessel_sim.actuators.yaw_moment_limit": 3e6,
}
CALM = {f"vessel_sim.disturbance.periodic.{name}": 0.0 for name in ("surge_force", "sway_force", "yaw_moment")}
NOISY = {
    "vessel_sim.sensors.position_noise": 0.1,
    "vessel_sim.sensors.heading_noise": math.radians(0.1),
    "vessel_sim.sensors.velocity_noise": 0.01,
    "vessel_sim.sensors.yaw_rate_noise": math.radians(0.1),
}
SEAS: tuple[dict[str, float], ...] = ({}, CALM, NOISY)
REFERENCES: tuple[dict[str, float], ...] = ({}, {"reference_ship.yaw_moment": 0.0})
CASES = tuple(COMMON | reference | sea for reference in REFERENCES for sea in SEAS)


def case_cost(job: tuple[dict[str, float], dict[str, float]]) -> float:
    """Return the cost of a set of gains on one case."""
    gains, case = job
    try:
        run = simulate(load_scenario("case2_tracking", case | {f"controller.los_pid.{name}": g for name, g in gains.items()}))
    except VesselHsmcError:
        return math.inf
    distance = position_error(run.state, run.reference)
    quarter = len(distance) // 4
    return math.log(max(rms(distance[3 * quarter :]), 1e-3)) + 0.5 * math.log(max(rms(distance[quarter : 2 * quarter]), 1e-2))


def main() -> None:
    """Multiply and divide one gain after the other while the cost decreases; then repeat with a smaller factor."""
    with ProcessPoolExecutor() as pool:

        def cost(gains: dict[str, float]) -> float:
            return sum(pool.map(case_cost, [(gains, case) for case in CASES])) / len(CASES)

        gains, step = dict(TEXTBOOK), 1.5
        best = cost(gains)
        chosen = {name: getattr(LosPidParameters(), name) for name in TEXTBOOK}
        print(f"textbook {best:.3f}, the package's {cost(chosen):.3f}", flush=True)
        for _ in range(4):
            before = best
            for name in gains:
                for factor in (step, 1.0 / step):
                    tried = gains | {name: gains[name] * factor}
                    if (found := cost(tried)) < best - 0.005:
                        gains, best = tried, found
                        print(f"{best:.3f} with {name} = {gains[name]:.3g}", flush=True)
                        break
            if best == before:
                step = math.sqrt(step)
        print(f"{best:.3f} with", ", ".join(f"{name} = {value:.3g}" for name, value in gains.items()))


if __name__ == "__main__":
    main()
