"""Many runs of one mission in conditions drawn about those of today: what it takes, and how often it fails.

| symbol | meaning | unit |
|---|---|---|
| V, F | mean speed of the wind, its mean force by the rule of `init`, F = rho/2·c·A·V² | m/s, N |
| I | turbulence intensity, standard deviation of the wind's speed over V | - |

The gusts of the plant are a force: their standard deviation is dF/dV·I·V = 2·I·F.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ControlError, InstabilityError, ParameterError, ScenarioError, SimulationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import NO_LEG, Run, TrackErrors
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.thruster_layout import FIXED
from vessel_hsmc_ros.guidance.factory import track_of
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, clock, track_errors
from vessel_hsmc_ros.plant.hull_parameters import EFFICIENCY, electric_power
from vessel_hsmc_ros.plant.simulator import within
from vessel_hsmc_ros.scenario.own_ship import MARGIN
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.scenario.ship_rules import loads, scale_of
from vessel_hsmc_ros.simulation.compile import ensure_compiled, is_compiled
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies import batch
from vessel_hsmc_ros.studies.forecast.feasibility import Leg, infeasible_legs, legs_of

WIND_SPEED, WIND_DIRECTION = 0.25, math.radians(20.0)
"""Standard deviations of the mean wind, relative and rad: a forecast of the same day misses the wind measured at 10 m by 1.5 m/s
(rms) at mean speeds of 5 to 6 m/s, and by some 20°."""

TURBULENCE = 0.08, 0.2  # range of I: 0.1 to 0.12 over open water, up to 0.2 under a coast
WIND_FORCE = 0.25  # of the logarithm of the force for a wind: the rule for area and coefficient is one of thumb
CURRENT_SPEED, CURRENT_DIRECTION = 0.2, math.radians(15.0)
"""Standard deviations of the current, relative and rad: models of tidal currents are accepted where nine of ten directions are
within 22.5°."""

INERTIA, DAMPING = 0.1, 0.2  # of the logarithms: twice the first is the 20 % within which a boat file needs its inertias
AXES = ("surge", "sway", "yaw")
REDRAWS = 100  # attempts to draw a hull whose damping takes energy from it at every motion
WIND, CURRENT = "vessel_sim.disturbance.earth_fixed", "vessel_sim.disturbance.current"


@dataclass(frozen=True)
class Conditions:
    """Mean wind and current of the day; directions clockwise from north."""

    wind: float = parameter(0.0, "Mean wind speed.", unit="m/s", low=0.0, high=60.0)
    wind_from: float = parameter(0.0, "Where the wind comes from, clockwise from north.", unit="degrees", low=0.0, high=360.0)
    current: float = parameter(0.0, "Speed of the current.", unit="m/s", low=0.0, high=10.0)
    current_to: float = parameter(0.0, "Where the current flows to, clockwise from north.", unit="degrees", low=0.0, high=360.0)

    @property
    def wind_towards(self) -> complex:
        """Unit vector of the wind, east + i·north."""
        return _towards(self.wind_from + 180.0)

    @property
    def current_towards(self) -> complex:
        """Unit vector of the current, east + i·north."""
        return _towards(self.current_to)


def conditions_of(scenario: Scenario) -> Conditions:
    """The mean wind and the current of a scenario, the wind from its force by the rule of `init`."""
    disturbance = scenario.vessel_sim.disturbance
    force = complex(disturbance.earth_fixed.east_force, disturbance.earth_fixed.north_force)
    current = complex(disturbance.current.east, disturbance.current.north)
    factor = loads(scenario.vessel_sim.vessel.length, 1.0)["wind_force"]
    return Conditions(math.sqrt(abs(force) / factor), _compass(-force), abs(current), _compass(current))


def mean_changes(conditions: Conditions, length: float) -> dict[str, object]:
    """The changes to a scenario that give it the conditions without gusts; the length of the hull in m."""
    force = loads(length, conditions.wind)["wind_force"] * conditions.wind_towards
    return _environment(force, 0.0, conditions.current * conditions.current_towards)


def drawn(scenario: Scenario, conditions: Conditions, seed: int, number: int) -> Scenario:
    """The scenario of a run."""
    for attempt in range(REDRAWS):
        try:
            return scenario.changed(_changes(scenario, conditions, np.random.default_rng((seed, number, attempt))))
        except ParameterError as error:
            reason = error
    raise ParameterError(f"no hull near the declared one is allowed: {reason}")


def _changes(scenario: Scenario, conditions: Conditions, random: np.random.Generator) -> dict[str, object]:
    normal = random.standard_normal(5)
    wind = conditions.wind * max(0.0, 1.0 + WIND_SPEED * normal[0])
    force = loads(scenario.vessel_sim.vessel.length, wind)["wind_force"] * math.exp(WIND_FORCE * normal[1])
    towards = conditions.wind_towards * np.exp(1j * WIND_DIRECTION * normal[2])
    current = conditions.current * max(0.0, 1.0 + CURRENT_SPEED * normal[3])
    flow = conditions.current_towards * np.exp(1j * CURRENT_DIRECTION * normal[4])
    gusts = 2.0 * random.uniform(*TURBULENCE) * force
    hull = _hull(scenario, random)
    return {
        **_environment(force * towards, gusts, current * flow),
        **hull,
        "vessel_sim.seed": int(random.integers(2**31)),
    }


def _hull(scenario: Scenario, random: np.random.Generator) -> dict[str, object]:
    """The hull data of the plant: one factor for each inertia, and one for all damping of an axis by its own velocity."""
    vessel = scenario.vessel_sim.vessel
    changes: dict[str, object] = {}
    for axis in AXES:
        inertia, damping = np.exp(random.standard_normal(2) * (INERTIA, DAMPING)).tolist()
        names = {f"{axis}_inertia": inertia, **{f"{axis}_damping{order}": damping for order in ("", "_quadratic", "_cubic")}}
        changes |= {f"vessel_sim.vessel.{name}": factor * getattr(vessel, name) for name, factor in names.items()}
    return changes


def _environment(force: complex, gusts: float, current: complex) -> dict[str, object]:
    return {
        f"{WIND}.east_force": float(force.real),
        f"{WIND}.north_force": float(force.imag),
        f"{WIND}.gust_deviation": float(gusts),
        f"{CURRENT}.east": float(current.real),
        f"{CURRENT}.north": float(current.imag),
    }


def _towards(degrees: float) -> complex:
    angle = math.radians(90.0 - degrees)
    return complex(math.cos(angle), math.sin(angle))


def _compass(way: complex) -> float:
    return math.degrees(math.atan2(way.real, way.imag)) % 360.0


QUANTILES = (0.05, 0.5, 0.95)
MAX_FAILED = 0.05  # share of failed runs above which the mission is not to be sailed
NEAR = 0.5  # distance from its end within which the last waypoint is reached, in lengths of the hull, or what the plan allows
CORRIDOR = 2.0  # distance from the path beyond which a run fails, in lengths of the hull
JUDGED_HZ = 5.0  # rate of the positions that are compared with the path
TRACK_POINTS = 800  # largest number of positions of a run that are kept
WAY = 5  # columns of the way of a run
JOULES = 3600.0  # in a watt-hour
WAITING = 2.0  # how much longer a run may take whose reference waits for its vessel


class Plan(NamedTuple):
    """A mission as it is to be sailed: its scenario in the mean conditions, its track and legs, and the conditions."""

    scenario: Scenario
    conditions: Conditions
    track: PlannedTrack
    legs: tuple[Leg, ...]
    corridor: float  # largest allowed distance from the path, m


class Sailed(NamedTuple):
    """A run: why it failed, empty if it did not; what it took, NaN where it did not arrive; and its way.

    `time`: until the last waypoint, s. `energy`: until then, W·h. `worst`: largest distance from the path on each leg and in the
    turn behind it, NaN for legs that it did not come to, (legs,) m. `way`: x, y, index of the leg, arc length along the plan as
    in `Leg.way`, distance to port, (n, 5).
    """

    number: int
    failure: str
    time: float
    energy: float
    worst: Array
    way: Array


@dataclass(frozen=True)
class Forecast:
    """The runs of a mission."""

    plan: Plan
    seed: int
    runs: tuple[Sailed, ...]

    @property
    def failed(self) -> list[Sailed]:
        """The runs that failed."""
        return [run for run in self.runs if run.failure]

    @property
    def succeeds(self) -> bool:
        """Whether few enough runs failed."""
        return len(self.failed) <= MAX_FAILED * len(self.runs)

    @property
    def battery(self) -> float:
        """Capacity of the battery, W·h; 0 where it is not declared."""
        return self.plan.scenario.vessel_sim.vessel.power.battery_wh

    @property
    def time(self) -> Array:
        """Times of the runs that arrived, s."""
        return np.array([run.time for run in self.runs if math.isfinite(run.time)])

    @property
    def energy(self) -> Array:
        """Energies of the runs that arrived, W·h."""
        return np.array([run.energy for run in self.runs if math.isfinite(run.energy)])

    @property
    def worst(self) -> Array:
        """Largest distances from the path by run and leg, (n, legs) m."""
        return np.array([run.worst for run in self.runs])

    @property
    def worst_leg(self) -> int:
        """Index of the leg with the largest upper bound of the distance."""
        return int(np.argmax([np.nan_to_num(band(column)[2]) for column in self.worst.T]))

    def reasons(self) -> list[str]:
        """Why runs failed, with their number; the most frequent first."""
        return [
            f"{count} of {len(self.runs)} runs: {why}" for why, count in Counter(r.failure for r in self.failed).most_common()
        ]


def band(values: Array) -> Array:
    """The quantiles of some values, those that are NaN left out; NaN without any.

    The k-th of n values in their order is the quantile of k/(n + 1), the probability with which a further run is below it.
    """
    known = values[np.isfinite(values)]
    return np.quantile(known, QUANTILES, method="weibull") if len(known) else np.full(len(QUANTILES), np.nan)


def plan_of(scenario: Scenario, conditions: Conditions, corridor: float | None = None) -> Plan:
    """Plan a mission. `corridor`: largest allowed distance from the path, m; None for two lengths."""
    ship, vessel = scenario.reference_ship, scenario.vessel_sim.vessel
    width = CORRIDOR * vessel.length if corridor is None else corridor
    if not 0.0 < width < math.inf:
        raise ParameterError(f"--corridor must be a distance above 0 m (got {width:g} m)")
    scale_of(vessel)  # checks that the propulsion has limits
    track = track_of(ship, 1.0 / ship.rate_hz)
    if track is None or not track.stretches:
        raise ScenarioError(f"{scenario.name} must have a mission: a path or a survey (got reference_ship.mode = {ship.mode})")
    duration = math.ceil(MARGIN * track.stretches[-1].end * (WAITING if track.waits else 1.0))
    mean = scenario.changed({**mean_changes(conditions, vessel.length), "vessel_sim.duration": duration})
    return Plan(mean, conditions, track, tuple(legs_of(track)), width)


def why_infeasible(plan: Plan) -> list[str]:
    """What no law can sail in the mean conditions, a line each; judged without a run."""
    return infeasible_legs(plan.scenario, plan.legs)


def forecast(
    plan: Plan, runs: int, seed: int, workers: int | None = None, on_progress: Callable[[int], None] | None = None
) -> Forecast:
    """Simulate a mission many times; the number of workers does not change the results."""
    done: list[Sailed] = []

    def note(result: Sailed) -> None:
        done.append(result)
        if on_progress is not None:
            on_progress(len(done))

    ensure_compiled([plan.scenario])
    # Machine code runs without the lock of the interpreter; a reference that waits for its vessel is interpreted.
    threads = is_compiled(plan.scenario) and not plan.track.waits
    batch.stream(partial(sail, plan, seed), range(runs), workers=workers, threads=threads, on_result=note)
    return Forecast(plan, seed, tuple(sorted(done, key=lambda one: one.number)))


def sail(plan: Plan, seed: int, number: int, progress: batch.Progress) -> Sailed:
    """Draw, simulate and evaluate a run; one that fails is a result, not an error."""
    scenario = drawn(plan.scenario, plan.conditions, seed, number)
    try:
        run = simulate(scenario, lambda done, total: progress(done / total))
    except (ControlError, SimulationError, InstabilityError) as error:
        nothing = np.full(len(plan.legs), math.nan)
        return Sailed(number, f"it ends early: {error}", math.nan, math.nan, nothing, np.empty((0, WAY)))
    return evaluated(number, run, plan)


def evaluated(number: int, run: Run, plan: Plan) -> Sailed:
    """What a run took."""
    planned = clock(plan.track, run.time, run.reference)
    arrival = _arrival(run, planned, plan)
    part = slice(0, len(run.time) if arrival is None else arrival + 1)
    judged = slice(None, part.stop, max(1, round(plan.scenario.vessel_sim.rate_hz / JUDGED_HZ)))
    errors = track_errors(plan.track, planned[judged], run.state[judged, :2])
    worst = np.array([_largest(errors, leg.number) for leg in plan.legs])
    time = energy = math.nan
    if arrival is not None:
        time, energy = _crossing(run, plan, arrival), energy_of(run.time[part], run.wrench[part], plan.scenario)
    places = {NO_LEG: NO_LEG, **{leg.number: index for index, leg in enumerate(plan.legs)}}
    index = np.array([places.get(leg, NO_LEG) for leg in errors.leg.tolist()], float)
    arc = arc_lengths(plan.track, planned[judged]) + errors.along
    way = np.column_stack((run.state[judged, :2], index, arc, errors.cross))
    every = -(-len(way) // TRACK_POINTS)
    return Sailed(number, _failure(arrival, worst, energy, plan), time, energy, worst, way[::every].copy())


def arc_lengths(track: PlannedTrack, planned: Array) -> Array:
    """Arc lengths of a plan since its last stop at its times, (n,) m; NaN where it stands."""
    found = np.full(len(planned), math.nan)
    for one in track.stretches:
        at = (planned >= one.begin) & (planned < one.end)
        found[at] = one.profile.at(planned[at] - one.begin)[0]
    return found


def energy_of(time: Array, wrench: Array, scenario: Scenario) -> float:
    """The electric energy of surge forces [N] and yaw moments [N·m], (n, 2), over times, (n,) s; W·h."""
    sim = scenario.vessel_sim
    vessel, limits = sim.vessel, within(sim.actuators, sim.vessel)
    scale, thrusters = scale_of(vessel), vessel.thrusters.thrusters()
    # Rudders and azimuths turn without a difference of thrusts; where the propulsion is not declared, one is assumed.
    turning = vessel.thrusters.limits()[1] if thrusters else limits.yaw_moment_limit
    if any(one.kind != FIXED for one in thrusters):
        turning = math.inf
    surge, yaw = wrench[:, 0] / limits.surge_force_limit, wrench[:, 1] / turning
    full = vessel.power.full_thrust or scale.F * scale.U / EFFICIENCY
    power = electric_power(surge, yaw, full, vessel.power.other)
    return float(np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(time))) / JOULES


def _arrival(run: Run, planned: Array, plan: Plan) -> int | None:
    """Index of the first sample on the last leg or after it that is near its end; None where the vessel does not arrive."""
    last = plan.track.stretches[-1]
    begins = last.begin + last.profile.time_at(np.array([last.route.length - last.route.elements[-1].length]))[0]
    there = np.flatnonzero((planned >= begins) & (_to_end(run, plan) <= _near(plan)))
    return int(there[0]) if len(there) else None


def _crossing(run: Run, plan: Plan, arrival: int) -> float:
    """The time at which the vessel comes near to the end, between two samples, s."""
    if not arrival:
        return float(run.time[0])
    before, after = _to_end(run, plan)[arrival - 1 : arrival + 1].tolist()
    share = (before - _near(plan)) / (before - after) if before > _near(plan) else 1.0
    return float(run.time[arrival - 1] + share * (run.time[arrival] - run.time[arrival - 1]))


def _to_end(run: Run, plan: Plan) -> Array:
    route = plan.track.stretches[-1].route
    distance: Array = np.abs(run.state[:, 0] + 1j * run.state[:, 1] - complex(route.position(route.length)))
    return distance


def _near(plan: Plan) -> float:
    return max(plan.track.near, NEAR * plan.scenario.vessel_sim.vessel.length)


def _largest(errors: TrackErrors, leg: int) -> float:
    """The largest distance from a leg and from the turn behind it, m; NaN where the run did not come to it."""
    cross = errors.cross[errors.leg == leg]
    return float(np.max(np.abs(cross))) if len(cross) else math.nan


def _failure(arrival: int | None, worst: Array, energy: float, plan: Plan) -> str:
    """Why a run failed, without numbers of its own, so that reasons can be counted; empty if it did not."""
    off = np.flatnonzero(worst > plan.corridor)
    if len(off):
        return f"it strays more than {quantity(plan.corridor, 'm')} from leg {plan.legs[off[0]].number + 1}"
    if arrival is None:
        return f"it does not come to the last waypoint within {quantity(plan.scenario.vessel_sim.duration, 's')}"
    battery = plan.scenario.vessel_sim.vessel.power.battery_wh
    return f"the battery of {quantity(battery)} W·h is empty before the end" if battery and energy > battery else ""


def summary(found: Forecast) -> dict[str, Sequence[float]]:
    """Bands of time [s], energy [W·h], what is left in the battery [W·h] if it is declared, and the largest distance [m]."""
    known = np.where(np.isfinite(found.worst), found.worst, 0.0)
    bands = {"time": band(found.time), "energy_wh": band(found.energy)}
    if found.battery:
        bands["battery_left_wh"] = band(found.battery - found.energy)
    bands["distance"] = band(np.max(known, axis=1))
    return {name: values.tolist() for name, values in bands.items()}
