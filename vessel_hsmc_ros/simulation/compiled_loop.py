"""The closed loop as one kernel, compiled: plant, reference, observer and law, step by step as in the nodes.

Its runs are bit-identical to interpreted ones, and some hundred times faster.

What the compiled loop takes, keeps and writes, made from a scenario: constants, schedules, reference and random numbers.
"""

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import KernelLaw, Law
from vessel_hsmc_ros.control.loop.allocated_forces import THRUST, TURN, Allocator
from vessel_hsmc_ros.control.loop.allocation import allocate, allocator, elapsed_time, new_state
from vessel_hsmc_ros.control.loop.control_loop import NO_WRENCH, ages, past_commands
from vessel_hsmc_ros.control.loop.control_period import (
    ERRORS,
    START,
    ControlConstants,
    ControlInputs,
    ControlState,
    Period,
    cause,
    control_period,
    period_of,
)
from vessel_hsmc_ros.control.loop.observer import Observer, with_actuators
from vessel_hsmc_ros.core.exceptions import SimulationError, VesselHsmcError
from vessel_hsmc_ros.core.kernel import Array, kernel, whole_periods
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, published
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, trajectory
from vessel_hsmc_ros.plant.devices import sampling
from vessel_hsmc_ros.plant.dynamics import Wrench, acceleration, unforced
from vessel_hsmc_ros.plant.simulator import (
    PlantConstants,
    PlantState,
    Simulator,
    apply,
    disturbance,
    divergence_of_ship,
    is_finite,
    measure,
    shown,
)
from vessel_hsmc_ros.plant.simulator import advance as advance_plant
from vessel_hsmc_ros.plant.thruster_plant import Thrusters, ThrusterState, apply_thrusts, idle, thrusters_of
from vessel_hsmc_ros.scenario.control import make_controlled_point, may_intervene
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law
from vessel_hsmc_ros.simulation.compilation import Compiled, available, compiled
from vessel_hsmc_ros.simulation.loop import BRIEF, WIDTH, Control, Evaluated, InterpretedLoop, Loop, all_terms, is_compilable


class Constants(NamedTuple):
    """What stays constant during a run: of plant and controller.

    `drive` is the way from the command to the hull, with states that are written in place: nothing, or a `ThrusterDrive`.
    """

    plant: PlantConstants
    controller: ControlConstants
    drive: Any


class Schedule(NamedTuple):
    """The instants of a run."""

    stamp: NDArray[np.int64]  # times of the steps, (n,) ns
    time: Array  # the same, (n,) s
    due: NDArray[np.bool_]  # whether a control period begins, (n,)
    measured_at: NDArray[np.int64]  # times of the measurements that odometry shows, (n,) ns
    age: Array  # how much older than the step they are, (n,) s
    behind: NDArray[np.int64]  # the same in control periods, rounded, (n,)
    latest: NDArray[np.int64]  # index of the latest published motion of the reference, (n,)
    sampled: NDArray[np.bool_]  # whether position, heading and velocities are sampled, (n, 3)


class Inputs(NamedTuple):
    """What is known of every step before the run."""

    schedule: Schedule
    reference: Array  # motions of the reference as published: x, y, psi, u, v, r, du, dv, dr, and psi as received, (m, 10)
    sensor_noise: Array  # standard normal numbers of the sensors, (n, 6); none where they are perfect
    gust_noise: Array  # standard normal numbers of the gusts, (n, 2); none where no wind blows


class State(NamedTuple):
    """What a step leaves to the next."""

    periods: int  # number of control periods so far
    plant: PlantState  # state of the plant
    controller: ControlState  # state of the controller, with the present command


class Kept(NamedTuple):
    """What the loop writes; arrays without elements are left out."""

    rows: Array  # by the columns of `loop.WIDTHS`, (n, 35)
    brief: Array  # what metrics need instead of rows: x, y, psi minus those of the reference, applied wrench, command, (7, n)
    terms: Array  # terms of the law, (m, t)
    weights: Array  # weights of its networks, (m, k, l)
    estimates: Array  # x, y, psi, u, v, r of the observer, and psi as received, (m, 7)
    back: Array  # what the tracking errors at the origin exceed those at the centre of percussion by, (m, 4)


NEVER = -1  # the stamp of the last command before the first


