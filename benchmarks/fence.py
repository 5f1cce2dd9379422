"""Stops of drawn boats against their predicted set, and runs of drawn boats at a fence.

    python benchmarks/fence.py stops [--count 1000000] [--seed 2]
    python benchmarks/fence.py runs [--count 1000] [--seed 2] [--law guided]
    python benchmarks/fence.py healthy [--longest 30]

Stops: boats of 0.5 to 50 m under way, of which the guard knows hull, actuators and an estimate of the water, brake as it
commands. Their path must stay within way and radius of `control/safety/fence_guard.py` until the surge velocity has ended.
Drawn are speed, turn, current up to half of the top speed from any direction, wind up to a fifth of the force, resistance from
linear to quadratic, lag, dead time, rate, age and control period, and errors of the estimate within its bounds.

Runs: a boat sails at a fence, in a current up to half of its top speed from any direction, and law and guard have to keep it
inside. Healthy runs: those of two suites, with a fence two stopping distances outside of their ways, in which it must not act.
Seed 1 is for development; held-out figures have another one. The exit code is 1 if a boat leaves its set, or crosses.
"""

import argparse
import math
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.control.safety.fence_guard import HEADING, Braking, Water, stop
from vessel_hsmc_ros.control.safety.parameters import Operation
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError, ScenarioError, SimulationError
from vessel_hsmc_ros.core.fence import Fence, FenceParameters, clearance, fence_of
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.simulation.compilation import compiled
from vessel_hsmc_ros.simulation.offline import ClosedLoop
from vessel_hsmc_ros.studies.comparison import Task, prepare
from vessel_hsmc_ros.studies.suite import Row, load_suite

BATCH = 10_000
STEPS = 3000  # of the longest stop; a step is at most a 400th of the time that it may take


def draw(rng: np.random.Generator, n: int) -> dict[str, Any]:
    """Boats under way, arrays of n."""
    u = rng.uniform
    L = np.exp(u(math.log(0.5), math.log(50.0), n))
    top = u(0.1, 0.6, n) * np.sqrt(GRAVITY * L)
    a = top / np.exp(u(math.log(1.5), math.log(20.0), n))  # the largest force stops the top speed in so many seconds
    period = u(0.02, 0.2, n)
    b = {"L": L, "top": top, "a": a, "period": period, "age": u(0.0, 0.2, n)}
    b["linear"] = u(0.0, 1.0, n)  # share of the resistance at the top speed
    b["lag"], b["dead"] = u(0.0, 1.0, n) * (n_of(rng, n, 0.8)), u(0.0, 0.6, n) * n_of(rng, n, 0.7)
    b["rate"] = np.where(n_of(rng, n, 0.5) > 0.0, a / u(0.1, 3.0, n), np.inf)
    b["side"] = np.where(n_of(rng, n, 0.2) > 0.0, -1.0, 1.0)  # astern
    b["current"] = u(0.0, 0.5, n) * top * np.exp(1j * u(-math.pi, math.pi, n))
    b["wind"] = u(-0.2, 0.2, n) * a
    b["U"] = u(0.05, 1.0, n) * top
    b["r"] = u(-0.5, 0.5, n) * b["U"] / L * n_of(rng, n, 0.5)
    b["k_v"], b["k_r"] = u(0.3, 2.0, n) * top / L, u(0.5, 3.0, n) * top / L
    b["turning"] = u(0.3, 3.0, n) * (top / L) ** 2  # yaw acceleration of the largest moment
    b["t_h"] = 1.0 / np.sqrt(b["turning"]) + 2.0 * (b["lag"] + b["dead"] + period)
    # A yaw disturbance that the brake, which holds the heading in proportion, holds within the deviation that it assumes.
    b["yaw"] = u(-1.0, 1.0, n) * np.minimum(0.02 * b["turning"], 0.25 * HEADING / b["t_h"] ** 2) * n_of(rng, n, 0.5)
    b["error"] = u(0.0, 0.1, n) * top
    return b


