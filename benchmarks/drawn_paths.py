"""Surveys and paths of drawn boats: geometry, limits and the fastest travel; `python benchmarks/drawn_paths.py`.

Each boat, of 0.5 to 300 m, has the scenario that `init` writes from its length, mass and force, and four references: the survey
and the path of `benchmarks/paths.py`, the same path without its stop, and a path of drawn waypoints, corners and speed with legs
of 1 to 40 lengths, many of which no boat could sail. What is accepted is sampled between the rows of its plan.

The fastest travel is that of a point on the same geometry: at every place as fast as yaw rate, drift angle, and the shares of
surge force and yaw moment that a reference may take allow in a steady turn, and as the yaw acceleration allows in a transition,
with `motion.acceleration` at once. It has no jerk to respect and no drift that follows its turns, so that no ship can reach it.
After a stop it sets off as slowly as the path does (`guidance/path.py`); the speed beside one that leaves at once is shown too.
"""

import argparse
import math
import time
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import numpy as np
import scipy.integrate  # noqa: F401 - the time of its import is no time of planning
from paths import CURRENT, SAMPLES, SPEED, Boat, boat  # type: ignore[import-not-found]

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.guidance.factory import make_reference, travel_limits
from vessel_hsmc_ros.guidance.planned_track import Stretch
from vessel_hsmc_ros.guidance.sailing import sustained
from vessel_hsmc_ros.guidance.timetable import TimetableConstants, TimetableMemory, follow
from vessel_hsmc_ros.plant.dynamics import Velocities, inverse_dynamics, unforced_sway
from vessel_hsmc_ros.scenario.own_ship import MainData
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.compilation import compiled

GRID, CURVATURES, BISECTIONS = 4000, 6, 10
"""Places of the fastest travel, curvatures whose speed is sought, and steps of that search."""

LEAST_SHARE = 0.05
"""Share of the speed of the legs down to which the speed of a curvature is sought."""

NO_SWAY = 1e-6
"""Sway acceleration relative to that of a turn below which there is none, as on a path of stops."""

EXCEEDED, AIM = 1.0 + 1e-6, 0.95
"""A share of a limit above this exceeds it; share of the speed of the fastest travel that references aim at."""


class Found(NamedTuple):
    """A reference: distance from its geometry in lengths, shares of the limits, mean speed relative to the fastest travel.

    `at_once` is the mean speed relative to a travel that leaves stops at once, `planning` the time to check and plan it, s.
    """

    off: float
    shares: dict[str, float]
    speed: float
    at_once: float
    planning: float