class ThrusterDrive(NamedTuple):
    """Constants of allocation and thrusters, and their states, arrays that are written in place."""

    allocator: Allocator
    thrusters: Thrusters
    # allocation, now: the states of the allocation, (k, COLUMNS), and of the thrusters
    allocation: Any
    now: ThrusterState
    last: Any  # stamp of the last command, (1,) ns


def thruster_drive(scenario: Scenario, period: float) -> ThrusterDrive | tuple[()]:
    """The drive of a scenario before its first step; nothing where a wrench drives the ship."""
    if not scenario.vessel_sim.by_thrusters:
        return ()
    layout, known = scenario.vessel_sim.vessel.thrusters, scenario.thruster_allocation.vessel.thrusters
    constants = allocator(known)
    last = np.array([NEVER], np.int64)
    return ThrusterDrive(constants, thrusters_of(layout, period, np.array), new_state(constants), idle(layout), last)


@kernel
def drive_by_thrusters(
    stamp: int, plant: PlantState, wrench: tuple[float, float], surge_speed: float, c: PlantConstants, drive: ThrusterDrive
) -> PlantState:
    """The state of the plant with the wrench that its thrusters give for a command.

    `wrench`: commanded surge force [N] and yaw moment [N·m]. `drive`: allocation and thrusters; their states are written.
    """
    last = drive.last[0]
    elapsed = elapsed_time(stamp, last) if last >= 0 else 0.0
    drive.last[0] = stamp
    allocate(wrench[0], wrench[1], elapsed, surge_speed, drive.allocator, drive.allocation)
    return apply_thrusts(plant, drive.allocation[:, THRUST], drive.allocation[:, TURN], c, drive.now, drive.thrusters)


class Prepared(NamedTuple):
    """A run before its first step."""

    state: State
    constants: Constants
    inputs: Inputs


def prepare(scenario: Scenario, samples: int, law: KernelLaw[Any]) -> Prepared:
    """Prepare a run; runs of the same schedule or reference share them.

    `law`: the law, which this does not change; its memory is copied. Raises ParameterError as `make_reference`; SimulationError
    if the motion of the reference is no longer finite.
    """
    sim, controller, ship = scenario.vessel_sim, scenario.controller, scenario.reference_ship
    period = RateGrid(sim.rate_hz).period
    late = whole_periods(sim.sensors.delay, period)
    instants = schedule(samples, sim.rate_hz, controller.rate_hz, ship.rate_hz, sim.sensors.rates(), late)
    reference = reference_of(ship, ship.rate_hz, int(instants.latest[-1]) + 2)
    plant = Simulator(sim, period)
    observer = Observer(controller.observer, controller.vessel)
    control = ControlConstants(law.constants, observer.constants, make_controlled_point(controller), law.vessel.steering)
    constants = Constants(plant.constants(), control, thruster_drive(scenario, period))
    noise = _drawn(plant.sensor_noise, samples, 6, not plant.odometry_is_true)
    gusts = _drawn(plant.gust_noise, samples, 2, constants.plant.wind.blows)
    commands = past_commands(RateGrid(controller.rate_hz).period)
    state = State(0, plant.initial_state(), ControlState(NO_WRENCH, law.memory, observer.state, START, commands))
    return Prepared(state, constants, Inputs(instants, reference, noise, gusts))


def _drawn(draw: Any, rows: int, columns: int, wanted: bool) -> Array:
    """Random numbers for every step; none where they are not used."""
    numbers: Array = draw(rows) if wanted else np.empty((0, columns))
    return numbers


@functools.lru_cache(maxsize=8)
def schedule(
    samples: int,
    plant_rate: float,
    control_rate: float,
    reference_rate: float,
    sensor_rates: tuple[float, float, float],
    late: int = 0,
) -> Schedule:
    """The instants of a run.

    `samples`: number of odometry messages. `sensor_rates`: those of position, heading and velocities, Hz; 0 for every message.
    `late`: delay of the odometry in periods of the plant.
    """
    stamps = RateGrid(plant_rate).stamps(samples)
    periods = RateGrid(control_rate).indices(stamps)
    due = np.ones(samples, np.bool_)
    due[1:] = np.diff(periods) != 0
    measured_at = stamps[np.maximum(np.arange(samples) - late, 0)]
    return Schedule(
        stamps,
        np.multiply(stamps, 1e-9, dtype=np.float64),
        due,
        measured_at,
        *ages(stamps, measured_at, RateGrid(control_rate).period),
        RateGrid(reference_rate).indices(stamps),
        sampling(sensor_rates, stamps),
    )


