"""What the compiled closed loop takes, keeps and writes; with thrusters, the allocation of its command to them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.allocated_forces import THRUST, TURN, Allocator
from vessel_hsmc_ros.control.allocation import allocate, allocator, elapsed_time, new_state
from vessel_hsmc_ros.control.control_period import ControlConstants, ControlState
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.plant.step import PlantConstants, PlantState
from vessel_hsmc_ros.plant.thruster_plant import Thrusters, ThrusterState, apply_thrusts, idle, thrusters_of
from vessel_hsmc_ros.scenario.scenario import Scenario


class Constants(NamedTuple):
    """What stays constant during a run: of plant and controller.

    `drive` is the way from the command to the hull, with states that are written in place: nothing, or a `ThrusterDrive`.
    """

    plant: PlantConstants
    controller: ControlConstants
    drive: Any


class Inputs(NamedTuple):
    """What is known of every step before the run.

    Attributes:
        stamp: Times of the steps, (n,) ns.
        time: The same, (n,) s.
        due: Whether a control period begins, (n,).
        measured_at: Times of the measurements that odometry shows, (n,) ns.
        age: How much older than the step they are, (n,) s.
        behind: The same in control periods, rounded, (n,).
        latest: Index of the latest published motion of the reference, (n,).
        sampled: Whether position, heading and velocities are sampled, (n, 3).
        reference: Motions of the reference as published: x, y, psi, u, v, r, du, dv, dr, and psi as received, (m, 10).
        sensor_noise: Standard normal numbers of the sensors, (n, 6); none where they are perfect.
        gust_noise: Standard normal numbers of the gusts, (n, 2); none where no wind blows.
    """

    stamp: NDArray[np.int64]
    time: Array
    due: NDArray[np.bool_]
    measured_at: NDArray[np.int64]
    age: Array
    behind: NDArray[np.int64]
    latest: NDArray[np.int64]
    sampled: NDArray[np.bool_]
    reference: Array
    sensor_noise: Array
    gust_noise: Array


class State(NamedTuple):
    """What a step leaves to the next.

    Attributes:
        periods: Number of control periods so far.
        plant: State of the plant.
        controller: State of the controller, with the present command.
    """

    periods: int
    plant: PlantState
    controller: ControlState


class Kept(NamedTuple):
    """What the loop writes; arrays without elements are left out.

    Attributes:
        rows: By the columns of `loop.WIDTHS`, (n, 35).
        brief: What metrics need instead of rows: x, y, psi minus those of the reference, applied wrench, command, (7, n).
        terms: Terms of the law, (m, t).
        weights: Weights of its networks, (m, k, l).
        estimates: x, y, psi, u, v, r of the observer, and psi as received, (m, 7).
        back: What the tracking errors at the origin exceed those at the centre of percussion by, (m, 4).
    """

    rows: Array
    brief: Array
    terms: Array
    weights: Array
    estimates: Array
    back: Array


NEVER = -1
"""The stamp of the last command before the first."""


class ThrusterDrive(NamedTuple):
    """Constants of allocation and thrusters, and their states, arrays that are written in place.

    Attributes:
        allocator, thrusters: The constants.
        allocation, now: The states of the allocation, (k, COLUMNS), and of the thrusters.
        last: Stamp of the last command, (1,) ns.
    """

    allocator: Allocator
    thrusters: Thrusters
    allocation: Any
    now: ThrusterState
    last: Any


def thruster_drive(scenario: Scenario, period: float) -> ThrusterDrive | tuple[()]:
    """The drive of a scenario before its first step; nothing where a wrench drives the ship.

    Args:
        scenario: The scenario.
        period: Of the plant, s.
    """
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

    Args:
        stamp: Of the command, ns.
        plant: State of the plant.
        wrench: Commanded surge force [N] and yaw moment [N·m].
        surge_speed: As measured, m/s.
        c: Constants of the plant.
        drive: Allocation and thrusters; their states are written.
    """
    last = drive.last[0]
    elapsed = elapsed_time(stamp, last) if last >= 0 else 0.0
    drive.last[0] = stamp
    allocate(wrench[0], wrench[1], elapsed, surge_speed, drive.allocator, drive.allocation)
    return apply_thrusts(plant, drive.allocation[:, THRUST], drive.allocation[:, TURN], c, drive.now, drive.thrusters)