def fastest(one: Stretch, top: float, scenario: Scenario, at_once: bool) -> float:
    """The shortest duration of a stretch, from rest to rest, s.

    Args:
        one: The stretch.
        top: Speed of its legs, m/s.
        scenario: Whose it is.
        at_once: Whether it is not slow in setting off.
    """
    p = scenario.reference_ship
    vessel, limits = p.vessel.coefficients(), travel_limits(p)
    s = np.linspace(0.0, one.route.length, GRID)
    kappa = np.abs(one.route.curvature(s)[0])
    bends = np.linspace(0.0, float(kappa.max()), CURVATURES)
    speeds = []
    for bend in bends:
        low, high = LEAST_SHARE * top, top
        for _ in range(0 if sustained(top, vessel, limits, bend) else BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if sustained(middle, vessel, limits, bend) else (low, middle)
        speeds.append(high)
    slope = np.maximum(np.abs(one.route.curvature(s)[1]), 1e-12)
    squares = np.minimum(np.interp(kappa, bends, speeds) ** 2, limits.yaw_acceleration / slope)
    squares[0] = squares[-1] = 0.0
    elements = one.route.elements
    if not at_once and len(elements) > 1 and not (elements[0].turn or elements[1].turn):  # a leg in two, of which one is slow
        slow = one.profile.at(one.profile.time_at(np.array([elements[0].length])))[1]
        squares[s <= elements[0].length] = np.minimum(squares[s <= elements[0].length], slow * slow)
    ramp = 2.0 * limits.acceleration * s
    squares = np.minimum.accumulate(squares - ramp) + ramp
    squares = (np.minimum.accumulate((squares + ramp)[::-1]) - ramp[::-1])[::-1]
    root = np.sqrt(squares)
    return float(np.sum(2.0 * (s[1] - s[0]) / (root[1:] + root[:-1])))


def assess(b: Boat, mode: str, changes: dict[str, Any]) -> Found:
    """Measure a reference.

    Raises:
        ParameterError: it is refused.
    """
    began = time.perf_counter()
    scenario = b.of(mode, changes)
    planning = time.perf_counter() - began
    p = scenario.reference_ship
    reference: Any = make_reference(p, 0.02)
    top = p.lawnmower.speed if p.mode == "lawnmower" else p.motion.speed
    table = reference.constants.table
    rows, step = np.empty((SAMPLES, 9)), float(table.times[-1]) / SAMPLES
    compiled(follow, **reference.kernels)(TimetableMemory(0), TimetableConstants(table, step), rows)
    times, states, accelerations = step * np.arange(SAMPLES), rows[:, :6], rows[:, 6:]
    off, sailed, shortest = 0.0, 0.0, np.zeros(2)
    for one in reference.track.stretches:
        on = (times >= one.begin) & (times <= one.end)
        planned = one.route.position(one.profile.at(times[on] - one.begin)[0])
        off = max(off, float(np.abs(states[on, 0] + 1j * states[on, 1] - planned).max()))
        sailed += one.end - one.begin
        shortest += [fastest(one, top, scenario, at_once) for at_once in (False, True)]
    vessel, m = p.vessel.coefficients(), p.motion
    u, v, r = states.T[3:]
    du, dv, dr = accelerations.T
    surge, yaw = inverse_dynamics(Velocities(u + np.where(u > 0.0, m.current, 0.0), v, r, du, dv, dr), vessel)
    sway = unforced_sway(u, v, r, dr, vessel)
    along = (u * du + v * dv) / np.maximum(np.hypot(u, v), 1e-9)
    shares = {
        "yaw rate": r / m.yaw_rate,
        "yaw acceleration": dr / m.yaw_acceleration,
        "acceleration": along / m.acceleration,
        "surge force": surge / p.vessel.surge_force_limit,
        "yaw moment": yaw / p.vessel.yaw_moment_limit,
        "speed": np.hypot(u, v) / top,
        "sway residual": (dv - sway) / max(np.abs(dv).max(), NO_SWAY * top * m.yaw_rate),
    }
    speed, at_once = map(float, shortest / sailed)
    return Found(off / b.scale.L, {name: float(np.abs(x).max()) for name, x in shares.items()}, speed, at_once, planning)


def drawn(rng: np.random.Generator) -> Boat:
    """A boat of 0.5 to 300 m."""
    length = math.exp(rng.uniform(math.log(0.5), math.log(300.0)))
    mass, force = 8.0 * length**3 * rng.uniform(0.3, 2.0), rng.uniform(0.02, 0.1) * 9.81
    return boat(f"{length:.3g} m", MainData(length=length, mass=mass, surge_force_limit=force * mass))


def drawn_path(b: Boat, rng: np.random.Generator) -> dict[str, Any]:
    """The parameters of a path of drawn waypoints, corners and speed."""
    L, U, n = b.scale.L, b.scale.U, int(rng.integers(2, 9))
    legs = np.exp(rng.uniform(math.log(1.0), math.log(40.0), n)) * np.exp(1j * np.cumsum(rng.uniform(-2.5, 2.5, n)))
    points = L * np.cumsum(legs)
    changes = {
        "motion.speed": U * rng.uniform(0.1, 1.0),
        "motion.current": U * rng.choice((0.0, CURRENT * SPEED, CURRENT)),
        "path.waypoints": [x for point in points for x in (float(point.real), float(point.imag))],
        "path.corners": [str(kind) for kind in rng.choice(("through", "over", "stop"), n, p=(0.6, 0.2, 0.2))],
    }
    return {f"reference_ship.{name}": value for name, value in changes.items()}


def report(several: list[Found]) -> None:
    """Print the largest figures of a kind of reference."""
    print(f"  off the geometry: {max(one.off for one in several):.2g} L")
    for name in several[0].shares:
        values = np.array([one.shares[name] for one in several])
        print(f"  {name}: {values.max():.6g}, exceeded {np.count_nonzero(values > EXCEEDED)} times")
    for what, speeds in (
        ("share of the fastest travel", np.array([one.speed for one in several])),
        ("of one that leaves stops at once", np.array([one.at_once for one in several])),
    ):
        below = f"{np.mean(speeds < AIM):.1%} below {AIM}"
        print(f"  {what}: least {speeds.min():.3f}, median {np.median(speeds):.3f}, {below}")
    planning = np.array([one.planning for one in several])
    print(f"  planned in {np.median(planning):.2f} s, at most {planning.max():.2f} s")


def of_boat(task: tuple[Boat, dict[str, Any]]) -> dict[str, Found | str]:
    """The references of a boat with a drawn path, or why they are refused."""
    b, path = task
    kinds: dict[str, tuple[str, dict[str, Any]]] = {
        "survey": ("lawnmower", {}),
        "path": ("path", {}),
        "path without a stop": ("path", {"reference_ship.path.corners": ["through"]}),
        "drawn path": ("path", path),
    }
    several: dict[str, Found | str] = {}
    for kind, (mode, changes) in kinds.items():
        try:
            several[kind] = assess(b, mode, changes)
        except ParameterError as error:
            several[kind] = str(error)
    return several


def main() -> None:
    """Print the largest figures of each kind of reference."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--boats", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=1)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    tasks = []
    for _ in range(options.boats):
        b = drawn(rng)
        tasks.append((b, drawn_path(b, rng)))
    found: dict[str, list[Found]] = {}
    refused: dict[str, int] = {}
    reasons: dict[str, str] = {}
    with ProcessPoolExecutor(options.processes) as pool:
        for (b, _), references in zip(tasks, pool.map(of_boat, tasks), strict=True):
            for kind, one in references.items():
                if isinstance(one, Found):
                    found.setdefault(kind, []).append(one)
                else:
                    refused[kind] = refused.get(kind, 0) + 1
                    reasons.setdefault(kind, f"{b.name}: {one}")
    for kind, several in found.items():
        print(f"{kind}: {len(several)} accepted, {refused.get(kind, 0)} refused", f"({reasons[kind]})" if kind in reasons else "")
        report(several)


if __name__ == "__main__":
    main()