@functools.lru_cache(maxsize=4)
def reference_of(parameters: ReferenceShipParameters, rate_hz: float, count: int) -> Array:
    """The motions of a reference as published, and the heading as received; see `Inputs`.

    `rate_hz`: rate at which it is published, Hz.
    """
    rows = np.empty((count, 10))
    rows[:, :9] = trajectory(parameters, rate_hz, count, compiled)
    compiled(receive_headings)(rows)
    return rows


@kernel
def receive_headings(rows: Array) -> None:
    """Write the headings in column 2, as the controller receives them, into column 9."""
    for i in range(len(rows)):
        rows[i, 9] = published(Motion(0.0, 0.0, rows[i, 2], 0.0, 0.0, 0.0)).psi


DONE, UNDEFINED, DIVERGED, OUTDATED = 0, 1, 2, 3
"""Why the loop has stopped: at the requested step, before a step at which the law has no finite wrench, after a step that ended
with a motion that is not finite, or after one after which the law needs other constants."""


@kernel
def drive(
    stamp: int,  # noqa: ARG001 - instead of `drive_by_thrusters`
    plant: PlantState,
    wrench: tuple[float, float],
    surge_speed: float,  # noqa: ARG001
    c: PlantConstants,
    state: Any,  # noqa: ARG001
) -> PlantState:
    """Apply the command by the actuators of a wrench; where thrusters drive the ship, `drive_by_thrusters` takes this place."""
    return apply(plant, wrench, c)


@kernel
def write(row: Array, start: int, values: Any) -> None:
    """Write the elements of a tuple into a row."""
    for i in range(len(values)):
        row[start + i] = values[i]


@kernel
def desired_motion(reference: Array, i: int) -> Motion:
    """A motion of the reference as the controller receives it."""
    return Motion(reference[i, 0], reference[i, 1], reference[i, 9], reference[i, 3], reference[i, 4], reference[i, 5])


@kernel
def control_inputs(k: int, measured: Motion, desired: Motion, inputs: Inputs) -> ControlInputs:
    """What the control period of step k takes.

    `measured`, `desired`: states of ship and reference as their messages give them.
    """
    row = inputs.reference[inputs.schedule.latest[k]]
    rate = Acceleration(row[6], row[7], row[8])
    return ControlInputs(
        inputs.schedule.measured_at[k], inputs.schedule.age[k], inputs.schedule.behind[k], measured, desired, rate
    )


@kernel
def received(plant: PlantState, constants: PlantConstants) -> tuple[Motion, Motion]:
    """State and measurement as their messages give them."""
    state = published(plant.motion)
    return state, (state if constants.odometry_is_true else published(shown(plant, constants)))


@kernel
def keep(
    row: Array, time: float, received: tuple[Motion, Motion, Motion], wrench: Any, disturbing: Any, state: Any, c: Any
) -> None:
    """Write a row.

    Args:
        time: Time, s.
        received: State, measurement and reference as their messages give them.
        wrench: Commanded surge force [N] and yaw moment [N·m].
        disturbing: Disturbing wrench, N, N, N·m.
        state: State of the plant, with the wrench that its actuators apply.
    """
    row[0] = time
    for i in range(3):
        write(row, 1 + 6 * i, received[i])
    row[19], row[20] = state.tau[0], state.tau[2]
    write(row, 21, wrench)
    write(row, 23, acceleration(disturbing, c.vessel))
    write(row, 26, unforced(state.motion, c.vessel, c.current))
    row[29], row[30] = state.motion.psi, shown(state, c).psi
    write(row, 31, disturbing)
    row[34] = state.tau[1]


@kernel
def keep_brief(brief: Array, k: int, state: Motion, desired: Motion, tau: Wrench, wrench: tuple[float, float]) -> None:
    """Write a column of what metrics need.

    `brief`: the array, (7, n). `state`, `desired`: state and reference as their messages give them. `tau`: applied wrench, N,
    N, N·m. `wrench`: commanded surge force [N] and yaw moment [N·m].
    """
    brief[0, k], brief[1, k], brief[2, k] = state.x - desired.x, state.y - desired.y, state.psi - desired.psi
    brief[3, k], brief[4, k] = tau[0], tau[2]
    brief[5, k], brief[6, k] = wrench


