"""How soon a law brings a ship to its reference from five lengths away, compared with a predictive law that has a perfect model.

The paper's ship, the six boats of the suite `boats` and ships of the campaign `strangers` start at rest, five lengths from where
a straight line or a circle begins, at a drawn bearing with a drawn heading, in calm water and with perfect sensors. The reference
starts from rest too and sails at about 0.3 to 0.5 of the top speed. One more row is the paper's own start, with its disturbance.

The laws have the actuators of each ship, declared exactly or not at all. `nmpc` has the exact hull, and a ship with instant
actuators, since its model has no others. Its horizon and weights are those of the paper's ship, scaled by L and T.

- Time: after which the error stays below 2 % of the length. Error: integral of the distance to the reference, over the run. Both
  are multiples of those of nmpc, of the runs in which nmpc arrives; a law that does not arrive counts as infinitely late.
- Loop: once within half of its first distance, the ship is again half a length further away than it has been. The runs in which
  nmpc does so too are left out, since they may have no straight approach.
- Way: length of the track relative to the reference until the ship arrives, in terms of the first distance.

    python benchmarks/capture.py [--seed 5] [--draws 200] [--picture docs/images/approaches.png]
"""

import argparse
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from paths import boat  # type: ignore[import-not-found]
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.control.interface.actuators import unit_time
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, NOT_DECLARED, KnownVessel
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError, ScenarioError, SimulationError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import distance
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.report.diagrams import INK, LAW_COLOURS, NEUTRAL, figure
from vessel_hsmc_ros.scenario.own_ship import MainData
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies import batch
from vessel_hsmc_ros.studies.campaign.distributions import ship_family
from vessel_hsmc_ros.studies.campaign.plan import Campaign, resolved
from vessel_hsmc_ros.studies.rivals.nmpc import ModelParameters, NmpcParameters

START, ARRIVED = 5.0, 0.02
"""Distance of the start, and the error below which a ship has arrived, in lengths."""

SPEEDS = 0.3, 0.5
"""Of the references, in terms of the top speed."""

PATIENCE, SETTLING = 3.0, 40.0
"""Duration of a run: so many times the time in which the ship gains the distance at its top speed, and so many T."""

PLAN_RATE = 10.0
"""Control rate of nmpc, in 1/T."""

STARTS, BOAT_STARTS = 20, 5
"""Starts of the paper's ship, and of each boat."""

FACTORS = {"declared": 1.5, "undeclared": 2.0}
"""What a law has of the actuators, and the multiple of the time and error of nmpc within which it is to be."""

ROWS = {f"{law}, {given}": (law, given) for law in ("hierarchical", "guided") for given in FACTORS}

CALM: dict[str, object] = {"ship.has_current": False, "ship.has_wind": False, "ship.noisy": False, "ship.coupled": False}
QUICK: dict[str, object] = {"ship.has_lag": False, "ship.has_rate": False, "ship.has_dead_time": False}

DRAWN_TRACKS, PANELS = 10, {"hierarchical": "hierarchical, declared", "guided": "guided, declared", "nmpc": "nmpc"}
"""Approaches of each law in the picture, and which rows they are of."""

SLOW = 0.5
"""Sum of lag, dead time and half of the time to the limit from which drawn actuators count as slow, in T."""

EVERY = 1000
"""Points of a track in the picture."""


class Task(NamedTuple):
    """A run: number of its approach, name of its row, and scenario."""

    approach: int
    row: str
    scenario: Scenario


class Result(NamedTuple):
    """What is found of a run: time, s, integral of the error, m·s, way, whether it loops, and its track in lengths, (n, 2)."""

    time: float
    error: float
    way: float
    loops: bool
    track: Array


