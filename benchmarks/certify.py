"""How the certificate of the hierarchical law compares with simulated vessels: is its bound ever exceeded, and how close is it?

Vessels of 1 to 40 m by the rules of `vessel-hsmc init`, with more or less sway damping, sail a straight line or a circle or keep
station in a wind with gusts, a current and noise; or they keep station under a periodic force that is fixed to the hull, and
noise. For each the certificate is computed once. Then hulls of its box are simulated, every second one a corner of it, with the
direction from which wind and current come drawn as well; the largest position error of the last quarter is compared with the
bound. Vessels without a certificate are left out, and those whose current estimate settles too slowly to be waited for.

The bound is for the whole box: its worst hull tells how close it is, and most hulls are far from being that.

    python benchmarks/certify.py [--seed 1] [--count 2000] [--hulls 100] [--minutes 20] [--references circle ...]
"""

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from vessel_hsmc_ros.control.laws.hierarchical_parameters import Gains, gains
from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.studies.batch import Outcome, simulate_many
from vessel_hsmc_ros.studies.certificate import BOX, at_a_point, case_of, in_box, under_way

WIND, HULL = "rest, wind and current", "rest, force fixed to the hull"
MODES = {"straight": 3.0, "circle": 3.0, WIND: 5.0, HULL: 5.0}
"""The references, and the factor within which the bound is to be."""

WAITING, AT_REST, SETTLINGS, PATIENCE = 150.0, 400.0, 8.0, 15.0
"""Duration of a run at least, in 1/c, under way and at rest, where a vessel may oscillate for long before it is near; the same
in settling times, and how many times longer than the first it may be at most."""

RATE = 30.0
"""Rate of law and hull in terms of 1/T, so that a run takes few steps; 50 Hz at most."""


class Run(NamedTuple):
    """A hull drawn from the box of a certificate, whose number is given."""

    certificate: int
    mode: str
    bound: float
    scenario: Scenario