def n_of(rng: np.random.Generator, n: int, share: float) -> Any:
    """1 with a probability, else 0, (n,)."""
    return (rng.uniform(0.0, 1.0, n) < share).astype(float)


def resistance(b: dict[str, Any], speed: Any) -> Any:
    """Acceleration by the resistance against a velocity through the water, which takes all of the force at the top speed."""
    w = speed / b["top"]
    return b["a"] * (b["linear"] * w + (1.0 - b["linear"]) * w * np.abs(w))


def measured(b: dict[str, Any], rng: np.random.Generator) -> tuple[Any, Any, Any, Any]:
    """The present force as an acceleration, and what the guard knows of the water: current, decay and push."""
    n = len(b["L"])
    c_h = b["current"].real  # the heading is 0
    speed = b["side"] * b["U"]
    through = speed - c_h
    force = np.clip(resistance(b, through) - b["wind"] + rng.uniform(-0.3, 0.3, n) * b["a"], -b["a"], b["a"])
    estimate = b["current"] + b["error"] * np.sqrt(rng.uniform(0.0, 1.0, n)) * np.exp(2j * math.pi * rng.uniform(0.0, 1.0, n))
    seen = speed - estimate.real
    # The decay is known for the largest speed through the water so far, which was at least that of the current.
    fastest = np.maximum(np.maximum(np.abs(through), np.abs(b["current"])), 0.05 * b["top"])
    decay = resistance(b, fastest) / fastest
    decay = decay * rng.uniform(0.8, 1.2, n)
    push = -resistance(b, through) + b["wind"] + decay * seen  # so that the present acceleration is right, as a filter finds it
    return force, estimate, decay, push


def simulate(b: dict[str, Any], force: Any, delay: Any) -> tuple[Any, Any, Any]:
    """Brake until the surge velocity has ended: places over time, (steps, n), the braking distance and whether all have ended."""
    n = len(b["L"])
    limit = b["a"]
    dt = np.minimum(0.02, (delay + b["U"] / limit) / 400.0)
    u, v, r, psi = b["side"] * b["U"], b["current"].imag.copy(), b["r"].copy(), np.zeros(n)
    tau, p, distance = force.copy(), np.zeros(n, complex), np.zeros(n)
    wait = np.ceil((b["dead"] + b["age"] + b["period"]) / dt).astype(int)
    moving, places = np.ones(n, bool), [p.copy()]
    for k in range(STEPS):
        arrived = np.where(k >= wait, -b["side"] * limit, force)
        change = np.where(b["lag"] > 0.0, -np.expm1(-dt / np.maximum(b["lag"], 1e-9)), 1.0) * (arrived - tau)
        tau = tau + np.clip(change, -b["rate"] * dt, b["rate"] * dt)
        c = b["current"] * np.exp(-1j * psi)
        du = tau - resistance(b, u - c.real) + b["wind"]
        dv = -b["k_v"] * (v - c.imag) - 0.7 * (u - c.real) * r
        turned = -(r + 0.25 * psi / b["t_h"]) / b["t_h"] * (k * dt > b["age"] + b["period"])
        dr = np.clip(turned, -b["turning"], b["turning"]) - b["k_r"] * r + b["yaw"]
        p = p + moving * dt * (u + 0.5 * dt * du + 1j * v) * np.exp(1j * psi)
        distance += moving * dt * np.maximum(b["side"] * (u + 0.5 * dt * du), 0.0)
        u, v, r, psi = u + dt * du, v + dt * dv, r + dt * dr, psi + dt * r
        moving &= b["side"] * u > 0.0
        places.append(p.copy())
        if not moving.any():
            break
    return np.array(places), distance, ~moving