def main() -> None:
    """Draw the starts, simulate the approaches, print the table and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--draws", type=int, default=200, help="ships of the campaign, of which some are infeasible")
    parser.add_argument("--picture", type=Path, help="where to draw the first approaches of the drawn ships")
    arguments = parser.parse_args()
    console, random = Console(width=160), np.random.default_rng(arguments.seed)
    with console.status("drawing"):
        approaches = [*of_paper(random), *of_boats(random), *of_strangers(arguments.draws, arguments.seed, random)]
    tasks = [Task(i, row, scenario) for i, (_, runs) in enumerate(approaches) for row, scenario in runs.items()]
    with console.status("simulating") as status:

        def progress(done: float) -> None:
            status.update(f"simulating: {done:.0f} of {len(tasks)} runs")

        results = batch.run_all(approach, tasks, on_progress=progress)
    found: list[dict[str, Result]] = [{} for _ in approaches]
    for task, result in zip(tasks, results, strict=True):
        found[task.approach][task.row] = result
    groups = {name: [each for each, (group, _) in zip(found, approaches, strict=True) if group == name] for name, _ in approaches}
    console.print(table({**groups, "all": found}))
    if arguments.picture:
        drawn = [each for each, (group, _) in zip(found, approaches, strict=True) if "drawn" in group]
        draw(arguments.picture, drawn[:: max(len(drawn) // DRAWN_TRACKS, 1)][:DRAWN_TRACKS])


Runs = Mapping[str, Scenario]
"""The scenario of each row, and of nmpc."""


def of_paper(random: np.random.Generator) -> Iterator[tuple[str, Runs]]:
    """The paper's own start, and starts of its ship."""
    own = load_scenario("case2_tracking").changed({"vessel_sim.duration": 200.0})
    exact = {f"controller.vessel.{name}": value for name, value in INSTANT.items()}
    yield "the paper's start", runs_of(own, own.changed(exact), own.changed(exact))
    for i in range(STARTS):
        yield "the paper's ship", of_family({**CALM, **QUICK, "ship.to_port": bool(i // 2 % 2)}, i, random)


def of_strangers(draws: int, seed: int, random: np.random.Generator) -> Iterator[tuple[str, Runs]]:
    """Ships of the campaign `strangers` that some law could keep on their reference."""
    campaign = Campaign.load("strangers", draws, seed)
    for i in range(draws):
        drawn = campaign.planned(i * len(campaign.variants)).values
        try:
            runs = of_family({**drawn, **CALM}, i, random)
        except (ParameterError, ScenarioError):
            continue
        if not ship_family().infeasible(runs["nmpc"]):
            yield f"drawn, {'slow' if slowness(drawn) > SLOW else 'quick'} actuators", runs


def slowness(drawn: Mapping[str, Any]) -> float:
    """How slow the actuators of a ship of the family are, in T."""
    parts = ("has_lag", "lag", 1.0), ("has_dead_time", "dead_time", 1.0), ("has_rate", "time_to_full", 0.5)
    return sum(share * drawn[f"ship.{name}"] for has, name, share in parts if drawn[f"ship.{has}"])


def of_family(numbers: Mapping[str, object], i: int, random: np.random.Generator) -> Runs:
    """The runs of a ship of the family, on a straight line for an even number, otherwise on a circle."""
    bearing, heading = random.uniform(-math.pi, math.pi, 2).tolist()
    start = {
        "ship.reference": ("straight", "circle")[i % 2],
        "ship.speed": float(random.uniform(*SPEEDS)),
        "ship.start_distance": START,
        "ship.start_direction": bearing,
        "ship.start_heading": heading,
        "ship.control_rate_hz": 50.0,
    }
    base = load_scenario("case2_tracking").changed({"controller.law": "guided"})
    nothing, exact, instant = (
        base.changed(resolved(numbers, start, {"ship.knowledge": knowledge}, more))
        for knowledge, more in (("nothing", {}), ("everything", {}), ("everything", QUICK))
    )
    return runs_of(*(each.changed({"vessel_sim.duration": duration(each)}) for each in (nothing, exact, instant)))


def of_boats(random: np.random.Generator) -> Iterator[tuple[str, Runs]]:
    """Starts of the six boats, whose actuators have the lag of their suite."""
    suite = yaml.safe_load((share_directory() / "config" / "suites" / "boats.yaml").read_text(encoding="utf-8"))
    for name, data in suite["ships"].items():
        b = boat(name, schema.build(MainData, {**data, "wind": 0.0}, "ships"))
        lag = suite["set"]["vessel_sim.actuators.yaw_lag"]["T"] * b.scale.T
        lags = dict.fromkeys(("surge_lag", "yaw_lag"), lag)
        for i in range(BOAT_STARTS):
            bearing, heading = random.uniform(-math.pi, math.pi, 2).tolist()
            d = START * b.scale.L
            at_start = b.scenario.changed(
                {
                    "reference_ship.mode": ("straight", "circle")[i % 2],
                    "vessel_sim.initial_pose": (d * math.cos(bearing), d * math.sin(bearing), heading),
                    "vessel_sim.duration": duration(b.scenario),
                }
            )
            slow = at_start.changed({f"vessel_sim.actuators.{key}": value for key, value in lags.items()})
            exact = {f"controller.vessel.{key}": value for key, value in {**INSTANT, **lags}.items()}
            nothing = {"controller.vessel.sway_damping_rate": NOT_DECLARED, "controller.vessel.coriolis_ratio": NOT_DECLARED}
            yield "the six boats", runs_of(slow.changed(nothing), slow.changed(exact), at_start)


def duration(scenario: Scenario) -> float:
    """Duration of a run, s."""
    scale, reference = scale_of(scenario.vessel_sim.vessel), scenario.reference_ship
    speed = (reference.circle if reference.mode == "circle" else reference.straight).speed
    return float(math.ceil(PATIENCE * START * scale.L / (scale.U - speed) + SETTLING * scale.T))


def runs_of(nothing: Scenario, exact: Scenario, instant: Scenario) -> Runs:
    """The runs of a ship that declares nothing, or everything exactly, and that of nmpc, whose actuators are instant."""
    given = dict(zip(FACTORS, (exact, nothing), strict=True))
    runs = {row: given[what].changed({"controller.law": law}) for row, (law, what) in ROWS.items()}
    return {"nmpc": with_nmpc(instant), **runs}


def with_nmpc(scenario: Scenario) -> Scenario:
    """A scenario by nmpc, whose model is the ship, and whose horizon and weights are scaled to it."""
    ship, known, p = scenario.vessel_sim.vessel, scenario.controller.vessel.as_controlled(), NmpcParameters()
    T = unit_time(known)
    t, s = T / unit_time(KnownVessel()), known.length / ShipParameters().length
    numbers: dict[str, object] = {
        "step_lengths": tuple(t * each for each in p.step_lengths),
        "preview": t * p.preview,
        "disturbance_bandwidth": p.disturbance_bandwidth / t,
        "position_weight": p.position_weight / s**2,
        "course_weight": p.course_weight * (t / s) ** 2,
        "change_weight": t * p.change_weight,
        **{f"model.{name}": getattr(ship, name) for name in ModelParameters.__dataclass_fields__},
    }
    simulated = scenario.vessel_sim.rate_hz
    rate = simulated / max(round(simulated * min(T / PLAN_RATE, 1.0)), 1)  # 1 Hz is the lowest
    return scenario.changed(
        {"controller.law": "nmpc", "controller.rate_hz": rate}
        | {f"controller.nmpc.{name}": value for name, value in numbers.items()}
    )


def approach(task: Task, _: batch.Progress) -> Result:
    """Simulate and measure a run."""
    scenario = task.scenario
    try:
        run = simulate(scenario)
    except (ControlError, SimulationError):
        return Result(math.inf, math.inf, math.inf, False, np.zeros((0, 2)))
    L = scenario.vessel_sim.vessel.length
    track = (run.state[:, :2] - run.reference[:, :2]) / L
    d, h = distance(track), float(run.time[1] - run.time[0])
    outside = np.flatnonzero(d > ARRIVED)
    end = int(outside[-1]) + 1 if len(outside) else 0
    near = d[np.argmax(d < 0.5 * d[0]) :] if d.min() < 0.5 * d[0] else d[:0]
    loops = bool(np.any(near - np.minimum.accumulate(near) > 0.5))
    way = float(np.sum(distance(np.diff(track[: end + 1], axis=0)))) / d[0]
    return Result(h * end if end < len(d) else math.inf, float(d.sum()) * L * h, way, loops, track[:: max(len(d) // EVERY, 1)])


def table(found: Mapping[str, list[dict[str, Result]]]) -> Table:
    """The rows of each group: times, errors, loops and ways."""
    made = Table("ships", "law", "runs", "time", "90 %", "within", "error", "90 %", "within", "loops", "way")
    for group, runs in found.items():
        arrived = [each for each in runs if math.isfinite(each["nmpc"].time)]
        straight = [each for each in runs if not each["nmpc"].loops]
        loops, way = len(runs) - len(straight), np.median([each["nmpc"].way for each in runs])
        made.add_row(group, "nmpc", f"{len(arrived)}/{len(runs)}", *[""] * 6, f"{loops}/{len(runs)}", f"{way:.2f}")
        for row, (_, given) in ROWS.items():
            times = [each[row].time / each["nmpc"].time for each in arrived]
            errors = [each[row].error / each["nmpc"].error for each in arrived]
            loops, way = sum(each[row].loops for each in straight), np.median([each[row].way for each in runs])
            cells = *spread(times, FACTORS[given]), *spread(errors, FACTORS[given]), f"{loops}/{len(straight)}", f"{way:.2f}"
            made.add_row(group, row, f"{len(arrived)}", *cells)
    return made


def spread(ratios: list[float], factor: float) -> tuple[str, str, str]:
    """Median, ninth decile, and the share within a factor."""
    if not ratios:
        return "-", "-", "-"
    middle, most = np.quantile(ratios, (0.5, 0.9), method="higher")
    return f"{middle:.2f}", f"{most:.2f}", f"{100.0 * np.mean(np.array(ratios) <= factor):.0f} % ({factor:g})"


def draw(path: Path, runs: list[dict[str, Result]]) -> None:
    """The tracks relative to the reference, which is in the middle, of the laws with declared actuators and of nmpc."""
    from matplotlib.patches import Circle

    with figure(path, 10.0, 3.8) as picture:
        panels: Any = picture.subplots(1, 3, sharex=True, sharey=True)
        for panel, (law, row) in zip(panels, PANELS.items(), strict=True):
            panel.add_patch(Circle((0.0, 0.0), START, fill=False, color=NEUTRAL, lw=0.8, ls=":"))
            for track in (each[row].track for each in runs):
                panel.plot(*track.T, color=LAW_COLOURS[law], lw=1.1)
                panel.plot(*track[0], "o", color=LAW_COLOURS[law], ms=3.5)
            panel.plot(0.0, 0.0, "+", color=INK, ms=9)
            panel.set(title=row, aspect="equal", xlabel="east of the reference [L]", xlim=(-6, 6), ylim=(-6, 6))
        panels[0].set_ylabel("north of the reference [L]")


if __name__ == "__main__":
    main()