def main() -> None:
    """Draw, certify, simulate, and print how often the bound is exceeded."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=2000, help="simulated runs")
    parser.add_argument("--hulls", type=int, default=100, help="hulls drawn from the box of each certificate")
    parser.add_argument("--references", nargs="+", choices=MODES, default=[*MODES], metavar="NAME", help="all by default")
    parser.add_argument("--minutes", type=float, default=math.inf, help="start no run later than this")
    arguments = parser.parse_args()
    end = time.monotonic() + 60.0 * arguments.minutes
    console, random = Console(width=160), np.random.default_rng(arguments.seed)
    runs: list[Run] = []
    modes, none = arguments.references, dict.fromkeys(arguments.references, 0)
    for i in track(range(arguments.count // arguments.hulls), "certifying", console=console):
        mode = modes[i % len(modes)]
        while not (found := certified(mode, random)):
            none[mode] += 1
        runs += (Run(i, mode, found[1], each) for each in drawn(mode, found[0], arguments.hulls, random))
    in_time = (run.scenario for run in runs if time.monotonic() < end)
    with console.status("simulating"):
        outcomes = simulate_many(in_time, workers=None)
    console.print(table(runs[: len(outcomes)], outcomes, none))


def certified(mode: str, random: np.random.Generator) -> tuple[Scenario, float] | None:
    """A drawn vessel in its loads and the bound of its certificate; None where there is none."""
    length = float(np.exp(random.uniform(0.0, math.log(40.0))))
    try:
        scenario = parse_scenario(scenario_text("drawn", MainData(length=length)), "drawn", source="drawn")
        scenario = scenario.changed(changes(scenario, mode, random))
        case = case_of(scenario)
    except VesselHsmcError:
        return None
    part = at_a_point(case) if mode in (WIND, HULL) else under_way(case)
    shortest, settling = scenario.vessel_sim.duration, max(part.settling, part.current_settling)
    if part.failed or SETTLINGS * settling > PATIENCE * shortest:
        return None
    duration = float(math.ceil(max(shortest, SETTLINGS * settling)))
    return replace(scenario, vessel_sim=replace(scenario.vessel_sim, duration=duration)), part.bound


def changes(scenario: Scenario, mode: str, random: np.random.Generator) -> dict[str, object]:
    """Drawn actuators, damping and loads of a vessel by the rules of thumb, and a duration that lets errors decay."""
    known = scenario.controller.vessel
    T = math.sqrt(known.yaw_inertia / known.yaw_moment_limit)
    lag, sway = float(random.uniform(0.0, 0.3)) * T, float(np.exp(random.uniform(0.0, math.log(4.0))))
    declared = dict.fromkeys(("surge_lag", "yaw_lag"), lag) | dict.fromkeys(("surge_dead_time", "yaw_dead_time"), 0.0)
    declared |= dict.fromkeys(("surge_force_rate", "yaw_moment_rate"), math.inf)
    slow = replace(known, **declared).as_controlled()  # type: ignore[arg-type]
    g, U = gains(scenario.controller.hierarchical, slow, 1.0 / scenario.controller.rate_hz), scenario.reference_ship.circle.speed
    at_rest, L, rate = mode in (WIND, HULL), known.length, float(min(50.0, math.ceil(RATE / T)))
    noise = 1e-3 * float(np.exp(random.uniform(math.log(0.1), 0.0)))
    sim = {
        "duration": float(math.ceil((AT_REST if at_rest else WAITING) / g.c)),
        **dict.fromkeys(("actuators.surge_lag", "actuators.yaw_lag"), lag),
        **{"sensors.position_noise": noise * L, "sensors.heading_noise": noise},
        **{"sensors.velocity_noise": noise * U, "sensors.yaw_rate_noise": noise * U / L},
    }
    damping = sway * scenario.vessel_sim.vessel.sway_damping
    sim |= fixed_to_hull(damping, g, L, random) if mode == HULL else fixed_to_earth(known.surge_force_limit, U, random)
    return {
        "controller.law": "hierarchical",
        "controller.hierarchical.actuator_identification": False,
        "reference_ship.mode": "goal" if at_rest else mode,
        "vessel.sway_damping": damping,
        **dict.fromkeys(("controller.rate_hz", "vessel_sim.rate_hz", "reference_ship.rate_hz"), rate),
        **{f"controller.vessel.{name}": value for name, value in declared.items()},
        **{f"vessel_sim.{name}": value for name, value in sim.items()},
    }


def fixed_to_earth(limit: float, U: float, random: np.random.Generator) -> dict[str, float]:
    """A drawn wind with gusts, up to 5 % of the largest surge force, and a current, up to a fifth of the speed U."""
    between, size = float(random.uniform(-math.pi, math.pi)), np.exp(random.uniform(math.log(0.1), 0.0, 2))
    force, current = 0.05 * size[0] * limit, 0.2 * size[1] * U
    return {
        "disturbance.earth_fixed.east_force": force,
        "disturbance.earth_fixed.gust_deviation": float(random.uniform(0.1, 0.3)) * force,
        "disturbance.current.east": current * math.cos(between),
        "disturbance.current.north": current * math.sin(between),
    }


def fixed_to_hull(damping: float, g: Gains, L: float, random: np.random.Generator) -> dict[str, float]:
    """A drawn periodic force under which the hull drifts at up to 0.2·c·l0, with a third of it in surge and a lever of L/20."""
    drift = float(np.exp(random.uniform(math.log(0.005), math.log(0.2)))) * g.c * g.l0
    force, period = 0.5 * drift * damping, float(np.exp(random.uniform(math.log(10.0), math.log(100.0)))) / g.c
    return {
        "disturbance.periodic.surge_force": force / 3.0,
        "disturbance.periodic.sway_force": force,
        "disturbance.periodic.yaw_moment": 0.05 * L * force,
        "disturbance.periodic.frequency": 2.0 * math.pi / period,
    }


def drawn(mode: str, scenario: Scenario, count: int, random: np.random.Generator) -> Iterator[Scenario]:
    """Scenarios of hulls of the box, with loads from any direction."""
    sim = scenario.vessel_sim
    wind, current = sim.disturbance.earth_fixed, sim.disturbance.current
    for i in range(count):
        factors, (angle, heading) = random.uniform(1.0 - BOX, 1.0 + BOX, 4), random.uniform(-math.pi, math.pi, 2)
        if i % 2:
            factors = 1.0 + BOX * np.sign(factors - 1.0)
        c, s = math.cos(angle), math.sin(angle)
        force = replace(wind, east_force=wind.east_force * c, north_force=wind.east_force * s)
        stream = replace(current, east=current.east * c - current.north * s, north=current.east * s + current.north * c)
        changed = replace(
            sim,
            vessel=in_box(sim.vessel, *factors.tolist()),
            disturbance=replace(sim.disturbance, earth_fixed=force, current=stream),
            seed=int(random.integers(1 << 30)),
            initial_pose=(0.0, 0.0, float(heading) if mode in (WIND, HULL) else 0.0),
        )
        yield replace(scenario, vessel_sim=changed)


def table(runs: list[Run], outcomes: list[Outcome], none: dict[str, int]) -> Table:
    """The bound relative to the largest error of each hull, and of the worst hull of each certificate."""
    found = Table(
        "reference", "runs", "left out", "exceeded", "bound/error", "within the factor", "bound/worst hull's", "within it"
    )
    for mode in none:
        factor = MODES[mode]
        errors: dict[int, list[float]] = {}
        for run, outcome in zip(runs, outcomes, strict=True):
            if run.mode == mode:
                metrics = outcome.metrics
                ratio = run.bound / metrics.position_error_peak_last_quarter if metrics else 0.0
                errors.setdefault(run.certificate, []).append(ratio)
        each, worst = np.concatenate([*errors.values()]), np.array([min(ratios) for ratios in errors.values()])
        cells = [cell for ratios in (each, worst) for cell in (spread(ratios), share(ratios, factor))]
        found.add_row(mode, f"{len(each)}", f"{none[mode]}", f"{np.sum(each < 1.0)}", *cells)
    return found


def spread(ratios: Array) -> str:
    """Median and ninth decile."""
    return f"median {np.median(ratios):.2f}, 90 % {np.quantile(ratios, 0.9):.2f}"


def share(ratios: Array, factor: float) -> str:
    """How many are from 1 to a factor."""
    return f"{100.0 * np.mean((ratios >= 1.0) & (ratios <= factor)):.0f} % within {factor:g}"


if __name__ == "__main__":
    main()