@kernel
def advance(start: int, stop: int, state: State, constants: Constants, inputs: Inputs, kept: Kept) -> tuple[int, int, State]:
    """Steps start to stop - 1 of the loop.

    `start`, `stop`: indices of steps. `state`: what the step before `start` has left; its arrays are written in place. Returns
    why the loop has stopped, the number of rows that are done, and the state that they have left.
    """
    periods, plant, controller = state
    c, last = constants.plant, len(inputs.schedule.time) - 1
    for k in range(start, stop):
        time = inputs.schedule.time[k]
        disturbing = disturbance(time, c, plant)
        sampled = inputs.schedule.sampled[k]
        plant = measure(plant, sampled[0], sampled[1], sampled[2], inputs.sensor_noise[k], time, c)
        shown, measured = received(plant, c)
        desired = desired_motion(inputs.reference, inputs.schedule.latest[k])
        renewed = False
        if inputs.schedule.due[k]:
            period = control_period(control_inputs(k, measured, desired, inputs), controller, constants.controller)
            controller, renewed = period.state, period.is_outdated
            if not period.is_defined:
                return UNDEFINED, k, State(periods, plant, controller)
            keep_period(periods, period, kept)
            periods += 1
        plant = drive(inputs.schedule.stamp[k], plant, controller.wrench, measured.u, c, constants.drive)
        if len(kept.rows):
            keep(kept.rows[k], time, (shown, measured, desired), controller.wrench, disturbing, plant, c)
        else:
            keep_brief(kept.brief, k, shown, desired, plant.tau, controller.wrench)
        reason = OUTDATED if renewed else DONE
        if k < last:  # the last sample is the final state
            plant = advance_plant(plant, plant.tau, acceleration(disturbing, c.vessel), inputs.gust_noise[k], c)
            reason = reason if is_finite(plant.motion) else DIVERGED
        if reason != DONE:
            return reason, k + 1, State(periods, plant, controller)
    return DONE, stop, State(periods, plant, controller)


@kernel
def keep_period(k: int, period: Period, kept: Kept) -> None:
    """Write what the controller has computed in a control period.

    `period`: its result; the memory of the law has the weights that it has used.
    """
    if k < len(kept.terms):
        write(kept.terms[k], 0, period.terms)
        W = period.state.memory.W
        for i in range(len(W)):
            for j in range(W.shape[1]):
                kept.weights[k, i, j] = W[i, j]
    if k < len(kept.estimates):
        write(kept.estimates[k], 0, period.motion)
        kept.estimates[k, 6] = published(period.motion).psi
    if k < len(kept.back):
        write(kept.back[k], 0, period.back)


def make_loop(
    scenario: Scenario, samples: int, law: Law[Any] | None = None, interpreted: bool = False, brief: Array | None = None
) -> Loop:
    """Make the loop of a scenario: compiled where its law can be, otherwise interpreted.

    `brief`: array for what a compiled run that is only to be evaluated keeps, (BRIEF, samples).
    """
    law = law or make_law(scenario.controller)
    # The compiled loop has no supervision, and takes a reference that is known before the run.
    interpreted = interpreted or may_intervene(scenario.controller) or scenario.reference_ship.follow == "vessel"
    if not interpreted and isinstance(law, KernelLaw) and is_compilable(type(law)) and available():
        try:
            return CompiledLoop(scenario, samples, law, brief)
        except SimulationError:  # of the reference: interpreted, the run goes on until it occurs
            pass
    return InterpretedLoop(scenario, samples, law)


def compiled_loop(law: type[KernelLaw[Any]], observed: bool, by_thrusters: bool = False) -> Compiled:
    """The loop with a law, with the observer or without, driven by a wrench or by thrusters."""
    kernels: dict[str, Any] = {"control_period": period_of(law, observed)}
    if by_thrusters:
        kernels["drive"] = drive_by_thrusters
    title = f"the law {law.name}{' with thrusters' * by_thrusters}{' with the observer' * observed}"
    return compiled(advance, title, allocates=observed, **kernels)