def distance_from(path: Any, way: Any) -> Any:
    """The largest distance of paths, (steps, n), from ways, (n, k), without code of the package, (n,)."""
    nearest = np.full(path.shape, np.inf)
    for a, b in zip(way.T[:-1], way.T[1:], strict=True):
        along = np.clip(((path - a) * np.conj(b - a)).real / np.maximum(np.abs(b - a) ** 2, 1e-300), 0.0, 1.0)
        nearest = np.minimum(nearest, np.abs(path - a - along * (b - a)))
    return nearest.max(axis=0)


def stops(count: int, seed: int) -> int:
    """Compare drawn stops with their sets."""
    rng, began = np.random.default_rng(seed), time.monotonic()
    ratios, outside, endless, worst, done = [], 0, 0, -math.inf, 0
    widths = []
    while done < count:
        n = min(BATCH, count - done)
        b = draw(rng, n)
        force, estimate, decay, push = measured(b, rng)
        names = ("side", "U", "r", "age", "a", "lag", "dead", "rate", "t_h", "period", "error")
        rows = zip(b["current"], force, estimate, decay, push, *(b[name] for name in names), strict=True)
        found = [
            stop(
                Motion(0.0, 0.0, 0.0, side * U, c.imag, r),
                acting,
                age,
                Braking(a, lag, dead, rate, 0.0, t_h, period),
                Water(complex(e), error, k, f),
            )
            for c, acting, e, k, f, side, U, r, age, a, lag, dead, rate, t_h, period, error in rows
        ]
        places, true, ended = simulate(b, force, np.array([each.delay for each in found]))
        predicted = np.array([each.distance for each in found])
        endless += int((~ended).sum())
        good = ended & np.isfinite(predicted)
        way = np.array([each.way[:5] for each in found])[good]
        path = np.append(places[:: max(1, len(places) // 40)], places[-1:], axis=0)[:, good]
        off = distance_from(path, way) - np.array([each.radius for each in found])[good]
        worst, outside = max(worst, float((off / b["L"][good]).max())), outside + int((off > 1e-9).sum())
        ratios.append(predicted[good] / np.maximum(true[good], 1e-9))
        widths.append(np.array([each.radius for each in found])[good] / b["L"][good])
        done += n
        sys.stderr.write(f"\r{done}/{count} stops, {outside} outside, {time.monotonic() - began:.0f} s")
    ratio = np.concatenate(ratios)
    print(f"\n{len(ratio)} stops of {count} with seed {seed}: {outside} outside of the set (farthest {worst:.3g} lengths)")
    print(f"{endless} without an end, {count - len(ratio) - endless} that the guard calls infeasible")
    quantiles = ", ".join(f"{100 * q:g} % {np.quantile(ratio, q):.3f}" for q in (0.01, 0.5, 0.9))
    print(f"predicted/true braking distance: least {ratio.min():.4f}, {quantiles}")
    print(f"radius, median {np.median(np.concatenate(widths)):.2f} lengths")
    return int(outside > 0)


class Case(NamedTuple):
    """A drawn run at a fence."""

    scenario: Scenario
    fence: Fence
    described: str


def case_of(seed: int, number: int, law: str) -> Case | str:
    """A boat that sails at a fence in a current; or why it is refused."""
    rng = np.random.default_rng((seed, number))
    u = rng.uniform
    L = float(np.exp(u(0.0, math.log(20.0))))
    mass, top = 8.0 * L**3 * u(0.6, 1.6), u(0.25, 0.5) * math.sqrt(GRAVITY * L)
    force = mass * top / (u(2.0, 8.0) * math.sqrt(L / GRAVITY) * 3.0)
    data = MainData(length=L, mass=mass, surge_force_limit=force, yaw_moment_limit=force * L * u(0.12, 0.4), speed=top)
    data = replace(data, lag=float(u(0.0, 0.3) * math.sqrt(L)) if u(0.0, 1.0) < 0.7 else 0.0)
    heading, off, distance = u(-math.pi, math.pi), u(-1.0, 1.0), u(12.0, 25.0) * L
    current = u(0.0, 0.5) * top * np.exp(1j * u(-math.pi, math.pi))
    speed = u(0.3, 0.7) * top
    # The fence is a square, one side of which is so far ahead, at an angle off the course.
    side = np.array([distance - 300.0 * L - 150j * L, distance - 150j * L, distance + 150j * L, distance - 300.0 * L + 150j * L])
    ring = np.append(side, side[0]) * np.exp(1j * (heading + off))
    rate = 10.0 if L < 6.0 else 5.0
    values = {
        "controller.law": law,
        "reference_ship.mode": "straight",
        "reference_ship.straight.speed": speed,
        "reference_ship.straight.rise_time": 15.0 * math.sqrt(L),
        **{f"{node}.rate_hz": rate for node in ("controller", "reference_ship", "vessel_sim")},
        **{f"{node}.initial_pose": [0.0, 0.0, heading] for node in ("reference_ship", "vessel_sim")},
        "vessel_sim.disturbance.current.east": current.real,
        "vessel_sim.disturbance.current.north": current.imag,
        "vessel_sim.duration": round(1.5 * distance / (math.cos(off) * speed) + 60.0 * L / top + 15.0 * math.sqrt(L)),
        "controller.safety.fence.inside": [value for p in ring for value in (p.real, p.imag)],
        "controller.safety.fence.current": 0.0 if law == "guided" else abs(current),
        "controller.guided.actuator_identification": False,
    }
    about = f"L {L:.1f} m, top {top:.2f} m/s, speed {speed / top:.2f}, current {abs(current) / top:.2f}, off {off:.2f}"
    try:
        scenario = parse_scenario(scenario_text("boat", data), "boat", source="boat").changed(values)
    except (ParameterError, ScenarioError) as error:
        return f"{about}: {error}"
    fence = fence_of(scenario.controller.safety.fence, "fence")
    assert fence is not None  # noqa: S101 - it has one
    return Case(scenario, fence, about)


class Ended(NamedTuple):
    """What became of a run."""

    number: int
    room: float  # least distance of the origin from the fence, in lengths, 0 or below outside
    acted: bool  # whether the guard holds it at the end
    described: str
    error: str = ""


def run_case(job: tuple[int, int, str]) -> Ended:
    """Sail a drawn run."""
    seed, number, law = job
    case = case_of(seed, number, law)
    if isinstance(case, str):
        return Ended(number, math.nan, False, case, "refused")
    closed = ClosedLoop(case.scenario)
    loop = closed._loop._loop  # type: ignore[attr-defined]
    loop.law.kernel = compiled(type(loop.law).kernel)
    try:
        closed.run()
    except (ControlError, SimulationError) as error:
        return Ended(number, math.nan, False, case.described, str(error))
    state = closed.result().state
    places = state[:, 0] + 1j * state[:, 1]
    length = case.scenario.vessel_sim.vessel.length
    room = min(clearance(case.fence, np.array([p, p])) for p in places[:: max(1, len(places) // 1500)])
    return Ended(number, room / length, loop.supervision.operation is Operation.SAFE, case.described)


def runs(count: int, seed: int, law: str, workers: int) -> int:
    """Sail drawn boats at a fence."""
    began, found = time.monotonic(), []
    with ProcessPoolExecutor(workers) as pool:
        for ended in pool.map(run_case, [(seed, number, law) for number in range(count)], chunksize=2):
            found.append(ended)
            crossed = [each for each in found if each.room <= 0.0]
            if ended.room <= 0.0 or ended.error:
                print(f"{ended.number}: {ended.room:.2f} lengths; {ended.described} {ended.error}", flush=True)
            sys.stderr.write(f"\r{len(found)}/{count} runs, {len(crossed)} crossed, {time.monotonic() - began:.0f} s")
    sailed = [each for each in found if not each.error]
    rooms = np.array([each.room for each in sailed])
    print(f"\n{len(sailed)} runs of {count} with seed {seed}, law {law}: {len(crossed)} crossed the fence")
    refused = sum(each.error == "refused" for each in found)
    print(f"{refused} refused at the start, {sum(each.acted for each in sailed)} held at the end")
    print(f"least room in lengths: least {rooms.min():.2f}, 1 % {np.quantile(rooms, 0.01):.2f}, median {np.median(rooms):.2f}")
    return int(len(crossed) > 0)


def healthy_case(job: tuple[str, Row, float]) -> Ended:
    """Sail a row of a suite with a fence two stopping distances outside of its way; the guard must not act.

    The stopping distance is the median of the run of how far the set reaches, in the wind and current of the row. A fence out of
    reach shows the sets of all periods, which are then compared with the one that follows from them.
    """
    suite, row, longest = job
    scenario, _ = prepare(Task(row, "guided", None))
    far = [-1e5, -1e5, 1e5, -1e5, 1e5, 1e5, -1e5, 1e5, -1e5, -1e5]
    changes = {"vessel_sim.duration": min(longest, scenario.vessel_sim.duration), "controller.safety.fence.inside": far}
    closed = ClosedLoop(scenario.changed(changes))
    loop = closed._loop._loop  # type: ignore[attr-defined] # the law is compiled, for speed
    loop.law.kernel = compiled(type(loop.law).kernel)
    guard, found = loop.watch.fence, []
    step, margin = guard.step, 0.5 * loop.law.vessel.length

    def noted(motion: Motion, *rest: Any) -> Any:
        reason = step(motion, *rest)
        found.append((complex(motion.x, motion.y), guard.stop))
        return reason

    guard.step = noted
    closed.run()
    reach = np.array([float(np.abs(each.way - p).max()) + each.radius + margin for p, each in found])
    room, run = 2.0 * float(np.median(reach)), closed.result()
    ways = np.concatenate([run.state[:, :2], run.reference[:, :2]])
    low, high = ways.min(axis=0) - room, ways.max(axis=0) + room
    ring = (low[0], low[1], high[0], low[1], high[0], high[1], low[0], high[1], low[0], low[1])
    fence = fence_of(FenceParameters(inside=ring), "fence")
    assert fence is not None  # noqa: S101 - it has one
    touching = sum(clearance(fence, each.way) - each.radius - margin <= 0.0 for _, each in found)
    spike = float(reach.max() / np.median(reach))
    return Ended(len(found), room / margin / 2.0, touching > 0, f"{suite} {row.name}", f"{touching} touching, spike {spike:.2f}")


def healthy(suites: str, longest: float, workers: int) -> int:
    """Sail suites with a fence outside of their ways."""
    jobs = [(suite, row, longest) for suite in suites.split(",") for row in load_suite(suite)]
    acted = []
    with ProcessPoolExecutor(workers) as pool:
        for k, ended in enumerate(pool.map(healthy_case, jobs)):
            acted += [ended.described] * ended.acted
            print(
                f"{k + 1}/{len(jobs)} {ended.described}: {'ACTED' if ended.acted else 'ok'} {ended.room:.1f} {ended.error}",
                flush=True,
            )
    print(f"{len(jobs)} healthy runs of up to {longest:g} s: the guard acted in {len(acted)}")
    return int(bool(acted))


def main() -> int:
    """Draw, simulate and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("stops", "runs", "healthy"))
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--law", default="guided")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--suites", default="guided,boats", help="of the healthy runs")
    parser.add_argument("--longest", type=float, default=1e6, help="length of a healthy run, s; that of its row by default")
    given = parser.parse_args()
    if given.what == "healthy":
        return healthy(given.suites, given.longest, given.workers)
    if given.what == "stops":
        return stops(given.count or 1_000_000, given.seed)
    return runs(given.count or 1000, given.seed, given.law, given.workers)


if __name__ == "__main__":
    sys.exit(main())
