"""How well boats of any size can sail the paths that their reference plans: `python benchmarks/paths.py [FOLDER]`.

For each of the six boats of the suite `boats` a survey and a path with all three kinds of corners, at 0.3 of the top speed,
allowing for a current of 0.15 of it. The table has the distance of the reference from its geometry, the largest shares of the
limits, the residual of the sway equation and the average speed relative to that of the legs. With a folder it draws path,
curvature, speed and, by a law in a wind of 5 m/s, the track of each boat. `--goals` checks the
arrival at a goal, and at the end of a path against the current, in a current of 0.15 of the top speed from each of four sides,
`--stops` how the boats leave a stop, in the wind and without, `--newcomer` a survey of a small boat, with run-ins. `--law`
sails with another law than `guided`.
"""

import argparse
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.metrics import held, per_leg, position_error, rms, summarise
from vessel_hsmc_ros.guidance.factory import make_reference, travel_limits
from vessel_hsmc_ros.guidance.lawnmower import plan_lawnmower
from vessel_hsmc_ros.guidance.timetable import Timetable, motion_at
from vessel_hsmc_ros.plant.dynamics import unforced_sway
from vessel_hsmc_ros.report.record import on_legs, planned
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import Scale, scale_of
from vessel_hsmc_ros.simulation.offline import simulate

SPEED, CURRENT, LEG, SPACING = 0.3, 0.15, 20.0, 4.0

WAYPOINTS = (20.0, 0.0, 20.0, 12.0, 4.0, 20.0, 24.0, 28.0, 0.0, 28.0)
CORNERS = ("through", "over", "through", "stop", "stop")
"""A path in lengths, and what stands at its waypoints."""

BOW_OFF, LAST_LEG = (30.0, 150.0, None), 12.0
"""Headings of goals in a current, from bow into it, degrees; None: the end of a path whose last leg, so many lengths, leads into
it."""

SAMPLES = 4000


class Boat(NamedTuple):
    """A boat: its name, scenario and units."""

    name: str
    scenario: Scenario
    scale: Scale

    def of(self, mode: str, other: dict[str, Any] | None = None) -> Scenario:
        """The scenario with a survey or the path as its reference, and other changes."""
        L, U = self.scale.L, self.scale.U
        changes: dict[str, Any] = {
            "mode": mode,
            "motion.speed": SPEED * U,
            "motion.current": CURRENT * U,
            "lawnmower.speed": SPEED * U,
            "lawnmower.leg_length": LEG * L,
            "lawnmower.spacing": SPACING * L,
            "path.time": 0.0,
            "path.waypoints": [L * number for number in WAYPOINTS],
            "path.corners": list(CORNERS),
        }
        return self.scenario.changed({f"reference_ship.{name}": value for name, value in changes.items()} | (other or {}))


def boat(name: str, data: MainData, law: str = "guided") -> Boat:
    """The boat of main data, with the scenario that `init` writes, by a law."""
    scenario = parse_scenario(scenario_text("boat", data), name, source=name).changed({"controller.law": law})
    return Boat(name, scenario, scale_of(scenario.vessel_sim.vessel))


def table_of(scenario: Scenario) -> Timetable:
    """The plan of the reference."""
    table: Timetable = make_reference(scenario.reference_ship, 0.02).constants.table  # type: ignore[attr-defined]
    return table


def sampled(table: Timetable) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, states (n, 6) and accelerations (n, 3) between the rows of a plan."""
    times = np.linspace(table.times[0], table.times[-1], SAMPLES)
    motions = [motion_at(float(t), table) for t in times]
    return times, np.array([m for m, _ in motions]), np.array([a for _, a in motions])


def off_geometry(b: Boat) -> float:
    """Largest distance of the survey's reference from its legs and turns, in lengths."""
    p = b.of("lawnmower").reference_ship
    x, y, course = p.initial_pose
    plan = plan_lawnmower(p.lawnmower, p.vessel.coefficients(), travel_limits(p), (x, y, course))
    times, states, _ = sampled(plan.table)
    off = np.abs(states[:, 0] + 1j * states[:, 1] - plan.route.position(plan.profile.at(times)[0]))
    return float(off.max()) / b.scale.L


def shares(b: Boat, mode: str) -> dict[str, float]:
    """Largest shares of the limits, the residual of the sway equation, and the average speed relative to the set one."""
    scenario = b.of(mode)
    p = scenario.reference_ship
    times, states, accelerations = sampled(table_of(scenario))
    vessel = p.vessel.coefficients()
    rows = zip(*states.T[3:], accelerations[:, 2], strict=True)
    unforced = [unforced_sway(u, v, r, dr, vessel) for u, v, r, dr in rows]
    speed = np.hypot(states[:, 3], states[:, 4])
    return {
        "yaw rate": float(np.abs(states[:, 5]).max()) / p.motion.yaw_rate,
        "yaw acceleration": float(np.abs(accelerations[:, 2]).max()) / p.motion.yaw_acceleration,
        "surge acceleration": float(np.abs(np.gradient(speed, times)).max()) / p.motion.acceleration,
        "sway residual": float(np.abs(accelerations[:, 1] - unforced).max() / np.abs(accelerations[:, 1]).max()),
        "average speed": float(speed.mean()) / p.motion.speed,
    }