class CompiledLoop(Loop):
    """Plant, reference ship and controller as one compiled kernel.

    `law`: the law; it is reset. `brief`: array for what its metrics need, (BRIEF, samples), instead of rows and all that the
    controller computes. Raises SimulationError if the motion of the reference is no longer finite.
    """

    block = 50_000  # a call converts all arguments and results, which takes 0.1 ms

    def __init__(self, scenario: Scenario, samples: int, law: KernelLaw[Any], brief: Array | None = None) -> None:
        law.reset()
        self._scenario, self._law, self._grid = scenario, law, RateGrid(scenario.controller.rate_hz)
        self.samples, self.done = samples, 0
        self._state, self._constants, self._inputs = prepare(scenario, samples, law)
        self.rows = np.empty((samples if brief is None else 0, WIDTH))
        periods = int(np.count_nonzero(self._inputs.schedule.due)) if brief is None else 0
        control = self._constants.controller
        estimates = np.empty((periods if control.observer.enabled else 0, 7))
        terms, weights = np.empty((periods, len(law.terms._fields))), np.empty((periods, *law.memory.W.shape))
        back = np.empty((periods if control.point.x_p else 0, len(ERRORS)))
        brief = np.empty((BRIEF, 0)) if brief is None else brief
        self._kept = Kept(self.rows, brief, terms, weights, estimates, back)
        self._advance = compiled_loop(type(law), control.observer.enabled, scenario.vessel_sim.by_thrusters)

    def advance(self, stop: int) -> None:
        """Go on until `stop` rows are done."""
        reason = OUTDATED
        while reason == OUTDATED and self.done < stop:
            given = self._state, self._constants, self._inputs, self._kept
            reason, self.done, self._state = self._advance(self.done, stop, *given)
            controller, c = self._state.controller, self._constants.controller
            self._law.memory = controller.memory
            if reason == OUTDATED:
                self._law.renew()
                self._state = self._state._replace(controller=controller._replace(memory=self._law.memory))
                observer = with_actuators(c.observer, self._scenario.controller.observer, self._law.known)
                self._constants = self._constants._replace(controller=c._replace(law=self._law.constants, observer=observer))
        if reason == UNDEFINED:
            raise self._undefined()
        if reason == DIVERGED:
            sim = self._scenario.vessel_sim
            time = (self.done - 1) * RateGrid(sim.rate_hz).period
            raise divergence_of_ship(time, self._state.plant.tau, sim.vessel)

    def _undefined(self) -> VesselHsmcError:
        """The error of the law at the present step: the interpreted law finds its cause."""
        k, inputs, controller = self.done, self._inputs, self._constants.controller
        _, measured = received(self._state.plant, self._constants.plant)
        desired = desired_motion(inputs.reference, int(inputs.schedule.latest[k]))
        return cause(self._law, control_inputs(k, measured, desired, inputs), self._state.controller, controller)

    def control(self) -> Control:
        """What the controller has computed so far."""
        m = self._state.periods
        stamps = self._inputs.schedule.stamp[: self.done][self._inputs.schedule.due[: self.done]][:m]
        terms = all_terms(self._law, stamps, self._grid, self._kept.terms[:m], self._kept.weights[:m])
        if len(self._kept.back):
            terms |= {name: terms[name] + self._kept.back[:m, i] for i, name in enumerate(ERRORS)}
        estimates = self._kept.estimates[:m]
        if not len(estimates):
            return Control(stamps, terms, None, None)
        return Control(stamps, terms, estimates[:, :6], np.column_stack((estimates[:, :2], estimates[:, 6], estimates[:, 3:6])))

    def evaluated(self) -> Evaluated:
        """What the metrics of the steps so far need, of a run that keeps nothing else."""
        brief, inputs = self._kept.brief[:, : self.done].T, self._inputs
        due = inputs.schedule.due[: self.done]
        command = brief[:, 5:7] if due.all() else brief[due, 5:7]
        return Evaluated(inputs.schedule.time[: self.done], brief[:, :3], brief[:, 3:5], command)

    def reference(self, count: int) -> Array:
        """The first published motions of the reference ship, (count, 9)."""
        return self._inputs.reference[:count, :9]
