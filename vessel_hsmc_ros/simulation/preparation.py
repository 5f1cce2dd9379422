"""What the compiled loop takes, keeps and writes, made from a scenario: constants, schedules, reference and random numbers."""

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.kernel_law import KernelLaw
from vessel_hsmc_ros.control.loop.allocated_forces import THRUST, TURN, Allocator
from vessel_hsmc_ros.control.loop.allocation import allocate, allocator, elapsed_time, new_state
from vessel_hsmc_ros.control.loop.control_loop import NO_WRENCH, ages, past_commands
from vessel_hsmc_ros.control.loop.control_period import ControlConstants, ControlState
from vessel_hsmc_ros.control.loop.controlled_point import START
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.delay_line import whole_periods
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion, published
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, trajectory
from vessel_hsmc_ros.plant.sensors import sampling
from vessel_hsmc_ros.plant.simulator import Simulator
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState
from vessel_hsmc_ros.plant.thruster_plant import Thrusters, ThrusterState, apply_thrusts, idle, thrusters_of
from vessel_hsmc_ros.scenario.control import make_controlled_point
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.compilation import compiled


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

    `stamp`: of the command, ns. `wrench`: commanded surge force [N] and yaw moment [N·m]. `surge_speed`: as measured, m/s.
    `drive`: allocation and thrusters; their states are written.
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
