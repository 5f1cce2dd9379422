"""How often what happens lies in the band of a forecast; `python benchmarks/forecast.py`.

Each case is a drawn boat with the scenario that `init` writes, half of them with noisy positions, and a drawn mission, wind and
current. Its forecast has the runs of the command. Further draws, of other seeds, are what happens: with their own mean wind and
current about those of the forecast, gusts, hull and noise. A band of 5 to 95 % should hold nine of ten of them. One that fails
is outside.
"""

import argparse
import math

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import loads, scale_of
from vessel_hsmc_ros.studies.forecast.forecast import (
    MAX_FAILED,
    Conditions,
    Forecast,
    Plan,
    band,
    forecast,
    plan_of,
    why_infeasible,
)

HELD_OUT = 1_000_000  # seeds of what happens are above those of the forecasts
WIND_SHARE, CURRENT_SHARE = 0.2, 0.2  # largest force of the wind over the largest thrust, and current over the top speed


def drawn_plan(random: np.random.Generator) -> Plan | None:
    """A mission of a boat in a wind and a current; None for one that is refused or infeasible."""
    length = math.exp(random.uniform(math.log(1.2), math.log(8.0)))
    noise = float(random.choice((0.0, 0.05 * length)))
    text = scenario_text("boat", MainData(length=length, mass=8.0 * length**3 * random.uniform(0.6, 1.5), gps_noise=noise))
    boat = parse_scenario(text, "boat")
    scale, n = scale_of(boat.vessel_sim.vessel), int(random.integers(2, 4))
    points = length * np.cumsum(random.uniform(5.0, 10.0, n) * np.exp(1j * np.cumsum(random.uniform(-2.0, 2.0, n))))
    path = {
        "mode": "path",
        "path.waypoints": [value for point in points.tolist() for value in (point.real, point.imag)],
        "path.speeds": [float(random.uniform(0.3, 0.45)) * scale.U],
    }
    wind = math.sqrt(random.uniform(0.0, WIND_SHARE) * scale.F / loads(length, 1.0)["wind_force"])
    current = random.uniform(0.0, CURRENT_SHARE) * scale.U
    conditions = Conditions(wind, random.uniform(0.0, 360.0), current, random.uniform(0.0, 360.0))
    try:
        plan = plan_of(boat.changed({f"reference_ship.{name}": value for name, value in path.items()}), conditions)
    except ParameterError:
        return None
    return None if why_infeasible(plan) else plan


def inside(predicted: Array, observed: Array) -> Array:
    """Whether observed values are in the band of predicted ones; those that are NaN are not."""
    low, _, high = band(predicted)
    return (observed >= low) & (observed <= high)


def measures(found: Forecast) -> dict[str, Array]:
    """Time, energy and largest distance of each run; NaN for a run that failed."""
    failed = np.array([bool(run.failure) for run in found.runs])
    worst = np.nanmax(np.column_stack((found.worst, np.zeros(len(found.runs)))), axis=1)
    columns = {"time": [run.time for run in found.runs], "energy": [run.energy for run in found.runs], "distance": worst}
    return {name: np.where(failed, np.nan, values) for name, values in columns.items()}


def main() -> None:
    """Print the shares of each case and of all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=10)
    parser.add_argument("--runs", type=int, default=200, help="runs of a forecast")
    parser.add_argument("--observed", type=int, default=100, help="further draws of a case")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    random, hits, failed = np.random.default_rng(options.seed), [], 0
    while len(hits) < options.cases:
        plan = drawn_plan(random)
        if plan is None:
            continue
        predicted = forecast(plan, options.runs, options.seed + len(hits))
        if not predicted.succeeds:
            print(f"not to be sailed, {len(predicted.failed)} of {options.runs} runs fail, above {MAX_FAILED:.0%}", flush=True)
            continue
        observed = forecast(plan, options.observed, HELD_OUT + options.seed + len(hits))
        known = measures(predicted)
        hits.append({name: inside(known[name], values) for name, values in measures(observed).items()})
        failed += len(observed.failed)
        shares = ", ".join(f"{name} {np.mean(held):.0%}" for name, held in hits[-1].items())
        c, length = plan.conditions, plan.scenario.vessel_sim.vessel.length
        print(f"{length:.2g} m, wind {c.wind:.1f} m/s, current {c.current:.2f} m/s: {shares}", flush=True)
    whole = ", ".join(f"{name} {np.mean([one[name] for one in hits]):.1%}" for name in hits[0])
    total = options.cases * options.observed
    print(f"in the band of 5 to 95 %: {whole} of {total} held-out draws in {options.cases} cases; {failed} failed")


if __name__ == "__main__":
    main()