def report(boats: list[Boat]) -> None:
    """Print the table."""
    names = ("yaw rate", "yaw acceleration", "surge acceleration", "sway residual", "average speed")
    print(f"| boat | reference | off its geometry | {' | '.join(names)} |\n|---|---|---|{'---|' * len(names)}")
    for b in boats:
        for mode in ("lawnmower", "path"):
            off = f"{off_geometry(b):.1e} L" if mode == "lawnmower" else "-"
            found = shares(b, mode)
            print(f"| {b.name} | {mode} | {off} | {' | '.join(f'{found[name]:.3g}' for name in names)} |", flush=True)


def arrival(b: Boat, to: float, degrees: float | None) -> tuple[float, float, float, float]:
    """How a boat arrives at a goal or at the end of a path, in a current.

    Args:
        b: The boat.
        to: Direction of the current, rad.
        degrees: Angle from bow into the current to the heading of the goal, one of BOW_OFF.

    Returns:
        Over the last quarter, rms and largest distance from the goal [L], largest speed over ground [U], and largest angle of the
        bow off the current [deg].
    """
    L, U = b.scale.L, b.scale.U
    leg = LAST_LEG * L
    changes: dict[str, Any] = {
        "reference_ship.mode": "path" if degrees is None else "goal",
        "reference_ship.goal.poses": [6.0 * L, 3.0 * L, to + math.pi + math.radians(degrees or 0.0)],
        "reference_ship.goal.times": [0.0],
        "reference_ship.path.waypoints": [6.0 * L + leg * math.cos(to), 3.0 * L + leg * math.sin(to), 6.0 * L, 3.0 * L],
        "reference_ship.path.time": 0.0,
        "reference_ship.motion.current": CURRENT * U,
        "vessel_sim.disturbance.current.east": CURRENT * U * math.cos(to),
        "vessel_sim.disturbance.current.north": CURRENT * U * math.sin(to),
        "vessel_sim.duration": float(math.ceil(350.0 * L / U)),
    }
    run = simulate(b.scenario.changed(changes))
    state = run.state[run.time >= 0.75 * run.time[-1]]
    off = np.hypot(*(state[:, :2] - np.array([6.0 * L, 3.0 * L])).T) / L
    angle = np.abs(np.angle(np.exp(1j * (state[:, 2] - to - math.pi))))
    speed = np.hypot(*state[:, 3:5].T)
    return math.sqrt(np.mean(off**2)), float(off.max()), float(speed.max()) / U, math.degrees(angle.max())


def report_goals(boats: list[Boat]) -> None:
    """Print how each boat arrives, at worst of a current to four sides."""
    print("| boat | arrival | rms | largest | speed over ground | bow |\n|---|---|---|---|---|---|")
    for b in boats:
        for degrees in BOW_OFF:
            found = [arrival(b, 0.5 * math.pi * side, degrees) for side in range(4)]
            rms, largest, speed, angle = np.array(found).max(axis=0)
            worst = f"{rms:.1e} L | {largest:.1e} L | {speed:.1e} U | {angle:.0f}°"
            how = "path" if degrees is None else f"goal, {degrees:g}° off the current"
            print(f"| {b.name} | {how} | {worst} |", flush=True)


def off_after_stop(b: Boat) -> tuple[float, float]:
    """Largest distance from the reference before the path's stop ends and after it, in lengths."""
    scenario = b.of("path")
    table, plan = table_of(scenario), planned(scenario)
    run = simulate(scenario.changed({"vessel_sim.duration": float(math.ceil(table.times[-1]))}))
    off = np.hypot(*(run.state[:, :2] - run.reference[:, :2]).T) / b.scale.L
    left = run.time >= (plan.stretches[1].begin if plan else math.inf)
    return float(off[~left].max()), float(off[left].max())


def report_stops(boats: list[Boat], calm: list[Boat]) -> None:
    """Print how far each boat is off its path before and after the stop, in wind and without."""
    print("| boat | until the stop ends | after it | without wind | after it |\n|---|---|---|---|---|")
    for b, still in zip(boats, calm, strict=True):
        values = " | ".join(f"{value:.2g} L" for value in (*off_after_stop(b), *off_after_stop(still)))
        print(f"| {b.name} | {values} |", flush=True)


def report_newcomer(law: str) -> None:
    """Print how a catamaran keeps the legs of its survey after run-ins of 0, 10 and 15 lengths, and the error of its observer."""
    changes: dict[str, Any] = {
        "reference_ship.mode": "lawnmower",
        "reference_ship.lawnmower.leg_length": 60.0,
        "reference_ship.lawnmower.spacing": 8.0,
        "reference_ship.lawnmower.speed": 1.2,
        "reference_ship.motion.current": 0.3,
        "vessel_sim.duration": 480.0,
        "vessel_sim.disturbance.current.north": 0.3,
        "vessel_sim.sensors.position_noise": 0.3,
        "vessel_sim.sensors.position_rate_hz": 5.0,
        "vessel_sim.sensors.heading_noise": 0.0087,
        "vessel_sim.sensors.heading_rate_hz": 10.0,
        "vessel_sim.sensors.measures_velocity": False,
        "controller.observer.enabled": True,
        "controller.observer.position_noise": 0.3,
        "controller.observer.heading_noise": 0.0087,
    }
    cat = boat("catamaran", MainData(length=2.5, mass=180.0, wind=6.0), law)
    print("| run-in | legs, rms | each leg | observer, rms |\n|---|---|---|---|")
    for run_in in (0.0, 25.0, 37.5):
        scenario = cat.scenario.changed({**changes, "reference_ship.lawnmower.run_in": run_in})
        run = simulate(scenario)
        errors, _ = on_legs(run, planned(scenario), run.time)
        truth = held(run.time, run.state, run.control["time"])
        observed = rms(position_error(run.control["estimate"], truth))
        each = ", ".join(f"{leg.cross_rms:.2f}" for leg in (per_leg(errors) if errors else ()))
        print(f"| {run_in:g} m | {summarise(errors).leg_cross_track_rms:.2f} m | {each} m | {observed:.2f} m |", flush=True)


def draw(b: Boat, folder: Path) -> None:
    """Draw path, curvature, speed and track of a boat."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(12.0, 7.0), layout="constrained")
    for row, mode in zip(axes, ("lawnmower", "path"), strict=True):
        scenario = b.of(mode)
        table = table_of(scenario)
        times, states, _ = sampled(table)
        u, v, r = states[:, 3:].T
        speed = np.hypot(u, v)
        moving = speed > 0.05 * speed.max()
        rate = r + np.gradient(np.unwrap(np.arctan2(v, np.maximum(u, 1e-9))), times)
        way = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(times)))) / b.scale.L
        run = simulate(scenario.changed({"vessel_sim.duration": float(math.ceil(table.times[-1]))}))
        row[0].plot(*(states[:, :2] / b.scale.L).T, color="tab:orange", label="reference")
        row[0].plot(*(run.state[:, :2] / b.scale.L).T, "--", color="tab:blue", label="track", linewidth=0.8)
        if mode == "path":
            row[0].plot(WAYPOINTS[::2], WAYPOINTS[1::2], "k+", markersize=9, label="waypoints")
        error = np.hypot(*(run.state[:, :2] - run.reference[:, :2]).T) / b.scale.L
        row[0].set(title=f"{b.name}, {mode}: error at most {error.max():.2g} L", xlabel="x/L", ylabel="y/L", aspect="equal")
        row[1].plot(way[moving], (rate / np.maximum(speed, 1e-9))[moving] * b.scale.L)
        row[1].set(xlabel="way/L", ylabel="curvature · L")
        row[2].plot(times, speed / b.scale.U, label="speed/U")
        row[2].plot(times, np.abs(r) / scenario.reference_ship.motion.yaw_rate, label="yaw rate/limit", linewidth=0.8)
        row[2].set(xlabel="time, s")
    # Below the diagrams, where they cover no line; those of the path have all lines of the survey.
    figure.legend(*axes[1, 0].get_legend_handles_labels(), loc="outside lower left", ncols=3, frameon=False)
    figure.legend(*axes[1, 2].get_legend_handles_labels(), loc="outside lower right", ncols=3, frameon=False)
    figure.savefig(folder / f"{b.name.replace(' ', '_')}.png", dpi=90)
    plt.close(figure)


def main() -> None:
    """Print the table and draw the pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, help="for pictures")
    parser.add_argument("--goals", action="store_true", help="arrival at goals in a current instead")
    parser.add_argument("--stops", action="store_true", help="how the boats leave a stop instead")
    parser.add_argument("--newcomer", action="store_true", help="a survey by a small boat with and without a run-in instead")
    parser.add_argument("--law", default="guided")
    options = parser.parse_args()
    law = options.law
    if options.newcomer:
        report_newcomer(law)
        return
    suite = yaml.safe_load((share_directory() / "config" / "suites" / "boats.yaml").read_text(encoding="utf-8"))
    boats = [boat(name, MainData(**data), law) for name, data in suite["ships"].items()]
    if options.stops:
        calm = [boat(name, MainData(**{**data, "wind": 0.0}), law) for name, data in suite["ships"].items()]
        report_stops(boats, calm)
        return
    if options.goals:
        report_goals(boats)
        return
    report(boats)
    if options.folder:
        options.folder.mkdir(parents=True, exist_ok=True)
        for b in boats:
            draw(b, options.folder)


if __name__ == "__main__":
    main()
